"""What a fleet does with one unit: the steps of `fit`, `diagnose` and `accept`, and the table's rows of their results."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from backdrive_bayes.commands.output import write_folder, write_json
from backdrive_bayes.commands.results import FitOptions, diagnose_unit, fit_unit, keep_fit, ready_unit
from backdrive_bayes.decisions.limits import Limits
from backdrive_bayes.fleet.store import CannotKeep

ABOUT = ("serial", "batch", "test_date")
"""Keys of a unit file that the table has columns for."""


@dataclass(frozen=True)
class UnitWork:
    """Fit a unit, and diagnose and judge it where asked; every number is the verbs' own, with the same options and seed.

    Limits need the diagnosis, as for `accept`: what acts beside the model would shift every number that is judged.
    """

    options: FitOptions
    diagnose: bool = False
    limits: Limits | None = None
    force: bool = False

    def __call__(self, path: Path, folder: Path | None) -> list[dict]:
        """The table's rows of a unit; the result folder of the verbs is written to ``folder`` (None: nowhere)."""
        ready = ready_unit(path, self.options.k, self.force)
        posterior, result = fit_unit(ready.unit, self.options)
        ready.stamp(result)["notes"] += ready.lines
        diagnosis = verdict = None
        if self.diagnose or self.limits:
            diagnosis = ready.stamp(diagnose_unit(ready.unit, self.options, sample=False)[0])
        if self.limits:
            verdict = self._verdict(posterior, result, diagnosis)
        if folder is not None:
            _keep(folder, posterior, result, diagnosis, verdict)
        return rows(ready.unit.identity, result, diagnosis, verdict)

    def _verdict(self, posterior, result, diagnosis):
        from backdrive_bayes.commands.door import collected
        from backdrive_bayes.commands.results import stamped_by
        from backdrive_bayes.decisions.acceptance import assess
        from backdrive_bayes.decisions.evidence import Evidence

        evidence = replace(Evidence.of(posterior, result), diagnosis=diagnosis)
        verdict = assess([evidence], self.limits)
        return stamped_by(verdict | collected([evidence.about]), [evidence])


def _keep(folder, posterior, result, diagnosis, verdict):
    try:
        with write_folder(folder) as room:
            keep_fit(posterior, result, room, figures=False)
            for name, found in (("diagnosis.json", diagnosis), ("verdict.json", verdict)):
                if found:
                    write_json(room / name, found)
    except OSError as error:
        raise CannotKeep(f"{error.strerror or error}") from None


def rows(identity: dict, result: dict, diagnosis: dict | None = None, verdict: dict | None = None) -> list[dict]:
    """One flat row a record from a unit's result objects; what is the unit's stands in each of them."""
    convergence = result["convergence"]
    of_unit = {
        "name": result["unit"],
        **{key: identity.get(key) for key in ABOUT},
        "rated_torque_Nm": result["rated_torque_Nm"],
        "forced": result["forced"],
        "warnings": sum(found["level"] != "note" for found in result["findings"]),
        "effects": "+".join(result["model"]["effects"]),
        **{key: convergence[key] for key in ("converged", "max_rhat", "min_bulk_ess", "min_tail_ess", "evaluations")},
        "data_sha256": ",".join(result["data_sha256"]),
        "k": result["k"],
        "level": result["level"],
    }
    of_unit |= _diagnosed(diagnosis) | _judged(verdict)
    for name, value in result["parameters"].items():
        of_unit |= _interval(name, value)
    return [
        of_unit
        | {key: record[key] for key in ("file", "loading_rate_Nm_per_s", "amplitude_Nm")}
        | {k: v for name, value in record["indicators"].items() for k, v in _interval(name, value).items()}
        for record in result["records"]
    ]


def _diagnosed(diagnosis):
    if diagnosis is None:
        return {"answer": None, "credible_set_90": None, "gap_probability": None, "unlisted_probability": None}
    answer, gap = diagnosis["answer"], diagnosis["gap"]
    return {
        "answer": "inconclusive" if diagnosis["outcome"]["exit_code"] else "+".join(answer["effects"]) or "none",
        "credible_set_90": ",".join(answer["credible_set_90"]),
        "gap_probability": gap["probability"],
        "unlisted_probability": gap["unlisted_probability"],
    }


def _judged(verdict):
    if verdict is None:
        return {"verdict": None, "reason": None, "conformance_probability": None, "limiting": None}
    return {
        "verdict": verdict["verdict"],
        "reason": verdict["reason"],
        "conformance_probability": verdict["conformance_probability"],
        "limiting": verdict["limiting"]["indicator"],
    }


def _interval(name, value):
    """Columns of a quantity: its median under its name, the ends of the interval beside it; None where it is not defined."""
    ends = {f"{name}_{end}": value and value[end] for end in ("lo", "hi")}
    return {name: value and value["median"], **ends}
