"""The search for a mode of the few nonlinear parameters, effects present under a wide scale."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.engine.design import Group, class_groups, class_priors, path_group, tangent_groups
from backdrive_bayes.engine.flanks import RATIOS, select_flank
from backdrive_bayes.engine.jitter import USUAL_JITTER, learn_jitter
from backdrive_bayes.engine.knots import finer, first_knots, least_distance
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import SWEEPS, find_scales, whiten
from backdrive_bayes.engine.periodic import WAVE
from backdrive_bayes.engine.reduced import Jitter, Reduced
from backdrive_bayes.engine.traces import trace_levels
from backdrive_bayes.mechanics.clearance import joined, spaced
from backdrive_bayes.mechanics.effect import Distortion, Effect, PathEffect, TangentEffect
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS
from backdrive_bayes.mechanics.reducer import ReducerClass
from backdrive_bayes.mechanics.registry import UNEQUAL, all_effects

MOST_FLANKS = 3
"""Flanks at most: each adds some 25 weights. They are selected before the jitter is learnt, which would absorb their residual."""
LEARNINGS = 4
"""How often the class is refined and the jitter learnt at most: a prediction made with too little jitter hides most of it."""
STEPS = 40
"""More than a search takes: what ends it is that nothing is promised."""
STILL = 0.3
"""Rise of the log density, as a straight line promises it, below which the search ends: ten times as much tells
of an effect."""
SPREAD, EXPONENTS = 2e-3, 50.0
"""Standard deviation of the prior that damps a step at first, in shares of the torque, and how many times that in exponents."""
BROKEN_PROMISE, KEPT_PROMISE, NARROWER, WIDER = 0.25, 0.75, 0.25, 2.0
"""Share of a promised rise below which that prior is made narrower, above which it is made wider, and how many times (usual for
trust regions: Nocedal and Wright, Numerical Optimization, 2006, ch. 4)."""
LAW, CREEP = "rate_dependent_friction", "viscoelastic_creep"
BENDING = {
    "torque_offset": ("offset",),
    "sensor_lag": ("lag_s",),
    LAW: ("friction_exponent", "drag_exponent", "shaft_drag"),
}
"""Effects whose columns are derivatives, and the places of their parameters in a distortion."""
WIDE = 2.0
"""Standard deviation of an effect's log scale while the mode is searched."""


