"""Convergence over independent ensembles: rank-normalised R-hat, bulk and tail ESS (Vehtari et al. 2021), by ArviZ."""

from __future__ import annotations

import enum
import warnings
from dataclasses import dataclass

import numpy as np

MAX_RHAT = 1.01
MIN_ESS = 1000.0


class Outcome(enum.Enum):
    """What the sampling came to, with advice."""

    CONVERGED = "converged"
    NOT_CONVERGED = (
        "not converged within the budget: give it more time (--budget), or leave out the member whose parameter mixes worst "
        "(--baseline)"
    )


@dataclass(frozen=True, eq=False)
class Convergence:
    """R-hat and ESS of every quantity by name, and the outcome."""

    names: tuple[str, ...]
    rhat: np.ndarray
    bulk_ess: np.ndarray
    tail_ess: np.ndarray
    seconds: float

    @property
    def outcome(self) -> Outcome:
        """Whether every quantity passes."""
        # A quantity that is the same in all draws has no R-hat and nothing left to learn.
        fine = np.isnan(self.rhat) | (
            (self.rhat < MAX_RHAT) & (self.bulk_ess >= MIN_ESS) & (self.tail_ess >= MIN_ESS)
        )
        return Outcome.CONVERGED if fine.all() else Outcome.NOT_CONVERGED

    @property
    def worst(self) -> str:
        """Name of the quantity that mixes worst."""
        return self.names[int(np.nanargmin(np.minimum(self.bulk_ess, self.tail_ess)))]

    def to_json(self) -> dict:
        """The contract's ``convergence`` object."""
        return {
            "converged": self.outcome is Outcome.CONVERGED,
            "max_rhat": float(np.nanmax(self.rhat)),
            "min_bulk_ess": float(np.nanmin(self.bulk_ess)),
            "min_tail_ess": float(np.nanmin(self.tail_ess)),
            "seconds": self.seconds,
            "worst": self.worst,
            "advice": "" if self.outcome is Outcome.CONVERGED else self.outcome.value,
        }


def diagnose_draws(names, draws, halves, seconds: float) -> Convergence:
    """Diagnostics of ``draws`` (ensembles, draws, quantities) ordered walker by walker.

    ``halves`` (ensembles, draws) marks the first and second half of the run; R-hat is taken over ensembles and halves.
    """
    split = _split_in_time(draws, halves)
    return Convergence(
        tuple(names),
        _arviz("rhat", split),
        _arviz("ess", draws, method="bulk"),
        _arviz("ess", draws, method="tail"),
        seconds,
    )


def _split_in_time(draws, halves):
    parts = [chain[half == h] for chain, half in zip(draws, halves, strict=True) for h in (0, 1)]
    shortest = min(len(p) for p in parts)
    return np.stack([p[:shortest] for p in parts])


def _arviz(function, draws, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import arviz
        import xarray

        data = xarray.Dataset({"q": (("chain", "draw", "quantity"), draws)})
        return np.asarray(getattr(arviz, function)(data, **options)["q"], float)
