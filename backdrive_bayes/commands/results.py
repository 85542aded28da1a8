"""The steps that verbs and the Python interface share: fit a unit, keep a fit, read one again."""

from __future__ import annotations

import contextlib
import math
import os
import platform
import time
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path

from backdrive_bayes.commands.door import add_force_argument, ready_unit
from backdrive_bayes.commands.output import say, write_json
from backdrive_bayes.commands.report import NAME as REPORT
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.results import CHECK, DIAGNOSIS, read_result, require_same_data

BASELINE = "geometric,elastic,friction"
HIGHEST_LEVEL = 0.99
"""Level at which eight of a fit's draws lie beyond each end of an interval; fewer do not tell where an end is."""
__all__ = ["FitOptions", "add_fit_arguments", "diagnose_unit", "draw_figures", "fit_unit", "is_result", "keep_fit", "ready_unit"]
FIT_FILES = ("posterior.nc", "indicators.json")
DIAGNOSIS_FIGURES = ("diagnosis", "gap-", "closed-fraction", "parameter-shift")
"""How the names of a diagnosis's figures begin."""
DECISION_FIGURES = {"verdict.json": "acceptance", "comparison.json": "comparison"}
"""How the names of a decision's figures begin, by its file."""


@dataclass(frozen=True)
class FitOptions:
    """How a unit is fitted; ``loads`` [N·m] and ``load_rate`` [N·m/s] ask for B."""

    baseline: tuple[str, ...] = tuple(BASELINE.split(","))
    k: float = 0.03
    level: float = 0.9
    seed: int = 0
    loads: tuple[float, ...] = ()
    load_rate: float | None = None

    def __post_init__(self):
        known = BASELINE.split(",")
        listed = self.baseline.split(",") if isinstance(self.baseline, str) else self.baseline
        object.__setattr__(self, "baseline", tuple(listed))
        for name in ("k", "level"):
            if isinstance(value := getattr(self, name), bool) or not isinstance(value, Real):
                raise BadInput(f"--{name}", "a number", repr(value))
        if not set(self.baseline) <= set(known) or "elastic" not in self.baseline:
            raise BadInput("--baseline", f"modules out of {', '.join(known)}, elastic among them", ",".join(self.baseline))
        if isinstance(self.seed, bool) or not isinstance(self.seed, Integral) or not 0 <= self.seed < 10**18:
            raise BadInput("--seed", "a whole number from 0 of at most 18 digits", repr(self.seed))
        object.__setattr__(self, "seed", int(self.seed))
        if not 0 < self.k < 1:
            raise BadInput("--k", "a number between 0 and 1", self.k)
        if not 0 < self.level <= HIGHEST_LEVEL:
            expected = f"a number above 0 and at most {HIGHEST_LEVEL:g}, beyond which too few draws lie"
            raise BadInput("--level", expected, self.level)
        for load in self.loads:
            if not math.isfinite(load) or load == 0:
                raise BadInput("--load", "a torque other than zero [N·m]", load)
        if self.load_rate is not None and not (self.loads and 0 < self.load_rate < math.inf):
            found = self.load_rate if self.loads else "no --load"
            raise BadInput("--load-rate", "a rate above zero [N·m/s] for a --load", found)

    @classmethod
    def of(cls, args) -> FitOptions:
        """From a parsed command line."""
        loads = tuple(getattr(args, "load", ()))
        return cls(args.baseline, args.k, args.level, args.seed, loads, getattr(args, "load_rate", None))

    def to_json(self) -> dict:
        """As results carry them; the seed stands beside them."""
        loads = {"loads": list(self.loads), "load_rate": self.load_rate} if self.loads else {}
        return {"baseline": list(self.baseline), "k": self.k, "level": self.level, **loads}


def require_fitted_with(options: FitOptions, about: dict, names=("baseline", "k", "level", "seed")) -> None:
    """BadInput where an option was given that a former fit, whose indicators object is ``about``, was made without."""
    fitted = {"baseline": tuple(about["options"]["baseline"]), "k": about["k"], "level": about["level"], "seed": about["seed"]}
    for name in names:
        given, usual = getattr(options, name), getattr(FitOptions, name)
        alike = [sorted(v) if name == "baseline" else v for v in (given, usual, fitted[name])]
        if alike[0] not in alike[1:]:
            shown = [",".join(v) if name == "baseline" else f"{v:g}" for v in (fitted[name], given)]
            raise BadInput(f"--{name}", f"{shown[0]}, with which '{about['unit']}' was fitted", shown[1])


