"""What decisions rest on: the saved draws of one unit's indicators, asked by rate and amplitude."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from backdrive_bayes.decisions.loops import SAME_AMPLITUDE, Loop, NotAvailable, find_loop, largest_loops, measured_loops, same
from backdrive_bayes.decisions.prediction import LogError, error_between, shifted
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import CORE, indicator_draws
from backdrive_bayes.inference.fit import Posterior
from backdrive_bayes.inference.posterior_file import attributes_of
from backdrive_bayes.results import DIAGNOSIS, INDICATORS, read_group, read_result


def same_lost_motion(evidences) -> None:
    """Raise NotAvailable where the units' lost motions were taken at different torques and must not be compared."""
    taken = [e.about["k"] * e.rated_torque for e in evidences]
    if any(not same(taken[0], t, SAME_AMPLITUDE) for t in taken[1:]):
        shown = " and ".join(f"±{t:.3g} N·m" for t in taken)
        raise NotAvailable(f"lost motion was taken at {shown}: give the same k·T_r")


@dataclass(frozen=True, eq=False)
class Evidence:
    """Draws of one unit under one model; ``about`` is its indicators object, ``draws`` the group of the same name.

    ``parameters`` maps shared parameters to draws (draws,) in SI units; ``diagnosis`` is a diagnosis object or None.
    """

    about: dict
    draws: object
    parameters: dict[str, np.ndarray]
    diagnosis: dict | None = None
    where: str = ""
    _log_errors: dict = field(default_factory=dict, repr=False)

    @classmethod
    def read(cls, folder: Path) -> Evidence:
        """From a result folder of a fit; BadInput where it is none or comes from a version that saved no draws."""
        folder = Path(folder)
        about = read_result(folder / "indicators.json", INDICATORS)
        if not (folder / "posterior.nc").is_file():
            raise BadInput(folder, "a result folder with posterior.nc", "none")
        posterior = read_group(folder / "posterior.nc", "posterior")
        path = folder / "diagnosis.json"
        diagnosis = read_result(path, DIAGNOSIS) if path.is_file() else None
        shared = {str(n): v.values.ravel() for n, v in posterior.items() if v.dims == ("chain", "draw")}
        return cls(about, _indicator_group(folder / "posterior.nc"), shared, diagnosis, str(folder))

    @classmethod
    def of(cls, posterior: Posterior, about: dict) -> Evidence:
        """From a posterior in memory and its indicators object."""
        physical = posterior.problem.physical(posterior.z)
        shared = {c.parameter.name: physical[:, i] for i, c in enumerate(posterior.problem.coordinates) if c.record is None}
        draws = indicator_draws(posterior, about["k"])
        return cls(about, draws.assign_attrs(attributes_of(posterior) | draws.attrs), shared)

    @property
    def name(self) -> str:
        """The unit's name."""
        return self.about["unit"]

    @property
    def converged(self) -> bool:
        """Whether the sampling converged."""
        return bool(self.about["convergence"]["converged"])

    @property
    def effects(self) -> set[str]:
        """Everything that the fitted model holds, modules and effects."""
        return {*self.about["model"]["modules"], *self.about["model"]["effects"]}

    @property
    def rated_torque(self) -> float:
        """T_r [N·m]."""
        return float(self.draws.attrs["rated_torque_nm"])

    @cached_property
    def kept(self) -> np.ndarray:
        """Numbers of the draws for which smaller amplitudes are known."""
        return self.draws["kept"].values

    @cached_property
    def measured(self) -> tuple[Loop, ...]:
        """The measured loops in order of rate and amplitude; repeats of a record are one loop."""
        return measured_loops(self.draws["loading_rate_Nm_per_s"].values, self.draws["amplitude_Nm"].values)

    @property
    def rates(self) -> list[float]:
        """The measured loading rates, each once, rising [N·m/s]."""
        return [loop.rate for loop in self.largest()]

    def largest(self) -> list[Loop]:
        """The loop of largest amplitude at every rate."""
        return largest_loops(self.measured)

    def loop(self, rate: float, amplitude: float | None = None) -> Loop:
        """The loop of that rate and amplitude; NotAvailable as ``find_loop`` says."""
        return find_loop(self.measured, rate, amplitude)

    def values(self, name: str, loop: Loop, kept: bool = False) -> np.ndarray:
        """Draws of an indicator, shape (draws,); of the kept draws where ``kept`` or the loop is predicted.

        Repeats of a record count as one loop: the mean of their draws. Raises NotAvailable where it is not defined.
        """
        if loop.predicted:
            values = self.predicted(name, loop)
        else:
            values = self.draws[name].values[..., list(loop.records)].mean(axis=-1).ravel().astype(float)
            values = values[self.kept] if kept else values
        if not np.isfinite(values).all():
            raise NotAvailable(f"{name} is not defined at {loop.text}")
        return values

    def predicted(self, name: str, loop: Loop) -> np.ndarray:
        """Kept draws of a core indicator of a loop within its records' amplitude, with the prediction's own error (draws,)."""
        if name not in CORE:
            raise NotAvailable(f"{name} is known at measured amplitudes only, not at {loop.text}")
        if name == "loop_area_J":
            return self.predicted("dissipation_ratio", loop) * self.predicted("absorbed_J", loop)
        ratio = np.log(loop.amplitude / self._measured_amplitude(loop))
        return shifted(name, self._bare_prediction(name, loop), self._log_error(name).at(ratio))

    def _measured_amplitude(self, loop):
        return float(self.draws["position_Nm"].values[list(loop.records), -1].mean())

    def _log_error(self, name) -> LogError:
        if name not in self._log_errors:
            # One stream an indicator: the same answer in whatever order questions are asked.
            rng = np.random.default_rng([5, CORE.index(name)])
            self._log_errors[name] = LogError(self._seen_errors(name), self.kept.size, rng)
        return self._log_errors[name]

    def _seen_errors(self, name):
        """Log amplitude ratio and log error (draws,) of every measured loop that a larger one of its rate predicts."""
        seen = []
        for loop in self.measured:
            top = self.loop(loop.rate)
            if loop is top:
                continue
            try:
                told = self._bare_prediction(name, Loop(top.rate, loop.amplitude, top.records, True))
                found = self.values(name, loop, kept=True)
            except NotAvailable:
                continue
            if (told > 0).all() and (found > 0).all():
                seen.append((float(np.log(loop.amplitude / self._measured_amplitude(top))), error_between(name, found, told)))
        return seen

    def _bare_prediction(self, name, loop):
        parts = []
        for r in loop.records:
            position = self.draws["position_Nm"].values[r]
            values = self.draws[f"{name}_by_amplitude"].values[:, r].astype(float)
            known = np.isfinite(values).all(axis=0)
            if known.sum() < 2 or not position[known][0] <= loop.amplitude * (1 + 1e-9):
                raise NotAvailable(f"{name} is not defined at {loop.text}")
            parts.append(PchipInterpolator(position[known], values[:, known], axis=1)(loop.amplitude))
        return np.mean(parts, axis=0)

    def model_error_share(self, name: str, loop: Loop) -> float | None:
        """Share of an indicator's variance that is due to model error; None where it was not kept."""
        if name not in CORE:
            return None
        return float(self.draws["model_error_share"].values[CORE.index(name), list(loop.records)].mean())

    def record_json(self, loop: Loop) -> dict:
        """The record object of a loop's first record."""
        return self.about["records"][loop.records[0]]

    @property
    def reproduction(self) -> dict:
        """Data hash, seed, versions and model of the fit."""
        a = self.draws.attrs
        found = {k: a[k].item() if hasattr(a[k], "item") else a[k] for k in ("data_sha256", "seed", "versions") if k in a}
        return found | {"model": self.about["model"], "folder": Path(self.where).name}


def _indicator_group(path: Path):
    try:
        return read_group(path, "indicators")
    except BadInput as error:
        found = "a posterior without them (fit the unit again with this version)"
        raise BadInput(path, "a posterior.nc that holds draws of the indicators", found) from error
