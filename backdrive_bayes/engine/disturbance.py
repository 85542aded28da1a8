"""A periodic disturbance of the bench: hum, vibration, a pump, looked for in the samples of all records together.

What disturbs a bench has one frequency in time in all records. Teeth and an encoder's waves come at even torques or angles:
their frequencies go with the rate. Whatever else a record's spectrum shows, the steps of a clock or of a counter, has a frequency
of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter
from scipy.special import logsumexp

from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.engine.residuals import residuals
from backdrive_bayes.engine.traces import TRACE, trace_probabilities
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.shape import ramp_rate

RATIO = 2.0
"""Ratio of neighbouring sizes, with which the evidence of a line changes little."""
SIZES = 0.7 * RATIO ** np.arange(-8.0, 1.0)
"""Usual root mean squares of a line in spreads of the residuals, RATIO apart: from 0.67, a line without noise, to less than a
million samples can tell."""
TOLERANCE = 1e-3
"""How far a line's frequency, or a record's rate, is from that of all: mains hold theirs to as much."""
PERIODS = 4
"""Fewest periods in a leg: of a slower wave block means leave nothing."""
FILLED = 4
"""Ordinates of a periodogram in an independent one: zeros are filled in."""
NEAR = 50
"""Independent ordinates on either side whose median tells the noise about a frequency, to an eighth."""
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
class Periodogram:
    """Power of one record's residuals over that of the noise about each frequency, and that ``noise`` [rad²] of one of the
    ``samples``, ``step_s`` apart, both (frequencies,), evenly ``step_hz`` apart; ``within_hz`` are the frequencies that can be
    told."""

    power: np.ndarray
    noise: np.ndarray
    samples: int
    step_s: float
    step_hz: float
    within_hz: tuple[float, float]

    def gains(self, frequencies_hz, sizes_rad) -> tuple[np.ndarray, np.ndarray]:
        """Log Bayes factors of lines of usual root mean squares ``sizes_rad`` over noise, (sizes, frequencies), and which are
        told; a line above half the sampling rate shows folded."""
        folded = np.abs(frequencies_hz - np.round(frequencies_hz * self.step_s) / self.step_s)
        told = (folded >= self.within_hz[0]) & (folded <= self.within_hz[1])
        at = np.clip(np.round(folded[told] / self.step_hz).astype(int), 0, self.power.size - 1)
        signal = self.samples * np.square(sizes_rad)[:, None] / (2.0 * HANN * self.noise[at])
        found = np.zeros((len(sizes_rad), frequencies_hz.size))
        found[:, told] = self.power[at] * signal / (1.0 + signal) - np.log1p(signal)
        return found, told


def disturbance(reduced: Reduced) -> float:
    """Log Bayes factor of a line at one frequency in time in all records over a trace of one, or none, and lines at one distance
    in torque, each as likely.

    It is looked for in what block means leave of the samples: what is slower is a matter of the contrasts.
    """
    left = residuals(reduced, reduced.angles)
    spread = float(np.median([1.4826 * np.median(np.abs(rest)) for rest in left]))
    each = [periodogram(*one, spread) for one in zip(reduced.unit.records, reduced.blocks, left, strict=True)]
    ramps = [(record.time_s, record.torque_nm) for record in reduced.unit.records]
    rates = [ramp_rate(time, torque, find_segments(time, torque)) for time, torque in ramps]
    told = [(one, rate) for one, rate in zip(each, rates, strict=True) if one is not None and rate > 0.0]
    if not told:
        return 0.0
    found, scale = [one for one, _ in told], np.array([rate for _, rate in told])
    in_time, in_torque = (shared(found, spread * SIZES, of) for of in (np.ones(scale.size), scale / scale.max()))
    level = TRACE * float(np.median([noise.white_rad for noise in reduced.noise]))
    trace = logsumexp(np.r_[0.0, in_time], b=trace_probabilities(spread * SIZES, RATIO, level))
    return float(log_mean(in_time) - log_mean([trace, log_mean(in_torque)]))


def periodogram(record, blocks, rest, spread: float) -> Periodogram | None:
    """That of a record's residuals ``rest`` (samples,) at even times, cut off beyond FAR times their ``spread``; None where the
    record has more gaps than samples."""
    step = float(np.median(np.diff(record.time_s)))
    span = float(record.time_s[-1] - record.time_s[0])
    if step <= 0.0 or span > GAPS * record.time_s.size * step:
        return None
    even = np.interp(np.arange(int(span / step) + 1) * step + record.time_s[0], record.time_s, rest)
    even = np.clip(even, -FAR * spread, FAR * spread)
    taper = np.hanning(even.size + 2)[1:-1]
    power = np.abs(np.fft.rfft(taper * (even - even.mean()), FILLED * even.size)) ** 2 / np.sum(taper**2)
    # Ordinates that are independent of one another tell the noise, but the lowest, which went with the mean.
    own = np.arange(FILLED, power.size, FILLED)
    noise = median_filter(power[own], 2 * NEAR + 1, mode="reflect") / np.log(2.0)
    noise = np.maximum(np.interp(np.arange(power.size), own, noise), np.finfo(float).tiny)
    leg_s = (blocks.end_s[-1] - blocks.begin_s[0]) / blocks.direction.size
    within = PERIODS / leg_s, NYQUIST * 0.5 / step
    return Periodogram(power / noise, noise, even.size, step, 1.0 / (FILLED * even.size * step), within)


def shared(each: list[Periodogram], sizes_rad, scale) -> np.ndarray:
    """Log Bayes factors of a line whose frequency in each record is in proportion to ``scale``, but for TOLERANCE, over lines of
    the records' own, (sizes,), averaged over frequencies; every record may leave it out of sight."""
    highest = max(one.within_hz[1] / k for one, k in zip(each, scale, strict=True))
    step = min(0.5 * FILLED * one.step_hz / k for one, k in zip(each, scale, strict=True))
    number = np.arange(1, int(min(highest / step, MOST)) + 1)
    begin, end = np.floor(number * (1.0 - TOLERANCE)).astype(int), np.ceil(number * (1.0 + TOLERANCE)).astype(int)
    begin, end = np.minimum(begin, number - 1), np.minimum(end, number.size)
    total, seen = np.zeros((len(sizes_rad), number.size)), np.zeros(number.size, bool)
    for one, k in zip(each, scale, strict=True):
        found, told = one.gains(k * step * number, sizes_rad)
        if told.any():
            own = log_mean([0.0, log_mean(found[:, told])])
            # No more than the number of frequencies, so that sums of exponentials hold.
            sums = np.cumsum(np.exp(np.where(told, found - own, -np.inf)), axis=1)
            sums = np.hstack([np.zeros((len(sizes_rad), 1)), sums])
            about = (sums[:, end] - sums[:, begin]) / (end - begin)
            total[:, told] += np.log(0.5 + 0.5 * np.maximum(about[:, told], 0.0))
            seen |= told
    return log_mean(total[:, seen], axis=1) if seen.any() else np.zeros(len(sizes_rad))
