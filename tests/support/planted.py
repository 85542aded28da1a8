"""Units of the class with planted faults, small enough to be analysed within a second or two."""

from copy import copy
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.signal import lfilter

from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, angle_noise, physical_reducer, ramp
from backdrive_bayes.engine import linearise as engine
from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.periodic import WAVE
from backdrive_bayes.engine.search import Search
from backdrive_bayes.mechanics.friction import FRICTION
from backdrive_bayes.mechanics.history import played, through
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.records.record import Record, Unit

NOISE = BenchNoise()
LOOPS = ((0.1, 0.02), (0.1, 0.1))
MORE = ((0.1, 0.02), (0.1, 0.025), (0.1, 0.08), (0.1, 0.1))
HERTZ = 400.0
SCALE = 0.1
PERIOD_RAD = 0.004


def smooth_reducer(extra=None) -> KnownReducer:
    """A reducer whose plays turn up to full load, so that its loading branch has one step and no shoulder.

    ``extra`` is (angle in angle scales, lowest and highest torque in shares) of a further step with drag.
    """
    known = physical_reducer(np.random.default_rng(0), scatter=0.0)
    plays, steps = (known.reducer.part(n).cells for n in ("friction", "clearance"))
    friction = np.exp(-0.5 * (np.log(plays.threshold / 0.05) / 0.6) ** 2)
    weights = known.weights | {"friction": 0.6 * friction / (friction @ plays.width)}
    if extra:
        size, low, high = extra
        covered = np.clip(np.minimum(steps.up + steps.width, high) - np.maximum(steps.up, low), 0.0, None)
        weights["clearance"] = weights["clearance"] + size * covered / covered.sum()
    return replace(known, weights=weights)


def planted(
    seed=0,
    *,
    known=None,
    offset_nm=0.0,
    lag_s=0.0,
    smooth_s=0.0,
    exponent=0.0,
    drag_nm=0.0,
    jitter=None,
    loops=LOOPS,
    noise=NOISE,
    **options,
) -> Unit:
    """A unit of a reducer whose weights do not scatter; ``jitter`` is (sd, correlation length) in shares of the torque, friction
    follows the rate over 0.05 N·m/s with ``exponent``, a drag at the shaft is ``drag_nm`` at 0.1 N·m/s and follows the root of
    the rate, or as much at rest and none there, the angle is behind a delay or a first-order lag of ``smooth_s``."""
    known = known or physical_reducer(np.random.default_rng(0), **({"scatter": 0.0} | options))
    rng, records = np.random.default_rng(seed + 20), []
    for amplitude, rate in loops:
        time, torque = ramp(amplitude, rate, HERTZ)
        felt = played(torque[0], torque, drag_nm * (np.sqrt(rate / 0.1) - (drag_nm < 0.0)))[1:]
        angle = _firmer(known, (rate / 0.05) ** exponent).angle_rad(time, felt)
        if jitter:
            angle = _jittered(torque, angle, *jitter, rng)
        if smooth_s:
            share = -np.expm1(-1.0 / (HERTZ * smooth_s))
            angle = angle[0] + lfilter([share], [1.0, share - 1.0], angle - angle[0])
        angle = np.interp(time - lag_s, time, angle) + angle_noise(time.size, 1 / HERTZ, noise, rng)
        read = torque - offset_nm + noise.torque_nm * rng.standard_normal(time.size)
        records.append(Record(f"rate-{rate:g}-amplitude-{amplitude:g}.csv", time, read, angle, rate, amplitude))
    return Unit("planted", SCALE, tuple(records))


def by_hand(exponent, known, seed=0, noise=NOISE) -> Unit:
    """Two records of a torque that moves slowly and five times as fast in turn, with friction that follows the rate at the
    moment."""
    rng, records = np.random.default_rng(seed + 40), []
    nodes = SCALE * np.r_[np.linspace(0, 1, 6), np.linspace(1, -1, 11)[1:], np.linspace(-1, 1, 11)[1:]]
    for name in "ab":
        corner = np.cumsum(np.r_[0.0, np.where(np.arange(nodes.size - 1) % 2 == (name == "b"), 1.0, 0.2)])
        time = np.arange(int(corner[-1] * HERTZ)) / HERTZ
        torque = np.interp(time, corner, nodes)
        history, angle = through(time, torque, SCALE), np.zeros(time.size)
        for part in known.reducer.parts:
            cells = part.cells.grown(exponent * history.surge) if part.name in FRICTION else part.cells
            angle[1:] += known.angle_scale_rad * cells.ends(history) @ known.weights[part.name]
        angle[0] = angle[1]
        angle += angle_noise(time.size, 1 / HERTZ, noise, rng)
        records.append(Record(f"{name}.csv", time, torque + noise.torque_nm * rng.standard_normal(time.size), angle, 0.04, SCALE))
    return Unit("by hand", SCALE, tuple(records))


def changed(unit: Unit, change) -> Unit:
    """The unit with ``change(record, index)`` added to the angles [rad]."""
    return replace(unit, records=tuple(replace(r, angle_rad=r.angle_rad + change(r, i)) for i, r in enumerate(unit.records)))


def _smooth(extra=None, **options):
    return planted(known=smooth_reducer(extra), **options)


def _distorted(record, turns):
    """Interpolation error of quadrature signals with an offset and flattened tops, about ``turns`` periods in the angles."""
    phase = 2 * np.pi * turns * record.angle_rad / np.ptp(record.angle_rad)
    sine, cosine = np.sin(phase) + 0.3 - 0.05 * np.sin(3 * phase), np.cos(phase) + 0.05 * np.cos(3 * phase)
    return 4e-4 * np.angle((cosine + 1j * sine) * np.exp(-1j * phase)) / 0.3


