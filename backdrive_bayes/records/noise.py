"""Noise of the two channels: white and correlated angle noise, white torque noise, each with its uncertainty.

The angle noise is a stationary Ornstein-Uhlenbeck process (variance, correlation time) plus white noise. It is estimated by
the Whittle likelihood (Whittle 1953) on periodograms of short windows whose trend has been taken out; the median over the
windows at each frequency keeps cliffs and jumps of the loop from passing as noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from backdrive_bayes.records.white_noise import white_noise

PRIOR_CORRELATION_TIME_S, PRIOR_LOG_SD = 0.03, 0.5
PRIOR_CORRELATED_SAMPLES, PRIOR_SAMPLES_LOG_SD = 8.0, 0.8
"""Correlation time, or its number of samples, and the standard deviation of their logarithms: what vibrates does so as long at
every rate, a filter that works in samples leaves as many of them."""
LEVEL_LOG_SD = 4.0
"""Standard deviation of the log levels of the noise about what the spectrum's ends tell."""
POLISHING = 4
"""Newton steps after the search, which stops where the likelihood is flat to its eighth digit: its last bits must not matter."""
WINDOWS_PER_SEGMENT = 16
SHORTEST_WINDOW, LONGEST_WINDOW = 16, 2048
"""Samples of a window: from fewer no spectrum can be made, and in more a short ramp's own shape would pass as noise."""
TREND_DEGREE = 3
WANDERS_FROM = 1.0 / 8.0
"""Correlation time in windows above which none is usual: such noise looks like what a window's trend leaves of the loop's shape.
As windows are a sixteenth of a leg, wanders (:mod:`backdrive_bayes.engine.wander`) begin there."""
ALIKE = 1.5
"""Ratio of the time between samples of two records below which they tell nothing of whether noise lasts for a time or for
samples."""
SWAYS = 2.0
"""Variance of a torque beside its trend, in that of its noise, from which on it is taken for real."""


@dataclass(frozen=True)
class NoiseEstimate:
    """Standard deviations of the noise [rad, N·m], the correlation time [s], and their standard errors.

    ``wander_rad`` and ``wander_time_s`` are those of a slow Ornstein-Uhlenbeck process beside, of which short windows see
    nothing (:mod:`backdrive_bayes.engine.wander`). ``scale_dof`` is the weight of the estimate in chi-square degrees of freedom:
    the variance of block means is known to a relative standard error sqrt(2 / scale_dof).
    """

    white_rad: float
    correlated_rad: float
    correlation_time_s: float
    torque_nm: float
    white_rad_sd: float
    correlated_rad_sd: float
    correlation_time_s_sd: float
    torque_nm_sd: float
    scale_dof: float
    wander_rad: float = 0.0
    wander_time_s: float = 1.0


@dataclass(frozen=True, eq=False)
class ChannelRecord:
    """What the noise of one record is estimated from: arrays of shape (samples,) and its segments."""

    time_s: np.ndarray
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    segments: tuple


def estimate_noise(time_s, torque_nm, angle_rad, segments) -> NoiseEstimate:
    """Noise of one record; arrays of shape (samples,), segments as from ``find_segments``."""
    return estimate_common_noise([ChannelRecord(time_s, torque_nm, angle_rad, segments)])[0]


