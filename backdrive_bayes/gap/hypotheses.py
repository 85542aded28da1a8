"""Log marginal likelihoods of sets of effects, in the contrasts that the class cannot hold."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.engine.disturbance import disturbance
from backdrive_bayes.engine.jumps import Jumps, find_jumps
from backdrive_bayes.engine.levels import learn_scales, levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.periodic import with_wave
from backdrive_bayes.gap.probabilities import probabilities
from backdrive_bayes.gap.table import ENCODER, STICK_SLIP, UNEXPLAINED, Table
from backdrive_bayes.mechanics.registry import all_effects


@dataclass(frozen=True, eq=False)
class Weighed:
    """Log marginal likelihoods of sets of effects, relative to none, with what they rest on; ``leaps`` is what the samples' teeth
    have of those with stick-slip, ``disturbance`` the log Bayes factor of a periodic disturbance in the samples."""

    linears: tuple[Linear, ...]
    mode: dict[tuple[str, ...], int]
    log_factor: dict[tuple[str, ...], float]
    leaps: dict[tuple[str, ...], float]
    disturbance: float
    frequency: dict[tuple[str, ...], float]
    jumps: Jumps
    left: dict[tuple[str, ...], float]
    contrasts: float
    posteriors: dict = field(default_factory=dict)

    @property
    def linear(self) -> Linear:
        """The linear model about the mode of the best hypothesis."""
        return self.of(max(self.log_factor, key=self.log_factor.__getitem__))

    def joint(self, properties: Mapping[str, float] | None = None) -> dict[tuple[str, ...], float]:
        """Probability of every set of effects; ``properties`` are those of effects inside the class, each taken alone."""
        return probabilities(self.log_factor, self.leaps, self.disturbance, self.left, properties or {})

    def of(self, effects: tuple[str, ...]) -> Linear:
        """The linear model about the mode where a hypothesis is most likely."""
        return self.linears[self.mode[self.nearest(effects)]]

    def nearest(self, effects: tuple[str, ...]) -> tuple[str, ...]:
        """The best weighed hypothesis with the most of these effects."""
        return max((h for h in self.mode if set(h) <= set(effects)), key=lambda h: (len(h), self.log_factor[h]))


def weigh(linears: tuple[Linear, ...], allowed=None) -> Weighed:
    """Weigh none, every effect and every pair about every mode; ``allowed`` restricts the names."""
    jumps = find_jumps(linears[0])
    names = [n for n in (*all_effects(), UNEXPLAINED, ENCODER, STICK_SLIP) if n == UNEXPLAINED or allowed is None or n in allowed]
    hypotheses = [(), *((n,) for n in names), *itertools.combinations(sorted(names), 2)]
    rows, lifts, samples = [], [], []
    # One table at a time: each is large.
    for linear in linears:
        table = Table(linear, jumps)
        lifts.append(_level(table, names) if len(linears) > 1 else 0.0)
        rows.append({h: table.weigh(h, lifts[-1]) for h in hypotheses})
        samples.append(table.contrasts.samples)

    def best_mode(hypothesis) -> int:
        return int(np.argmax([row[hypothesis].log_marginal for row in rows]))

    none, both = rows[best_mode(())][()].log_marginal, (ENCODER, STICK_SLIP)
    # An encoder's wave and teeth are not to speak for both from the same leaps.
    if both in hypotheses:
        waved = rows[best_mode((ENCODER,))][(ENCODER,)].log_marginal - none
        if max(waved, jumps.log_factor) > 0:
            beside = find_jumps(linears[0], rows[0][(ENCODER,)].frequency)
            for linear, row, lift in zip(linears, rows, lifts, strict=True):
                row[both] = Table(linear, beside).weigh(both, lift)
    mode = {h: best_mode(h) for h in hypotheses}
    found = {h: rows[m][h] for h, m in mode.items()}
    return Weighed(
        tuple(linears),
        mode,
        {h: f.log_marginal - none for h, f in found.items()},
        {h: f.leaps for h, f in found.items() if STICK_SLIP in h},
        disturbance(linears[0].reduced),
        {h: f.frequency for h, f in found.items() if f.frequency is not None},
        jumps,
        {h: f.left for h, f in found.items() if f.left is not None},
        samples[0],
    )


def _level(table: Table, names) -> float:
    """What makes a table's log marginal likelihoods comparable between modes: that of its best single effect with the scales of
    the class learnt, less the table's own."""
    singles = [(), *((n,) for n in names if n not in (UNEXPLAINED, STICK_SLIP))]
    log = {h: table.log_marginal(h) for h in singles}
    best = max(log, key=log.__getitem__)
    linear = with_wave(table.linear, table.frequency[best]) if ENCODER in best else table.linear
    scales, log_scale, solution = learn_scales(linear, levels(linear, best))
    # The solution knows the frequency of a wave: what its search costs is not part of the level.
    return solution.log_marginal + linear.data.log_volume + scales.log_prior(log_scale) - log[best] - table.price.get(best, 0.0)
