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
        """What growths are multiplied by: exponent and bend of a law of the rate, each like ``log_rate``, and exponent and bend
        of one of the amplitude; the records' mean is none."""
        own = np.log(self.amplitude) - np.log(self.amplitude).mean()
        apart = log_amplitude - float(np.log(self.amplitude).mean())
        return log_rate, log_rate**2 - np.mean(self.log_rate**2), apart, apart**2 - float(np.mean(own**2))


@dataclass(frozen=True)
class Effect:
    """A candidate effect.

    ``breaks`` is the symmetry of the class that it breaks, ``of_reducer`` is False for faults of the measuring
    channel, ``per_record`` says whether each record has weights of its own, ``of_class`` whether every reducer has it, ``known``
    whether its standard deviation where it acts is not inferred.
    ``present`` gives the standard deviation of its (independent) weights where it acts; where it is a mere trace, as on every
    bench, the noise decides (:mod:`backdrive_bayes.engine.traces`).
    """

    of_class: ClassVar[bool] = False
    known: ClassVar[bool] = False
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
    """An effect by which the thresholds of one part follow the rate at the moment: the derivative by a term of the law.

    ``part`` is the number of friction (0) or drag (1), ``term`` that of exponent (0) or bend (1) of the
    rate, or of the amplitude (2 and 3).
    """

    part: int = 0
    term: int = 0


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
    of the rate with these exponents and bends, and that of the amplitude likewise: a law of either has the same freedom.
    """

    offset: float = 0.0
    lag_s: float = 0.0
    friction_exponent: float = 0.0
    drag_exponent: float = 0.0
    friction_bend: float = 0.0
    drag_bend: float = 0.0
    friction_amplitude: float = 0.0
    drag_amplitude: float = 0.0
    friction_amplitude_bend: float = 0.0
    drag_amplitude_bend: float = 0.0

    def growth(self, log_rate, log_amplitude: float, context: Context) -> tuple:
        """Logarithms of the factors of friction and drag thresholds, each like ``log_rate``: one rate or many."""
        friction = self.friction_exponent, self.friction_bend, self.friction_amplitude, self.friction_amplitude_bend
        drag = self.drag_exponent, self.drag_bend, self.drag_amplitude, self.drag_amplitude_bend
        terms = context.law(log_rate, log_amplitude)
        along, across = (sum(a * term for a, term in zip(law, terms, strict=True)) for law in (friction, drag))
        return _bounded(along), _bounded(across)


def _bounded(growth):
    """A growth within MOST_GROWTH, one number where it hardly moves."""
    growth = np.clip(growth, -MOST_GROWTH, MOST_GROWTH)
    return growth if np.ptp(growth) > LEAST_GROWTH else float(np.mean(growth))
