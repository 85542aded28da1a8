"""Evidence for what breaks a symmetry: effects weighed in what the class cannot hold.

The class is integrated under a prior ``WIDENED`` times wider than what the unit taught, so that an effect gains
nothing by drawing
again what the class has learnt already (columns made from the prediction look like the loop itself). What is left are
contrasts: between mirrored branches, rates, times and legs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import log_ndtr, logsumexp

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.linear import Linear

WIDENED = 5.0
SIZES = np.exp([-1.5, 0.0, 1.5])
"""Sizes of an effect over its usual one, averaged over with these weights: """
SIZE_WEIGHTS = np.array([0.25, 0.5, 0.25])
BARRED = -1e4
"""Log probability of what there is not: so small that nothing makes up for it, and finite."""


def nothing_barred(means) -> np.ndarray:
    """That there is anything, whatever the weights (…, width): (…,)."""
    return np.zeros(np.shape(means)[:-1])


@dataclass(frozen=True, eq=False)
class Contrasts:
    """Effects' columns and the data with the class integrated: Gram matrices of what is left.

    ``gram`` (weights, weights), ``moment`` (weights,), ``total``; ``index`` numbers the group of a weight;
    ``samples`` is the number of independent contrasts. ``white`` (samples, weights) are the whitened columns and ``held`` what
    the class holds of them, of which the Gram matrices are made; where a further group is ``integrated`` they are those of the
    whole, and ``log_volume`` is what that costs.
    """

    names: tuple[str, ...]
    index: np.ndarray
    gram: np.ndarray
    moment: np.ndarray
    total: float
    samples: float
    noise_dof: float
    white: np.ndarray
    held: np.ndarray
    log_volume: float = 0.0
    integrated: Integrated | None = None

    def beside(self, name: str, scale: float) -> Contrasts:
        """The same without a group whose weights, of standard deviation ``scale``, are integrated as those of the class are."""
        of = self.index == self.names.index(name)
        _, lower, seen = self._solved(np.where(of, scale, 0.0))
        rest = np.flatnonzero(~of)
        across = solve_triangular(lower, scale * self.gram[np.ix_(of, rest)], lower=True, check_finite=False)
        return replace(
            self,
            index=self.index[rest],
            gram=self.gram[np.ix_(rest, rest)] - across.T @ across,
            moment=self.moment[rest] - across.T @ seen,
            total=self.total - float(seen @ seen),
            log_volume=float(np.log(np.diag(lower)).sum()),
            integrated=Integrated(self, of, scale, lower, seen, across),
        )

    def joined(self, first: int, more: Contrasts) -> Contrasts:
        """The ``first`` columns and ``more``, made with the same linear model, of which what is integrated here holds too."""
        part = self.integrated
        if part is None:
            raise ValueError("contrasts of which nothing is integrated")
        every = part.whole.white.T @ more.white - part.whole.held.T @ more.held
        beyond = solve_triangular(part.lower, part.scale * every[part.of], lower=True, check_finite=False)
        across = (every[~part.of] - part.across.T @ beyond)[:first]
        return replace(
            self,
            names=(*self.names, *more.names),
            index=np.r_[self.index[:first], more.index + len(self.names)],
            gram=np.block([[self.gram[:first, :first], across], [across.T, more.gram - beyond.T @ beyond]]),
            moment=np.r_[self.moment[:first], more.moment - beyond.T @ part.seen],
            integrated=None,
        )

    def log_marginal(self, scale, one_way: Sequence[int] = ()) -> float:
        """Log marginal likelihood for standard deviations of the weights, up to a constant; ``one_way`` numbers weights that have
        half a normal prior, each counted as if it were the only one."""
        return float(self.log_marginals(scale, np.empty(0, int), np.empty((1, 0)), one_way)[0])

    def log_marginals(self, scale, columns, sizes, one_way: Sequence[int] = (), barred=nothing_barred) -> np.ndarray:
        """The same where weights of further ``columns`` (width,) have each of ``sizes`` (n, width) in turn; ``barred`` says of
        their means (…, width) whether there is no such thing."""
        on, lower, seen = self._solved(scale)
        across = solve_triangular(lower, scale[on, None] * self.gram[np.ix_(on, columns)], lower=True, check_finite=False)
        rest, left = self.gram[np.ix_(columns, columns)] - across.T @ across, self.moment[columns] - across.T @ seen
        along = [solve_triangular(lower, (on == w).astype(float), lower=True, check_finite=False) for w in one_way]
        base, dof, found = self._chi2(seen), self.noise_dof + self.samples, []
        volume = self.log_volume + float(np.log(np.diag(lower)).sum())
        for size in sizes:
            more = np.linalg.cholesky(np.eye(columns.size) + np.outer(size, size) * rest)
            further = np.linalg.solve(more, size * left)
            chi2 = max(base - float(further @ further), 0.0)
            log = -0.5 * dof * np.log1p(chi2 / self.noise_dof) - volume - float(np.log(np.diag(more)).sum())
            log += BARRED * float(barred(size * np.linalg.solve(more.T, further)))
            for own in along:
                beyond = -np.linalg.solve(more, size * (across.T @ own))
                spread = np.sqrt((self.noise_dof + chi2) / dof) * np.hypot(np.linalg.norm(own), np.linalg.norm(beyond))
                log += np.log(2.0) + float(log_ndtr((own @ seen + beyond @ further) / spread))
            found.append(log)
        return np.array(found)

    def gains(self, scale, columns, sizes, barred=nothing_barred) -> np.ndarray:
        """Gain in log marginal likelihood of each member (members, width) of further ``columns`` whose weights have standard
        deviations ``sizes``, beside the first weights, of ``scale``; averaged over SIZES, ``barred`` as above."""
        whole = np.unique(columns)
        at = np.searchsorted(whole, columns)
        own, lower, seen = self._solved(scale)
        across = solve_triangular(lower, scale[own, None] * self.gram[np.ix_(own, whole)], lower=True, check_finite=False)
        chi2, dof = self._chi2(seen), self.noise_dof + self.samples
        left = (self.moment[whole] - across.T @ seen)[at] * sizes
        members = across.T[at]
        gram = self.gram[columns[:, :, None], columns[:, None, :]] - members @ members.transpose(0, 2, 1)
        gram *= sizes[:, :, None] * sizes[:, None, :]
        found = []
        for size in SIZES:
            inner = np.eye(columns.shape[1]) + size**2 * gram
            solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
            less = np.minimum(size**2 * np.sum(left * solved, axis=1), chi2)
            gain = -0.5 * dof * np.log1p(-less / (self.noise_dof + chi2)) - 0.5 * np.linalg.slogdet(inner)[1]
            found.append(gain + BARRED * barred(size**2 * sizes * solved))
        return logsumexp(found, axis=0, b=SIZE_WEIGHTS[:, None])

    def chi2(self, scale) -> float:
        """What is left of the contrasts at the posterior mean, over their number."""
        return self._chi2(self._solved(scale)[2]) / self.samples

    def _chi2(self, seen) -> float:
        return max(self.total - float(seen @ seen), 0.0)

    def _solved(self, scale) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Numbers of the weights that are on, the Cholesky factor of their precision, and their scores under it."""
        on = np.flatnonzero(scale > 0)
        inner = self.gram[np.ix_(on, on)] * np.outer(scale[on], scale[on])
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        return on, lower, solve_triangular(lower, scale[on] * self.moment[on], lower=True, check_finite=False)


