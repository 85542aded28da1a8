"""Lines in the spectrum of the angle's noise: mains hum, vibration, ripple of a torque that no sensor reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.noise import SHORTEST_WINDOW, ChannelRecord, NoiseEstimate, longest, median_periodogram

NEAR = 12
"""Ordinates on either side that a line is compared with."""
USUAL = 5.0
"""Mean height over the noise about them of the lines that every bench has: its own resonances, its drive."""
HIGHEST = 1e5
"""Height over the noise up to which a disturbance may stand, each order of magnitude as likely."""


@dataclass(frozen=True)
class Line:
    """The highest line: its frequency as sampled and the power's height over that of the noise about it."""

    frequency_hz: float
    height: float

    @property
    def log_factor(self) -> float:
        """Log Bayes factor of a disturbance over the lines of any bench, whose heights are exponential."""
        height = min(self.height, HIGHEST)
        if height <= 1.0:
            return -np.inf
        usual = -height / USUAL - np.log(USUAL)
        return float(-np.log(height) - np.log(np.log(HIGHEST)) - usual)


def highest_line(record: ChannelRecord, noise: NoiseEstimate) -> Line | None:
    """The highest line of one record; None where it is too short for a spectrum."""
    if longest(record) < SHORTEST_WINDOW:
        return None
    spectrum = median_periodogram(record)
    ratio = spectrum.power / spectrum.model(*np.log([noise.correlated_rad, noise.white_rad, noise.correlation_time_s]))
    about = np.array([np.median(ratio[max(k - NEAR, 0) : k + NEAR + 1]) for k in range(ratio.size)])
    height = ratio / np.maximum(about, 1e-300)
    at = int(np.argmax(height))
    return Line(float(spectrum.omega[at] / (2 * np.pi * spectrum.step_s)), float(height[at]))