def add_fit_arguments(parser) -> None:
    """The options of every verb that may fit."""
    modules = "modules of the model, comma-separated, out of %(default)s (default: all)"
    share = "share of the rated torque T_r at which lost motion is taken (default 0.03)"
    level = "level of the indicators' central intervals (default 0.9); a diagnosis has its own at 0.9"
    parser.add_argument("--baseline", default=BASELINE, help=modules)
    parser.add_argument("--k", type=float, default=0.03, help=share)
    parser.add_argument("--level", type=float, default=0.9, help=level)
    parser.add_argument("--no-figures", action="store_true", help="write no figures")
    add_force_argument(parser)


@one_thread()
def fit_unit(unit, options: FitOptions, note=lambda text: None, posterior=None):
    """Posterior of a unit and its indicators object, with the classic fit and the unit's own words.

    ``posterior`` is taken where one was computed already.
    """
    from backdrive_bayes.engine.posterior_file import as_saved
    from backdrive_bayes.gap.averaged import fit_posterior
    from backdrive_bayes.indicators.convergence import examined
    from backdrive_bayes.indicators.draws import IndicatorDraws
    from backdrive_bayes.indicators.least_squares import least_squares_json
    from backdrive_bayes.indicators.loads import loads_json, require_loads
    from backdrive_bayes.indicators.summary import indicators_json

    require_loads(unit.rated_torque_nm, options.loads)
    posterior = as_saved(posterior or fit_posterior(unit, options.baseline, options.seed, note))
    note("indicators and their intervals")
    posterior = examined(IndicatorDraws(posterior, options.k), unit)
    result = indicators_json(IndicatorDraws(posterior, options.k), options.level)
    if options.loads:
        result["loads"] = loads_json(posterior, options.loads, options.load_rate, options.level)
    for record, own in zip(result["records"], unit.records, strict=True):
        record["least_squares"] = least_squares_json(own, unit.rated_torque_nm, options.k)
    result["identity"] = dict(unit.identity)
    result["notes"] = [*unit.notes, *(f"{r.name}: {note}" for r in unit.records for note in r.notes)]
    return posterior, stamped(result, origin(unit), options.seed, options.to_json())


def origin(unit) -> dict:
    """Which data a result of a unit rests on."""
    return {"unit": unit.name, "data_sha256": list(unit.data_sha256), "unit_sha256": unit.file_sha256}


def stamped(result: dict, origin: dict, seed: int, options: dict) -> dict:
    """The result with what it rests on (data, version, seed, options) and how it came out."""
    from importlib.metadata import version

    from backdrive_bayes.decisions.outcome import outcome_of
    from backdrive_bayes.engine.posterior_file import software

    result |= origin | {"version": version("backdrive-bayes"), "versions": software(), "seed": seed, "options": options}
    result["outcome"] = outcome_of(result).to_json()
    return result


def stamped_by(result: dict, evidences, seed: int | None = None, **options) -> dict:
    """The same for a result that rests on fits of one unit or several; without a seed of its own it has that of the first."""
    about = evidences[0].about
    own = {key: about[key] for key in ("k", "level")} | {"baseline": about["model"]["modules"]}
    rests = {key: about[key] for key in ("data_sha256", "unit_sha256")}
    if len(evidences) > 1:
        rests = {"data_sha256": [h for e in evidences for h in e.about["data_sha256"]]}
    return stamped(result, rests, about["seed"] if seed is None else seed, own | options)


@one_thread()
def diagnose_unit(unit, options: FitOptions, note=lambda text: None, sample: bool = True, simulated=None):
    """The diagnosis object of a unit, and posterior and indicators object of the model it chose.

    Without ``sample`` these are None; whether they might be used is examined all the same.

    ``simulated`` is the unit of a simulator's answers, of which the diagnosis then says what it lacks.
    """
    from backdrive_bayes.gap.diagnose import diagnose
    from backdrive_bayes.gap.simulated import diagnose_simulated
    from backdrive_bayes.indicators.convergence import judged_convergence

    shared: dict = {"seed": options.seed, "k": options.k, "progress": note}
    if simulated is None:
        found = diagnose(unit, baseline=options.baseline, **shared)
    elif set(options.baseline) == set(FitOptions.baseline):
        found = diagnose_simulated(unit, simulated, **shared)
    else:
        raise BadInput("--baseline", f"{BASELINE} beside --simulated", ",".join(options.baseline))
    about = options.to_json() | ({"simulated": simulated.name} if simulated else {})
    if not sample:
        found.json["convergence"] = judged_convergence(found.posterior, options.k, unit)
        return stamped(found.json, origin(unit), options.seed, about), None
    sampled = fit_unit(unit, options, note, found.posterior)
    found.json["convergence"] = sampled[1]["convergence"]
    return stamped(found.json, origin(unit), options.seed, about), sampled


