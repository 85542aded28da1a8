"""Global consumer's and producer's risks of a production process that is measured, JCGM 106:2012, 9.5 and annex A."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from backdrive_bayes.decisions.evidence import Evidence, same_lost_motion
from backdrive_bayes.decisions.loops import NotAvailable
from backdrive_bayes.errors import BadInput

SHAPES = ("normal", "lognormal", "gamma")
FEWEST_UNITS = 3
"""Of which a mean and a standard deviation are made."""
NODES, PIECES = 40, 24
REACH, BEYOND = 9.0, 1e-15
"""Standard deviations of a measurement, and probability of the process, beyond which nothing is integrated."""


@dataclass(frozen=True)
class Process:
    """What is known of a production process before a unit is measured: mean and standard deviation of the quantity, and shape."""

    mean: float
    sd: float
    shape: str = "normal"

    @cached_property
    def distribution(self):
        """The frozen scipy distribution."""
        if self.shape == "normal":
            return stats.norm(self.mean, self.sd)
        ratio2 = (self.sd / self.mean) ** 2
        if self.shape == "lognormal":
            return stats.lognorm(np.sqrt(np.log1p(ratio2)), scale=self.mean / np.sqrt(1 + ratio2))
        return stats.gamma(1 / ratio2, scale=self.mean * ratio2)

    def to_json(self) -> dict:
        """As saved."""
        return {"mean": self.mean, "sd": self.sd, "shape": self.shape}


@dataclass(frozen=True)
class GlobalRisks:
    """Probabilities over units of the process and their measurements.

    ``consumer``: out of limits and accepted; ``producer``: within limits and rejected; ``nonconforming``: out of limits;
    ``accepted``, ``rejected``: the shares of units so decided (the rest is inconclusive).
    """

    consumer: float
    producer: float
    nonconforming: float
    accepted: float
    rejected: float

    def to_json(self) -> dict:
        """As saved, with the share that stays inconclusive."""
        return asdict(self) | {"inconclusive": max(0.0, 1 - self.accepted - self.rejected)}


def global_risks(process: Process, uncertainty: float, limit, accepted, rejected_outside=None) -> GlobalRisks:
    """Risks of accepting estimates inside ``accepted`` and rejecting those outside ``rejected_outside``.

    ``limit``, ``accepted`` and ``rejected_outside`` (by default the same) are pairs (low, high), infinities allowed; ``accepted``
    may be None. The measurement is normal with standard ``uncertainty``. Formulas (17) to (20) in JCGM 106:2012, 9.5 and annex A
    are the case without an inconclusive zone.
    """
    rejected_outside = accepted if rejected_outside is None else rejected_outside
    inside, outside = _regions(process, uncertainty, limit, accepted, rejected_outside)
    return GlobalRisks(
        _mass(outside, process, uncertainty, accepted),
        _mass(inside, process, uncertainty, rejected_outside, complement=True),
        _mass(outside, process),
        _mass(inside + outside, process, uncertainty, accepted),
        _mass(inside + outside, process, uncertainty, rejected_outside, complement=True),
    )


def process_of_units(first: Evidence, others, indicator: str, rate: float, amplitude: float) -> tuple[Process, int]:
    """The process of ``others`` like the unit ``first``, by an indicator of a loop, and their number; BadInput where one is there
    twice, was taken at another torque, or where they are too few."""
    estimates, spreads, seen = [], [], [first.about["data_sha256"]]
    for other in others:
        if other.about["data_sha256"] in seen:
            raise BadInput(other.where, "other units in the batch, each once", f"the data of {other.name} once more")
        seen.append(other.about["data_sha256"])
        try:
            if indicator == "lost_motion_rad":
                same_lost_motion([first, other])
            values = other.values(indicator, other.loop(rate, amplitude))
        except NotAvailable as why:
            raise BadInput(other.where, f"{indicator} of the batch's unit", str(why)) from None
        estimates.append(float(np.median(values)))
        spreads.append(float(np.std(values)))
    if len(estimates) < FEWEST_UNITS:
        raise BadInput("batch", f"at least {FEWEST_UNITS} other units", f"{len(estimates)}")
    return process_of_batch(estimates, spreads), len(estimates)


def process_of_batch(estimates, uncertainties) -> Process:
    """A normal process from other units' estimates, their measurement variance taken out."""
    estimates, uncertainties = np.asarray(estimates, float), np.asarray(uncertainties, float)
    total, measured = np.var(estimates, ddof=1), np.mean(uncertainties**2)
    # A batch that scatters no more than its measurements tells only that the process does not scatter more.
    return Process(float(estimates.mean()), float(np.sqrt(max(total - measured, 0.05 * total, 1e-24))))


def _regions(process, uncertainty, limit, *intervals):
    """Pieces (low, high) of the process's support within and beyond the limit, cut at quantiles and where an integrand bends."""
    d = process.distribution
    bends = [*d.ppf(np.r_[BEYOND, np.arange(1, PIECES) / PIECES]), float(d.isf(BEYOND))]
    low, high = bends[0], bends[-1]
    for lo_hi in (limit, *(i for i in intervals if i is not None)):
        for edge in lo_hi:
            if np.isfinite(edge):
                bends += [edge + s * uncertainty for s in (-REACH, -2, 0, 2, REACH)]
    bends = np.unique(np.clip(bends, low, high))
    pieces = list(zip(bends[:-1], bends[1:], strict=True))
    within = [p for p in pieces if limit[0] <= 0.5 * (p[0] + p[1]) <= limit[1]]
    return within, [p for p in pieces if p not in within]


def _mass(pieces, process, uncertainty=None, interval=None, complement=False) -> float:
    """∫ g₀(η) P(estimate in interval | η) dη over ``pieces`` by Gauss-Legendre over the probability of η: a density may have no
    bound, as that of a gamma process wider than its mean."""
    if uncertainty is not None and interval is None:
        return _mass(pieces, process) if complement else 0.0
    d, total = process.distribution, 0.0
    node, weight = np.polynomial.legendre.leggauss(NODES)
    for ends in pieces:
        # From the end that is near, or nothing is left of small probabilities.
        to, back = (d.sf, d.isf) if ends[0] >= d.median() else (d.cdf, d.ppf)
        a, b = to(ends)
        value = 1.0
        if uncertainty is not None:
            lo, hi = ((edge - back(0.5 * (b - a) * node + 0.5 * (a + b))) / uncertainty for edge in interval)
            inside = stats.norm.cdf(hi) - stats.norm.cdf(lo)
            # Outside of an interval that holds nothing, as (inf, -inf), is everything, once.
            value = np.minimum(stats.norm.cdf(lo) + stats.norm.sf(hi), 1.0) if complement else inside
        total += 0.5 * abs(float(b - a)) * float(np.sum(weight * value))
    return float(total)
