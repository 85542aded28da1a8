"""Interpolation error of the encoder, periodic in the measured angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class EncoderError(Effect):
    """Sine with a second harmonic, or a sawtooth rounded; ``period`` is an angle share, strength the sine's steepest slope."""

    period: float
    phase: float
    harmonic: float
    sharpness: float

    guess = 0.3
    most = 0.85
    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with interpolation error [rad]."""
        turn = 2 * np.pi * angle_rad / (self.period * run.reducer.angle_rad) + self.phase
        wave = np.sin(turn) + self.harmonic * np.sin(2 * turn + 1.0)
        if self.sharpness:
            wave = np.arctan2(self.sharpness * np.sin(turn), 1.0 - self.sharpness * np.cos(turn))
        return angle_rad + self.strength * self.period * run.reducer.angle_rad * wave / (2 * np.pi)


def draw(rng, reducer):
    """Five to sixty-odd periods in the measured range."""
    variant = rng.integers(3)
    harmonic, sharpness = (rng.uniform(0.2, 0.5) if variant == 1 else 0.0), (rng.uniform(0.5, 0.8) if variant == 2 else 0.0)
    return EncoderError(0.0, log_uniform(rng, 0.03, 0.4), rng.uniform(0, 2 * np.pi), harmonic, sharpness)
