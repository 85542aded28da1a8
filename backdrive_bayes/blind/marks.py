"""The marks that a diagnosis is held to, and whether the scores meet them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Mark:
    """A score's name, how to find it in blind.json, and the least or largest value that is good enough."""

    name: str
    find: Callable[[dict], float | None]
    least: float | None = None
    most: float | None = None

    def judge(self, scores: dict) -> dict:
        """Found and wanted value; ``met`` is None where there was nothing to score."""
        found = self.find(scores)
        met = None
        if found is not None:
            met = found <= self.most if self.most is not None else found >= (self.least or 0.0)
        return {"mark": self.name, "least": self.least, "most": self.most, "found": found, "met": met}


def _at(severity):
    def find(scores):
        rows = [row for row in scores["top_1"]["by_severity"] if row["severity"] == severity]
        return rows[0]["listed_reached"]["share"] if rows else None

    return find


MARKS = (
    Mark("macro top-1 of listed effects, severity 1", _at(1.0), least=0.95),
    Mark("macro top-1 of listed effects, severity 0.4", _at(0.4), least=0.85),
    Mark("calibration error of the top probability", lambda s: s["calibration"]["top"]["expected_error"], most=0.05),
    Mark("coverage of the 90 % sets", lambda s: s["credible_sets"]["coverage"]["share"], least=0.90),
    Mark("mean size of the 90 % sets", lambda s: s["credible_sets"]["size"]["mean"], most=1.6),
    Mark("false alarms: anything named on none", lambda s: s["false_alarms"]["named"]["share"], most=0.05),
    Mark("unlisted effects called unknown", lambda s: s["abstention"]["unknown"]["share"], least=0.8),
    Mark("removed effects called unknown", lambda s: s["removed"]["unknown"]["share"], least=0.8),
    Mark("mean overlap of where", lambda s: s["where"]["remainder"]["with_zeros"]["mean"], least=0.6),
    Mark("median difference to the oracle's closed fraction", lambda s: s["closed"]["difference"]["median"], most=0.1),
)


def judge_all(scores: dict) -> list[dict]:
    """Every mark with what was found."""
    return [mark.judge(scores) for mark in MARKS]
