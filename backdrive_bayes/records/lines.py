"""Lines in the spectrum of the angle's noise: mains hum, vibration, ripple of a torque that no sensor reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.faults import least_step
from backdrive_bayes.records.noise import SHORTEST_WINDOW, ChannelRecord, NoiseEstimate, longest, median_periodogram

NEAR = 12
"""Ordinates on either side that a line is compared with: a line leaks into two, the median of twenty-five is known to a fifth."""
CLEAR = 18.85
"""Power ratio from which a line is a disturbance: lines that every bench has, of its resonances and its drive, reach 17 on eleven
measured units and 10 on units of virtual benches."""


@dataclass(frozen=True)
class Line:
    """The clearest line: its frequency as sampled, the ratio of its power to that of the noise about it, its amplitude, and the
    step of the channel, whose staircase is as regular as the ramp that it follows."""

    frequency_hz: float
    power_ratio: float
    amplitude_rad: float = np.inf
    step_rad: float = 0.0

    @property
    def disturbs(self) -> bool:
        """Whether it stands above the lines of any bench and is no staircase of the encoder."""
        return self.power_ratio > CLEAR and self.amplitude_rad > self.step_rad


def clearest_line(record: ChannelRecord, noise: NoiseEstimate) -> Line | None:
    """The clearest line of one record; None where it is too short for a spectrum."""
    if longest(record) < SHORTEST_WINDOW:
        return None
    spectrum = median_periodogram(record)
    power = spectrum.power / spectrum.model(np.log([noise.correlated_rad, noise.white_rad, noise.correlation_time_s]))
    about = np.array([np.median(power[max(k - NEAR, 0) : k + NEAR + 1]) for k in range(power.size)])
    ratio = power / np.maximum(about, 1e-300)
    at = int(np.argmax(ratio))
    # A Hann taper of mean square one keeps two thirds of the power of a wave, which is a quarter of its square and window.
    amplitude = 2.0 * float(np.sqrt(1.5 * np.log(2.0) * spectrum.power[at] / spectrum.window))
    frequency = float(spectrum.omega[at] / (2 * np.pi * spectrum.step_s))
    return Line(frequency, float(ratio[at]), amplitude, least_step(record.angle_rad))
