"""The posterior that `fit` gives: averaged over the hypotheses that remain probable."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.design import path_group
from backdrive_bayes.engine.infer import infer, prepare
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.periodic import with_wave
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.gap.hypotheses import Weighed, weigh
from backdrive_bayes.gap.table import ENCODER, STICK_SLIP, UNEXPLAINED
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import UNKNOWN, all_effects
from backdrive_bayes.records.record import Unit

LEAST = 0.2
"""Hypotheses less probable than this share of the likeliest are left out of the average."""
MOST = 2
"""Hypotheses that are averaged over at most."""


_LAST: dict[tuple, Weighed] = {}
"""The unit that was weighed last: a diagnosis after a fit of the same files goes on from it."""


def weighed_unit(unit: Unit, modules=BASELINE, allowed=None, note=lambda text: None) -> Weighed:
    """The effects of a unit weighed, by the same call for a fit and its diagnosis; what was read from the same files is kept."""
    key = (unit.file_sha256, unit.data_sha256, modules, allowed)
    if not unit.file_sha256 or key not in _LAST:
        linears = prepare(unit, modules, note)
        note("weighing effects")
        found = weigh(linears, allowed)
        _LAST.clear()
        if not unit.file_sha256:
            return found
        _LAST[key] = found
    return _LAST[key]


def fit_posterior(unit: Unit, modules=BASELINE, seed: int = 0, note=lambda text: None) -> Posterior:
    """Posterior of a unit, averaged over what may break the symmetries of its class, the model discrepancy included."""
    with one_thread():
        weighed = weighed_unit(unit, tuple(modules), None, note)
        joint = weighed.joint()
        likeliest = sorted(joint.items(), key=lambda item: -item[1])[:MOST]
        mode = weighed.of(likeliest[0][0])
        kept = [(h, p) for h, p in likeliest if p >= LEAST * likeliest[0][1] and weighed.of(h) is mode]
        drawn = [(posterior_of(weighed, h, seed, note), p) for h, p in kept]
    return mixed(drawn)


def posterior_of(
    weighed: Weighed, effects: tuple[str, ...], seed: int, note=lambda text: None, off: tuple[str, ...] = ()
) -> Posterior:
    """Posterior under one set of effects, without the modules that are ``off``, in the linear model that weighed it; computed
    once for a seed."""
    key = tuple(effects), seed, off
    if key not in weighed.posteriors:
        listed = tuple(e for e in effects if e in all_effects())
        found = infer(with_columns(weighed, effects), listed, seed, note, off)
        weighed.posteriors[key] = replace(found, hypothesis=tuple(effects))
    return weighed.posteriors[key]


def with_columns(weighed: Weighed, effects: tuple[str, ...]) -> Linear:
    """The linear model with the columns of effects that it does not hold yet: an encoder's wave, what is unexplained."""
    linear = weighed.of(effects)
    if ENCODER in effects:
        linear = with_wave(linear, weighed.frequency.get(weighed.nearest(effects), weighed.frequency[(ENCODER,)]))
    if UNEXPLAINED in effects or STICK_SLIP in effects:
        linear = linear.beside(path_group(linear.reduced, UNKNOWN), UNKNOWN.present(linear.reduced.context))
    return linear


def mixed(drawn: list[tuple[Posterior, float]]) -> Posterior:
    """Draws of several posteriors of one linear model in proportion to their probabilities; the first is the likeliest."""
    first, total = drawn[0][0], sum(p for _, p in drawn)
    if len(drawn) == 1:
        return first
    draws = first.shape[1]
    counts = [max(1, int(round(draws * p / total))) for _, p in drawn[1:]]
    counts = [draws - sum(counts), *counts]
    picks = [np.linspace(0, q.shape[1] - 1, n).astype(int) for (q, _), n in zip(drawn, counts, strict=True)]
    # Interleaved, so that halves of a chain hold the hypotheses alike.
    order = np.argsort(np.concatenate([(np.arange(n) + 0.5) / n for n in counts]), kind="stable")
    common = [n for n in first.weights if all(n in q.weights for q, _ in drawn)]

    def join(part):
        return np.concatenate([part(q)[:, k] for (q, _), k in zip(drawn, picks, strict=True)], axis=1)[:, order]

    worst = min((q.convergence for q, _ in drawn), key=lambda c: (c.converged, -np.nanmax(c.rhat)))
    return replace(
        first,
        weights={n: join(lambda q, n=n: q.weights[n]) for n in common},
        log_scale={n: join(lambda q, n=n: q.log_scale[n]) for n in common if n in first.log_scale},
        log_density=join(lambda q: q.log_density),
        convergence=worst,
    )
