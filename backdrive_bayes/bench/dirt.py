"""What no real bench is free of, each a fraction of the noise: ripple, asymmetry, drift, a resonance, digits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.channel_noise import ChannelNoise
from backdrive_bayes.bench.effect import Effect, log_uniform

FRACTION = 0.15


@dataclass(frozen=True)
class Dirt(Effect):
    """All of it; strength is the level, 1 a usual bench. Amplitudes in rad (``ripple_nm`` in N·m)."""

    asymmetry_rad: float
    drift_rad_per_s: float
    wave_rad: float
    wave_load: float
    ripple_nm: float
    ripple_hz: float

    of_reducer = False

    def torque(self, run, torque_nm):
        """Torque with ripple [N·m]."""
        return torque_nm + self.strength * self.ripple_nm * np.sin(2 * np.pi * self.ripple_hz * run.bench_time_s)

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Departure of real springs from smooth laws [rad]."""
        load = transmitted_nm / run.reducer.rated_torque_nm
        return self.strength * (self.asymmetry_rad * np.abs(load) + self.wave_rad * np.sin(self.wave_load * load))

    def read(self, run, angle_rad):
        """Angle with a little drift [rad]."""
        return angle_rad + self.strength * self.drift_rad_per_s * run.time_s


def draw_dirt(rng, reducer, noise: ChannelNoise, longest_s: float, level: float) -> Dirt:
    """Dirt of the given level; each part up to FRACTION or so of the slow angle noise."""
    size = FRACTION * noise.correlated_rad * rng.uniform(-1, 1, 3)
    return Dirt(
        strength=level,
        asymmetry_rad=float(size[0]),
        drift_rad_per_s=float(size[1] / longest_s),
        wave_rad=float(size[2]),
        wave_load=rng.uniform(4.0, 12.0),
        ripple_nm=FRACTION * noise.torque_nm * rng.uniform(0.3, 1.0),
        ripple_hz=log_uniform(rng, 1.0, 12.0),
    )


def resonance(rng, samples: int, step_s: float, noise: ChannelNoise, level: float):
    """A weak resonance of the rig in the angle noise [rad], shape (samples,): a ring of 15-80 Hz."""
    time = np.arange(samples) * step_s
    turn = 2 * np.pi * rng.uniform(15.0, 80.0) * time
    knots = max(4, int(samples * step_s / 0.25))
    swell = [np.interp(time, np.linspace(0, time[-1], knots), rng.standard_normal(knots)) for _ in range(2)]
    return level * FRACTION * noise.correlated_rad * (swell[0] * np.sin(turn) + swell[1] * np.cos(turn))


def quantise(angle_rad, noise: ChannelNoise, level: float):
    """Angle in steps of a digital encoder [rad]."""
    step = level * 0.3 * noise.white_rad
    return np.round(angle_rad / step) * step if step else angle_rad
