"""What an effect is to this bench: a strength, drawn parameters, and hooks at the physical places where it acts.

The places come in this order: the torque that acts (the sensor's reading is what is commanded), the sliders' friction, the
drag on floating parts, the torque behind the sliders, the deflection, and the reading of the angle. An effect overrides what
it touches.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.bench.plan import Path
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances
from backdrive_bayes.bench.sliders.reducer import BenchReducer


@dataclass(frozen=True)
class Run:
    """One record as effects see it, at ``time_s`` (steps,), which counts from the record's start, negative in its past."""

    reducer: BenchReducer
    where: Circumstances
    time_s: np.ndarray
    torque_nm: np.ndarray
    """Torque as commanded and measured [N·m], (steps,)."""

    @classmethod
    def at(cls, reducer, where: Circumstances, time_s) -> Run:
        """The run of a record at these times."""
        return cls(reducer, where, time_s, where.path.torque_at(time_s))

    @property
    def path(self) -> Path:
        """Torque path of the record."""
        return self.where.path

    @property
    def index(self) -> int:
        """The record's number in the unit."""
        return self.where.index

    @property
    def bench_time_s(self):
        """Time since the bench was switched on [s]."""
        return self.where.start_s + self.time_s

    @property
    def load(self):
        """Torque as a share of the rated torque."""
        return self.torque_nm / self.reducer.rated_torque_nm

    @property
    def relative_rate(self) -> float:
        """Loading rate in rated torques per second."""
        return self.path.rate_nm_per_s / self.reducer.rated_torque_nm


@dataclass(frozen=True)
class Effect(BenchEffect):
    """An effect of the given ``strength`` (its own unit, 0 is absent); final classes override the hooks they need."""

    strength: float = field()

    def torque(self, run: Run, torque_nm):
        """Torque that acts on the reducer [N·m]."""
        return torque_nm

    def friction(self, run: Run, torque_nm, half_width_nm):
        """What the sliders hold back [N·m], shape (steps, elements)."""
        return half_width_nm

    def floating_drag(self, run: Run, drag_nm):
        """Drag on the floating parts [N·m], shape (steps, elements)."""
        return drag_nm

    def transmit(self, run: Run, transmitted_nm):
        """Torque behind the sliders [N·m]."""
        return transmitted_nm

    def deflect(self, run: Run, torque_nm, transmitted_nm, angle_rad):
        """Angle [rad] added to the reducer's own ``angle_rad``."""
        return 0.0

    def read(self, run: Run, angle_rad):
        """Angle as the channel reports it [rad], at the run's times; between them the angle is straight."""
        return angle_rad
