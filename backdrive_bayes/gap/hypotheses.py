"""Log marginal likelihoods of sets of effects, in the contrasts that the class cannot hold."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from backdrive_bayes.engine.contrasts import SIZE_WEIGHTS, SIZES, averaged, make_contrasts
from backdrive_bayes.engine.design import path_group
from backdrive_bayes.engine.jumps import Jumps, find_jumps
from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import find_scales
from backdrive_bayes.engine.periodic import AMPLITUDE, FREQUENCIES, wave_group, with_wave
from backdrive_bayes.engine.traces import trace_of
from backdrive_bayes.engine.unlisted import module_group, step_group, uneven_group
from backdrive_bayes.mechanics.registry import UNKNOWN, all_effects

ENCODER, STICK_SLIP, UNEXPLAINED = "encoder_error", "stick_slip", "unknown"
MODULE_CHANGE = 0.05
"""Usual change of a module in shares of itself."""
KINDS = (UNEXPLAINED, "module_change", "uneven", "step")
"""What something unlisted may be: a process on each leg, a module that changes in time, legs of two directions that part, a step
in time; each as likely."""
PAIRED = 6
"""Effects that are tried in pairs: those that explain most alone."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """Log marginal likelihoods of sets of effects, relative to none, with what they rest on."""

    linears: tuple[Linear, ...]
    mode: dict[tuple[str, ...], int]
    log_factor: dict[tuple[str, ...], float]
    frequency: dict[tuple[str, ...], float]
    jumps: Jumps
    left: dict[tuple[str, ...], float]
    contrasts: float
    posteriors: dict = field(default_factory=dict)

    @property
    def linear(self) -> Linear:
        """The linear model about the mode of the best hypothesis."""
        return self.of(max(self.log_factor, key=self.log_factor.__getitem__))

    def of(self, effects: tuple[str, ...]) -> Linear:
        """The linear model about the mode where a hypothesis is most likely."""
        return self.linears[self.mode[self.nearest(effects)]]

    def nearest(self, effects: tuple[str, ...]) -> tuple[str, ...]:
        """The best weighed hypothesis with the most of these effects."""
        return max((h for h in self.mode if set(h) <= set(effects)), key=lambda h: (len(h), self.log_factor[h]))


def weigh(linears: tuple[Linear, ...], allowed=None) -> Weighed:
    """Weigh none, every effect and the pairs of the most promising about every mode; ``allowed`` restricts the names."""
    jumps = find_jumps(linears[0])
    tables = [_Table(linear, jumps.log_factor > 0) for linear in linears]
    names = [n for n in (*tables[0].terms, ENCODER, STICK_SLIP) if n == UNEXPLAINED or allowed is None or n in allowed]
    level = [_level(table, names) if len(tables) > 1 else 0.0 for table in tables]

    def best_mode(hypothesis):
        leap = jumps.log_factor if STICK_SLIP in hypothesis else 0.0
        found = [table.log_marginal(hypothesis) + leap + lift for table, lift in zip(tables, level, strict=True)]
        return max(found), int(np.argmax(found))

    found = {h: best_mode(h) for h in [(), *((n,) for n in names)]}
    promising = sorted(names, key=lambda n: -found[(n,)][0])[:PAIRED]
    found |= {h: best_mode(h) for h in itertools.combinations(sorted(promising), 2)}
    none = found[()][0]
    return Weighed(
        tuple(linears),
        {h: mode for h, (_, mode) in found.items()},
        {h: float(value - none) for h, (value, _) in found.items()},
        {h: tables[mode].frequency[h] for h, (_, mode) in found.items() if ENCODER in h},
        jumps,
        {h: tables[mode].left(h) for h, (_, mode) in found.items() if UNEXPLAINED not in h},
        tables[0].contrasts.samples,
    )


def _level(table: _Table, names) -> float:
    """What makes a table's log marginal likelihoods comparable between modes: that of its best single effect with the scales of
    the class learnt, less the table's own."""
    singles = [(), *((n,) for n in names if n not in (UNEXPLAINED, STICK_SLIP))]
    log = {h: table.log_marginal(h) for h in singles}
    best = max(log, key=log.__getitem__)
    linear = with_wave(table.linear, table.frequency[best]) if ENCODER in best else table.linear
    scales = linear.design.scales(levels(linear, best))
    start = np.where(scales.free, [linear.log_scale[n] for n in linear.design.names], scales.mean)
    log_scale, solution = find_scales(linear.data, scales, start)
    return solution.log_marginal + linear.data.log_volume + scales.log_prior(log_scale) - log[best]


