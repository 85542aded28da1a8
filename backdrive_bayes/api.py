"""The Python interface: the verbs as functions whose results show themselves and can be saved."""

from __future__ import annotations

import html
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

from backdrive_bayes.commands.door import collected, judged
from backdrive_bayes.commands.output import write_file, write_folder, write_json
from backdrive_bayes.commands.results import (
    FitOptions,
    diagnose_unit,
    fit_unit,
    is_result,
    keep_decision,
    keep_fit,
    refuse_company,
    retire,
    stamped_by,
)
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.claims import read_claims
from backdrive_bayes.decisions.comparison import ROPE
from backdrive_bayes.decisions.comparison import compare as compare_evidence
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.limits import Limits, read_limits
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.decisions.pool import Pool
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.loads import loads_json
from backdrive_bayes.number_text import probability_text
from backdrive_bayes.records import record
from backdrive_bayes.records.unit_folder import read_unit


class Unit(record.Unit):
    """A reducer and its records; see :meth:`read`."""

    @classmethod
    def read(cls, path: Path | str) -> Unit:
        """The unit in a folder with unit.toml, or of one bare record file; BadInput says what is wrong with it."""
        unit = read_unit(path)
        return cls(**{f.name: getattr(unit, f.name) for f in fields(unit)})

    def _repr_html_(self):
        records = "".join(f"<li>{html.escape(r.name)}: {r.time_s.size} samples</li>" for r in self.records)
        return f"<b>{html.escape(self.name)}</b>, rated torque {self.rated_torque_nm:.4g} N·m<ul>{records}</ul>"


@dataclass(frozen=True, eq=False)
class Fit:
    """A posterior and its indicators object, of indicators.json's form."""

    posterior: Posterior
    indicators: dict

    @cached_property
    def evidence(self) -> Evidence:
        """The draws that decisions rest on."""
        return Evidence.of(self.posterior, self.indicators)

    @property
    def converged(self) -> bool:
        """Whether every parameter and indicator passed the diagnostics and the measurement does not contradict."""
        return self.indicators["outcome"]["word"] == "converged"

    def back_drive(self, *loads: float, rate: float | None = None) -> list[dict]:
        """Angle θ_L [rad] and energy W_L [J] with intervals for loads [N·m] at a rate [N·m/s], by default every measured one."""
        options = FitOptions(loads=loads, load_rate=rate)
        return loads_json(self.posterior, options.loads, options.load_rate, self.indicators["level"])

    def save(self, folder: Path | str, figures: bool = True) -> Path:
        """Write indicators.json, posterior.nc and figures, as the verb ``fit`` does."""
        with write_folder(folder) as room:
            keep_fit(self.posterior, self.indicators, room, figures)
            retire(Path(folder), self.indicators)
        return Path(folder)

    def _repr_html_(self):
        names = list(self.indicators["records"][0]["indicators"])
        rows = [[r["file"], *(_interval(r["indicators"][n]) for n in names)] for r in self.indicators["records"]]
        return _title(self.indicators["unit"], line(self.indicators["outcome"])) + _table(["record", *names], rows)


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """A diagnosis object, of diagnosis.json's form, and the fit of the model that it chose."""

    result: dict
    fit: Fit

    @property
    def effects(self) -> list[str]:
        """The answer: names of effects, none for no gap, ["unknown"] for one that the library does not hold."""
        return self.result["answer"]["effects"]

    @property
    def probabilities(self) -> dict[str, float]:
        """Probability of every candidate, highest first."""
        return {row["effect"]: row["probability"] for row in self.result["which"]}

    def save(self, folder: Path | str, figures: bool = True) -> Path:
        """Write diagnosis.json, the chosen model's fit and figures, as the verb ``diagnose`` does."""
        with write_folder(folder) as room:
            write_json(room / "diagnosis.json", self.result)
            keep_fit(self.fit.posterior, self.fit.indicators, room, figures)
            retire(Path(folder), self.fit.indicators)
        return Path(folder)

    def _repr_html_(self):
        rows = [[name, probability_text(p)] for name, p in self.probabilities.items() if p >= 0.005]
        where = html.escape(self.result["where"]["summary"])
        outcome = self.result["outcome"]
        named = "" if outcome["exit_code"] else f": {' + '.join(self.effects) or 'no gap'}"
        return _title(self.result["unit"], line(outcome) + named) + _table(["effect", "probability"], rows) + f"<p>{where}</p>"


