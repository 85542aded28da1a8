"""A saved diagnosis, read for display."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures.style import in_words, record_labels
from backdrive_bayes.number_text import plain
from backdrive_bayes.results import DIAGNOSIS, read_result

FILE = "diagnosis.json"
_SUFFIX = re.compile(r"\.(csv|parquet|tdms|mat)(\.[a-z0-9]+)?$", re.IGNORECASE)
PLAIN = ("unknown", "none")
"""Answers that name no effect."""
LEADERS, NEGLIGIBLE = 3, 0.005
"""So many hypotheses are shown however improbable; further ones from this probability on."""


@dataclass(frozen=True)
class Hypothesis:
    """One line of the answer; ``count`` hypotheses stand behind it (more than one where they are lumped)."""

    effect: str
    probability: float
    in_set: bool
    count: int = 1


@dataclass(frozen=True, eq=False)
class Diagnosed:
    """The object of one diagnosis.json; parts that it lacks read as empty."""

    result: dict

    @classmethod
    def read(cls, folder: Path) -> Diagnosed:
        """Read a result folder of ``diagnose``; BadInput where the file is missing, broken or incomplete."""
        path = Path(folder) / FILE
        result = read_result(path, DIAGNOSIS)
        for key in ("unit", "records", "which", "answer", "outcome"):
            if key not in result:
                raise BadInput(path, f"key '{key}'", "no such key")
        return cls(result)

    @property
    def records(self) -> list[dict]:
        """The record objects."""
        return self.result["records"]

    @cached_property
    def labels(self) -> list[str]:
        """A short unique name of each record: its rate, or its file's name where rates repeat."""
        by_rate = [f"{plain(r['loading_rate_Nm_per_s'], 2)} N·m/s" for r in self.records]
        by_file = [_SUFFIX.sub("", Path(str(r["file"])).name) for r in self.records]
        for labels in (by_rate, by_file):
            if len(set(labels)) == len(labels) and all(0 < len(x) <= 20 for x in labels):
                return labels
        return record_labels(self.records)

    @cached_property
    def numbers(self) -> dict[str, int]:
        """Which record a file is."""
        return {r["file"]: i for i, r in enumerate(self.records)}

    @property
    def inconclusive(self) -> str:
        """Why there is no answer; empty where there is one."""
        outcome = self.result["outcome"]
        return outcome["reason"] if outcome["exit_code"] else ""

    @property
    def effects(self) -> list[str]:
        """The named effects, ["unknown"], or nothing where there is no gap."""
        return self.result["answer"].get("effects") or []

    @property
    def credible_set(self) -> list[str]:
        """Effects and pairs of the 90 % credible set; empty where the result is inconclusive."""
        return [] if self.inconclusive else self.result["answer"].get("credible_set_90") or []

    @property
    def gap(self) -> dict:
        """Probability and size of the gap; empty where it was not judged."""
        return self.result.get("gap") or {}

    @property
    def cells(self) -> list[dict]:
        """The cells of the gap map that belong to a record."""
        return [c for c in self.where.get("map") or [] if c["record"] in self.numbers]

    @property
    def where(self) -> dict:
        """Summary and map."""
        return self.result.get("where") or {}

    @property
    def summary(self) -> str:
        """Where the gap lies, in words."""
        return in_words(str(self.where.get("summary") or ""))

    @property
    def simulator(self) -> dict:
        """What a simulator was found to lack; empty where none was set against the unit."""
        return self.result.get("simulator") or {}

    @property
    def enlarged(self) -> bool:
        """Whether there is something after to set beside before: an effect was added or a simulator re-tuned, and the result
        may be used."""
        return bool(self.effects or self.simulator.get("told")) and not self.inconclusive

    @property
    def shrink(self) -> dict:
        """How far the gap shrinks; empty where nothing was added to the model."""
        return (self.result.get("shrink") or {}) if self.enlarged else {}

    @property
    def added(self) -> bool:
        """Whether an effect was added to the model, or a simulator re-tuned: an unknown cause alone adds none, and closes nothing
        by itself; a property is part of the class."""
        if self.inside:
            return False
        closed = self.shrink.get("closed_fraction") or {}
        return bool(self.shrink) and (self.effects != ["unknown"] or any(closed.get(end) for end in ("lo", "hi")))

    @property
    def inside(self) -> bool:
        """Whether all that is named lies inside the class, which has it before and after: such a diagnosis closes nothing."""
        return bool(self.effects) and "closed_fraction" in self.shrink and self.shrink["closed_fraction"] is None

    @property
    def shifts(self) -> list[dict]:
        """Shifts of the baseline's parameters, largest first; empty where nothing was added to the model."""
        found = (self.result.get("parameter_shift") or []) if self.enlarged and self.effects and not self.inside else []
        return sorted(found, key=lambda s: -abs(s["shift_sd"] or 0.0))

    @property
    def noise_rad(self) -> float | None:
        """The noise floor of the whole unit [rad], None where it is not known."""
        return self.gap.get("noise_floor_rad") or (self.result.get("shrink") or {}).get("noise_floor_rad") or None

    @property
    def level(self) -> float:
        """Level of the intervals."""
        return self.result.get("level", 0.9)

    def answered(self) -> list[dict]:
        """The hypotheses behind the answer: the pair as a whole where it was weighed as one."""
        entries = {_parts(e["effect"]): e for e in self.hypotheses}
        whole = entries.get(frozenset(self.effects))
        found = [whole] if whole else [entries.get(frozenset([e])) for e in self.effects]
        return [e for e in found if e]

    @cached_property
    def hypotheses(self) -> list[dict]:
        """The entries of ``which``, most probable first; one that names the same effects in another order is joined."""
        found: dict[frozenset, dict] = {}
        for entry in sorted(self.result["which"], key=lambda e: -e["probability"]):
            first = found.setdefault(_parts(entry["effect"]), entry)
            if first is not entry:
                found[_parts(entry["effect"])] = first | {"probability": first["probability"] + entry["probability"]}
        return sorted(found.values(), key=lambda e: -e["probability"])

    def ranked(self, at_most: int = 5) -> list[Hypothesis]:
        """The most probable hypotheses, the whole credible set (ten at most), "unknown" and "none"; the rest in one."""
        inside = {_parts(e) for e in self.credible_set[:10]}
        shown: list = []
        rest: list = []
        for i, entry in enumerate(self.hypotheses):
            inner = _parts(entry["effect"]) in inside
            likely = i < at_most and (i < LEADERS or entry["probability"] >= NEGLIGIBLE)
            chosen = likely or inner or entry["effect"] in PLAIN
            (shown if chosen else rest).append(Hypothesis(entry["effect"], entry["probability"], inner))
        if len(rest) == 1:
            return [*shown, *rest]
        lump = Hypothesis("", sum(h.probability for h in rest), False, len(rest))
        return [*shown, lump] if rest else shown


def _parts(effect):
    return frozenset(effect.split("+"))
