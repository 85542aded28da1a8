"""What an effect is: columns whose weights are wide where it acts and at trace level where it does not."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from backdrive_bayes.mechanics.history import History

MOST_GROWTH = 3.0
"""Log factor of thresholds beyond which no law of the rate is followed."""
LEAST_GROWTH = 2e-3
"""Range of that factor along a history below which its mean stands for it."""
LEAST_DRAG = 1e-5
"""The same of a drag before all parts, in shares of the torque scale."""


@dataclass(frozen=True, eq=False)
class Context:
    """What effects may know of a unit; torques are shares of the largest torque, angles of the angle scale.

    ``rate`` (records,) are loading rates [1/s], ``duration_s`` and ``amplitude`` (records,); ``angle_noise`` and ``torque_noise``
    standard deviations
    of block means and of single torque samples.
    """

    torque_scale_nm: float
    angle_scale_rad: float
    rate: np.ndarray
    duration_s: np.ndarray
    angle_noise: float
    torque_noise: float
    amplitude: np.ndarray = field(default_factory=lambda: np.ones(1))

    @property
    def log_rate(self) -> np.ndarray:
        """Logarithms of the rates over their geometric mean, (records,)."""
        return np.log(self.rate) - np.log(self.rate).mean()

    def law(self, log_rate, log_amplitude: float) -> tuple:
        """What growths are multiplied by: the exponent of a law of the rate, like ``log_rate``, exponent and bend of one of the
        amplitude, of which the records' mean is none, and a drag before all parts, like the root of the rate over the largest."""
        own = np.log(self.amplitude) - np.log(self.amplitude).mean()
        apart = log_amplitude - float(np.log(self.amplitude).mean())
        root = np.exp(0.5 * np.minimum(log_rate - self.log_rate.max(), MOST_GROWTH))
        return log_rate, apart, apart**2 - float(np.mean(own**2)), root


@dataclass(frozen=True)
class Effect:
    """A candidate effect.

    ``breaks`` is the symmetry of the class that it breaks, ``of_reducer`` is False for faults of the measuring
    channel, ``per_record`` says whether each record has weights of its own, ``of_class`` whether every reducer has it, ``known``
    whether its standard deviation where it acts is not inferred, ``instead`` whether it is weighed in place of the other terms of
    its name, about modes that are searched without it (a fit lets all of them act).
    ``present`` gives the standard deviation of its (independent) weights where it acts; where it is a mere trace, as on every
    bench, the noise decides (:mod:`backdrive_bayes.engine.traces`).
    """

    of_class: ClassVar[bool] = False
    known: ClassVar[bool] = False
    instead: ClassVar[bool] = False
    name: str
    breaks: str
    signature: str
    source: str
    unit: str = "1"
    of_reducer: bool = True
    per_record: bool = False

    def present(self, context: Context) -> float:
        """Typical standard deviation of the weights where the effect acts."""
        raise NotImplementedError


@dataclass(frozen=True)
class PathEffect(Effect):
    """An effect whose columns follow from the torque history alone."""

    def responses(self, history: History, record: int | None, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """Its columns at the beginning and the end of every segment, (segments, columns) each; ``record`` is the number of the
        record whose history it is, None for a history that was not measured."""
        raise NotImplementedError


@dataclass(frozen=True)
class TangentEffect(Effect):
    """An effect that moves a nonlinear parameter of the operator: its column is the derivative of the present prediction.

    ``parameter`` is the place of the parameter in :class:`Distortion`; where ``one_way``, what the name stands for cannot be
    negative.
    """

    one_way: ClassVar[bool] = False
    parameter: str = ""


@dataclass(frozen=True)
class GrowthEffect(TangentEffect):
    """An effect by which thresholds follow the rate at the moment: the derivative by a term of the law.

    ``part`` is the number of friction (0), of drag (1) or of a drag before all parts (2), ``term`` that of the exponent of the
    rate (0), of exponent and bend of the amplitude (1 and 2) or of the root of the rate (3).
    """

    part: int = 0
    term: int = 0


@dataclass(frozen=True)
class AngleEffect(Effect):
    """An effect whose columns follow from the angle that the class turns, the same in all records."""

    def columns(self, angle) -> np.ndarray:
        """Its columns (…, columns) at angles (…,) of the class at its present weights, in shares of the angle scale."""
        raise NotImplementedError


@dataclass(frozen=True)
class FlankEffect(Effect):
    """Flanks that differ: the even counterparts of the class's parts at their present weights, one column a part."""


@dataclass(frozen=True)
class SpreadEffect(Effect):
    """A late channel that smooths: the prediction behind a first-order lag less that behind a pure delay of the same mean."""


@dataclass(frozen=True)
class Distortion:
    """How a channel and the rate distort what the class sees; all zero for an ideal bench and a rate-independent reducer.

    ``offset`` is a share of the torque scale, ``lag_s`` in seconds; the logarithms of friction and drag thresholds follow the log
    of the rate with these exponents, and that of the amplitude with these and bends. ``shaft_drag`` is a share of the torque
    scale at the largest rate, or at rest where it falls with the rate (negative).
    """

    offset: float = 0.0
    lag_s: float = 0.0
    friction_exponent: float = 0.0
    drag_exponent: float = 0.0
    friction_amplitude: float = 0.0
    drag_amplitude: float = 0.0
    friction_amplitude_bend: float = 0.0
    drag_amplitude_bend: float = 0.0
    shaft_drag: float = 0.0

    def law(self, log_rate, log_amplitude: float, context: Context) -> tuple:
        """Derivatives of the growths by their parameters, as :meth:`Context.law`: no drag helps the motion, so that one which
        falls with the rate is none from the largest one on."""
        *terms, root = context.law(log_rate, log_amplitude)
        return *terms, np.minimum(root - 1.0, 0.0) if self.shaft_drag < 0.0 else root

    def growth(self, log_rate, log_amplitude: float, context: Context) -> tuple:
        """Logarithms of the factors of friction and drag thresholds and the drag before all parts in shares of the torque scale,
        each like ``log_rate``: one rate or many."""
        friction = self.friction_exponent, self.friction_amplitude, self.friction_amplitude_bend
        drag = self.drag_exponent, self.drag_amplitude, self.drag_amplitude_bend
        *terms, root = self.law(log_rate, log_amplitude, context)
        along, across = (sum(a * term for a, term in zip(law, terms, strict=True)) for law in (friction, drag))
        before = self.shaft_drag * root
        return _bounded(along), _bounded(across), before if np.ptp(before) > LEAST_DRAG else float(np.mean(before))


def _bounded(growth):
    """A growth within MOST_GROWTH, one number where it hardly moves."""
    growth = np.clip(growth, -MOST_GROWTH, MOST_GROWTH)
    return growth if np.ptp(growth) > LEAST_GROWTH else float(np.mean(growth))