@dataclass(frozen=True, eq=False)
class Verdict:
    """A verdict object, of verdict.json's form."""

    result: dict

    @property
    def verdict(self) -> str:
        """accepted, rejected or inconclusive."""
        return self.result["verdict"]

    def save(self, folder: Path | str, figures: bool = True) -> Path:
        """Write verdict.json and its figures, as the verb ``accept`` does; BadInput beside a fit of other data."""
        refuse_company(Path(folder), self.result)
        return _save(self.result, "verdict.json", folder, figures)

    def __str__(self):
        return f"{self.result['unit']}: {line(self.result['outcome'])}"

    def _repr_html_(self):
        rows = [
            [r["indicator"], f"{r['loading_rate_Nm_per_s']:.3g}", f"{r['amplitude_Nm']:.3g}", _between(r), _interval(r),
             probability_text(r["conformance_probability"]), r["verdict"]]
            for r in self.result["limits"]
        ]  # fmt: skip
        names = ["indicator", "rate [N·m/s]", "amplitude [N·m]", "limits", "posterior", "conformance", "verdict"]
        advice = f"<p>{html.escape(self.result['next']['do'])}</p>" if self.result["next"] else ""
        return _title(self.result["unit"], line(self.result["outcome"])) + _table(names, rows) + advice


@dataclass(frozen=True, eq=False)
class Comparison:
    """A comparison object, of comparison.json's form."""

    result: dict

    @property
    def claims(self) -> list[dict]:
        """The answered claims, none where none were asked."""
        return (self.result["claims"] or {}).get("claims", [])

    def save(self, folder: Path | str, figures: bool = True) -> Path:
        """Write comparison.json and its figures, as the verb ``compare`` does."""
        return _save(self.result, "comparison.json", folder, figures)

    def _repr_html_(self):
        told = f"{line(self.result['outcome'])}: ratios with {self.result['level']:.0%} intervals"
        out = _title("Comparison of " + ", ".join(self.result["names"]), told)
        for pair in self.result["pairs"]:
            rows = [
                [f"{c['loading_rate_Nm_per_s']:.3g}", f"{c['amplitude_Nm']:.3g}", name, _interval(r["ratio"]),
                 probability_text(r["probability_first_greater"]), r["verdict"]]
                for c in pair["conditions"] for name, r in c["indicators"].items()
            ]  # fmt: skip
            ratio = f"{pair['first']} / {pair['second']}"
            out += _table(["rate [N·m/s]", "amplitude [N·m]", "indicator", ratio, "P(first larger)", "verdict"], rows)
        if self.claims:
            rows = [[c["id"], c["claim"], probability_text(c["probability"]), c["verdict"]] for c in self.claims]
            out += _table(["no.", "claim", "probability", "verdict"], rows)
        return out


def fit(unit, *, k=0.03, level=0.9, seed: int = 0, baseline=None, loads=(), load_rate=None, force=False, progress=None) -> Fit:
    """Posterior and indicators of a unit (or of the path of one); ``progress`` receives lines about the state of the run.

    ``loads`` [N·m], arriving at ``load_rate`` [N·m/s] or at every measured rate, are answered under ``indicators["loads"]``.
    BadInput where the check finds the data unfit, unless ``force``, which the result says.
    """
    modules = FitOptions.baseline if baseline is None else baseline
    options = FitOptions(modules, k, level, seed, tuple(loads), load_rate)
    ready = _ready(unit, k, force)
    return _fitted(ready, *fit_unit(ready.unit, options, progress or (lambda text: None)))


def diagnose(unit, *, simulated=None, k=0.03, level=0.9, seed: int = 0, baseline=None, force=False, progress=None) -> Diagnosis:
    """Where model and measurement part, which effect causes it, and the fit of the model with it, as for :func:`fit`.

    ``simulated`` is a unit (or the path of one) of what a simulator answered to the same or other torque paths; the diagnosis
    then says what the simulator lacks, and ``result["simulator"]`` what re-tuning it would close.
    """
    modules = FitOptions.baseline if baseline is None else baseline
    options, ready = FitOptions(modules, k, level, seed), _ready(unit, k, force)
    other = None if simulated is None else _ready(simulated, k, force)
    result, sampled = diagnose_unit(ready.unit, options, progress or (lambda text: None), simulated=other and other.unit)
    return Diagnosis(ready.beside(other).stamp(result), _fitted(ready, *sampled))


