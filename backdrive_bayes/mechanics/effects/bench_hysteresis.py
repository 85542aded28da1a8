"""Friction between torque sensor and output shaft (cables, bearings of the bench): part of every test, below what can be told."""

import numpy as np

from backdrive_bayes.mechanics.effect import Effect

SIZE = 0.1
"""Scale of a half-normal prior, in the torque noise of a sample: friction never helps the motion."""


class BenchHysteresis(Effect):
    """The reducer feels the torque that is read less a small part that opposes motion.

    It looks like friction of the reducer, so that no record tells it: it widens the intervals of what the loop encloses.
    """

    def usual(self, context) -> float:
        """Mean of the prior."""
        return float(SIZE * np.sqrt(2.0 / np.pi)) * context.torque_noise

    def present(self, context):
        """Standard deviation of the prior."""
        return float(SIZE * np.sqrt(1.0 - 2.0 / np.pi)) * context.torque_noise


BENCH_HYSTERESIS = BenchHysteresis(
    "bench_hysteresis",
    "none",
    "loop wider by a small torque",
    "JCGM 100:2008, F.2.4 (corrections that are not made)",
    "N·m",
    False,
)
