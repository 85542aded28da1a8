"""The steps that verbs and the Python interface share: fit a unit, keep a fit, read one again."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from backdrive_bayes.commands.door import add_force_argument, ready_unit
from backdrive_bayes.commands.output import say, write_json
from backdrive_bayes.errors import BadInput, MissingExtra

BASELINE = "geometric,elastic,friction"
__all__ = ["FitOptions", "add_fit_arguments", "diagnose_unit", "draw_figures", "fit_unit", "is_result", "keep_fit", "ready_unit"]
FIT_FILES = ("posterior.nc", "indicators.json")


@dataclass(frozen=True)
class FitOptions:
    """How a unit is fitted; ``seconds`` is the budget of sampling, ``loads`` [N·m] and ``load_rate`` [N·m/s] ask for B."""

    baseline: tuple[str, ...] = tuple(BASELINE.split(","))
    k: float = 0.03
    level: float = 0.9
    seconds: float = 120.0
    seed: int = 0
    loads: tuple[float, ...] = ()
    load_rate: float | None = None

    def __post_init__(self):
        from backdrive_bayes.model.registry import members_named

        members_named(self.baseline, "--baseline")
        for name, value, top in (("--k", self.k, 1.0), ("--level", self.level, 1.0), ("--budget", self.seconds, 1e7)):
            if not 0 < value < top:
                raise BadInput(name, f"a number between 0 and {top:g}", value)
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
        baseline = tuple(args.baseline.split(","))
        return cls(baseline, args.k, args.level, args.budget, args.seed, loads, getattr(args, "load_rate", None))


def add_fit_arguments(parser) -> None:
    """The options of every verb that may fit."""
    parser.add_argument("--baseline", default=BASELINE, help="modules of the model, comma-separated")
    parser.add_argument("--k", type=float, default=0.03, help="share of T_r at which lost motion is taken (default 0.03)")
    parser.add_argument("--level", type=float, default=0.9, help="level of the central intervals (default 0.9)")
    parser.add_argument("--budget", type=float, default=120.0, metavar="SECONDS", help="stop sampling after this time")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")
    add_force_argument(parser)


def fit_unit(unit, options: FitOptions, note=lambda text: None, resume=None):
    """Posterior of a unit and its indicators object, with the classic fit and the unit's own words.

    ``resume`` is what chain_file.read_chain found of a fit whose budget ran out.
    """
    from backdrive_bayes.indicators.least_squares import least_squares_json
    from backdrive_bayes.indicators.loads import loads_json, require_loads
    from backdrive_bayes.indicators.summary import indicators_json, monitored
    from backdrive_bayes.inference.fit import fit
    from backdrive_bayes.inference.sampling import Settings

    require_loads(unit, options.loads)
    posterior = fit(
        unit,
        baseline=options.baseline,
        seed=options.seed,
        settings=Settings(max_seconds=options.seconds),
        quantities=monitored(options.k),
        resume=resume,
        progress=note,
    )
    note("indicators and their intervals")
    result = indicators_json(posterior, options.k, options.level)
    if options.loads:
        result["loads"] = loads_json(posterior, options.loads, options.load_rate, options.level)
    for record, own in zip(result["records"], unit.records, strict=True):
        record["least_squares"] = least_squares_json(own, unit.rated_torque_nm, options.k)
    result["identity"] = dict(unit.identity)
    result["notes"] = [*unit.notes, *(f"{r.name}: {note}" for r in unit.records for note in r.notes)]
    return posterior, result


def diagnose_unit(unit, options: FitOptions, note=lambda text: None, sample: bool = True):
    """The diagnosis object of a unit, and posterior and indicators object of the model it chose (None where not asked for)."""
    from backdrive_bayes.gap.diagnose import diagnose

    found = diagnose(unit, baseline=options.baseline, seed=options.seed, k=options.k, progress=note)
    if not sample:
        return found.json, None
    named = tuple(e for e in found.effects if e not in options.baseline)
    sampled = fit_unit(unit, replace(options, baseline=(*options.baseline, *named)), note)
    found.json["convergence"] = sampled[0].convergence.to_json()
    return found.json, sampled


def keep_fit(posterior, result: dict, folder: Path, figures: bool = True, note=lambda text: None) -> None:
    """Write indicators.json, posterior.nc and figures into ``folder``."""
    from backdrive_bayes.indicators.draws import indicator_draws
    from backdrive_bayes.inference.posterior_file import write_posterior

    note("draws of the indicators")
    write_json(folder / "indicators.json", result)
    write_posterior(posterior, folder / "posterior.nc", {"indicators": indicator_draws(posterior, result["k"])})
    if figures:
        note("figures")
        draw_figures("save_figures", folder)


def draw_figures(function: str, folder: Path) -> None:
    """Draw what ``folder`` holds into its figures/, or say which package is missing."""
    try:
        from backdrive_bayes.figures import catalogue

        getattr(catalogue, function)(folder, folder / "figures")
    except MissingExtra as missing:
        say(f"no figures: {missing}")


def is_result(path: Path) -> bool:
    """Whether a path is a result folder of a former fit and no unit."""
    return path.is_dir() and all((path / name).is_file() for name in FIT_FILES) and not (path / "unit.toml").is_file()