class _Table:
    """Scales of the contrasts' weights by hypothesis, and their log marginal likelihoods."""

    def __init__(self, linear: Linear, jumps: bool):
        bank = replace(wave_group(linear, FREQUENCIES), name="bank")
        unlisted = (path_group(linear.reduced, UNKNOWN), module_group(linear), uneven_group(linear), step_group(linear))
        self.linear, self.contrasts = linear, make_contrasts(linear, (*unlisted, bank))
        contrasts, context = self.contrasts, linear.reduced.context
        effects = {e.name: e for e in linear.effects} | {UNEXPLAINED: UNKNOWN}
        self.names = contrasts.names
        self.trace = np.array([trace_of(linear, effects[n]) if n in effects else 0.0 for n in self.names])
        usual = {n: e.present(context) for n, e in effects.items()} | {"module_change": MODULE_CHANGE, "uneven": AMPLITUDE}
        self.present = np.array([usual.get(n, 0.0) for n in self.names])
        listed = {n: tuple(e.name for e in terms) for n, terms in all_effects().items()}
        self.terms = {n: t for n, t in listed.items() if any(x in self.names for x in t)} | {UNEXPLAINED: (UNEXPLAINED,)}
        # Jumps leave traces in the block means that no slow model explains.
        self.jumping = {UNEXPLAINED} if jumps else set()
        self.frequency: dict[tuple[str, ...], float] = {}
        self._scans: dict[tuple, np.ndarray] = {}

    def scale(self, on, size: float = 1.0) -> np.ndarray:
        """Standard deviations of all weights where the terms ``on`` are present at ``size`` times their usual level."""
        level = np.where(np.isin(self.names, list(on)), size * self.present, self.trace)
        return level[self.contrasts.index]

    def log_marginal(self, hypothesis) -> float:
        """Log marginal likelihood of a set of names, averaged over sizes, frequencies and kinds of what is unlisted."""
        if UNEXPLAINED not in hypothesis:
            return self._of_terms(hypothesis, self._on(hypothesis))
        listed = tuple(n for n in hypothesis if n != UNEXPLAINED)
        on = self._on(listed)
        kinds = [self._of_terms(hypothesis, on | {k}) for k in KINDS[:3]]
        if ENCODER not in hypothesis:
            kinds.append(self._with_bank(on, "step", 1)[0])
        return float(logsumexp(kinds) - np.log(len(kinds)))

    def _on(self, hypothesis) -> set:
        return set().union(*(self.jumping if n == STICK_SLIP else self.terms.get(n, ()) for n in hypothesis))

    def _of_terms(self, hypothesis, on) -> float:
        if ENCODER in hypothesis:
            found, at = self._with_bank(on, "bank", 2)
            # Beside something unlisted, the first kind is the one whose columns a fit takes.
            self.frequency.setdefault(hypothesis, float(FREQUENCIES[at]))
            return found
        if not on:
            return self.contrasts.log_marginal(self.scale(on))
        return averaged([self.contrasts.log_marginal(self.scale(on, s)) for s in SIZES])

    def left(self, hypothesis) -> float:
        """Variance of the contrasts in noise units that a hypothesis leaves."""
        scale = self.scale(self._on(hypothesis), SIZES[-1])
        if hypothesis in self.frequency:
            at = int(np.argmin(np.abs(FREQUENCIES - self.frequency[hypothesis])))
            scale[self._columns("bank", 2)[at]] = AMPLITUDE * SIZES[-1]
        return self.contrasts.chi2(scale)

    def _columns(self, bank, width) -> np.ndarray:
        """Numbers of a bank's columns, (members, width)."""
        return np.flatnonzero(self.contrasts.index == self.names.index(bank)).reshape(-1, width)

    def _with_bank(self, on, bank, width) -> tuple[float, int]:
        """Log marginal likelihood averaged over a bank's members of ``width`` columns, and the best member."""
        gains = self._scan(frozenset(on), bank, width)
        at = int(np.argmax(gains))
        price = gains[at] - (logsumexp(gains) - np.log(gains.size))
        found = []
        for size in SIZES if on else (1.0,):
            for member in SIZES:
                scale = self.scale(on, size)
                scale[self._columns(bank, width)[at]] = member * AMPLITUDE
                found.append(self.contrasts.log_marginal(scale))
        by_size = np.reshape(found, (-1, SIZES.size))
        return float((averaged([averaged(f) for f in by_size]) if on else averaged(by_size[0])) - price), at

    def _scan(self, on, bank, width) -> np.ndarray:
        """Approximate gain of every member of a bank beside the terms ``on``."""
        if (on, bank) in self._scans:
            return self._scans[on, bank]
        c, scale, index = self.contrasts, self.scale(on), self._columns(bank, width)
        own = np.flatnonzero(scale > 0)
        inner = c.gram[np.ix_(own, own)] * np.outer(scale[own], scale[own])
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        seen = solve_triangular(lower, scale[own] * c.moment[own], lower=True, check_finite=False)
        across = solve_triangular(lower, scale[own, None] * c.gram[np.ix_(own, index.ravel())], lower=True, check_finite=False)
        precision = (c.noise_dof + c.samples) / (c.noise_dof + max(c.total - float(seen @ seen), 0.0))
        left = (c.moment[index.ravel()] - across.T @ seen).reshape(index.shape)
        members = across.T.reshape(*index.shape, own.size)
        gram = c.gram[index[:, :, None], index[:, None, :]] - np.einsum("fim,fjm->fij", members, members)
        gains = []
        for size in SIZES:
            variance = (size * AMPLITUDE) ** 2
            inner = np.eye(width) + variance * gram
            solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
            gains.append(0.5 * precision * variance * np.sum(left * solved, axis=1) - 0.5 * np.linalg.slogdet(inner)[1])
        self._scans[on, bank] = logsumexp(gains, axis=0, b=SIZE_WEIGHTS[:, None])
        return self._scans[on, bank]
