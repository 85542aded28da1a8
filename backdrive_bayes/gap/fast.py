"""Fast structure: periodic in the angle, saw-toothed in the torque, periodic or rough in time, each with its evidence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import ive, logsumexp

from backdrive_bayes.gap.candidates import Candidates
from backdrive_bayes.gap.fine import FineLeg, fine_legs
from backdrive_bayes.gap.setting import Setting

ENCODER_ERROR, STICK_SLIP, VIBRATION = "encoder_error", "stick_slip", "vibration"
AMPLITUDES = (0.3, 1.0, 3.0, 10.0)
"""Prior standard deviations of a fast component, in those of the noise."""
SINE_AMPLITUDES = np.geomspace(0.05, 20.0, 24)
COHERENCE = 8.0
"""Log evidence of a sine of the angle counts up to so many times the part of it that a phase common to all legs brings."""
PERIODS = 160
HARMONICS = 3
HARMLESS = 0.3
"""Amplitude of a vibration that every rig has, in standard deviations of the angle's noise."""
HIGHEST_LINE = 0.95
"""Share of the Nyquist frequency: quanta beat with the sampling just below it."""
PIECE = 60
"""Fine blocks of a leg over which skewness is taken."""


@dataclass(frozen=True, eq=False)
class Fast:
    """Log evidence against no fast structure by name, and the best period of each (rad, N·m, s)."""

    log_evidence: dict[str, float]
    period: dict[str, float]

    def within(self, allowed) -> Fast:
        """The same to a library of the ``allowed`` effects only (None: all): what it has no name for counts as vibration does."""
        if allowed is None:
            return self
        known = {n: v for n, v in self.log_evidence.items() if n in allowed}
        return replace(self, log_evidence=known | {VIBRATION: max(v for n, v in self.log_evidence.items() if n not in known)})


def weigh_fast(setting: Setting, candidates: Candidates) -> tuple[Fast, Candidates]:
    """Weigh every kind of fast structure beside the best hypothesis.

    An error of the encoder that was fitted to wide blocks may have taken the teeth of stick-slip: where these say more without it
    than it gained, the hypotheses that hold it are left out.
    """
    best = candidates.best
    found = _weigh_beside(setting, best.fitted)
    if ENCODER_ERROR in best.effects:
        rest = candidates.without(ENCODER_ERROR)
        without = _weigh_beside(setting, rest.best.fitted)
        teeth = without.log_evidence[STICK_SLIP]
        more = teeth - found.log_evidence[STICK_SLIP] > best.height - rest.best.height
        if more and teeth > without.log_evidence[ENCODER_ERROR]:
            return without, rest
    return found, candidates


def _weigh_beside(setting, fitted):
    legs = fine_legs(setting, fitted)
    saw, jumps = _saw_of_torque(setting, legs, _torque_periods(setting)), _jumps(legs)
    found = {
        ENCODER_ERROR: _sine_of_angle(setting, legs, _angle_periods(legs)),
        STICK_SLIP: max(saw, (jumps, float("nan"))),
        VIBRATION: _lines(setting, fitted),
    }
    return Fast({k: v[0] for k, v in found.items()}, {k: v[1] for k, v in found.items()})


def _angle_periods(legs):
    # Where the reading stands still between its quanta the median step may be zero.
    step = np.median([np.mean(np.abs(np.diff(leg.angle_rad))) for leg in legs])
    span = max(np.ptp(leg.angle_rad) for leg in legs)
    # Evenly in the number of periods within the range, so near that a sine between two of them stays in phase.
    return span / np.arange(10.0, max(span / (5 * step), 20.0), 0.5)


def _torque_periods(setting):
    return setting.unit.rated_torque_nm * np.geomspace(0.008, 0.25, PERIODS)


def _sine_of_angle(setting, legs, periods):
    """Log evidence of a sine of the angle read, of one amplitude in all records and a phase of each; and its period.

    What a model leaves swings along every leg as well, but with no phase in common: an encoder's error must be the more evident
    for the legs of a record sharing one.
    """
    amplitude = setting.noise_rad * SINE_AMPLITUDES[:, None]
    shared, apart = np.zeros((2, SINE_AMPLITUDES.size, periods.size))
    for record in {leg.record for leg in legs}:
        energy, load = np.zeros(periods.size), np.zeros((periods.size, 2))
        for leg in (leg for leg in legs if leg.record == record):
            turn = 2 * np.pi * leg.angle_rad[:, None] / periods
            white = leg.white(np.concatenate([np.cos(turn), np.sin(turn)], axis=1))
            own_energy = 0.5 * np.sum(white**2, axis=0).reshape(2, -1).sum(axis=0)
            own_load = (leg.residual @ white).reshape(2, -1).T
            apart += _any_phase(amplitude, own_load, own_energy)
            energy, load = energy + own_energy, load + own_load
        shared += _any_phase(amplitude, load, energy)
    best = periods[int(np.argmax(shared.max(axis=0)))]
    # Beforehand no octave of periods is likelier than another.
    weight = periods / periods.sum()
    together, alone = _averaged(shared, weight), _averaged(apart, weight)
    if len(legs) == len({leg.record for leg in legs}):
        return together, float(best)
    return min(together, COHERENCE * (together - alone)), float(best)


