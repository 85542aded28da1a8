"""A periodic disturbance of the bench: hum, vibration, a pump, looked for in the samples of all records together.

What disturbs a bench has one frequency in time and one size in all records. Teeth and an encoder's waves come at even torques or
angles: their frequencies go with the rate. Whatever else a record's spectrum shows, the steps of a clock or of a counter, the
shape of its loop, has a frequency of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import logsumexp

from backdrive_bayes.engine.jumps import residuals
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.engine.traces import TRACE, trace_probabilities
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.lines import clearest_line
from backdrive_bayes.records.noise import ChannelRecord

RATIO = 2.0
SIZES = 0.1 * RATIO ** np.arange(5)
"""Root mean squares of a line in spreads of the residuals, RATIO apart; a line without noise has 1.05."""
NEAR = 50
"""Independent ordinates on either side whose median tells the noise about a frequency, to an eighth."""
PERIODS = 4
"""Fewest periods in a leg: slower, a wave is a part of the loop's shape. Zeros are filled in for as many ordinates in one."""
FAR = 4.0
"""Spreads at which residuals are cut off: clearances that are crossed have every frequency."""
HANN = 1.5
"""Noise bandwidth of a Hann taper, in ordinates."""
NYQUIST = 0.9
"""Share of half the sampling rate up to which an uneven clock leaves a line where it is."""
GAPS = 2
"""Times as many instants as samples from which on a record has more gaps than samples: it tells no frequency."""
MOST = 300_000
"""Frequencies that are tried, the lowest; each is as likely."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Power of one record's residuals over that of the noise about each frequency, and that ``noise`` [rad²] of one of the
    ``samples``, both (frequencies,), evenly ``step_hz`` apart; ``within_hz`` are the frequencies that can be told."""

    power: np.ndarray
    noise: np.ndarray
    samples: int
    step_hz: float
    within_hz: tuple[float, float]

    def gains(self, frequencies_hz, sizes_rad) -> tuple[np.ndarray, np.ndarray]:
        """Log Bayes factors of lines of root mean squares ``sizes_rad`` over noise, (sizes, frequencies), and which are told."""
        told = (frequencies_hz >= self.within_hz[0]) & (frequencies_hz <= self.within_hz[1])
        at = np.clip(np.round(frequencies_hz[told] / self.step_hz).astype(int), 0, self.power.size - 1)
        signal = self.samples * np.square(sizes_rad)[:, None] / (2.0 * HANN * self.noise[at])
        found = np.zeros((len(sizes_rad), frequencies_hz.size))
        found[:, told] = self.power[at] * signal / (1.0 + signal) - np.log1p(signal)
        return found, told


def disturbance(linear: Linear) -> float:
    """Log Bayes factor of a periodic disturbance: a line that all records share, or one that stands far above any bench's in the
    record where it is clearest; minus infinity without a spectrum."""
    reduced, found = linear.reduced, []
    for record, noise in zip(reduced.unit.records, reduced.noise, strict=True):
        segments = find_segments(record.time_s, record.torque_nm)
        line = clearest_line(ChannelRecord(record.time_s, record.torque_nm, record.angle_rad, segments), noise)
        found.append(-np.inf if line is None else line.log_factor)
    return float(log_mean([max(found), common_line(linear)]))


def common_line(linear: Linear) -> float:
    """Log Bayes factor of a line at one frequency in time that all records share, over none, a trace of one, and lines at one
    distance in torque."""
    reduced, left = linear.reduced, residuals(linear)
    spread = float(np.median([1.4826 * np.median(np.abs(rest)) for rest in left]))
    legs = [(blocks.end_s[-1] - blocks.begin_s[0]) / blocks.direction.size for blocks in reduced.blocks]
    each = zip(reduced.unit.records, left, legs, strict=True)
    spectra = [spectrum(record.time_s, rest, spread, leg_s) for record, rest, leg_s in each]
    rate = np.asarray(reduced.context.rate) / np.max(reduced.context.rate)
    in_time, in_torque = (_shared(spectra, spread * SIZES, scale) for scale in (np.ones(rate.size), rate))
    level = TRACE * float(np.median([noise.white_rad for noise in reduced.noise]))
    trace = logsumexp(np.r_[0.0, in_time], b=trace_probabilities(spread * SIZES, RATIO, level))
    return float(log_mean(in_time) - log_mean([trace, log_mean(in_torque)]))


def spectrum(time_s, rest, spread: float, leg_s: float) -> Spectrum:
    """The spectrum of a record's residuals ``rest`` (samples,) at even times, cut off beyond FAR times the ``spread``; ``leg_s``
    is the usual duration of a leg."""
    step = float(np.median(np.diff(time_s)))
    count = int((time_s[-1] - time_s[0]) / step) + 1
    even = np.interp(np.arange(min(count, GAPS * time_s.size)) * step + time_s[0], time_s, rest)
    even = np.clip(even, -FAR * spread, FAR * spread)
    taper = np.hanning(even.size + 2)[1:-1]
    power = np.abs(np.fft.rfft(taper * (even - even.mean()), PERIODS * even.size)) ** 2 / np.sum(taper**2)
    # Every ordinate that is independent of the others tells the noise, the zeros that are filled in nothing of it.
    noise = median_filter(power[::PERIODS], 2 * NEAR + 1, mode="nearest") / np.log(2.0)
    noise = np.interp(np.arange(power.size), np.arange(0, power.size, PERIODS), noise)
    noise = np.maximum(noise, np.finfo(float).tiny)
    within = (PERIODS / leg_s, NYQUIST * 0.5 / step if count == even.size else 0.0)
    return Spectrum(power / noise, noise, even.size, 1.0 / (PERIODS * even.size * step), within)


def _shared(spectra: list[Spectrum], sizes_rad, scale) -> np.ndarray:
    """Log Bayes factors of a line whose frequency in each record is in proportion to ``scale`` over lines of the records' own,
    (sizes,), averaged over frequencies; the line need not be seen in every record."""
    highest = max(s.within_hz[1] / k for s, k in zip(spectra, scale, strict=True))
    step = min(0.5 * PERIODS * s.step_hz / k for s, k in zip(spectra, scale, strict=True))
    frequencies = step * np.arange(1, int(min(highest / step, MOST)) + 1)
    total, seen = np.zeros((len(sizes_rad), frequencies.size)), np.zeros(frequencies.size, bool)
    for spectrum, k in zip(spectra, scale, strict=True):
        found, told = spectrum.gains(k * frequencies, sizes_rad)
        if told.any():
            own = log_mean([0.0, log_mean(found[:, told])])
            total[:, told] += np.logaddexp(0.0, found[:, told] - own) - np.log(2.0)
            seen |= told
    return log_mean(total[:, seen], axis=1) if seen.any() else np.zeros(len(sizes_rad))

