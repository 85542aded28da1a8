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
        "not converged within the budget: go on with more time (--resume --budget SECONDS), or leave out the member whose "
        "parameter mixes worst (--baseline)"
    )
    NOT_BURNT_IN = "not converged: the budget ended before the burn-in did: go on with more time (--resume --budget SECONDS)"


@dataclass(frozen=True, eq=False)
class Convergence:
    """R-hat and ESS of every quantity by name, whether the chains were burnt in, and the outcome."""

    names: tuple[str, ...]
    rhat: np.ndarray
    bulk_ess: np.ndarray
    tail_ess: np.ndarray
    seconds: float
    burnt_in: bool = True

    @property
    def outcome(self) -> Outcome:
        """Whether every quantity passes, in chains that were burnt in."""
        # A quantity that is the same in all draws has no R-hat and nothing left to learn.
        fine = np.isnan(self.rhat) | (
            (self.rhat < MAX_RHAT) & (self.bulk_ess >= MIN_ESS) & (self.tail_ess >= MIN_ESS)
        )
        if not self.burnt_in:
            return Outcome.NOT_BURNT_IN
        return Outcome.CONVERGED if fine.all() else Outcome.NOT_CONVERGED

    def joined(self, other: Convergence) -> Convergence:
        """Both sets of quantities as one."""
        return Convergence(
            self.names + other.names,
            np.concatenate([self.rhat, other.rhat]),
            np.concatenate([self.bulk_ess, other.bulk_ess]),
            np.concatenate([self.tail_ess, other.tail_ess]),
            other.seconds,
            self.burnt_in and other.burnt_in,
        )

    @property
    def worst(self) -> str:
        """Name of the quantity that mixes worst."""
        return self.names[int(np.nanargmin(np.minimum(self.bulk_ess, self.tail_ess)))]

    def to_json(self) -> dict:
        """The contract's ``convergence`` object."""
        return {
            "converged": self.outcome is Outcome.CONVERGED,
            "burnt_in": self.burnt_in,
            "max_rhat": float(np.nanmax(self.rhat)),
            "min_bulk_ess": float(np.nanmin(self.bulk_ess)),
            "min_tail_ess": float(np.nanmin(self.tail_ess)),
            "seconds": self.seconds,
            "worst": self.worst,
            "advice": "" if self.outcome is Outcome.CONVERGED else self.outcome.value,
        }


def diagnose_draws(names, draws, step, seconds: float) -> Convergence:
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
        seconds,
    )


def _arviz(function, draws, **options):
    """One statistic of every quantity, shape (quantities,)."""
    from arviz_stats.base import array_stats

    with warnings.catch_warnings():
        # Of a constant the variance is zero; its NaN is dealt with above.
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(getattr(array_stats, function)(draws, chain_axis=0, draw_axis=1, **options), float)