def estimate_common_noise(records) -> tuple[NoiseEstimate, ...]:
    """Noise of the records of one bench: common angle noise, torque noise of each record.

    The correlation lasts as long in all records, or as many samples, whichever is likelier. Records too short for a spectrum
    count only where all are; the angle's noise then comes from second differences.
    """
    spectra = [median_periodogram(r) for r in records if longest(r) >= SHORTEST_WINDOW]
    if not spectra:
        return tuple(_rough_noise(r) for r in records)
    theta, covariance, in_samples = _fit_spectra(spectra)
    sd = np.minimum(np.sqrt(np.diag(covariance)), 3.0)
    correlated, white, correlation = (float(v) for v in np.exp(theta))
    found = []
    for record in records:
        step = float(np.median(np.diff(record.time_s)))
        time = correlation * step if in_samples else correlation
        gradient = _block_gradient(correlated, white, time, step)
        level, error = _noise_of(record.torque_nm, record.time_s)
        estimate = NoiseEstimate(
            white_rad=white,
            correlated_rad=correlated,
            correlation_time_s=time,
            torque_nm=level,
            white_rad_sd=float(white * sd[1]),
            correlated_rad_sd=float(correlated * sd[0]),
            correlation_time_s_sd=float(time * sd[2]),
            torque_nm_sd=error,
            scale_dof=float(np.clip(2.0 / max(gradient @ covariance @ gradient, 1e-9), 4.0, 1e5)),
        )
        found.append(estimate)
    return tuple(found)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Median periodogram ``power`` at angular frequencies ``omega`` [rad/sample], the weight of its ordinates, and the samples of
    a window."""

    power: np.ndarray
    omega: np.ndarray
    weight: float
    window: int
    step_s: float

    def model(self, theta) -> np.ndarray:
        """Expected power at the ordinates for log(correlated), log(white), log(correlation time)."""
        return self._correlated(theta)[0] + np.exp(2 * theta[1]) + 1e-9 * self.power.mean() + 1e-40

    def cost(self, theta):
        """Whittle's negative log likelihood of the same, and its gradient (3,)."""
        (slow, by_time), model = self._correlated(theta), self.model(theta)
        slopes = np.stack([2 * slow, np.full_like(slow, 2 * np.exp(2 * theta[1])), by_time])
        fit = self.power / model
        return self.weight * np.sum(np.log(model) + fit), self.weight * slopes @ ((1 - fit) / model)

    def _correlated(self, theta):
        """Power of the correlated part and its derivative by the log correlation time."""
        variance, step = np.exp(2 * theta[0]), self.step_s / np.exp(theta[2])
        phi, cosine = np.exp(-step), np.cos(self.omega)
        below = 1 - 2 * phi * cosine + phi**2
        by_phi = -2 * variance * (phi * below + (1 - phi**2) * (phi - cosine)) / below**2
        return variance * (1 - phi**2) / below, by_phi * phi * step


def longest(record: ChannelRecord) -> int:
    """Samples of the longest ramp."""
    return max(s.stop - s.start for s in record.segments)


def _rough_noise(record: ChannelRecord) -> NoiseEstimate:
    """All angle noise taken as white, with the uncertainty of few samples."""
    angle, torque = (_noise_of(values, record.time_s) for values in (record.angle_rad, record.torque_nm))
    floor = 1e-12 * float(np.ptp(record.angle_rad))
    white, correlated = max(angle[0], floor), max(0.1 * angle[0], floor)
    relative = PRIOR_CORRELATION_TIME_S * PRIOR_LOG_SD
    return NoiseEstimate(white, correlated, PRIOR_CORRELATION_TIME_S, torque[0], white, correlated, relative, torque[1], 4.0)


