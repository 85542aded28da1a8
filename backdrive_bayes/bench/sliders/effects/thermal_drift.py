"""Slow drift of the angle's reading with the time since switch-on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders.effect import Effect

SESSION_S = 6000.0
VARIANTS = ("linear", "warm_up", "walk", "air_conditioning")


@dataclass(frozen=True)
class ThermalDrift(Effect):
    """Drift as a function of the bench's time; strength is the angle share that it moves in ``scale_s``."""

    variant: str
    direction: float
    scale_s: float
    walk: tuple[float, ...] = ()

    most = 10.0
    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with drift [rad]."""
        return angle_rad + self.strength * self.direction * run.reducer.angle_rad * self._course(run.bench_time_s)

    def _course(self, time_s):
        if self.variant == "warm_up":
            return -np.expm1(-np.maximum(time_s, 0.0) / self.scale_s)
        if self.variant == "walk":
            return PchipInterpolator(np.linspace(-10.0, SESSION_S, len(self.walk)), self.walk)(np.clip(time_s, -10, SESSION_S))
        if self.variant == "air_conditioning":
            return np.sin(2 * np.pi * time_s / self.scale_s)
        return time_s / self.scale_s


def draw(rng, reducer):
    """Linear, warm-up over 0.3-5 minutes, a walk with steps of seconds, or a swing of 0.5-5 minutes."""
    variant = str(rng.choice(VARIANTS))
    scale = log_uniform(rng, 30.0, 300.0) if variant == "air_conditioning" else log_uniform(rng, 20.0, 300.0)
    if variant != "walk":
        return ThermalDrift(0.0, variant, sign(rng), scale)
    step = log_uniform(rng, 4.0, 15.0)
    steps = rng.standard_normal(int(SESSION_S / step)) * np.sqrt(step / 30.0)
    return ThermalDrift(0.0, variant, sign(rng), 30.0, tuple(np.cumsum(steps).tolist()))
