"""What an effect is to the contact bench: hooks where it acts on the chain, on its angle, or on the reading.

The places come in this order: the contacts themselves, the torque that acts, the angle behind the chain, the sampling of the
angle, and its reading. An effect overrides what it touches. Angles are shares of the reducer's angle scale, torques of T_r.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain
from backdrive_bayes.bench.contact.reducer import ContactReducer
from backdrive_bayes.bench.draws import sign
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances


@dataclass(frozen=True)
class Test:
    """One record as effects see it: the reducer and the record's circumstances."""

    __test__ = False

    reducer: ContactReducer
    where: Circumstances

    @property
    def relative_rate(self) -> float:
        """Loading rate in rated torques per second."""
        return self.where.path.rate_nm_per_s / self.reducer.rated_torque_nm


@dataclass(frozen=True, eq=False)
class Run:
    """The chain's answer: rising ``time_s`` (steps,), the acting ``load``, the output ``angle`` and the meshes' torques ``mesh``.

    ``load`` and ``angle`` have shape (steps,), ``mesh`` (steps, stages).
    """

    time_s: np.ndarray
    load: np.ndarray
    angle: np.ndarray
    mesh: np.ndarray


@dataclass(frozen=True)
class ContactEffect(BenchEffect):
    """An effect of the contact bench; final classes override the hooks they need."""

    # Without a default, so that drawn parameters can follow it.
    strength: float = field()

    def chain(self, test: Test, chain: Chain) -> Chain:
        """The chain with changed contacts."""
        return chain

    def times_s(self, test: Test) -> np.ndarray:
        """Times [s] at which the acting torque bends and the path does not."""
        return np.zeros(0)

    def load(self, test: Test, time_s, load):
        """Acting torque (steps,)."""
        return load

    def deflect(self, test: Test, run: Run):
        """Angle added behind the chain (steps,)."""
        return 0.0

    def late(self, test: Test, run: Run, time_s):
        """Change of the angle at ``time_s`` (samples,) because it is read late."""
        return 0.0

    def read(self, test: Test, time_s, angle):
        """Angle as reported (samples,)."""
        return angle


def loaded_angle(rng, reducer: ContactReducer, low: float = 0.15, high: float = 0.85) -> float:
    """An output angle that the reducer passes under load, on either side, between these shares of the way to T_r."""
    free = reducer.clearance_share
    return sign(rng) * (free + (1.0 - free) * rng.uniform(low, high))
