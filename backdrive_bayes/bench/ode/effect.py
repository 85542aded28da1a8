"""What an effect is to this bench: a strength, drawn parameters, and hooks at the places where it acts.

The places come in this order: the torque that acts, the chain's parts, the modulation of compliance and friction in time,
couplings in series on the output side, the angle as a function of where the output stands, the channel's dynamics, and the
reading. Torques are shares of the rated torque, angles of the angle scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.ode.chain import Chain
from backdrive_bayes.bench.ode.reducer import OdeReducer
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances


@dataclass(frozen=True)
class Run:
    """One record as effects see it."""

    reducer: OdeReducer
    where: Circumstances

    @property
    def relative_rate(self) -> float:
        """Loading rate in rated torques per second."""
        return self.where.path.rate_nm_per_s / self.reducer.rated_torque_nm

    def load(self, time_s):
        """Commanded torque as a share of the rated torque, shape of ``time_s``."""
        return self.where.path.torque_at(time_s) / self.reducer.rated_torque_nm

    def bench_time_s(self, time_s):
        """Time since switch-on [s]."""
        return self.where.start_s + time_s


@dataclass(frozen=True)
class OdeEffect(BenchEffect):
    """An effect that does nothing; final classes override the hooks they need. Arrays share the shape of ``time_s``."""

    def torque(self, run: Run, time_s, torque):
        """Acting torque."""
        return torque

    def alter(self, run: Run, chain: Chain) -> Chain:
        """The chain with other parts."""
        return chain

    def widen(self, run: Run, time_s):
        """Modulation of the chain's extra compliance."""
        return np.zeros_like(time_s)

    def rub(self, run: Run, time_s):
        """Factor on all friction."""
        return np.ones_like(time_s)

    def series(self, run: Run, time_s, torque):
        """Times and added angle of a part in series, or None."""
        return None

    def mesh(self, run: Run, time_s, torque, angle):
        """Angle with what depends on where the output stands."""
        return angle

    def respond(self, run: Run, time_s, angle):
        """Times and angle behind the channel's dynamics."""
        return time_s, angle

    def read(self, run: Run, time_s, angle):
        """Angle as read at the samples."""
        return angle
