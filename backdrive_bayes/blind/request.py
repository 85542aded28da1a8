"""What a blind check asks for, and which effect every unit of it gets."""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass

from backdrive_bayes.bench.plan import DEFAULT_PLAN, Plan, make_plan, random_plan
from backdrive_bayes.bench.registry import EFFECTS, MEMBERS, NONE, UNKNOWN
from backdrive_bayes.errors import BadInput

LISTED = tuple(name for name in EFFECTS if name not in MEMBERS)
"""The effects that a diagnosis may name: the baseline holds the members itself, so that they are no gap and are never drawn."""
PAIR = "pair"
CLASSES = (NONE, *LISTED, UNKNOWN, PAIR)

SHARES = {NONE: 0.15, UNKNOWN: 0.15, PAIR: 0.10, "single": 0.60}
"""Share of the units by kind; kinds that are not asked for leave theirs to the others."""
PLANS = ("rates", "random", "quick")


@dataclass(frozen=True)
class Request:
    """A blind check: how many units, of which classes and severities (severity.py of the bench), on which test plan.

    ``classes`` are of ``CLASSES``; ``reserved`` takes unlisted effects from the bench's reserved group; ``plan`` is one of
    ``PLANS``; ``dirt`` is the level of the small faults that every bench has. The same request gives the same units.
    """

    units: int
    severities: tuple[float, ...] = (1.0, 0.4, 0.2, 0.1)
    classes: tuple[str, ...] = CLASSES
    reserved: bool = False
    plan: str = "rates"
    dirt: float = 1.0
    seed: int = 0

    def __post_init__(self):
        strange = [name for name in self.classes if name not in CLASSES]
        if strange or not self.classes:
            raise BadInput("effects", f"some of {', '.join(CLASSES)}", ", ".join(strange) or "none of them")
        if self.classes == (PAIR,) or (PAIR in self.classes and len(self._singles()) == 1):
            raise BadInput("effects", "two effects or more to make pairs of", ", ".join(self.classes))
        if not 1 <= self.units <= 9999:
            raise BadInput("units", "a number from 1 to 9999", self.units)
        if not self.severities or not all(0.0 < s <= 10.0 for s in self.severities):
            raise BadInput("severities", "numbers above 0 and up to 10", self.severities)
        if len(set(self.classes)) < len(self.classes) or len(set(self.severities)) < len(self.severities):
            raise BadInput("effects and severities", "each once", "one twice")
        if self.plan not in PLANS:
            raise BadInput("plan", f"one of {', '.join(PLANS)}", self.plan)

    def _singles(self):
        return tuple(name for name in self.classes if name in LISTED)

    def as_json(self) -> dict:
        """The request as plain JSON data."""
        return {k: list(v) if isinstance(v, tuple) else v for k, v in asdict(self).items()}


def assign(request: Request, rng) -> list[dict[str, float]]:
    """Effects and their severities of every unit in an order drawn at random; {} for none.

    Classes and severities are dealt evenly, so that no class is left to chance.
    """
    names, counts = _names(request), _counts(request)
    dealt = [effects for kind, count in counts.items() for effects in _deal(names[kind], request.severities, count, rng)]
    return [dealt[i] for i in rng.permutation(len(dealt))]


def draw_plan(request: Request, rng) -> Plan:
    """The records of one unit."""
    if request.plan == "random":
        return random_plan(rng)
    return DEFAULT_PLAN if request.plan == "rates" else make_plan((1.0, 5.0), sampling_hz=200.0)


def _counts(request):
    singles = request._singles()
    asked = [kind for kind in SHARES if kind in request.classes or (kind == "single" and singles)]
    total = sum(SHARES[kind] for kind in asked)
    exact = {kind: request.units * SHARES[kind] / total for kind in asked}
    counts = {kind: int(value) for kind, value in exact.items()}
    by_remainder = sorted(asked, key=lambda kind: counts[kind] - exact[kind])
    for kind in by_remainder[: request.units - sum(counts.values())]:
        counts[kind] += 1
    return counts


def _names(request) -> dict[str, list[tuple[str, ...]]]:
    """Effects of the units of each kind."""
    singles = request._singles()
    pairs = itertools.combinations(sorted(singles or LISTED), 2)
    return {NONE: [()], UNKNOWN: [(UNKNOWN,)], PAIR: list(pairs), "single": [(name,) for name in singles]}


def _deal(names, levels, count, rng) -> list[dict[str, float]]:
    """Names round by round, in one order at random; from one to the next, and from round to round, the severity is another."""
    order, levels = rng.permutation(len(names)), [levels[i] for i in rng.permutation(len(levels))]
    turns = (divmod(k, len(names)) for k in range(count))
    return [dict.fromkeys(names[order[at]], levels[(turn + at) % len(levels)]) for turn, at in turns]
