"""The modes of the few nonlinear parameters and the linear models about them."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.design import Group, grown_histories
from backdrive_bayes.engine.knots import LEAST_APART
from backdrive_bayes.engine.levels import learn_scales, levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.periodic import WAVE, clearest_wave, log_prior, periodic_group, rises
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.engine.search import BENDING, LAW, Search, length
from backdrive_bayes.engine.start import possible_starts
from backdrive_bayes.engine.wander import learn_wander
from backdrive_bayes.mechanics.effect import Distortion, Effect
from backdrive_bayes.mechanics.history import LEAST_RANGE
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import all_effects

BENT = 2.0
"""Torque, in its noise, by which a distortion moves the prediction no longer along a straight line."""

COLLINEAR = 1e-6
"""Share of the line of a law below which its bend is nothing: two amplitudes tell of no bend."""


def joint_mode(free: Search, starts: Sequence[Distortion]) -> tuple[Linear, tuple[Group, ...], float]:
    """The mode of a search where every effect may act, the encoder's wave if it has one, and the frequency of the clearest.

    It is the higher of the ends of two searches, from an undistorted bench and from the best other start, and beside the clearest
    wave of what is left there, if that is higher still, each with the wander of the reading that it leaves. The class is learnt
    anew beside a wave or a wander: without, it has spent itself on them.
    """
    begun = [free.first(start) for start in _apart([Distortion(), *starts], free.reduced.context)]
    likeliest = [begun[0], *sorted(begun[1:], key=lambda first: -first.log_marginal)[:1]]
    modes = sorted((free.find_mode(first, first.distortion) for first in likeliest), key=lambda mode: -mode.log_marginal)
    joint = free.learn(*_apart([mode.distortion for mode in modes], free.reduced.context))
    waves: tuple[Group, ...] = ()
    wandering, gain = learn_wander(joint)
    clear, frequency = clearest_wave(joint)
    if clear > 0:
        wave = periodic_group(joint, frequency)
        waved = replace(free, fixed=(*free.fixed, wave)).learn(joint.distortion)
        # Of a large wave, what the encoder reads is not the angle at which it errs.
        turned = periodic_group(waved, frequency)
        nearer = replace(free, fixed=(*free.fixed, turned)).find_mode(waved, waved.distortion)
        if nearer.log_marginal > waved.log_marginal:
            wave, waved = turned, nearer
        steady, more = learn_wander(waved)
        if waved.log_marginal + more + log_prior(frequency) > joint.log_marginal + gain and rises(waved, frequency):
            joint, waves, wandering, gain = waved, (wave,), steady, more
    if gain > 0:
        joint = replace(free, reduced=wandering, fixed=(*free.fixed, *waves)).learn(joint.distortion)
    return joint, waves, frequency


def linearise(reduced: Reduced, effects: tuple[Effect, ...], modules=BASELINE) -> tuple[Linear, ...]:
    """The joint model's mode and modes of what bends the prediction, all in one class.

    Whatever cannot be followed by a straight line from there (an offset, a lag, a law of the rate, a wave) has modes of its own:
    one where none of them acts, and those of each and of each pair without the others. A hypothesis is weighed about the mode
    where it is likeliest.
    """
    free, starts = Search(reduced, effects, modules), possible_starts(reduced)
    joint, waves, frequency = joint_mode(free, starts)
    context = joint.reduced.context
    late = max(start.lag_s for start in starts)
    reach = replace(joint.distortion, offset=starts[0].offset, lag_s=max(joint.distortion.lag_s, late))
    bent = _bent(joint, reach)
    lawless = _by_amplitude(joint, reach)
    # Where all may act, the friction's growth may stand against a creep: alone it begins at none as well.
    level = replace(reach, friction_exponent=0.0)
    by_law = reach, level, replace(level, drag_exponent=0.0, shaft_drag=starts[-1].shaft_drag)

    def search(some: tuple[str, ...] | None, like: Linear) -> Search:
        fixed = (*free.fixed, *(waves if some is None or WAVE in some else ()))
        return replace(free, reduced=like.reduced, fixed=fixed, only=some)

    def mode(some: tuple[str, ...], like: Linear, *near: Distortion) -> Linear:
        begun = [_only(at, some) for at in (by_law if LAW in some else (lawless,))]
        return _likeliest(search(some, like).find_mode(like, at) for at in _apart([*begun, *near], context))

    def possible(found: dict[tuple[str, ...], Linear]) -> dict[tuple[str, ...], Linear]:
        return {some: linear for some, linear in found.items() if WAVE not in linear.design.names or rises(linear, frequency)}

    if LAW not in bent and any(term.name in joint.design.names for term in all_effects()[LAW]):
        # A creep may stand for all of it.
        bent = (*bent, LAW) if _bends(LAW, mode((LAW,), joint).distortion, context) else bent
    modes: dict[tuple[str, ...] | None, Linear] = {None: joint}
    if bent:
        joint, none = _in_one_class(joint, search((), joint).learn(Distortion()), search)
        none = _likeliest((none, mode((), joint)))
        apart = possible({(name,): mode((name,), joint, none.distortion) for name in bent})
        # Of two that act together each alone is likelier than nothing; beside a law of the rate no creep acted.
        likelier = [some[0] for some, linear in apart.items() if LAW in some or linear.log_marginal > none.log_marginal]
        apart |= possible({pair: mode(pair, joint) for pair in itertools.combinations(likelier, 2)})
        modes = {None: joint, (): none} | apart
        modes = _reached(modes | {(): _with_none(modes, search)})
    # At the joint mode a drift may stand for a wander.
    straight = modes.get((), joint)
    wandering, gain = learn_wander(_calm(straight))
    if gain > 0 and wandering.noise != straight.reduced.noise:
        steady = replace(search((), straight), reduced=wandering).find_mode(straight, _only(straight.distortion, ()))
        others = ((some, linear) for some, linear in modes.items() if some != ())
        found = {some: (linear, search(some, steady).find_mode(steady, linear.distortion)) for some, linear in others}
        modes = modes | {some: _likeliest(ends) for some, ends in found.items()} | {(): steady}
    return tuple(linear.without(WAVE) for linear in modes.values())


def _likeliest(modes: Iterable[Linear]) -> Linear:
    return max(modes, key=lambda linear: linear.log_marginal)


def _reached(modes: dict) -> dict:
    """Modes by what may act, the joint one and those where no other with less to act is as likely."""

    def spare(some, linear):
        fewer = (other for less, other in modes.items() if less is not None and set(less) < set(some))
        return any(other.log_marginal >= linear.log_marginal for other in fewer)

    return {some: linear for some, linear in modes.items() if some is None or not spare(some, linear)}


def _in_one_class(joint: Linear, none: Linear, search) -> tuple[Linear, Linear]:
    """The joint mode and that of none in one class: that of the likelier of them, or one that has the other's as well if that is
    likelier. What acts is not to be weighed by the class that its own search came upon. The less likely mode may have a noise of
    its own: what does not act may be scatter of the crossing torques instead."""
    pair = ((None, joint), ((), none))
    (some, best), (rest, other) = sorted(pair, key=lambda item: -item[1].log_marginal)
    wide = search(some, best).widened(best, other.reducer)
    best = _likeliest((best, search(some, wide).find_mode(wide, best.distortion)))
    less = search(rest, best).find_mode(best, other.distortion)
    found = {some: best, rest: _likeliest((less, search(rest, best).with_own_noise(less)))}
    return found[None], found[()]


def _with_none(modes, search) -> Linear:
    """The likeliest mode where none acts that is found from there or from the others: a law of the amplitude that the search of
    an effect came upon is not to speak for the effect."""
    known = modes[()]
    starts = [known.distortion, *(_only(linear.distortion, ()) for linear in modes.values())]
    others = _apart(starts, known.reduced.context)[1:]
    return _likeliest((known, *(search((), known).find_mode(known, start) for start in others)))


def _calm(linear: Linear) -> Linear:
    """The same where every effect is at trace level."""
    _, log_scale, solution = learn_scales(linear, levels(linear, ()))
    return replace(linear, log_scale=dict(zip(linear.design.names, log_scale.tolist(), strict=True)), solution=solution)


def _by_amplitude(joint: Linear, reach: Distortion) -> Distortion:
    """The same where thresholds follow the amplitude alone, as nearly as that makes them grow as much."""
    along, context = grown_histories(joint.reduced, reach), joint.reduced.context
    law = np.array([context.law(0.0, history.log_amplitude)[1:3] for history, _ in along])
    growth = np.array([[np.mean(g) for g in grown[:2]] for _, grown in along])
    if np.ptp(law[:, 0]) < LEAST_RANGE:
        return reach
    (friction, drag), (friction_bend, drag_bend) = np.linalg.lstsq(law, growth - growth.mean(axis=0), rcond=COLLINEAR)[0].tolist()
    lines = {"friction_amplitude": friction, "drag_amplitude": drag}
    return replace(reach, **lines, friction_amplitude_bend=friction_bend, drag_amplitude_bend=drag_bend)


def _bent(joint: Linear, reach: Distortion) -> tuple[str, ...]:
    """What is too large at the joint mode, or where the legs agree best, to be taken back along a straight line."""
    large = tuple(name for name in BENDING if _bends(name, reach, joint.reduced.context))
    return (*large, WAVE) if WAVE in joint.design.names else large


def _bends(name: str, distortion: Distortion, context) -> bool:
    """Whether an effect moves the prediction further than along a straight line."""
    straight = replace(distortion, **dict.fromkeys(BENDING[name], 0.0))
    return length(distortion, straight, context) > BENT * context.torque_noise


def _only(distortion: Distortion, some) -> Distortion:
    """A distortion by some effects alone."""
    return replace(distortion, **{p: 0.0 for n, places in BENDING.items() if n not in some for p in places})


def _apart(starts, context):
    """Starts that differ by more than the distance of knots."""
    kept, least = [], 2 * LEAST_APART * context.torque_noise
    for start in starts:
        if all(length(start, other, context) > least for other in kept):
            kept.append(start)
    return kept