def accept(fitted, limits, *, probabilities=None, batch=()) -> Verdict:
    """The verdict on a unit against limits (a file or :class:`Limits`).

    ``fitted`` is a unit or the path of one, which is fitted and diagnosed; a fit or the folder of one, whose structure only a
    diagnosis beside it examines; a diagnosis, which judges the model it chose; or a list of fits of one unit under several
    models with their ``probabilities``. ``batch`` are fits of other units of the same process, or the folder of a pooled batch,
    for global risks.
    """
    models = list(fitted) if isinstance(fitted, list | tuple) else [fitted]
    name = "" if isinstance(limits, Limits) else Path(limits).name
    limits = limits if isinstance(limits, Limits) else read_limits(limits)
    k = limits.only_k(name) or FitOptions.k
    evidences = [_evidence(m, k, examined=True) for m in models]
    others = Pool.read(Path(batch)) if isinstance(batch, str | Path) else [_evidence(b, k) for b in batch]
    result = assess(evidences, limits, probabilities, others) | collected([evidences[0].about])
    units = others.about["units"] if isinstance(others, Pool) else [other.name for other in others]
    return Verdict(stamped_by(result, evidences[:1], limits=name, models=len(models), batch=units))


def compare(*fitted, claims=None, rope: float = ROPE, seed: int = 0) -> Comparison:
    """The comparison of two or more fits (or folders of fits); ``claims`` is a file, or "paper" for the published ones."""
    evidences = [_evidence(f) for f in fitted]
    level = evidences[0].about["level"] if evidences else 0.9
    result = compare_evidence(evidences, read_claims(claims) if claims else None, rope, level, seed)
    result |= collected([e.about for e in evidences])
    return Comparison(stamped_by(result, evidences, seed, rope=rope, claims=Path(claims or "").name))


def report(*results, out: Path | str, template: Path | str | None = None) -> Path:
    """Save the results (or take folders that hold some) below ``out`` and make out/report.pdf of them, dressed in a company's
    ``template``, a folder with template.toml and logo."""
    from backdrive_bayes.commands.report import NAME, read_template
    from backdrive_bayes.report.report import write_report

    folders = []
    if not results or not all(isinstance(r, str | Path | Fit | Diagnosis | Verdict | Comparison) for r in results):
        raise BadInput("report", "results or folders that hold some", repr(results)[:200])
    for number, result in enumerate(results, 1):
        own = Path(out) / f"{number}-{type(result).__name__.lower()}"
        folders.append(Path(result) if isinstance(result, str | Path) else result.save(own, figures=False))
    with write_file(Path(out) / NAME) as temporary:
        write_report(folders, temporary, read_template(Path(template)) if template else None)
    return Path(out) / NAME


def _ready(unit, k, force):
    if isinstance(unit, record.Unit):
        return judged(unit, k, force)
    return judged(Unit.read(unit), k, force, unit)


def _fitted(ready, posterior, indicators) -> Fit:
    ready.stamp(indicators)["notes"] += ready.lines
    return Fit(posterior, indicators)


def _evidence(fitted, k: float = FitOptions.k, examined: bool = False) -> Evidence:
    """Draws to decide on; a unit is fitted for them, its lost motion at ``k`` T_r, and diagnosed where it is ``examined``."""
    if isinstance(fitted, Fit):
        return fitted.evidence
    if isinstance(fitted, Diagnosis):
        return replace(fitted.fit.evidence, diagnosis=fitted.result)
    if isinstance(fitted, Evidence):
        return fitted
    if not isinstance(fitted, record.Unit) and is_result(Path(fitted)):
        return Evidence.read(Path(fitted))
    found = fit(fitted, k=k).evidence
    return replace(found, diagnosis=diagnose(fitted, k=k).result) if examined else found


def _save(result, name, folder, figures):
    with write_folder(folder) as room:
        keep_decision(result, name, Path(folder), room, figures)
    return Path(folder)


def _title(name, text):
    return f"<p><b>{html.escape(name)}</b>: {html.escape(text)}</p>"


def _table(names, rows):
    head = "".join(f"<th>{html.escape(str(n))}</th>" for n in names)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(str(c))}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _interval(entry):
    return "–" if entry is None else f"{entry['median']:.4g} [{entry['lo']:.4g}, {entry['hi']:.4g}]"


def _between(row):
    return f"{row['min']:.4g} to {row['max']:.4g}".replace("-inf to", "at most").replace(" to inf", " or more")