def teeth(record, height=6e-4, length_nm=4e-3):
    """Stick-slip: on every leg the angle hangs back with the torque run since the last leap, and leaps ahead."""
    run = np.cumsum(np.abs(np.diff(record.torque_nm, prepend=record.torque_nm[0])))
    steps = np.random.default_rng(3).uniform(0.8, 1.2, int(run[-1] / length_nm) + 9) * length_nm
    leaps = np.cumsum(steps)
    at = np.searchsorted(leaps, run)
    since = run - np.r_[0.0, leaps][at]
    return -height * np.sign(np.gradient(np.convolve(record.torque_nm, np.ones(9) / 9, "same"))) * since / length_nm


def _delayed_square(record, time_s=3.0):
    """Creep under the square of the load: one Kelvin-Voigt element at rest at the start."""
    share = 1.0 - np.exp(-1.0 / (HERTZ * time_s))
    load = (record.torque_nm / 0.1) ** 2 * np.sign(record.torque_nm)
    return 2e-3 * lfilter([share], [1.0, share - 1.0], load)


def stepped(size_rad):
    """A clean unit but for a step of the reading halfway through the first record."""
    return changed(_smooth(), lambda r, i: size_rad * (r.time_s > 0.55 * r.time_s[-1]) * (i == 0))


UNITS = {
    "none": _smooth,
    "torque_offset": lambda: _smooth(offset_nm=8e-4),
    "sensor_lag": lambda: _smooth(lag_s=0.03),
    # A wave that is even in the angle: an odd one is part of an odd loop.
    "encoder_error": lambda: changed(_smooth(), lambda r, i: 4e-4 * np.cos(2 * np.pi * r.angle_rad / PERIOD_RAD)),
    "thermal_drift": lambda: changed(_smooth(loops=MORE), lambda r, i: 1.5e-3 * (r.time_s / 20) ** 0.7),
    "asymmetric_stiffness": lambda: changed(_smooth(), lambda r, i: 0.035 * np.abs(r.torque_nm)),
    "unknown": lambda: stepped(1.5e-3),
    "second_backlash": lambda: _smooth((0.15, 0.25, 0.35)),
    "interface_slip": lambda: _smooth((0.1, 0.75, 1.0)),
}
"""Units by what is planted in them."""


@cache
def prepared(name):
    """The linear models of one of UNITS."""
    return prepare(UNITS[name]())


def joint_mode(reduced, effects):
    """The first of the modes of ``linearise``; the others, of each bending effect alone, are not searched."""
    return engine.joint_mode(Search(reduced, effects, BASELINE), engine.possible_starts(reduced))[0].without(WAVE)


def _firmer(known, factor):
    """The reducer with other thresholds of friction."""
    parts = (replace(p, cells=p.cells.wider(factor)) if p.name in FRICTION else p for p in known.reducer.parts)
    reducer = copy(known.reducer)
    object.__setattr__(reducer, "parts", tuple(parts))
    return replace(known, reducer=reducer)


def _jittered(torque, angle, sd, length, rng):
    """Every leg read at torques that wander by ``sd`` over ``length``."""
    leg = np.cumsum(np.r_[0, np.diff(np.sign(np.diff(torque))) != 0, 0])
    phi, found = np.exp(-abs(torque[1] - torque[0]) / (length * SCALE)), np.empty_like(angle)
    for k in np.unique(leg):
        own = np.flatnonzero(leg == k)
        sign = np.sign(torque[own[-1]] - torque[own[0]])
        drive = rng.standard_normal(own.size)
        wander = lfilter([np.sqrt(1 - phi**2)], [1, -phi], drive, zi=[phi * rng.standard_normal()])[0]
        found[own] = np.interp(sign * (torque[own] + sd * SCALE * wander), sign * torque[own], angle[own])
    return found


VARIANTS = {
    "stick_slip": lambda: changed(_smooth(), lambda r, i: teeth(r)),
    "teeth_back": lambda: changed(_smooth(), lambda r, i: teeth(r, -6e-4)),
    "encoder_error": lambda: changed(_smooth(), lambda r, i: _distorted(r, 3.6)),
    "viscoelastic_creep": lambda: changed(_smooth(loops=MORE), lambda r, i: _delayed_square(r)),
}
"""Effects in another form than in UNITS."""


def _set(record):
    """A ratchet: every passage beyond two thirds of full torque leaves a little."""
    share = record.torque_nm / SCALE
    return 5e-3 * np.cumsum(np.maximum(share - 0.67, 0.0) * np.abs(np.diff(share, prepend=share[0])))


def _bump(record, height, at, width):
    """A particle between the teeth at one angle, in shares of half the range."""
    return height * np.exp(-0.5 * ((2 * record.angle_rad / np.ptp(record.angle_rad) - at) / width) ** 2)


UNLISTED = {
    "ratchet": lambda: changed(_smooth(loops=MORE), lambda r, i: _set(r)),
    "bump": lambda: changed(_smooth(), lambda r, i: _bump(r, 6e-4, 0.4, 0.05)),
    "shape": lambda: changed(_smooth(), lambda r, i: 4e-4 * np.cos(2.4 * np.pi * r.angle_rad / np.ptp(r.angle_rad))),
}
"""Effects that are not listed, by the kind of what is unlisted that they are."""
