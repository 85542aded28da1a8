"""What an effect is to the virtual bench: a strength, drawn parameters, and hooks at the physical places where it acts.

The places come in this order: the torque that acts (the sensor's reading is what is commanded), the sliders' friction, the
drag on floating parts, the torque behind the sliders, the deflection, and the reading of the angle. An effect overrides what
it touches.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from backdrive_bayes.bench.reducer import BenchReducer


@dataclass(frozen=True)
class Run:
    """One record as effects see it: arrays of shape (steps,).

    ``time_s`` counts from the record's start and is negative in its past, ``start_s`` is that start since the bench was
    switched on; ``torque_nm`` is the torque as commanded and measured; ``index`` the record's number in the unit;
    ``floating`` from -1 to 1 says where the clearance floats at first.
    """

    reducer: BenchReducer
    time_s: np.ndarray
    torque_nm: np.ndarray
    rate_nm_per_s: float
    start_s: float
    index: int
    floating: float = 0.0

    @property
    def bench_time_s(self):
        """Time since the bench was switched on [s]."""
        return self.start_s + self.time_s

    @property
    def load(self):
        """Torque as a share of the rated torque."""
        return self.torque_nm / self.reducer.rated_torque_nm

    @property
    def relative_rate(self):
        """Loading rate in rated torques per second."""
        return self.rate_nm_per_s / self.reducer.rated_torque_nm


@dataclass(frozen=True)
class Effect:
    """An effect of the given ``strength`` (its own unit, 0 is absent); final classes override the hooks they need."""

    strength: float

    guess = 0.01
    most = 1.0
    of_reducer = True

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
        """Angle as the channel reports it [rad], on evenly spaced samples."""
        return angle_rad

    def parameters(self) -> dict:
        """Drawn parameters by name, for the truth."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}


def log_uniform(rng, low: float, high: float) -> float:
    """A number between ``low`` and ``high``, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def sign(rng) -> float:
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))