def keep_fit(posterior, result: dict, folder: Path, figures: bool = True, note=lambda text: None) -> str:
    """Write posterior.nc, indicators.json with its digest, and figures into ``folder``; returns the digest."""
    from backdrive_bayes.engine.posterior_file import write_posterior

    note("saving the posterior")
    digest = write_posterior(posterior, folder / "posterior.nc", result)
    write_json(folder / "indicators.json", result | {"posterior_sha256": digest})
    if figures:
        note("figures")
        draw_figures("indicators.json", folder)
    return digest


def keep_decision(result: dict, name: str, out: Path, folder: Path, figures: bool) -> None:
    """Write a verdict or a comparison and its figures into ``folder``, which becomes ``out``; those of an older one go."""
    write_json(folder / name, result)
    if figures:
        draw_figures(name, folder)
    # Last, so that what fails before leaves the older ones as they are.
    retire_figures(out, (DECISION_FIGURES[name],))


def keep_run(folder: Path, verb: str, began_s: float) -> None:
    """Write run.json: how long it took since ``began_s`` of time.perf_counter, and on what machine; no result depends on it."""
    facts = {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()}
    seconds = round(time.perf_counter() - began_s, 2)
    write_json(folder / "run.json", {"schema": "backdrive-bayes/run/1", "verb": verb, "seconds": seconds, "machine": facts})


def retire(out: Path, result: dict) -> None:
    """Take away what rests on an older fit in ``out``: its verdict and figures, a check and a diagnosis of other data.

    ``result`` is the indicators object of the fit that is about to come.
    """
    (out / "verdict.json").unlink(missing_ok=True)
    kept = [_keep_own(out / name, schema, result) for name, schema in (("diagnosis.json", DIAGNOSIS), ("check.json", CHECK))]
    retire_figures(out, ("",), DIAGNOSIS_FIGURES if kept[0] else ())
    with contextlib.suppress(OSError):  # it is not there, or holds what stays
        (out / "figures").rmdir()


def retire_figures(out: Path, kinds: tuple[str, ...], kept: tuple[str, ...] = ()) -> None:
    """Take away the figures in ``out`` whose names begin with one of ``kinds`` and none of ``kept``, and the report that has
    them: a later result may have fewer."""
    (out / REPORT).unlink(missing_ok=True)
    for figure in (out / "figures").glob("*.*g"):
        if figure.name.startswith(kinds) and not figure.name.startswith(kept) and figure.suffix in (".svg", ".png"):
            figure.unlink()


def _keep_own(path: Path, schema: str, about: dict) -> bool:
    """Whether a result file is there and of the same data; any other is taken away."""
    try:
        require_same_data(path, read_result(path, schema), about)
    except BadInput:
        path.unlink(missing_ok=True)
        return False
    return True


def refuse_company(out: Path, result: dict) -> None:
    """BadInput where ``out`` holds a fit of other data than a result that is to lie beside it."""
    from backdrive_bayes.results import INDICATORS

    path = out / "indicators.json"
    if path.is_file():
        require_same_data(out, result, read_result(path, INDICATORS))


def draw_figures(file: str, folder: Path) -> None:
    """Draw the figures of a result ``file`` in ``folder`` into its figures/, or say which package is missing."""
    try:
        from backdrive_bayes.figures.catalogue import save_figures

        save_figures(folder, folder / "figures", file)
    except MissingExtra as missing:
        say(f"no figures: {missing}")


def is_result(path: Path) -> bool:
    """Whether a path is a result folder of a former fit and no unit."""
    return path.is_dir() and all((path / name).is_file() for name in FIT_FILES) and not (path / "unit.toml").is_file()
