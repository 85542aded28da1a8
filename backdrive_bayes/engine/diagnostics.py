"""Convergence over independent ensembles: rank-normalised R-hat, bulk and tail ESS (Vehtari et al. 2021), by ArviZ."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

MAX_RHAT = 1.01
MIN_ESS = 400.0
"""A hundred for each of four chains, as Vehtari et al. recommend."""
ADVICE = "not converged within the budget of evaluations"


@dataclass(frozen=True, eq=False)
class Convergence:
    """R-hat and ESS of every quantity by name, the evaluations spent, and whether that is enough."""

    names: tuple[str, ...]
    rhat: np.ndarray
    bulk_ess: np.ndarray
    tail_ess: np.ndarray
    evaluations: int

    @property
    def converged(self) -> bool:
        """Whether every quantity passes."""
        # A quantity that is the same in all draws has no R-hat and nothing left to learn.
        fine = np.isnan(self.rhat) | ((self.rhat < MAX_RHAT) & (self.bulk_ess >= MIN_ESS) & (self.tail_ess >= MIN_ESS))
        return bool(fine.all())

    def joined(self, other: Convergence) -> Convergence:
        """Both sets of quantities as one."""
        return Convergence(
            self.names + other.names,
            np.concatenate([self.rhat, other.rhat]),
            np.concatenate([self.bulk_ess, other.bulk_ess]),
            np.concatenate([self.tail_ess, other.tail_ess]),
            max(self.evaluations, other.evaluations),
        )

    @property
    def worst(self) -> str:
        """Name of the quantity that mixes worst."""
        return self.names[int(np.nanargmin(np.minimum(self.bulk_ess, self.tail_ess)))]

    @property
    def failed(self) -> tuple[str, ...]:
        """Each criterion that is not met, with the quantity that misses it by most."""
        told, high = [], np.nan_to_num(self.rhat)
        if not np.all(high < MAX_RHAT):
            i = int(high.argmax())
            value = f"R-hat {self.rhat[i]:.4f} of {self.names[i]} is not below {MAX_RHAT:g}"
            told.append(value if np.isfinite(self.rhat[i]) else f"{self.names[i]} is not defined in all draws")
        for kind, values in (("bulk", self.bulk_ess), ("tail", self.tail_ess)):
            ess = np.where(np.isnan(self.rhat) | np.isnan(values), np.inf, values)
            i = int(ess.argmin())
            if ess[i] < MIN_ESS:
                told.append(f"{kind} ESS {int(ess[i])} of {self.names[i]} is below {MIN_ESS:g}")
        return tuple(told)

    @property
    def least_ess(self) -> float:
        """Bulk or tail ESS of the quantity that mixes worst."""
        return float(np.nanmin(np.minimum(self.bulk_ess, self.tail_ess)))

    def line(self) -> str:
        """One phrase for a log."""
        return f"R-hat at most {np.nanmax(self.rhat):.3f}, ESS at least {self.least_ess:.0f} ({self.worst})"

    def to_json(self) -> dict:
        """The contract's ``convergence`` object."""
        return {
            "converged": self.converged,
            "max_rhat": float(np.nanmax(self.rhat)),
            "min_bulk_ess": float(np.nanmin(self.bulk_ess)),
            "min_tail_ess": float(np.nanmin(self.tail_ess)),
            "evaluations": self.evaluations,
            "worst": self.worst,
            "advice": "" if self.converged else f"{ADVICE}: {', '.join(self.failed)}; check the records",
        }


def diagnose_draws(names, draws, step, evaluations: int) -> Convergence:
    """Diagnostics of ``draws`` (ensembles, draws, quantities) ordered walker by walker, drawn at ``step`` (ensembles, draws).

    Walker by walker, the autocorrelation is that of the walkers and ESS is honest; in the order of time, split R-hat
    compares the ensembles and the halves of the run.
    """
    order = np.argsort(step, axis=1, kind="stable")
    in_time = np.take_along_axis(draws, order[..., None], axis=1)
    # Undefined in some draws only: that is no constant, and nothing may be concluded from it.
    broken = np.isnan(draws).any(axis=(0, 1)) & ~np.isnan(draws).all(axis=(0, 1))
    return Convergence(
        tuple(names),
        np.where(broken, np.inf, _arviz("rhat", in_time)),
        _arviz("ess", draws, method="bulk"),
        _arviz("ess", draws, method="tail", prob=(0.05, 0.95)),
        evaluations,
    )


def _arviz(function, draws, **options):
    """One statistic of every quantity, shape (quantities,)."""
    from arviz_stats.base import array_stats

    with warnings.catch_warnings():
        # Of a constant the variance is zero; its NaN is dealt with above.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(getattr(array_stats, function)(draws, chain_axis=0, draw_axis=1, **options), float)