@dataclass(frozen=True, eq=False)
class Integrated:
    """A group of weights that is integrated: the ``whole`` of contrasts ``of`` which (weights,) it is, its standard deviation,
    the Cholesky factor of its precision, its scores, and what it holds ``across`` the other columns."""

    whole: Contrasts
    of: np.ndarray
    scale: float
    lower: np.ndarray
    seen: np.ndarray
    across: np.ndarray


def make_contrasts(linear: Linear, groups: tuple[Group, ...]) -> Contrasts:
    """Contrasts of a unit for ``groups`` of columns."""
    core = [i for i, n in enumerate(linear.design.names) if n in _class_names(linear)]
    design = Design(groups)
    data = linear.whitened(design)
    own = np.isin(linear.design.index, core)
    scale = WIDENED * np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index[own]]
    inner = linear.data.gram[np.ix_(own, own)] * np.outer(scale, scale)
    inner[np.diag_indices_from(inner)] += 1.0
    lower = cholesky(inner, lower=True, check_finite=False)
    seen = solve_triangular(lower, (linear.data.x[:, own] * scale).T, lower=True, check_finite=False)
    columns, angle = seen @ data.x, seen @ data.y
    return Contrasts(
        design.names,
        design.index,
        data.gram - columns.T @ columns,
        data.moment - columns.T @ angle,
        data.total - float(angle @ angle),
        data.samples - float(np.sum(seen**2)),
        data.noise_dof,
        data.x,
        columns,
    )


def effect_groups(linear: Linear) -> tuple[Group, ...]:
    """Columns of the linear model's effects."""
    return tuple(g for g in linear.design.groups if g.name not in _class_names(linear))


def _class_names(linear):
    return {p.name for p in linear.reducer.parts} | {e.name for e in linear.effects if e.of_class}


def averaged(log_marginals) -> float:
    """Log marginal likelihood averaged over SIZES; ``log_marginals`` (sizes,)."""
    return float(logsumexp(log_marginals, b=SIZE_WEIGHTS))