def median_periodogram(record: ChannelRecord) -> Spectrum:
    """Median over short windows of a record, each free of its trend."""
    most = longest(record)
    length = int(np.clip(most // WINDOWS_PER_SEGMENT, SHORTEST_WINDOW, LONGEST_WINDOW))
    starts = np.concatenate([np.arange(s.start, s.stop - length + 1, length) for s in record.segments])
    angle, torque = (values[starts.astype(int)[:, None] + np.arange(length)] for values in (record.angle_rad, record.torque_nm))
    basis = np.linalg.qr(np.vander(np.linspace(-1, 1, length), TREND_DEGREE + 1))[0]
    windows, sway = (values - (values @ basis) @ basis.T for values in (angle, torque))
    # A torque that rises in stairs moves the angle in stairs, which are no noise.
    size = np.maximum(np.mean(sway**2, axis=1), 1e-300)
    real = np.maximum(0.0, 1.0 - SWAYS * white_noise(record.torque_nm, record.time_s) ** 2 / size)
    windows = windows - (real * np.mean(sway * windows, axis=1) / size)[:, None] * sway
    taper = np.hanning(length + 2)[1:-1]
    taper = taper / np.sqrt(np.mean(taper**2))
    power = np.abs(np.fft.rfft(windows * taper, axis=1)) ** 2 / length
    # The trend takes the lowest frequencies with it, the last one has another distribution.
    keep = slice(TREND_DEGREE + 1, (length - 1) // 2)
    # A Hann taper halves the independent ordinates, the median over windows has the efficiency ln(2)² of their mean.
    weight = len(starts) * 0.5 * np.log(2.0) ** 2
    omega = 2 * np.pi * np.fft.rfftfreq(length)[keep]
    step = float(np.median(np.diff(record.time_s)))
    return Spectrum(np.median(power[:, keep], axis=0) / np.log(2.0), omega, weight, length, step)


def _fit_spectra(spectra):
    """Log correlated and white standard deviations and log correlation time with their covariance, and whether that time is in
    samples."""
    prior = np.log(PRIOR_CORRELATION_TIME_S), PRIOR_LOG_SD
    found = [(*_fit(spectra, *prior), False)]
    steps = [s.step_s for s in spectra]
    if max(steps) > ALIKE * min(steps):
        prior = np.log(PRIOR_CORRELATED_SAMPLES), PRIOR_SAMPLES_LOG_SD
        found.append((*_fit([replace(s, step_s=1.0) for s in spectra], *prior), True))
    _, best, covariance, in_samples = min(found, key=lambda one: one[0])
    return best, covariance, in_samples


def _fit(spectra, log_time, log_time_sd):
    """Least cost of all spectra with the parameters there and their covariance."""
    low = np.median([np.log(s.power[0] + 1e-40) for s in spectra])
    high = np.median([np.log(np.median(s.power[3 * s.power.size // 4 :]) + 1e-40) for s in spectra])
    usual = min(log_time, np.log(WANDERS_FROM * max(s.window * s.step_s for s in spectra)))
    centre, spread = np.array([0.5 * low, 0.5 * high, usual]), np.array([LEVEL_LOG_SD, LEVEL_LOG_SD, log_time_sd])

    def cost(theta):
        away = (theta - centre) / spread
        found = [s.cost(theta) for s in spectra]
        value = sum(f for f, _ in found) + 0.5 * away @ away + np.log(log_time_sd)
        return value, sum(g for _, g in found) + away / spread

    floor = np.append(centre[:2] - 12, np.log(min(s.step_s for s in spectra)))
    # Of steps longer than any noise lasts there is none that does.
    top = np.maximum(centre + [12, 12, 6], floor)
    bounds = list(zip(floor, top, strict=True))
    shifts = ((0.0, 0.0), (-1.5, -1.0), (-1.0, 1.0))
    starts = [np.clip(centre + [a, 0, b], floor, top) for a, b in shifts]
    best = min((minimize(cost, x, jac=True, method="L-BFGS-B", bounds=bounds) for x in starts), key=lambda r: r.fun).x
    low, high = np.transpose(bounds)
    for _ in range(POLISHING):
        free = (best > low) & (best < high)
        step = np.zeros(best.size)
        step[free] = np.linalg.solve(_hessian(cost, best)[np.ix_(free, free)], cost(best)[1][free])
        moved = np.clip(best - step, low, high)
        if cost(moved)[0] > cost(best)[0] + 1e-9:
            break
        best = moved
    return cost(best)[0], best, np.linalg.pinv(_hessian(cost, best), hermitian=True)


def _hessian(function, x, h=1e-4):
    value = np.stack([function(x + e)[1] - function(x - e)[1] for e in h * np.eye(len(x))]) / (2 * h)
    w, v = np.linalg.eigh(0.5 * (value + value.T))
    return (v * np.maximum(w, 0.1)) @ v.T


def _block_gradient(correlated, white, correlation, step):
    """Derivative of the log variance of a block mean (two correlation times long) by the three log parameters."""
    span = max(2 * correlation, step)
    ratio = span / correlation
    slow = correlated**2 * 2 * (ratio - 1 + np.exp(-ratio)) / ratio**2
    fast = white**2 * step / span
    total = slow + fast
    return np.array([2 * slow / total, 2 * fast / total, slow / total])


def _noise_of(values, time_s):
    """White noise of a channel and its standard error: that of a median has the efficiency .37."""
    sd = white_noise(values, time_s)
    return sd, sd / float(np.sqrt(2.0 * 0.37 * max(values.size, 1)))
