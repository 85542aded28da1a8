"""What verbs do with the findings on their data: say them, keep them in results, refuse unfit data unless forced."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.commands.output import say
from backdrive_bayes.errors import BadInput

FORCED = "forced: the data are unfit, nothing that rests on them is to be trusted"


@dataclass(frozen=True, eq=False)
class ReadyUnit:
    """A unit as read, without wild samples; ``checked`` is what check_unit says, ``forced`` whether errors were overruled."""

    unit: object
    checked: dict
    forced: bool = False

    def stamp(self, result: dict) -> dict:
        """The result object with ``findings`` and ``forced``."""
        result["findings"], result["forced"] = self.checked["findings"], self.forced
        return result

    @property
    def lines(self) -> list[str]:
        """Errors and warnings as lines."""
        return [message["text"] for message in self.checked["messages"] if message["level"] != "info"]


def ready_unit(path: Path, k: float = 0.03, force: bool = False) -> ReadyUnit:
    """Read and check a unit and repeat its warnings; ``k`` is the share of T_r at which lost motion is taken.

    Raises BadInput where the check finds errors, unless ``force``, which is said.
    """
    from backdrive_bayes.records.check import check_unit
    from backdrive_bayes.records.faults import without_wild
    from backdrive_bayes.records.unit_folder import read_unit

    unit = without_wild(read_unit(path))
    checked = check_unit(unit, k)
    if not checked["may_infer"] and not force:
        raise BadInput(path, "data fit for inference (--force goes on regardless)", checked["reason"])
    ready = ReadyUnit(unit, checked, not checked["may_infer"])
    repeat_findings(unit.name, ready.stamp({}))
    return ready


def repeat_findings(name: str, result: dict) -> None:
    """Say the errors and warnings that a result object of a unit carries, and whether it was forced."""
    if result.get("forced"):
        say(f"{name}: {FORCED}")
    for finding in result.get("findings", []):
        if finding["level"] != "note":
            where = f"{finding['record']}: " if finding["record"] else ""
            say(f"{finding['level']}: {where}{finding['text']}")


def collected(abouts: list[dict]) -> dict:
    """``findings`` (with the unit's name) and ``forced`` of a result that rests on several units' indicators objects."""
    findings = [{"unit": about["unit"], **row} for about in abouts for row in about.get("findings", [])]
    return {"findings": findings, "forced": any(about.get("forced", False) for about in abouts)}


def add_force_argument(parser) -> None:
    """The option that goes on with unfit data."""
    parser.add_argument("--force", action="store_true", help="go on with data that check finds unfit; every output says so")