@dataclass(frozen=True, eq=False)
class Search:
    """The search for a mode beside ``fixed`` columns.

    Of what bends the prediction ``only`` these may act, all by default.
    """

    reduced: Reduced
    effects: tuple[Effect, ...]
    modules: tuple[str, ...]
    fixed: tuple[Group, ...] = ()
    only: tuple[str, ...] | None = None

    def learn(self, distortion: Distortion, *near: Distortion) -> Linear:
        """The linear model about the highest mode that is reached from a distortion, or from those ``near``, with a class, jitter
        and noise that are learnt there."""
        learnt = self._learnt(self.first(distortion))
        return max((self.find_mode(learnt, at) for at in (distortion, *near)), key=lambda mode: mode.log_marginal)

    def first(self, distortion: Distortion) -> Linear:
        """The linear model about a distortion with the class, jitter and noise that every unit begins with."""
        reduced, usual = self.reduced, USUAL_JITTER
        jitter = Jitter(usual.torque * reduced.context.torque_noise, usual.length)
        reducer = ReducerClass(first_knots(reduced, distortion), self.modules)
        linear = self._linear(reducer, distortion, reduced.covariances(reduced.read_slopes, jitter), {}, jitter, set())
        return self._anew(linear)

    def _learnt(self, linear: Linear) -> Linear:
        """The same about the same distortion with flanks, jitter and knots that the residuals want."""
        while "friction" in self.modules and linear.reducer.ratios.size < MOST_FLANKS:
            ratios = select_flank(linear)
            if ratios.size == linear.reducer.ratios.size:
                break
            linear = self._anew(linear, reducer=replace(linear.reducer, ratios=ratios))
        # A step may be one of the loop, or torque that was not read: what is likelier decides.
        fine = self._refined(linear, learning=False)
        ends = [self._refined(one) for one in ((linear, fine) if fine is not linear else (linear,))]
        return max(ends, key=lambda end: end.log_marginal)

    def widened(self, linear: Linear, other: ReducerClass) -> Linear:
        """The model about the same distortion in a class that has the knots of both, of the other only where they are denser,
        and the flanks of both; knots and jitter are then refined."""
        own, gaps = linear.reducer, np.diff(other.knots, prepend=-np.inf, append=np.inf)
        knots = joined(own.knots, other.knots, 0.5 * np.minimum(gaps[1:], gaps[:-1]))
        ratios = joined(own.ratios, other.ratios, np.full(other.ratios.size, np.diff(RATIOS).max()))
        reducer = replace(own, knots=spaced(knots, least_distance(self.reduced)), ratios=ratios)
        return self._refined(self._anew(linear, reducer=reducer))

    def with_own_noise(self, linear: Linear) -> Linear:
        """The mode that is reached from one with the jitter that is learnt there, and the noise by what it predicts."""
        own = self._anew(linear, jitter=learn_jitter(linear))
        return self.find_mode(own, own.distortion)

    def _refined(self, linear: Linear, learning: bool = True) -> Linear:
        """The likeliest on the way to one with the knots that the residuals want, and the jitter where it is ``learning``."""
        best = linear
        for _ in range(LEARNINGS):
            before, linear = linear, self._anew(linear, jitter=learn_jitter(linear)) if learning else linear
            reducer = finer(linear)
            refined = self._anew(linear, reducer=reducer) if reducer.knots.size > linear.reducer.knots.size else linear
            best = max((best, linear, refined), key=lambda one: one.log_marginal)
            if refined is linear and linear.jitter == before.jitter:
                break
            linear = refined
        return best

    def _anew(self, linear: Linear, reducer: ReducerClass | None = None, jitter: Jitter | None = None) -> Linear:
        """The linear model about the same distortion with another class or jitter, its noise by what was predicted."""
        reducer, jitter, reduced = reducer or linear.reducer, jitter or linear.jitter, self.reduced
        covariances = tuple(reduced.covariances(reduced.slopes(linear.predicted), jitter))
        weights = linear.weights if reducer is linear.reducer else None
        return self._linear(reducer, linear.distortion, covariances, linear.log_scale, jitter, self._backward(linear), weights)

    def find_mode(self, like: Linear, distortion: Distortion) -> Linear:
        """The linear model about the mode that is reached from a distortion, of the class and jitter of ``like``, and of its
        noise where both are of the same block means: a step is taken where it raises the log density of the nonlinear parameters.
        A straight line promises more than there is, or less, and is trusted as far as it kept its promise; the search ends
        where it promises nothing so far. Its derivatives are those at the weights of the model before, and scales take one step
        towards their mode with each of the parameters; where a step was refused, and where nothing is promised, derivatives are
        made anew at the model's own weights, and scales take all that are left. What is one way and wanted to act the other way
        meanwhile is tried once more where the search would end; the likelier end counts."""
        covariances = like.covariances
        if self.reduced is not like.reduced:
            covariances = tuple(self.reduced.covariances(self.reduced.slopes(like.predicted), like.jitter))
        idle: set[str] = set()
        again: set[str] = set()
        ends: list[Linear] = []

        def about(at: Distortion, best: Linear, sweeps: int) -> Linear:
            return self._linear(like.reducer, at, covariances, best.log_scale, like.jitter, idle, best.weights, sweeps)

        best, spread, own = self._linear(like.reducer, distortion, covariances, {}, like.jitter, idle), SPREAD, False
        for _ in range(STEPS):
            if not idle >= (backward := self._backward(best)):
                idle |= backward
                best, own = about(best.distortion, best, SWEEPS), True
            moved, here = self._moved(best, spread), self._log_density(best, best.log_scale)
            promised = self._log_density(best, best.log_scale, moved) - here
            if promised >= STILL:
                tried = about(moved, best, 1)
                kept = (self._log_density(tried, best.log_scale) - here) / promised
                if not kept >= BROKEN_PROMISE:
                    # A prior wider than the step was long did not damp it.
                    spread = NARROWER * min(spread, length(moved, best.distortion, self.reduced.context))
                elif kept > KEPT_PROMISE:
                    spread *= WIDER
                if kept > 0.0:
                    best, own = tried, False
                    continue
            elif own:
                # What wanted to act the other way on the way here may not any more.
                if not (wanted := idle - again - self._backward(best)):
                    break
                ends.append(best)
                again |= wanted
                idle -= wanted
                own = False
            if not own:
                best, own = about(best.distortion, best, SWEEPS), True
        ends.append(best if own else about(best.distortion, best, SWEEPS))
        return max(ends, key=lambda end: end.log_marginal)

    def _log_density(self, linear: Linear, log_scale, at: Distortion | None = None) -> float:
        """Log density of the data and a distortion, by default its own, at known log scales, up to a constant."""
        names, index = linear.design.names, linear.design.index
        values, held = np.zeros(index.size), np.zeros(index.size, bool)
        scale = np.exp([linear.log_scale[n] for n in names])[index]
        for effect in (e for e in self.effects if isinstance(e, TangentEffect) and e.name in names):
            own = index == names.index(effect.name)
            values[own], held[own] = getattr(at or linear.distortion, effect.parameter), True
            scale[own] = np.exp(log_scale[effect.name])
        return float(linear.data.moments.holding(values, held, scale).log_marginal(scale[~held])) + linear.data.log_volume

    def _linear(self, reducer, distortion, covariances, known, jitter, idle, weights=None, sweeps=SWEEPS):
        """The linear model about a distortion; derivatives are those at ``weights``, by default the ones that fit best there."""
        core = class_groups(self.reduced, reducer, distortion)
        paths = (path_group(self.reduced, effect, distortion) for effect in self.effects if isinstance(effect, PathEffect))
        beside = (*paths, *self.fixed)
        if weights is None:
            plain = core.joined(*beside)
            data = self._whitened(plain, self.reduced.angles, covariances)
            weights = plain.split(self._solve(reducer, plain, data, known)[1].mean)
        tangents = tangent_groups(self.reduced, reducer, core, distortion, weights, self.effects)
        design = core.joined(*beside, *tangents)
        shift = _shift(design, distortion, self.effects, self.reduced.context)
        angles = tuple(a + s for a, s in zip(self.reduced.angles, shift, strict=True))
        data = self._whitened(design, angles, covariances)
        log_scale, solution = self._solve(reducer, design, data, known, idle, sweeps)
        weights = design.split(solution.mean)
        predicted = tuple(p - s for p, s in zip(design.predict(weights), shift, strict=True))
        waves = {n: w for n, w in weights.items() if n == WAVE}
        waving = tuple(w + np.zeros(a.size) for w, a in zip(design.predict(waves), angles, strict=True))
        shared = (self.reduced, reducer, distortion, design, self.effects, angles, tuple(covariances), data)
        return Linear(*shared, log_scale, solution, jitter, predicted, waving)

    def _whitened(self, design, angles, covariances):
        return whiten(design.records(), angles, covariances, self.reduced.scale_dof, self.reduced.settled)

    def _solve(self, reducer, design, data, known, idle=frozenset(), sweeps=SWEEPS):
        """Log scales by name and weights, at their mode or ``sweeps`` steps towards it from the ``known`` ones by name."""
        priors = class_priors(reducer)
        traces = trace_levels(self.reduced, design, self.effects)
        for effect in (e for e in self.effects if e.name in traces):
            free = self._acts(effect) and effect.name not in idle
            level = effect.present(self.reduced.context) if free else traces[effect.name]
            priors[effect.name] = (float(np.log(level)), WIDE if free and not (effect.of_class or effect.known) else 0.0)
        priors |= {g.name: (float(np.log(6e-3)), WIDE) for g in self.fixed if g.name not in priors}
        scales = design.scales(priors)
        start = np.array([known.get(name, mean) for name, mean in zip(design.names, scales.mean, strict=True)])
        log_scale, solution = find_scales(data, scales, np.where(scales.free, start, scales.mean), sweeps)
        return dict(zip(design.names, log_scale, strict=True)), solution

    def _acts(self, effect) -> bool:
        """Whether an effect may be more than a trace: all at the joint mode, else what does not bend and ``only`` these."""
        if effect.of_class or effect in UNEQUAL:
            return True
        if effect.instead:
            return False
        if effect is BENCH_HYSTERESIS or self.only is None:
            return effect is not BENCH_HYSTERESIS
        # A creep may stand for a law of the rate: where that acts, it is weighed without.
        still = {*BENDING, CREEP} if LAW in self.only else {*BENDING}
        return effect in {t for n, terms in all_effects().items() if n in self.only or n not in still for t in terms}

    def _backward(self, linear) -> set[str]:
        """Effects that are one way and want to act the other way."""
        found = (e for e in self.effects if isinstance(e, TangentEffect) and e.one_way and e.name in linear.weights)
        return {e.name for e in found if linear.weights[e.name][0] < 0.0}

    def _moved(self, linear, spread: float) -> Distortion:
        """The distortion that a straight line promises most of, where one more prior about the present one has ``spread`` for its
        standard deviation, in the units of :func:`length`."""
        here, design, units = linear.distortion, linear.design, _units(linear.distortion, self.reduced.context)
        row = {name: int(np.argmax(design.index == k)) for k, name in enumerate(design.names)}
        effects = [e for e in self.effects if isinstance(e, TangentEffect) and e.name in row]
        rows, unit = [row[e.name] for e in effects], np.array([units[e.parameter] for e in effects])
        root, value = linear.solution.root[rows], np.array([getattr(here, e.parameter) for e in effects])
        # With the covariance C of the parameters and D of the prior, (1/C + 1/D)⁻¹ 1/C = (1 + C/D)⁻¹ (Levenberg, Marquardt).
        damped = np.eye(unit.size) + linear.solution.variance * root @ root.T / (spread * unit) ** 2
        moved = value + np.linalg.solve(damped, linear.solution.mean[rows] - value)
        return replace(here, **dict(zip([e.parameter for e in effects], moved.tolist(), strict=True)))


def _shift(design, distortion, effects, context):
    """What the tangent effects' columns make of the distortion itself, less the bench's usual friction."""
    found = [0.0] * len(design.groups[0].columns)
    for effect in effects:
        if isinstance(effect, TangentEffect) and effect.name in design.names:
            group = design.group(effect.name)
            found = [f + c[:, 0] * getattr(distortion, effect.parameter) for f, c in zip(found, group.columns, strict=True)]
        if effect is BENCH_HYSTERESIS:
            group = design.group(effect.name)
            found = [f - c[:, 0] * BENCH_HYSTERESIS.usual(context) for f, c in zip(found, group.columns, strict=True)]
    return found


def _units(distortion, context) -> dict[str, float]:
    """What counts as a step of one by parameter: the torque scale, a lag that makes as much of it, or EXPONENTS."""
    torques = {"offset": 1.0, "shaft_drag": 1.0, "lag_s": 1.0 / context.rate.max()}
    return dict.fromkeys(vars(distortion), EXPONENTS) | torques


def length(moved, distortion, context) -> float:
    """Largest part of the step between two distortions, in shares of the torque scale."""
    units = _units(distortion, context)
    return max(abs(getattr(moved, n) - getattr(distortion, n)) / unit for n, unit in units.items())