def _any_phase(amplitude, load, energy):
    # The phase integrated: the mean of exp(pull cos φ) is the Bessel function I0.
    pull = amplitude * np.hypot(*load.T)
    return np.log(ive(0, pull)) + pull - 0.5 * amplitude**2 * energy


def _averaged(values, weight) -> float:
    """Log of the mean of exp(values) (amplitudes, periods) under the prior weight of the periods."""
    return float(logsumexp(values, b=weight) - np.log(len(values)))


def _saw_columns(leg: FineLeg, period):
    turn = 2 * np.pi * leg.way_nm / period
    return [f(h * turn) / h for h in range(1, HARMONICS + 1) for f in (np.cos, np.sin)]


def _jumps(legs) -> float:
    """Log evidence of many small jumps in the direction of loading, evenly or unevenly spaced.

    A jump is one spike of the whitened residual; jumps one way make its distribution skewed along most of every leg, which
    neither Gaussian noise nor a few sharp places do. Skewness is taken piece by piece and clipped.
    """
    skew, variance = [], []
    for leg in legs:
        pieces = np.array_split(leg.residual * leg.direction, max(1, leg.residual.size // PIECE))
        for piece in pieces:
            centred = piece - piece.mean()
            skew.append(np.clip(np.mean(centred**3) / np.mean(centred**2) ** 1.5, -1.5, 1.5))
            variance.append(6.0 / piece.size)
    z = np.sum(skew) / np.sqrt(np.sum(variance))
    return float(0.5 * max(z, 0.0) ** 2 - 3.0)


def _lines(setting, fitted):
    """Log evidence of a line in the spectrum of the angle at full sampling rate, the same in all records, and its period [s].

    An ordinate of the periodogram over the level of its neighbours is exponential under noise; over a line of unknown
    amplitude its evidence is about exp(excess) over the number of frequencies tried. What a harmless vibration brings is no
    evidence.
    """
    frequencies, total = None, 0.0
    for r, record in enumerate(setting.unit.records):
        data = fitted.problem.records[r]
        smooth = np.interp(record.time_s, data.blocks.mid_s, data.blocks.angle_rad)
        harmless = HARMLESS * float(np.hypot(data.noise.correlated_rad, data.noise.white_rad))
        ratio, frequency = _spectrum_ratio(record.time_s, record.angle_rad - smooth, harmless)
        if frequencies is None:
            frequencies = frequency
        nearest = np.searchsorted(frequency, frequencies).clip(1, frequency.size - 2)
        # The line may fall between the coarser ordinates of a shorter record.
        excess = np.maximum.reduce([ratio[nearest - 1], ratio[nearest], ratio[nearest + 1]]) - 1.8
        total = total + np.where((frequencies >= frequency[0]) & (frequencies <= frequency[-1]), excess, 0.0)
    best = int(np.argmax(total))
    records = len(setting.unit.records)
    # The tail of a sum of several largest-of-three ordinates is longer than that of one.
    tail = records * np.log(3.0) + (records - 1) * np.log(max(total[best], 1.0))
    return float(total[best] - np.log(frequencies.size) - tail - 3.0), float(1 / frequencies[best])


def _spectrum_ratio(time, residual, harmless):
    """Periodogram over its running median, and frequencies [Hz], without the two hundred lowest and the highest.

    From each ordinate's root that of a line of amplitude ``harmless`` [rad] is taken.
    """
    step = float(np.median(np.diff(time)))
    taper = np.hanning(residual.size)
    power = np.abs(np.fft.rfft((residual - residual.mean()) * taper)) ** 2
    frequency = np.fft.rfftfreq(residual.size, step)
    level = median_filter(power, 101, mode="nearest") / np.log(2.0)
    keep = slice(min(200, power.size // 4), int(HIGHEST_LINE * power.size))
    line = 0.5 * harmless * taper.sum()
    root = np.maximum(np.sqrt(power[keep]) - line, 0.0)
    return root**2 / np.maximum(level[keep], 1e-300), frequency[keep]


def _saw_of_torque(setting, legs, periods):
    """Log evidence of a saw-tooth of the torque, each leg with shape and phase of its own, and its period."""
    total = np.zeros((len(AMPLITUDES), len(periods)))
    for leg in legs:
        raw = np.stack([c for p in periods for c in _saw_columns(leg, p)], axis=1)
        white = leg.white(raw).reshape(raw.shape[0], len(periods), -1)
        gram, load = np.einsum("npi,npj->pij", white, white), np.einsum("npi,n->pi", white, leg.residual)
        for a, amplitude in enumerate(AMPLITUDES):
            inner = np.eye(gram.shape[-1]) / (amplitude * setting.noise_rad) ** 2 + gram
            gain = np.einsum("pi,pi->p", load, np.linalg.solve(inner, load[..., None])[..., 0])
            spread = np.linalg.slogdet(inner)[1] + 2 * gram.shape[-1] * np.log(amplitude * setting.noise_rad)
            total[a] += 0.5 * (gain - spread)
    return _averaged(total, np.full(periods.size, 1 / periods.size)), float(periods[int(np.argmax(total.max(axis=0)))])
