"""What decisions rest on: draws of one unit's indicators, asked by rate and amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np

from backdrive_bayes.decisions.loops import Loop, NotAvailable, find_loop, largest_loops, measured_loops
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.posterior_file import as_saved
from backdrive_bayes.engine.posterior_read import read_posterior
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import IndicatorDraws
from backdrive_bayes.indicators.same_loop import same_amplitude
from backdrive_bayes.number_text import plain
from backdrive_bayes.results import (
    DIAGNOSIS,
    INDICATORS,
    read_group,
    read_result,
    require_own_posterior,
    require_same_data,
)


class Draws(Protocol):
    """What evidence asks of draws; :class:`~backdrive_bayes.indicators.draws.IndicatorDraws` is it for a posterior."""

    @property
    def posterior(self) -> Posterior:
        """What they are draws of."""

    @property
    def rates(self) -> np.ndarray:
        """Loading rates of the records [N·m/s]."""

    @property
    def amplitudes(self) -> np.ndarray:
        """Amplitudes of the records [N·m]."""

    @property
    def rated_torque_nm(self) -> float:
        """The rated torque T_r."""

    @property
    def travelled_nm(self) -> float:
        """Torque that all records travel, up and down [N·m]."""

    @property
    def kept(self) -> np.ndarray:
        """Numbers of the kept draws."""

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """Draws of the parameters."""

    def values(self, name: str, rate: float, amplitude: float, kept: bool = False) -> np.ndarray:
        """An indicator of a loop, of all or the kept draws."""

    def width_torques(self, amplitude: float) -> np.ndarray:
        """Torques at which the width of a loop is given."""

    def widths(self, rate: float, amplitude: float) -> np.ndarray:
        """Width of the kept draws' loops there."""

    def sensitivity(self, response: str, parameter: str) -> np.ndarray:
        """d ln(response) / d ln(parameter) of the kept draws."""


def same_lost_motion(evidences) -> None:
    """Raise NotAvailable where the units' lost motions were taken at different torques and must not be compared."""
    taken = [e.about["k"] * e.rated_torque for e in evidences]
    if any(not same_amplitude(taken[0], t) for t in taken[1:]):
        shown = " and ".join(f"±{plain(t)} N·m" for t in taken)
        raise NotAvailable(f"lost motion was taken at {shown}: give the same k·T_r")


def same_load(evidences, amplitudes) -> None:
    """Raise NotAvailable where the loads that arrive on loops of those amplitudes [N·m], one a unit, differ: a load is as large
    as the amplitude, but no larger than the rated torque."""
    loads = [min(e.rated_torque, a) for e, a in zip(evidences, amplitudes, strict=True)]
    if any(not same_amplitude(loads[0], load) for load in loads[1:]):
        shown = " and ".join(f"{plain(load)} N·m" for load in loads)
        raise NotAvailable(f"loads are {shown}: ask at one amplitude within both T_r")


@dataclass(frozen=True, eq=False)
class Evidence:
    """Draws of one unit under one model; ``about`` is its indicators object, ``diagnosis`` a diagnosis object or None."""

    about: dict
    draws: Draws
    diagnosis: dict | None = None
    where: str = ""

    @classmethod
    def read(cls, folder: Path) -> Evidence:
        """From a result folder of a fit; BadInput where it is none or its files do not belong together."""
        folder = Path(folder)
        about, path = read_result(folder / "indicators.json", INDICATORS), folder / "posterior.nc"
        if not path.is_file():
            raise BadInput(folder, "a result folder with posterior.nc", "none")
        posterior = read_posterior(path)
        require_own_posterior(path, read_group(path, "sample_stats").attrs, about)
        path = folder / "diagnosis.json"
        diagnosis = read_result(path, DIAGNOSIS) if path.is_file() else None
        if diagnosis is not None:
            require_same_data(path, diagnosis, about)
        return cls(about, IndicatorDraws(posterior, _k(folder, about)), diagnosis, str(folder))

    @classmethod
    def of(cls, posterior: Posterior, about: dict) -> Evidence:
        """From a posterior in memory and its indicators object."""
        return cls(about, IndicatorDraws(as_saved(posterior), about["k"]))

    @property
    def name(self) -> str:
        """The unit's name."""
        return self.about["unit"]

    @property
    def usable(self) -> bool:
        """Whether it converged on data that the check found fit."""
        return self.converged and not self.about.get("forced")

    @property
    def converged(self) -> bool:
        """Whether the sampling converged and the measurement does not contradict."""
        return bool(self.about["convergence"]["converged"])

    @property
    def effects(self) -> set[str]:
        """Everything that the fitted model holds, modules and effects."""
        return {*self.about["model"]["modules"], *self.about["model"]["effects"]}

    @property
    def rated_torque(self) -> float:
        """T_r [N·m]."""
        return float(self.draws.rated_torque_nm)

    @cached_property
    def kept(self) -> np.ndarray:
        """Numbers of the draws that are used where many loops are wanted."""
        return self.draws.kept

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The user's parameters by name, (draws,) each, SI units."""
        return self.draws.parameters

    @cached_property
    def measured(self) -> tuple[Loop, ...]:
        """The measured loops in order of rate and amplitude; repeats of a record are one loop."""
        return measured_loops(self.draws.rates, self.draws.amplitudes)

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

        Raises NotAvailable where it is not defined.
        """
        values = self.draws.values(name, loop.rate, loop.amplitude, kept or loop.predicted)
        if not np.isfinite(values).all():
            raise NotAvailable(f"{name} is not defined at {loop.text}")
        return values

    def record_json(self, loop: Loop) -> dict:
        """The record object of a loop's first record."""
        return self.about["records"][loop.records[0]]

    @property
    def reproduction(self) -> dict:
        """Data hashes, seed, versions and model of the fit."""
        found = {key: self.about[key] for key in ("data_sha256", "seed", "versions") if key in self.about}
        return found | {"model": self.about["model"], "folder": Path(self.where).name}


def _k(folder, about) -> float:
    k = about.get("k")
    if isinstance(k, bool) or not isinstance(k, int | float) or not 0 < k < 1:
        raise BadInput(folder / "indicators.json, key k", "a share between 0 and 1", repr(k)[:40])
    return float(k)
