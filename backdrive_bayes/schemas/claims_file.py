"""A claims file: questions to posteriors."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.words import Positive

LETTERS = tuple("ABCDEFGHIJKLMNOPQRSTUVWXYZ")
_MOST = 500
Letter = Annotated[str, Meta(pattern=r"^[^\W\d]\w*\Z", title="a letter or name for a unit")]
Letters = Annotated[list[Letter], Meta(min_length=1, title='letters for the units in their order, as in ["A", "B"]')]


class ClaimTable(Struct, forbid_unknown_fields=True, frozen=True):
    """``[[claim]]``: a predicate on draws (``holds``) or an inferred probability, and where it is asked."""

    id: str | int | None = None
    text: str | None = None
    holds: Annotated[str, Meta(title="a comparison as text")] | None = None
    probability: Annotated[str, Meta(title="a probability as text")] | None = None
    every: Literal["rate"] | None = None
    along: Literal["rate", "amplitude", "torque"] | None = None
    rate: Positive | None = None
    amplitude: Positive | None = None
    low: Positive | None = field(default=None, name="from")
    high: Positive | None = field(default=None, name="to")
    note: str = ""

    def __post_init__(self):
        if (self.holds is None) == (self.probability is None):
            raise BadInput("", "either holds or probability", "neither" if self.holds is None else "both")

    @property
    def asked(self) -> tuple[str, str]:
        """The key that asks and its expression."""
        return ("holds", self.holds) if self.holds is not None else ("probability", self.probability or "")


class ClaimsFile(Struct, frozen=True):
    """The claims, and the letters that call the units in the order in which they are given."""

    schema: Literal["backdrive-bayes/claims/1"]
    claim: Annotated[list[ClaimTable], Meta(min_length=1, max_length=_MOST, title=f"one to {_MOST} [[claim]] tables")]
    units: Letters = field(default_factory=lambda: list(LETTERS))
    source: str = ""
