"""Parameters of a model member: name, unit, prior, null value and source.

Every prior is a monotone transform of a standard normal variable, so that the sampler works in one space in which the
prior is N(0, I), whatever the physical units are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtr, ndtri


@dataclass(frozen=True)
class LogNormal:
    """Positive quantity with the given median and standard deviation of its natural logarithm."""

    median: float
    sigma: float

    def from_normal(self, z):
        """Physical value of the standard-normal coordinate ``z`` (any shape)."""
        return self.median * np.exp(self.sigma * np.asarray(z))

    def to_normal(self, value):
        """Standard-normal coordinate of a physical value (any shape)."""
        return np.log(np.asarray(value) / self.median) / self.sigma

    def describe(self) -> str:
        """One phrase for reports."""
        return f"log-normal, median {self.median:.4g}, log-sd {self.sigma:.3g}"


@dataclass(frozen=True)
class Uniform:
    """Quantity spread evenly between two bounds."""

    lo: float
    hi: float

    def from_normal(self, z):
        """Physical value of the standard-normal coordinate ``z`` (any shape)."""
        return self.lo + (self.hi - self.lo) * ndtr(z)

    def to_normal(self, value):
        """Standard-normal coordinate of a physical value (any shape); clipped just inside the bounds."""
        share = (np.asarray(value) - self.lo) / (self.hi - self.lo)
        return ndtri(np.clip(share, 1e-12, 1 - 1e-12))

    def describe(self) -> str:
        """One phrase for reports."""
        return f"uniform on [{self.lo:.4g}, {self.hi:.4g}]"


@dataclass(frozen=True)
class BoundedLogNormal:
    """Positive quantity below ``hi``: log-normal far below the bound (median, log-sd ``sigma``), logistic towards it."""

    median: float
    sigma: float
    hi: float

    def from_normal(self, z):
        """Physical value of the standard-normal coordinate ``z`` (any shape)."""
        return self.hi / (1 + (self.hi / self.median - 1) * np.exp(-self.sigma * np.asarray(z)))

    def to_normal(self, value):
        """Standard-normal coordinate of a physical value (any shape) below the bound."""
        odds = (self.hi / np.asarray(value) - 1) / (self.hi / self.median - 1)
        return -np.log(odds) / self.sigma

    def describe(self) -> str:
        """One phrase for reports."""
        return f"log-normal, median {self.median:.4g}, log-sd {self.sigma:.3g}, below {self.hi:.4g}"


@dataclass(frozen=True)
class LogUniform:
    """Positive quantity whose logarithm is spread evenly between two bounds."""

    lo: float
    hi: float

    def from_normal(self, z):
        """Physical value of the standard-normal coordinate ``z`` (any shape)."""
        return self.lo * (self.hi / self.lo) ** ndtr(z)

    def to_normal(self, value):
        """Standard-normal coordinate of a physical value (any shape); clipped just inside the bounds."""
        return Uniform(0.0, 1.0).to_normal(np.log(np.asarray(value) / self.lo) / np.log(self.hi / self.lo))

    def describe(self) -> str:
        """One phrase for reports."""
        return f"log-uniform on [{self.lo:.4g}, {self.hi:.4g}]"


@dataclass(frozen=True)
class Normal:
    """Quantity of either sign around zero."""

    sd: float

    def from_normal(self, z):
        """Physical value of the standard-normal coordinate ``z`` (any shape)."""
        return self.sd * np.asarray(z)

    def to_normal(self, value):
        """Standard-normal coordinate of a physical value (any shape)."""
        return np.asarray(value) / self.sd

    def describe(self) -> str:
        """One phrase for reports."""
        return f"normal, mean 0, sd {self.sd:.4g}"


Prior = LogNormal | BoundedLogNormal | Uniform | LogUniform | Normal


@dataclass(frozen=True)
class Scale:
    """The two scales that a unit's priors are stated in: rated torque [N·m] and an angle scale [rad]."""

    torque_nm: float
    angle_rad: float


@dataclass(frozen=True)
class Parameter:
    """One physical parameter.

    ``prior`` is stated for a unit of rated torque 1 and angle scale 1 and is multiplied by the scale that ``dimension``
    names (``torque``, ``angle``, ``compliance`` or ``none``). At ``null`` the member's contribution vanishes (None where
    another parameter of the member does that). ``per_record`` marks a value of its own for every record.
    """

    name: str
    unit: str
    dimension: str
    prior: Prior
    null: float | None
    source: str
    per_record: bool = False

    def scaled_prior(self, scale: Scale) -> Prior:
        """The prior in SI units for a reducer of the given scale."""
        factor = {
            "torque": scale.torque_nm,
            "angle": scale.angle_rad,
            "compliance": scale.angle_rad / scale.torque_nm,
            "none": 1.0,
        }[self.dimension]
        # Every number of a prior but the log-sd carries the quantity's dimension.
        return replace(self.prior, **{k: v * factor for k, v in vars(self.prior).items() if k != "sigma"})
