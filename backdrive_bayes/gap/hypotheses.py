"""Log marginal likelihoods of sets of effects, in the contrasts that the class cannot hold."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from backdrive_bayes.engine.contrasts import SIZE_WEIGHTS, SIZES, Contrasts, averaged, make_contrasts
from backdrive_bayes.engine.design import Design, Group, path_group
from backdrive_bayes.engine.jumps import Jumps, find_jumps
from backdrive_bayes.engine.linearise import Linear, linearise
from backdrive_bayes.engine.periodic import FREQUENCIES, wave_group
from backdrive_bayes.engine.traces import trace_of
from backdrive_bayes.engine.unlisted import module_group, step_group
from backdrive_bayes.mechanics.registry import UNKNOWN, all_effects

ENCODER, STICK_SLIP, UNEXPLAINED = "encoder_error", "stick_slip", "unknown"
WAVE = 6e-3
"""Usual amplitude of an encoder's wave, and of a step in time, in shares of the angle scale."""
MODULE_CHANGE = 0.05
"""Usual change of a module in shares of itself."""
KINDS = (UNEXPLAINED, "module_change", "step")
"""What something unlisted may be: a process on each leg, a module that changes in time, a step in time; each as likely."""
PAIRED = 6
"""Effects that are tried in pairs: those that explain most alone."""
CLEAR = 20.0
"""Log Bayes factor from which an encoder's wave is taken into the linear model before all is weighed again."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """Log marginal likelihoods of sets of effects, relative to none, with what they rest on."""

    linear: Linear
    log_factor: dict[tuple[str, ...], float]
    frequency: dict[tuple[str, ...], float]
    jumps: Jumps
    left: dict[tuple[str, ...], float]
    contrasts: float
    posteriors: dict = field(default_factory=dict)


def weigh(linear: Linear, allowed=None) -> Weighed:
    """Weigh none, every effect and the pairs of the most promising; ``allowed`` restricts the names.

    A clear wave is first taken into the linear model, because it leaves residuals that bend everything else.
    """
    found = _weigh(linear, allowed)
    best = max(found.log_factor, key=lambda h: found.log_factor[h])
    if ENCODER in best and found.log_factor[best] > CLEAR:
        wave = wave_group(linear, found.frequency[best])
        again = linearise(linear.reduced, linear.effects, linear.reducer.modules, (Group("wave", wave.columns),))
        if again.log_marginal > linear.log_marginal:
            return _weigh(_without_wave(again), allowed)
    return found


def _without_wave(linear: Linear) -> Linear:
    from dataclasses import replace

    design = Design(tuple(g for g in linear.design.groups if g.name != "wave"))
    data = linear.whitened(design)
    scales = {n: s for n, s in linear.log_scale.items() if n != "wave"}
    keep = linear.design.index != linear.design.names.index("wave")
    solution = replace(linear.solution, mean=linear.solution.mean[keep], root=linear.solution.root[keep])
    return replace(linear, design=design, data=data, log_scale=scales, solution=solution)


def _weigh(linear: Linear, allowed) -> Weighed:
    bank = Group("bank", wave_group(linear, FREQUENCIES).columns)
    groups = (path_group(linear.reduced, UNKNOWN), module_group(linear), step_group(linear), bank)
    contrasts = make_contrasts(linear, groups)
    jumps = find_jumps(linear)
    table = _Table(linear, contrasts, jumps.log_factor > 0)
    names = [n for n in (*table.terms, ENCODER, STICK_SLIP) if n == UNEXPLAINED or allowed is None or n in allowed]
    log: dict[tuple[str, ...], float] = {(): table.log_marginal(())}
    for name in names:
        log[(name,)] = table.log_marginal((name,)) + (jumps.log_factor if name == STICK_SLIP else 0.0)
    best = sorted(names, key=lambda n: -log[(n,)])[:PAIRED]
    for pair in itertools.combinations(sorted(best), 2):
        log[pair] = table.log_marginal(pair) + (jumps.log_factor if STICK_SLIP in pair else 0.0)
    relative = {h: float(v - log[()]) for h, v in log.items()}
    left = {h: table.left(h) for h in log if UNEXPLAINED not in h}
    return Weighed(linear, relative, table.frequency, jumps, left, contrasts.samples)


class _Table:
    """Scales of the contrasts' weights by hypothesis, and their log marginal likelihoods."""

    def __init__(self, linear: Linear, contrasts: Contrasts, jumps: bool):
        self.contrasts, context = contrasts, linear.reduced.context
        effects = {e.name: e for e in linear.effects} | {UNEXPLAINED: UNKNOWN}
        self.names = contrasts.names
        self.trace = np.array([trace_of(linear, effects[n]) if n in effects else 0.0 for n in self.names])
        usual = {n: e.present(context) for n, e in effects.items()} | {"module_change": MODULE_CHANGE}
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
        kinds = [self._of_terms(hypothesis, on | {k}) for k in KINDS[:2]]
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
            scale[self._columns("bank", 2)[at]] = WAVE * SIZES[-1]
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
                scale[self._columns(bank, width)[at]] = member * WAVE
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
            variance = (size * WAVE) ** 2
            inner = np.eye(width) + variance * gram
            solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
            gains.append(0.5 * precision * variance * np.sum(left * solved, axis=1) - 0.5 * np.linalg.slogdet(inner)[1])
        self._scans[on, bank] = logsumexp(gains, axis=0, b=SIZE_WEIGHTS[:, None])
        return self._scans[on, bank]
