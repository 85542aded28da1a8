"""What verbs do with the findings on their data: say them, keep them in results, refuse unfit data unless forced."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from backdrive_bayes.commands.output import say
from backdrive_bayes.decisions.outcome import FORCED, outcome_of
from backdrive_bayes.errors import BadInput

if TYPE_CHECKING:
    from backdrive_bayes.records.record import Unit


@dataclass(frozen=True, eq=False)
class ReadyUnit:
    """A unit without wild samples; ``checked`` is what check_unit says of it as read, ``forced`` that errors were overruled."""

    unit: Unit
    checked: dict
    forced: bool = False

    def stamp(self, result: dict) -> dict:
        """The result object with ``findings``, ``forced`` and the outcome that follows."""
        result["findings"], result["forced"] = self.checked["findings"], self.forced
        result["outcome"] = outcome_of(result).to_json()
        return result

    def beside(self, other: ReadyUnit | None) -> ReadyUnit:
        """The same with what is said of another unit that a result rests on as well."""
        if other is None:
            return self
        theirs = [row | {"record": f"{other.unit.name}: {row['record'] or 'all'}"} for row in other.checked["findings"]]
        checked = self.checked | {"findings": [*self.checked["findings"], *theirs]}
        return replace(self, checked=checked, forced=self.forced or other.forced)

    @property
    def lines(self) -> list[str]:
        """Errors and warnings as lines."""
        return [message["text"] for message in self.checked["messages"] if message["level"] != "info"]


def judged(unit, k: float = 0.03, force: bool = False, where: object = "") -> ReadyUnit:
    """Check a unit; ``k`` is the share of T_r at which lost motion is taken.

    Raises BadInput for a unit in which the check finds errors, unless ``force``; it names ``where`` the unit was read from,
    which is empty for one that was made in memory.
    """
    from backdrive_bayes.records.check import check_unit
    from backdrive_bayes.records.faults import without_wild
    from backdrive_bayes.records.plausible import check_plausible

    if not where:  # made in memory: what a reader would refuse
        for record in unit.records:
            check_plausible(record, unit.rated_torque_nm, record.name)
    checked = check_unit(unit, k)
    if not checked["may_infer"] and not force:
        expected = "data fit for inference (--force, in Python force=True, goes on regardless)"
        raise BadInput(where or unit.name, expected, checked["reason"])
    return ReadyUnit(without_wild(unit), checked, not checked["may_infer"])


def ready_unit(path: Path, k: float = 0.03, force: bool = False) -> ReadyUnit:
    """Read and check a unit and repeat its warnings; BadInput as :func:`judged` says."""
    from backdrive_bayes.records.unit_folder import read_unit

    ready = judged(read_unit(path), k, force, path)
    repeat_findings(ready.unit.name, {"findings": ready.checked["findings"], "forced": ready.forced})
    return ready


def repeat_findings(name: str, result: dict) -> None:
    """Say what a result object of a unit carries: whether it was forced, errors, warnings, and notes on the unit itself."""
    if result.get("forced"):
        say(f"{name}: {FORCED}")
    for finding in result.get("findings", []):
        if finding["level"] != "note" or not finding["record"]:
            where = f"{finding['record']}: " if finding["record"] else ""
            say(f"{finding['level']}: {where}{finding['text']}")


def collected(abouts: list[dict]) -> dict:
    """``findings`` (with the unit's name) and ``forced`` of a result that rests on several units' indicators objects."""
    findings = [{"unit": about["unit"], **row} for about in abouts for row in about.get("findings", [])]
    return {"findings": findings, "forced": any(about.get("forced", False) for about in abouts)}


def add_force_argument(parser) -> None:
    """The option that goes on with unfit data."""
    parser.add_argument("--force", action="store_true", help="go on with data that check finds unfit; every output says so")
