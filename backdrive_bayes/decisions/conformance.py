"""Conformance of one unit to one limit, JCGM 106:2012: plain arrays of posterior draws in, probabilities out.

Conformance probability p_c (clause 7), specific consumer's risk 1 − p_c of a unit that is passed and specific producer's
risk p_c of one that is failed (3.3.13, 3.3.14 and 9.3), guarded acceptance (clause 8.3).
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr, ndtri


class Verdict(enum.Enum):
    """What is decided about a unit; ``exit_code`` is that of the command line."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    INCONCLUSIVE = "inconclusive"

    @property
    def exit_code(self) -> int:
        """0 accepted, 3 rejected, 4 inconclusive."""
        return {"accepted": 0, "rejected": 3, "inconclusive": 4}[self.value]


@dataclass(frozen=True)
class Risks:
    """Specific risks of a decision about this unit; what no model covers (``unknown``) counts against either decision.

    ``within`` is the largest probability that limits are kept where something unknown acts.
    """

    conformance: float
    unknown: float = 0.0
    within: float = 1.0

    @property
    def consumer(self) -> float:
        """Probability that the unit is out of limits, should it be accepted."""
        return min(1.0, max(0.0, 1.0 - self.conformance))

    @property
    def producer(self) -> float:
        """Probability that the unit is within limits, should it be rejected."""
        return min(1.0, self.conformance + self.within * self.unknown)

    def verdict(self, consumer: float, producer: float) -> Verdict:
        """Accepted or rejected where the risk of doing so is at most the agreed one, else inconclusive."""
        if self.consumer <= consumer:
            return Verdict.ACCEPTED
        return Verdict.REJECTED if self.producer <= producer else Verdict.INCONCLUSIVE


def conformance_probability(values, lo=-np.inf, hi=np.inf) -> float:
    """p_c: probability that the quantity with draws ``values`` (draws,) lies in [lo, hi].

    The estimate (inside + 1/2) / (draws + 1) never is 0 or 1: a finite number of draws proves neither. JCGM 106:2012, 7.1.
    """
    return share((values >= lo) & (values <= hi))


def share(inside) -> float:
    """(true + 1/2) / (draws + 1) of booleans (draws,)."""
    return float((np.count_nonzero(inside) + 0.5) / (inside.size + 1))


def monte_carlo_error(probability: float, effective_draws: float) -> float:
    """Standard error of a probability that was estimated from so many effective draws."""
    return float(np.sqrt(probability * (1 - probability) / max(effective_draws, 1.0)))


def guard_bands(values, risk: float) -> tuple[float, float]:
    """Guard bands beneath an upper and above a lower limit that keep the specific consumer's risk at ``risk``.

    A one-sided limit's guarded acceptance is: the median may not come nearer to the limit than the guard band. With a normal
    posterior it is z(1 − risk) standard deviations. JCGM 106:2012, 8.3.2.
    """
    low, median, high = np.quantile(values, [risk, 0.5, 1 - risk])
    return float(high - median), float(median - low)


def normal_conformance(estimate, uncertainty, lo=-np.inf, hi=np.inf):
    """p_c of a normal state of knowledge with that estimate and standard uncertainty. JCGM 106:2012, 7.2 to 7.5."""
    return ndtr((hi - estimate) / uncertainty) - ndtr((lo - estimate) / uncertainty)


def acceptance_interval(uncertainty: float, lo: float, hi: float, conformance: float) -> tuple[float, float] | None:
    """Estimates whose normal p_c is at least ``conformance``; None where no estimate reaches it. JCGM 106:2012, 8.3."""
    if np.isfinite(lo) and np.isfinite(hi):
        # One limit alone would allow an estimate as near to it as that, a standard uncertainty less.
        centre, reach = 0.5 * (lo + hi), 0.5 * (hi - lo) + (1.0 - ndtri(conformance)) * uncertainty
        if normal_conformance(centre, uncertainty, lo, hi) < conformance:
            return None
        half = brentq(lambda d: normal_conformance(centre + d, uncertainty, lo, hi) - conformance, 0.0, reach)
        return centre - half, centre + half
    guard = ndtri(conformance) * uncertainty
    return lo + guard, hi - guard
