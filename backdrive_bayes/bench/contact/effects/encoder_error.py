"""Interpolation error of the encoder: its two signals are not a perfect sine and cosine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.drawing import log_uniform
from backdrive_bayes.bench.contact.effect import ContactEffect


@dataclass(frozen=True)
class EncoderError(ContactEffect):
    """Angle read from distorted quadrature signals; ``period`` is one signal period, an angle share, ``phase`` where it starts.

    Strength is the distortion of the signals over their amplitude, shared out as ``offset`` of the sine, ``gain`` of the cosine
    and ``shape``, the third harmonic (flattened signals). Source: Heydemann, Appl. Opt. 20, 1981.
    """

    period: float
    phase: float
    offset: float
    gain: float
    shape: float

    guess = 0.1
    most = 0.85
    of_reducer = False

    def read(self, test, time_s, angle):
        """Angle with interpolation error."""
        turn = 2 * np.pi * angle / self.period + self.phase
        sine = np.sin(turn) + self.strength * (self.offset - self.shape * np.sin(3 * turn) / 3.0)
        cosine = (1.0 + self.strength * self.gain) * np.cos(turn) + self.strength * self.shape * np.cos(3 * turn) / 3.0
        wrong = np.angle((cosine + 1j * sine) * np.exp(-1j * turn))
        return angle + self.period * wrong / (2 * np.pi)


def draw(rng, reducer):
    """Three to forty periods in the measured range; mostly offset, gain, or shape."""
    parts = [(1.0, 0.0, 0.0), (0.4, 1.5, 0.0), (0.1, 0.2, 1.0), (0.7, 0.5, 0.5)][int(rng.integers(4))]
    return EncoderError(0.0, log_uniform(rng, 0.05, 0.6), rng.uniform(0.0, 2 * np.pi), *parts)
