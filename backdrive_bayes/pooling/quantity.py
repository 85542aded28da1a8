"""One quantity pooled over a batch: mean and spread, the next unit, every unit's shrunk interval, and the information lost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from backdrive_bayes.indicators.intervals import ends, interval, named
from backdrive_bayes.pooling.hierarchy import FEWEST_UNITS, Hierarchy, sample_hierarchy
from backdrive_bayes.pooling.loss import MOST_BITS, batch_loss, fit_loss, unit_loss
from backdrive_bayes.pooling.mixture import Mixture, fit_mixture

KEPT = 200
"""Draws of the hierarchy that losses and units' intervals are taken from, and that are saved for the next unit."""
LOWER_ENDS = 21
"""Intervals among which the shortest is taken."""
MOST_SHIFT = 1.0
"""Standard deviations by which a prior may have moved a posterior: beyond, fewer than a sixth of the draws tell what is left."""
MOST_TIES = 0.01
"""Share of draws that may repeat: a functional that is cut at the end of its range has no density there."""
_APART = "look at it and pool the batch without it, or measure it again with more records"


@dataclass(frozen=True, eq=False)
class Likelihood:
    """A unit's likelihood of a quantity: draws ``x`` (draws,), the ``weight`` that takes its prior out, and the mixture of both.

    ``loss`` is that of the compression [bit], ``prior_shift`` how far the prior had moved the draws' mean, in their standard
    deviations; ``refused`` says why the unit cannot be pooled, None where it can.
    """

    x: np.ndarray
    weight: np.ndarray
    mixture: Mixture
    loss: float
    prior_shift: float
    refused: str | None


def likelihood(draws, prior) -> Likelihood:
    """A unit's likelihood from posterior ``draws`` (draws,) and draws of its ``prior`` (prior draws,)."""
    x = np.asarray(draws, float)
    # Draws of the prior that were cut at the end of the range are no part of its density within.
    log_weight = -fit_mixture(np.unique(prior)).log_density(x)
    weight = np.exp(log_weight - log_weight.max())
    mixture = fit_mixture(x, weight)
    sd = float(x.std()) or 1e-300
    shift = float(x.mean() - weight @ x / weight.sum()) / sd
    loss = fit_loss(mixture, x, weight)
    return Likelihood(x, weight, mixture, loss, shift, _why_not(x, loss, shift, _effective(weight)))


def _why_not(x, loss, shift, effective) -> str | None:
    ties = 1.0 - np.unique(x).size / x.size
    if ties > MOST_TIES:
        return f"left out: {100 * ties:.0f} % of its draws lie at the end of the range; measure it with more records"
    if abs(shift) > MOST_SHIFT:
        return f"left out: its prior had moved it by {abs(shift):.2g} standard deviations; measure it with more records"
    if loss <= MOST_BITS:
        return None
    lost = f"{loss:.2g} bit are lost"
    return f"left out: {lost} ({effective:.0f} effective draws without its prior); measure it with more records"


def pool_quantity(names, draws, priors, seed: int, level: float) -> dict:
    """The object of one quantity from units' ``draws`` and ``priors``, lists of arrays (draws,) in SI units.

    Positive quantities are pooled by their logarithms: ``mean`` is then the geometric mean and ``spread`` the standard deviation
    of the logarithm. Where nothing is to be told ``refused`` says why, and what to do instead.
    """
    log = all(np.min(d) > 0 for d in draws)
    forward, back = (np.log, np.exp) if log else (np.asarray, np.asarray)
    priors = [p[p > 0] if log else p for p in priors]
    units = [likelihood(forward(d), forward(p)) for d, p in zip(draws, priors, strict=True)]
    rows = [_row(name, d, u, level) for name, d, u in zip(names, draws, units, strict=True)]
    kept = [i for i, u in enumerate(units) if not u.refused]
    found: dict = {"scale": "log" if log else "linear", "units": len(kept), "refused": None, "of_units": rows}
    if len(kept) < FEWEST_UNITS:
        return found | {"refused": _too_few(len(kept), rows)}
    hierarchy = sample_hierarchy([units[i].mixture for i in kept], seed)
    small = hierarchy.thinned(KEPT)
    found |= {"convergence": hierarchy.convergence.to_json(), "loss_bits": _batch_loss(small, [units[i] for i in kept])}
    refused = _refused(found, [names[i] for i in kept], [units[i] for i in kept], small)
    if refused:
        return found | {"refused": refused}
    for i in kept:
        rows[i] |= _pooled(small, units[i], back, level)
    return found | _told(hierarchy, small, back, level)


def _told(hierarchy: Hierarchy, small: Hierarchy, back, level) -> dict:
    below, above = back(small.next_unit.quantile(ndtr([-1.0, 1.0])))
    return {
        "mean": interval(back(hierarchy.mean), level),
        "spread": shortest(hierarchy.spread, level),
        "next_unit": named(*back(small.next_unit.quantile(ends(level)))) | {"sd": float(0.5 * (above - below))},
        "predictive": {"mean": small.mean.tolist(), "spread": small.spread.tolist()},
    }


def shortest(values, level: float) -> dict:
    """Median and shortest interval of positive ``values`` (draws,); it begins at zero where they do not keep away from it.

    A central interval never reaches zero, so that it would exclude a batch whose units do not differ.
    """
    tail = np.linspace(0, 1 - level, LOWER_ENDS)
    low, high = np.quantile(values, tail), np.quantile(values, tail + level)
    low[0], high[-1] = 0.0, np.max(values)
    best = int(np.argmin(high - low))
    return named(low[best], np.median(values), high[best])


def _row(name, draws, unit: Likelihood, level) -> dict:
    row = {"unit": name, "own": interval(draws, level), "pooled": None, "prior_shift_sd": unit.prior_shift}
    return row | {"loss_bits": unit.loss, "effective_draws": _effective(unit.weight), "refused": unit.refused}


def _pooled(small, unit, back, level) -> dict:
    bits, effective = unit_loss(small, unit.mixture, unit.x, unit.weight)
    found = {"loss_bits": max(bits, unit.loss), "effective_draws": effective}
    if bits > MOST_BITS:
        return found | {"refused": f"{effective:.0f} effective draws lie where the other units put it: {_APART}"}
    return found | {"pooled": named(*back(small.pooled(unit.mixture).quantile(ends(level))))}


def _batch_loss(small, units) -> float:
    return batch_loss(small, [u.mixture for u in units], [u.x for u in units], [u.weight for u in units])


def _too_few(kept: int, rows) -> str:
    reasons = [f"; {r['unit']} is {r['refused']}" for r in rows if r["refused"]]
    return f"{kept} units tell enough of it and {FEWEST_UNITS} are needed: add units or records{''.join(reasons[:1])}"


def _refused(found, names, units, small) -> str | None:
    if not found["convergence"]["converged"]:
        return f"the hierarchy did not converge ({found['convergence']['worst']}): add units"
    if found["loss_bits"] <= MOST_BITS:
        return None
    alone = [batch_loss(small, [u.mixture], [u.x], [u.weight]) for u in units]
    worst = int(np.argmax(alone))
    lost = f"{found['loss_bits']:.2g} bit are lost by re-weighting stored draws (at most {MOST_BITS:g})"
    return f"{lost}, most of it by {names[worst]}: {_APART}"


def _effective(weight) -> float:
    return float(weight.sum() ** 2 / np.sum(weight**2))
