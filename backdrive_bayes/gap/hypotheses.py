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
from backdrive_bayes.engine.marginal import whiten
from backdrive_bayes.engine.periodic import FREQUENCIES, wave_group
from backdrive_bayes.engine.traces import trace_of
from backdrive_bayes.mechanics.registry import UNKNOWN, all_effects

ENCODER, STICK_SLIP, UNEXPLAINED = "encoder_error", "stick_slip", "unknown"
WAVE = 6e-3
"""Usual amplitude of an encoder's wave in shares of the angle scale."""
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
    wave: Group | None = field(default=None)


def weigh(linear: Linear, allowed=None) -> Weighed:
    """Weigh none, every effect and the pairs of the most promising; ``allowed`` restricts the names.

    A clear wave is first taken into the linear model, because it leaves residuals that bend everything else.
    """
    found = _weigh(linear, allowed)
    best = max(found.log_factor, key=found.log_factor.get)
    if ENCODER in best and found.log_factor[best] > CLEAR:
        wave = wave_group(linear, found.frequency[best])
        again = linearise(linear.reduced, linear.effects, linear.reducer.modules, (Group("wave", wave.columns),))
        if again.solution.log_marginal > linear.solution.log_marginal:
            return _weigh(_without_wave(again), allowed)
    return found


def _without_wave(linear: Linear) -> Linear:
    from dataclasses import replace

    design = Design(tuple(g for g in linear.design.groups if g.name != "wave"))
    data = whiten(design.records(), linear.angles, linear.covariances, linear.data.noise_dof)
    scales = {n: s for n, s in linear.log_scale.items() if n != "wave"}
    keep = linear.design.index != linear.design.names.index("wave")
    solution = replace(linear.solution, mean=linear.solution.mean[keep], root=linear.solution.root[keep])
    return replace(linear, design=design, data=data, log_scale=scales, solution=solution)


def _weigh(linear: Linear, allowed) -> Weighed:
    bank = wave_group(linear, FREQUENCIES)
    contrasts = make_contrasts(linear, (path_group(linear.reduced, UNKNOWN), Group("bank", bank.columns)))
    table = _Table(linear, contrasts)
    jumps = find_jumps(linear)
    jumping = (STICK_SLIP,) if jumps.log_factor > 0 else ()
    names = [n for n in (*table.terms, ENCODER, *jumping) if n == UNEXPLAINED or allowed is None or n in allowed]
    log = {(): table.log_marginal(())}
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

    def __init__(self, linear: Linear, contrasts: Contrasts):
        self.contrasts, context = contrasts, linear.reduced.context
        effects = {e.name: e for e in linear.effects} | {UNEXPLAINED: UNKNOWN}
        self.names = contrasts.names
        self.trace = np.array([trace_of(linear, effects[n]) if n in effects else 0.0 for n in self.names])
        self.present = np.array([effects[n].present(context) if n in effects else 0.0 for n in self.names])
        listed = {n: tuple(e.name for e in terms) for n, terms in all_effects().items()}
        self.terms = {n: t for n, t in listed.items() if any(x in self.names for x in t)} | {UNEXPLAINED: (UNEXPLAINED,)}
        self.listed = int(np.sum(contrasts.index < len(self.names) - 1))
        self.frequency: dict[tuple[str, ...], float] = {}
        self._scans: dict[frozenset, np.ndarray] = {}

    def scale(self, on, size: float = 1.0) -> np.ndarray:
        """Standard deviations of all weights where the terms ``on`` are present at ``size`` times their usual level."""
        level = np.where(np.isin(self.names, list(on)), size * self.present, self.trace)
        return level[self.contrasts.index]

    def log_marginal(self, hypothesis) -> float:
        """Log marginal likelihood of a set of names, averaged over sizes (and frequencies)."""
        on = set()
        for name in hypothesis:
            # Jumps leave traces in the block means that no slow model explains.
            on |= set(self.terms.get(UNEXPLAINED if name == STICK_SLIP else name, ()))
        sizes = SIZES if on else (1.0,)
        if ENCODER not in hypothesis:
            found = [self.contrasts.log_marginal(self.scale(on, s)) for s in sizes]
            return averaged(found) if on else found[0]
        gains = self._scan(frozenset(on))
        at = int(np.argmax(gains))
        self.frequency[hypothesis] = float(FREQUENCIES[at])
        price = gains[at] - (logsumexp(gains) - np.log(gains.size))
        found = [averaged([self._with_wave(on, s, at, w) for w in SIZES]) for s in sizes]
        return (averaged(found) if on else found[0]) - price

    def left(self, hypothesis) -> float:
        """Variance of the contrasts in noise units that a hypothesis leaves."""
        on = set()
        for name in hypothesis:
            on |= set(self.terms.get(UNEXPLAINED if name == STICK_SLIP else name, ()))
        scale = self.scale(on, SIZES[-1])
        if hypothesis in self.frequency:
            at = self.listed + 2 * int(np.argmin(np.abs(FREQUENCIES - self.frequency[hypothesis])))
            scale[at : at + 2] = WAVE * SIZES[-1]
        return self.contrasts.chi2(scale)

    def _with_wave(self, on, size, at, wave):
        scale = self.scale(on, size)
        scale[self.listed + 2 * at : self.listed + 2 * at + 2] = wave * WAVE
        return self.contrasts.log_marginal(scale)

    def _scan(self, on) -> np.ndarray:
        """Approximate gain of a wave at every frequency beside the terms ``on``."""
        if on in self._scans:
            return self._scans[on]
        c, m = self.contrasts, self.listed
        scale = self.scale(on)[:m]
        inner = c.gram[:m, :m] * np.outer(scale, scale)
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        seen = solve_triangular(lower, scale * c.moment[:m], lower=True, check_finite=False)
        across = solve_triangular(lower, scale[:, None] * c.gram[:m, m:], lower=True, check_finite=False)
        precision = (c.noise_dof + c.samples) / (c.noise_dof + max(c.total - seen @ seen, 0.0))
        left = (c.moment[m:] - across.T @ seen).reshape(-1, 2)
        pairs = across.T.reshape(-1, 2, m)
        index = m + np.arange(left.size).reshape(-1, 2)
        gram = c.gram[index[:, :, None], index[:, None, :]] - np.einsum("fim,fjm->fij", pairs, pairs)
        gains = []
        for size in SIZES:
            variance = (size * WAVE) ** 2
            inner = np.eye(2) + variance * gram
            solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
            gains.append(0.5 * precision * variance * np.sum(left * solved, axis=1) - 0.5 * np.linalg.slogdet(inner)[1])
        self._scans[on] = logsumexp(gains, axis=0, b=SIZE_WEIGHTS[:, None])
        return self._scans[on]
