"""indicators.json: indicators, loops and parameters of a fitted unit."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Convergence, Curve, Interval, Model, Number, Probability, Result
from backdrive_bayes.schemas.words import Text


class Indicators(Struct):
    """Indicators of a settled loop; the lost motion is null where the loop does not reach k·T_r."""

    lost_motion_rad: Interval | None
    zero_torque_width_rad: Interval
    peak_angle_rad: Interval
    loop_area_J: Interval
    absorbed_J: Interval
    dissipation_ratio: Interval


class TorqueEnergy(Struct):
    """Energy per torque over the torque, and its two torques."""

    torque_Nm: Curve
    median_J_per_Nm: Curve
    lo: Curve
    hi: Curve
    tau1_Nm: Interval | None = None
    tau2_Nm: Interval | None = None


class Load(Struct):
    """How far a load that was asked for turns the output, and the energy absorbed."""

    load_Nm: float
    loading_rate_Nm_per_s: float
    theta_L_rad: Interval
    W_L_J: Interval
    predicted: list[str] = field(default_factory=list)


class FittedRecord(Struct):
    """One record: its indicators, its loop and the classic least-squares fit beside them."""

    file: Text
    loading_rate_Nm_per_s: float
    amplitude_Nm: float
    indicators: Indicators
    torque_energy: TorqueEnergy
    least_squares: dict[str, Any] | None = None
    loop: dict[str, Any] = field(default_factory=dict)
    mechanism: dict[str, Interval | None] = field(default_factory=dict)
    modules: dict[str, dict[str, Curve]] = field(default_factory=dict)
    by_amplitude: dict[str, Any] = field(default_factory=dict)
    windowed: dict[str, Any] = field(default_factory=dict)
    back_drive: dict[str, Any] | None = None
    noise: dict[str, Number] = field(default_factory=dict)


class Parameter(Interval, kw_only=True):
    """A parameter of the model with its unit, meaning and prior."""

    unit: str
    definition: str = ""
    null: Number = None
    prior: str = ""
    prior_interval: Interval | None = None


class IndicatorsFile(Result, kw_only=True):
    """All of it; ``posterior_sha256`` is that of the posterior.nc it was written with."""

    schema: Literal["backdrive-bayes/indicators/1"]
    unit: Text
    k: Probability
    level: Probability
    model: Model
    convergence: Convergence
    records: list[FittedRecord]
    rated_torque_Nm: float | None = None
    parameters: dict[str, Parameter] = field(default_factory=dict)
    loads: list[Load] = field(default_factory=list)
    jitter: dict[str, float] = field(default_factory=dict)
    identity: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    posterior_sha256: str = ""
