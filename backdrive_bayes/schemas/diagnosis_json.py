"""diagnosis.json: where the gap lies, which effect causes it, how far it shrinks."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Branch, Convergence, Count, Curve, Digest, Interval, Number, Probability, Result
from backdrive_bayes.schemas.words import Text


class Gap(Struct):
    """Whether there is a gap, and its size against the noise."""

    probability: Probability
    unlisted_probability: Probability
    rms_rad: Number = None
    noise_floor_rad: Number = None


class Cell(Struct):
    """One stretch of a branch: its share of the gap, and the gap's mean there."""

    record: Text
    branch: Branch
    cycle: Count
    torque_lo_Nm: float
    torque_hi_Nm: float
    share: Number
    signed_rms_rad: Number
    credible: bool = True


class Where(Struct):
    """Where the gap lies, in one sentence and as a map."""

    summary: str
    map: list[Cell]


class EffectParameter(Interval, kw_only=True):
    """A parameter of an effect with its unit."""

    unit: str


class Hypothesis(Struct):
    """An effect or a pair, ``unknown`` or ``none``, and its probability; they sum to 1."""

    effect: Text
    probability: Probability
    parameters: dict[str, EffectParameter] = field(default_factory=dict)


class Answer(Struct):
    """What is named: nothing for no gap, ``unknown`` for an unlisted effect, several where several act."""

    effects: list[str]
    credible_set_90: list[str] = field(default_factory=list)


class HeldOut(Struct):
    """A held-out record or leg before and after the effect is added."""

    record: Text
    before_rad: Number
    after_rad: Number
    noise_floor_rad: Number
    retuned_rad: Number = None
    closed_fraction: Interval | None = None


class BeforeAfter(Struct):
    """An indicator without and with the effect."""

    before: Interval | None
    after: Interval | None


class Shrink(Struct):
    """How far the gap shrinks on held-out data; ``closed_fraction`` is null where only properties of the class are named."""

    held_out: str
    before_rad: Number
    after_rad: Number
    noise_floor_rad: Number
    closed_fraction: Interval | None
    indicators: dict[str, BeforeAfter]
    retuned_rad: Number = None
    records: list[HeldOut] = field(default_factory=list)
    gaussian_process: dict[str, Any] = field(default_factory=dict)
    indicators_at: dict[str, Any] | None = None


class NextTest(Struct):
    """The measurement that would best separate what is still confusable."""

    do: str
    separates: list[str]
    expected_entropy_drop_bits: Number
    others: dict[str, Number] = field(default_factory=dict)


class ParameterShift(Struct):
    """A parameter of the baseline without and with the effect, its shift in standard deviations."""

    parameter: Text
    unit: str
    before: Interval | None
    after: Interval | None
    shift_sd: Number


class Residual(Struct):
    """Residuals of a record over the torque, the first loading left out."""

    record: Text
    torque_Nm: Curve
    direction: Curve
    before_rad: Curve
    after_rad: Curve
    retuned_rad: Curve = field(default_factory=list)
    noise_rad: Number = None


class GapPart(Where, kw_only=True):
    """Where a part of the gap lies."""

    part: Literal["retuning", "effect", "left"]


class GapShares(Struct):
    """Shares of the gap on one held-out record or leg."""

    record: Text
    retuning: Interval
    effect: Interval
    left: Interval


class SimulatedParameter(Struct):
    """A parameter of the reducer in the simulator and in the unit; ``credible`` where the change's interval excludes zero."""

    name: Text
    unit: str
    simulated: Number
    measured: Interval
    simulated_interval: Interval | None = None
    change: Interval | None = None
    credible: bool = False


class Simulator(Struct):
    """The gap between a simulator and the unit, split: closed by re-tuning, by what is missing, left.

    ``told`` says whether the gap stands out of the noise; shares are null where it does not. ``effects`` are those that the
    simulator has itself, ``same_path`` says of which records its own angle was taken, ``noise_added`` how it was read.
    """

    closed_by_retuning: Interval
    closed_by_effect: Interval
    left: Interval
    parameters: list[SimulatedParameter]
    unit: str = ""
    told: bool = True
    summary: str = ""
    closed_by_both: Interval | None = None
    effects: list[str] = field(default_factory=list)
    shared_effects: list[str] = field(default_factory=list)
    same_path: list[bool] = field(default_factory=list)
    noise_added: dict[str, Number] = field(default_factory=dict)
    rms_rad: dict[str, Number] = field(default_factory=dict)
    parts: list[GapPart] = field(default_factory=list)
    records: list[GapShares] = field(default_factory=list)
    data_sha256: list[Digest] = field(default_factory=list)
    convergence: Convergence | None = None


class DiagnosisFile(Result, kw_only=True):
    """All of it; ``inconclusive`` says why nothing is named, and is empty otherwise."""

    schema: Literal["backdrive-bayes/diagnosis/1"]
    unit: Text
    baseline: list[str]
    which: list[Hypothesis]
    answer: Answer
    where: Where
    gap: Gap | None
    shrink: Shrink | None
    next_test: NextTest | None
    inconclusive: str = ""
    level: Probability = 0.9
    k: Probability = 0.03
    records: list[dict[str, Any]] = field(default_factory=list)
    residual: list[Residual] = field(default_factory=list)
    parameter_shift: list[ParameterShift] = field(default_factory=list)
    simulator: Simulator | None = None
    convergence: Convergence | None = None
