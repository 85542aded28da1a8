"""limits.toml: the limits of indicators and the agreed risks."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.words import Finite, Positive, Risk

CONSUMER, PRODUCER = 0.05, 0.10
Shape = Literal["normal", "lognormal", "gamma"]


class AtTable(Struct, forbid_unknown_fields=True, frozen=True):
    """Where a limit holds."""

    loading_rate_Nm_per_s: Positive | None = None
    amplitude_Nm: Positive | None = None

    def __post_init__(self):
        if self.loading_rate_Nm_per_s is None and self.amplitude_Nm is None:
            raise BadInput("", "loading_rate_Nm_per_s or amplitude_Nm", "an empty table")


class ProcessTable(Struct, forbid_unknown_fields=True, frozen=True):
    """What is known of the production process."""

    mean: Finite
    sd: Positive
    shape: Shape = "normal"

    def __post_init__(self):
        if self.shape != "normal" and self.mean <= 0:
            raise BadInput("mean", f"a positive number for a {self.shape} process", f"{self.mean:g}")


class LimitTable(Struct, forbid_unknown_fields=True, frozen=True):
    """One limit: ``min``, ``max`` or both, where it holds, and what is known of the process."""

    min: Finite | None = None
    max: Finite | None = None
    at: AtTable | None = None
    k: Annotated[float, Meta(gt=0.0, lt=1.0, title="a share of T_r below 1")] | None = None
    process: ProcessTable | None = None

    def __post_init__(self):
        if self.min is None and self.max is None:
            raise BadInput("", "max, min or both", "neither")
        if self.min is not None and self.max is not None and self.min >= self.max:
            raise BadInput("", "max above min", f"min = {self.min:g}, max = {self.max:g}")


class RiskTable(Struct, forbid_unknown_fields=True, frozen=True):
    """``[risk]``: highest agreed probabilities of a wrong pass and a wrong rejection."""

    consumer: Risk = CONSUMER
    producer: Risk = PRODUCER


OneOrMore = LimitTable | list[LimitTable]


class LimitsFile(Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """The limits by the indicators' names, one table or several each."""

    lost_motion_rad: OneOrMore = field(default_factory=list)
    zero_torque_width_rad: OneOrMore = field(default_factory=list)
    peak_angle_rad: OneOrMore = field(default_factory=list)
    loop_area_J: OneOrMore = field(default_factory=list)
    absorbed_J: OneOrMore = field(default_factory=list)
    dissipation_ratio: OneOrMore = field(default_factory=list)
    tau1_Nm: OneOrMore = field(default_factory=list)
    tau2_Nm: OneOrMore = field(default_factory=list)
    hump_torque_Nm: OneOrMore = field(default_factory=list)
    S_g_J: OneOrMore = field(default_factory=list)
    S_f_J: OneOrMore = field(default_factory=list)
    S_g_over_S: OneOrMore = field(default_factory=list)
    S_f_over_S: OneOrMore = field(default_factory=list)
    elastic_share: OneOrMore = field(default_factory=list)
    theta_L_rad: OneOrMore = field(default_factory=list)
    W_L_J: OneOrMore = field(default_factory=list)
    risk: RiskTable = field(default_factory=RiskTable)

    def __post_init__(self):
        if not any(tables for _, tables in self.by_indicator()):
            raise BadInput("", "at least one limit, as in [lost_motion_rad] max = 0.003", "none")
        for name, tables in self.by_indicator():
            for table in tables:
                # No indicator of a reducer is negative.
                if table.max is not None and table.max < 0:
                    raise BadInput(f"{name}.max", "a limit of 0 or more, as the quantity cannot be negative", f"{table.max:g}")
                if table.k is not None and name != "lost_motion_rad":
                    raise BadInput(f"{name}.k", "k with lost_motion_rad only", f"{table.k:g}")

    def by_indicator(self) -> list[tuple[str, list[LimitTable]]]:
        """Every indicator's name with its limits, in the order of the fields."""
        names = [name for name in self.__struct_fields__ if name != "risk"]
        values = [(name, getattr(self, name)) for name in names]
        return [(name, value if isinstance(value, list) else [value]) for name, value in values]
