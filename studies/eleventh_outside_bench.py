"""Eleventh outside bench: written without sight of the package it tests, with reducer mechanics of its own.

"python eleventh_outside_bench.py OUT --units 80 --seed 111" writes OUT/case-01 ... (unit.toml, a CSV a record)
and OUT/key.json; the same seed gives the same bytes.

Families (torque in units of the rated torque, quasi-static; every one is odd, rate-independent, and closes after first loading):
planetary_sharing  2-4 stages in series; 3-5 planets a stage with clearances of their own share the load through stiffening
                   contacts; each stage moves against a drag and a load-proportional friction.
strain_wave        tooth pairs in parallel, each an elastic stop that slides (Iwan) with limits growing with the wind-up,
                   on a soft-centred hardening spring; solved for the angle at each torque.
cycloid_pins       ten pins engage one after another by lever arm and clearance; presliding friction of Dahl's kind with a
                   constant and a load-proportional limit.
split_preload      two trains preloaded against each other; one flank lifts off beyond the preload (the loop softens); the
                   friction of each train follows its own contact force.
worm_wedge         driving and back-driving friction differ (flat-topped loop); tooth clearance in series with an axial float of
                   the worm against its bearing spring.
spur_relays        a train of 4-7 clearances that cross one by one at scattered drags, a hardening shaft, and bearings with a
                   spectrum of play thresholds.
hypoid_duhem       contact films that follow an S-shaped law over a sliding memory measured in torque (Duhem operator).
Every reducer has an output seal too: a compliant slider with a plain play threshold. stick_slip acts on this slider,
rate_dependent_friction and x_thixotropic_grease on all friction of the reducer, x_scuffed_flank on its load-proportional part.

Conventions: what never settles (x_running_in_wear, x_thixotropic_grease, x_warming_softens) has that truth by convention; the
rest as in outside_units.py.
Unlisted kinds: x_running_in_wear (clearance grows from cycle to cycle), x_coupling_jump (encoder coupling slips at instants),
x_floor_vibration (narrow-band in time), x_chip_in_mesh (a chip holds one flank off until crushed, in every cycle),
x_thixotropic_grease (friction falls with time or with work done), x_scuffed_flank (friction of one flank only),
x_warming_softens (compliance grows with time), x_stalled_interface (angle frozen for short whiles, then catching up).
"""

from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from outside_units import (
    ARCMIN,
    BODY,
    CODE,
    LAG,
    LOAD,
    SIZES,
    TIME,
    Bench,
    Effect,
    Run,
    Trace,
    Unit,
    adding,
    clamp_slip,
    lagged,
    log_uniform,
    loop_indicators,
    pick,
    settled_path,
    triangle,
    uniform,
)


# ---------------------------------------------------------------- kernels
@njit
def _edge(v, outward, inward):
    return v / (1.0 + outward) if v >= 0.0 else v / (1.0 - min(inward, 0.9))

@njit
def wedge_play(q, fr, drag, out, back, pos, neg):
    """Moment behind a slider whose friction is drag + out|m| outward and drag + back|m| inward; pos, neg scale the flanks."""
    m, res = 0.0, np.empty_like(q)
    for i in range(q.size):
        f = drag * fr[i]
        lo = _edge(q[i] - f, out * pos * fr[i], back * neg * fr[i])
        hi = -_edge(-q[i] - f, out * neg * fr[i], back * pos * fr[i])
        m = min(max(m, lo), hi)
        res[i] = m
    return res

def play(q, radius):
    return wedge_play(q, np.ones_like(q), radius, 0.0, 0.0, 1.0, 1.0)

@njit
def _look(table, step, x):
    """Linear look-up in a table on a uniform grid symmetric about zero, extrapolated at its ends."""
    half = (table.size - 1) // 2
    p = x / step + half
    k = min(max(int(np.floor(p)), 0), table.size - 2)
    return table[k] + (p - k) * (table[k + 1] - table[k])

@njit
def _rub(force, dx, limit, stiff, dahl):
    if dahl:
        goal = limit if dx > 0.0 else -limit
        return goal + (force - goal) * np.exp(-abs(dx) * stiff)
    return min(max(force + stiff * dx, -limit), limit)

@njit
def _torque(x, x0, forces, law, fr, pos, neg, now):
    """Torque of spring and friction elements at x, the elements coming from x0; their new forces go to now."""
    step, spring, load, drag, mu, stiff, side, dahl = law
    total = _look(spring, step, x)
    for j in range(forces.size):
        limit = fr * (drag[j] + mu[j] * (pos if x > 0.0 else neg) * _look(load, step, side[j] * x))
        now[j] = _rub(forces[j], x - x0, limit, stiff[j], dahl)
        total += now[j]
    return total

@njit
def parallel_friction(q, fr, law, pos, neg):
    """Angle of a spring with friction elements beside it, driven by torque: Illinois steps to the root at each sample."""
    x, forces, now, res = 0.0, np.zeros(law[3].size), np.zeros(law[3].size), np.empty_like(q)
    for i in range(q.size):
        a, fa = x, _torque(x, x, forces, law, fr[i], pos, neg, now) - q[i]
        b, fb, move = a, fa, -1e-4 * np.sign(fa)
        while fa * fb > 0.0:
            b, move = b + move, 2.0 * move
            fb = _torque(b, x, forces, law, fr[i], pos, neg, now) - q[i]
        while abs(fb) > 1e-13 and abs(b - a) > 1e-14:
            c = b - fb * (b - a) / (fb - fa)
            fc = _torque(c, x, forces, law, fr[i], pos, neg, now) - q[i]
            a, fa = (b, fb) if fc * fb < 0.0 else (a, 0.5 * fa)
            b, fb = c, fc
        x = b
        forces[:] = now
        res[i] = x
    return res

@njit
def eyring(z, q, b):
    """Thermally activated creep dy/dz = b sinh((q - y)/b), exact for torque held between samples."""
    y, res = 0.0, np.zeros_like(q)
    for i in range(1, q.size):
        y = q[i] - 2.0 * b * np.arctanh(np.tanh((q[i] - y) / (2.0 * b)) * np.exp(z[i - 1] - z[i]))
        res[i] = y
    return res

@njit
def breakaway(q, fr, kinetic, static):
    """Slider that holds until |q - m| exceeds a static level, then jumps to the kinetic level."""
    m, event, res = 0.0, 0, np.empty_like(q)
    for i in range(q.size):
        if abs(q[i] - m) > static[event % static.size] * fr[i]:
            m = q[i] - np.sign(q[i] - m) * kinetic * fr[i]
            event += 1
        res[i] = m
    return res

@njit
def chip_hold(q, yields, gone):
    """Share of a chip's thickness by which one flank is held off: full from first contact, crushed between yields and gone."""
    left, res = 1.0, np.zeros_like(q)
    for i in range(q.size):
        if q[i] < -0.05:
            left = 1.0
        left = min(left, min(max((gone - q[i]) / (gone - yields), 0.0), 1.0))
        res[i] = left * min(max(q[i] / 0.1, 0.0), 1.0)
    return res

# ---------------------------------------------------------------- reducers
@dataclass
class Reducer:
    family: str
    parts: list
    seal: float
    seal_drag: float
    scale: float = 1.0
    half: float = 1.0

    def angle(self, run):
        q, fr = run.q, run.fr
        body = sum(part(q, fr, run.pos, run.neg) for part in self.parts)
        return self.scale * (body + self.seal * wedge_play(q, fr, self.seal_drag, 0.0, 0.0, 1.0, 1.0))

def inverse_law(torque_of):
    """Deflection as an odd function of the moment, from a rising torque law on x >= 0."""
    x = 6.0 * np.linspace(0.0, 1.0, 6001) ** 1.5
    m = torque_of(x)
    return lambda v: np.sign(v) * np.interp(np.abs(v), m, x)

def planetary_sharing(rng):
    def stage(weight):
        drag, mu, n = log_uniform(rng, 0.008, 0.06), uniform(rng, 0.02, 0.12), uniform(rng, 1.05, 1.5)
        gap, cross = uniform(rng, 0.1, 0.8), uniform(rng, 0.01, 0.04)
        gaps = gap * (1.0 + 0.4 * np.sort(rng.random(int(rng.integers(3, 6)))))
        law = inverse_law(lambda x: cross / gap * x + np.mean(np.maximum(x[:, None] - gaps, 0.0) ** n, axis=1))
        return lambda q, fr, pos, neg: weight * law(wedge_play(q, fr, drag, mu, mu, pos, neg))
    return [stage(w) for w in rng.dirichlet(np.full(int(rng.integers(2, 5)), 3.0))]

def two_sided(law):
    x = np.linspace(-6.0, 6.0, 12001)
    return x[1] - x[0], law(x)

def strain_wave(rng):
    soft, width, hard = uniform(rng, 0.3, 0.75), uniform(rng, 0.1, 0.3), uniform(rng, 0.1, 0.6)
    step, raw = two_sided(lambda x: x - soft * width * np.tanh(x / width) + hard * x**3)
    spring = raw / np.interp(1.0, np.linspace(-6, 6, raw.size), raw)
    n = int(rng.integers(8, 17))
    drag = uniform(rng, 0.05, 0.2) * rng.dirichlet(np.full(n, 2.0))
    mu, stiff = uniform(rng, 0.2, 1.3) * drag, drag / np.exp(rng.uniform(np.log(0.01), np.log(0.2), n))
    law = (step, spring, np.abs(spring), drag, mu, stiff, np.ones(n), False)
    return [lambda q, fr, pos, neg: parallel_friction(q, fr, law, pos, neg)]

def cycloid_pins(rng):
    lever = np.cos(np.linspace(0.1, 1.4, 10))
    gaps = uniform(rng, 0.1, 0.35) * (0.4 + 0.6 * rng.random(10)) * lever
    n, cross = uniform(rng, 1.1, 1.5), uniform(rng, 0.015, 0.05)
    def pins(x):
        return np.sign(x) * np.sum(lever * np.maximum(np.abs(x)[:, None] * lever - gaps, 0.0) ** n, axis=1)
    step, spring = two_sided(lambda x: cross * np.clip(x / 0.3, -1.0, 1.0) + 0.02 * x + pins(x) / pins(np.ones(1)))
    drag, mu, grip = rng.uniform(0.02, 0.08, 1), rng.uniform(0.03, 0.12, 1), np.full(1, 1.0 / log_uniform(rng, 0.008, 0.04))
    law = (step, spring, np.abs(spring), drag, mu, grip, np.ones(1), True)
    return [lambda q, fr, pos, neg: parallel_friction(q, fr, law, pos, neg)]

def split_preload(rng):
    preload, n, bed = uniform(rng, 0.15, 0.4), uniform(rng, 1.05, 1.4), uniform(rng, 0.05, 0.15)
    start = uniform(rng, 0.08, 0.25)
    def contact(x):
        return preload * np.maximum(1.0 + x / start, 0.0) ** n
    step, spring = two_sided(lambda x: contact(x) - contact(-x) + bed * x)
    share = rng.dirichlet(np.full(6, 2.0))
    drag, mu = uniform(rng, 0.01, 0.04) * share, uniform(rng, 0.04, 0.15) * share
    stiff = (drag + mu * preload) / np.exp(rng.uniform(np.log(0.004), np.log(0.25 * start), 6))
    law = (step, spring, two_sided(contact)[1], *(np.tile(v, 2) for v in (drag, mu, stiff)), np.repeat([1.0, -1.0], 6), False)
    return [lambda q, fr, pos, neg: parallel_friction(q, fr, law, pos, neg)]

def worm_wedge(rng):
    drag, out, back = log_uniform(rng, 0.01, 0.05), uniform(rng, 0.08, 0.3), uniform(rng, 0.1, 0.4)
    gap, cross, n = uniform(rng, 0.1, 0.6), uniform(rng, 0.01, 0.04), uniform(rng, 1.05, 1.4)
    teeth = inverse_law(lambda x: cross / gap * x + np.maximum(x - gap, 0.0) ** n)
    seat, part = uniform(rng, 0.25, 0.55), uniform(rng, 0.3, 1.0)
    axial = inverse_law(lambda y: 0.6 * y + 2.5 * np.maximum(y - seat, 0.0) ** 1.2)
    def worm(q, fr, pos, neg):
        m = wedge_play(q, fr, drag, out, back, pos, neg)
        return teeth(m) + part * axial(m)
    return [worm]

def spur_relays(rng):
    n = int(rng.integers(4, 8))
    drags = log_uniform(rng, 0.02, 0.06) * np.exp(0.4 * rng.standard_normal(n))
    widths, gaps = rng.uniform(0.01, 0.05, n), uniform(rng, 0.1, 0.6) * rng.dirichlet(np.full(n, 3.0))
    drag, mu, hard = log_uniform(rng, 0.005, 0.03), uniform(rng, 0.02, 0.12), uniform(rng, 0.0, 0.5)
    radii, weights = np.linspace(0.02, uniform(rng, 0.15, 0.35), 8), uniform(rng, 0.1, 0.35) * rng.dirichlet(np.ones(8))
    def train(q, fr, pos, neg):
        m = wedge_play(q, fr, drag, mu, mu, pos, neg)
        x = (1.0 - hard) * m + hard * 0.5 * np.tanh(m / 0.5)
        for d, width, gap in zip(drags, widths, gaps, strict=True):
            x = x + gap * np.tanh(wedge_play(q, fr, d, 0.0, 0.0, pos, neg) / width)
        for r, w in zip(radii, weights, strict=True):
            x = x + w * wedge_play(q, fr, r, 0.0, 0.0, pos, neg)
        return x
    return [train]

def hypoid_duhem(rng):
    gap, width, hard = uniform(rng, 0.1, 0.6), uniform(rng, 0.04, 0.12), uniform(rng, 0.0, 0.6)
    direct, memory = uniform(rng, 0.3, 0.8), uniform(rng, 24.0, 50.0)
    def films(q, fr, pos, neg):
        law = gap * np.tanh(q / width) + (1.0 - hard) * q + 0.4 * hard * np.arcsinh(q / 0.4)
        slid = np.cumsum(memory * np.abs(np.diff(q, prepend=q[0])) / (fr * np.where(q > 0.0, pos, neg)))
        return direct * law + (1.0 - direct) * lagged(slid, law, 0.0)
    return [films]

FAMILIES = (planetary_sharing, strain_wave, cycloid_pins, split_preload, worm_wedge, spur_relays, hypoid_duhem)

def make_reducer(family, rng):
    parts = family(rng)
    red = Reducer(family.__name__, parts, uniform(rng, 0.08, 0.3), log_uniform(rng, 0.04, 0.12))
    path = settled_path(1.0, 1.0)
    shape = loop_indicators(path.q, red.angle(Run(path, 0, path.q, np.ones_like(path.q))))
    red.scale = log_uniform(rng, 0.3, 40.0) * ARCMIN / shape["lost_motion_rad"]
    red.half = shape["peak_rad"] * red.scale
    return red

# ---------------------------------------------------------------- paths and records
def wave(look, u):
    if look["style"] == "sine":
        return np.sin(2.0 * np.pi * u)
    if look["style"] == "stairs":
        stair = 4 * look["steps"] * u
        return triangle((np.floor(stair) + np.minimum(stair % 1.0 / (1.0 - look["dwell"]), 1.0)) / (4 * look["steps"]))
    s, r = triangle(u), look["round"] if look["style"] == "rounded" else 1e-9
    y = np.abs(s)
    return np.sign(s) * np.where(y > 1.0 - r, 1.0 - r / 2 - (1.0 - y) ** 2 / (2 * r), y) / (1.0 - r / 2)

def make_path(rng, look, amplitude, rate, n):
    """Local rate: that at which sliding goes on, held through dwells, never below 0.3 of the mean."""
    first, step = 1.25 if look["start"] == "tip" else 0.0, look["cycles"] / (n - 1)
    keep = int(round(first / step))
    u = first + step * np.arange(-keep, n)
    u[1:-1] += (0.3 if look["unequal"] else 0.0) * step * rng.uniform(-1.0, 1.0, u.size - 2)
    u[0] = 0.0
    t, q = (u - first) * 4.0 * amplitude / rate, amplitude * wave(look, u)
    local = np.full_like(t, rate / (1.0 - look["dwell"]) if look["style"] == "stairs" else rate)
    if look["style"] in ("sine", "rounded"):
        local = np.maximum(np.abs(np.gradient(q, t)), 0.3 * rate)
    return Trace(t, q, u, local, keep, amplitude, rate)

def draw_look(rng):
    return {"style": str(rng.choice(["triangle", "sine", "stairs", "rounded"], p=[0.52, 0.16, 0.16, 0.16])),
            "start": str(rng.choice(["rest", "tip"], p=[0.6, 0.4])), "cycles": float(rng.choice([2.0, 2.0, 2.5, 3.0])),
            "unequal": bool(rng.random() < 0.2), "round": uniform(rng, 0.1, 0.4), "steps": int(rng.integers(6, 15)),
            "dwell": uniform(rng, 0.25, 0.6), "correlated": max(uniform(rng, -0.9, 0.6), 0.0), "length": uniform(rng, 2.0, 8.0),
            "torque_noise": uniform(rng, 0.05, 0.25), "lsb": max(uniform(rng, -4.0, 2.0), 0.0)}

def draw_records(rng, look):
    """Records in order on the bench clock; the fastest a cycle of 10-60 s (at rated torque), rates spanning 3 to 30."""
    n, clock, done = int(rng.integers(2, 5)), 0.0, 0.0
    amplitudes = np.where(rng.random(n) < pick(rng, 0.0, 0.6), rng.uniform(0.5, 0.95, n), 1.0)
    amplitudes[int(rng.integers(n))] = 1.0
    spread = np.r_[0.0, 1.0, np.arange(1, n - 1) / (n - 1) + rng.uniform(-0.1, 0.1, n - 2)]
    rates = rng.permutation(4.0 / uniform(rng, 10.0, 60.0) * log_uniform(rng, 3.0, 30.0) ** -spread)
    paths = [make_path(rng, look, float(a), float(r), int(log_uniform(rng, 1500, 8000)))
             for a, r in zip(amplitudes, rates, strict=True)]
    for p in paths:
        p.clock, p.done = clock - p.t[0], done
        clock, done = p.clock + p.t[-1] + uniform(rng, 5.0, 60.0), done + p.u[-1]
    return paths

def draw_unit(rng, family, turn):
    look, reducer = draw_look(rng), make_reducer(family, rng)
    return Unit(reducer, draw_records(rng, look), look, log_uniform(rng, 0.1, 500.0), log_uniform(rng, 300.0, 2000.0),
                reducer.half * uniform(rng, -2.0, 2.0), turn)

# ---------------------------------------------------------------- effects
def interface_slip(rng, unit):
    kind, edge, power = unit.kind("fixed_threshold", "kinematic"), uniform(rng, 0.74, 0.9), uniform(rng, 1.0, 1.6)
    if kind == "kinematic":
        return Effect({"kind": kind, "threshold": 0.6 + 0.4 * edge}, BODY,
                      adding(unit, lambda run: play(run.q, 0.6 + 0.4 * edge)), 0.8)
    return Effect({"kind": kind, "threshold": edge, "power": power}, BODY,
                  adding(unit, lambda run: clamp_slip(run.q, edge, power)), 0.8)

def viscoelastic_creep(rng, unit):
    kind = unit.kind("kelvin", "two_kelvins", "eyring")
    tau, b = unit.mean_period * log_uniform(rng, 0.02, 0.4), uniform(rng, 0.08, 0.3)
    laws = {"kelvin": lambda t, q: lagged(t / tau, q, 0.0), "eyring": lambda t, q: eyring(t / tau, q, b),
            "two_kelvins": lambda t, q: 0.5 * lagged(t / tau, q, 0.0) + 0.5 * lagged(t / (7.0 * tau), q, 0.0)}
    return Effect({"kind": kind, "tau_s": tau, "activation": b}, BODY,
                  adding(unit, lambda run: laws[kind](run.path.t, run.q)), 0.7)

def asymmetric_stiffness(rng, unit):
    kind, sign, n = unit.kind("flank_in_series", "one_sided_compliance"), pick(rng, -1.0, 1.0), uniform(rng, 1.0, 1.5)
    drag, mu = uniform(rng, 0.01, 0.04), uniform(rng, 0.02, 0.08)
    def flank(run):
        if kind == "flank_in_series":
            return sign * np.maximum(sign * wedge_play(run.q, run.fr, drag, mu, mu, 1.0, 1.0), 0.0) ** n
        return sign * np.maximum(sign * run.theta, 0.0) / unit.reducer.half
    return Effect({"kind": kind, "side": sign, "power": n}, BODY, adding(unit, flank), 0.6)

def second_backlash(rng, unit):
    kind, drag = unit.kind("free_step", "shared_teeth"), uniform(rng, 0.3, 0.55)
    width = uniform(rng, 0.004, 0.015) if kind == "free_step" else uniform(rng, 0.04, 0.12)
    meet = np.tanh if kind == "shared_teeth" else lambda m: np.clip(m, -1.0, 1.0)
    return Effect({"kind": kind, "drag": drag, "width": width}, BODY,
                  adding(unit, lambda run: meet(play(run.q, drag) / width)), 0.4)

def sensor_lag(rng, unit):
    kind, unit_s = unit.kind("delay", "first_order"), min(p.period for p in unit.paths)
    late = {"delay": lambda t, x, tau: np.interp(t - tau, t, x), "first_order": lambda t, x, tau: lagged(t / tau, x, x[0])}
    return Effect({"kind": kind, "unit_s": unit_s}, LAG,
                  lambda run, s: replace(run, theta=late[kind](run.path.t, run.theta, s * unit_s)), 0.06)

def thermal_drift(rng, unit):
    kind, total = unit.kind("linear", "warm_up", "room_cycle"), unit.paths[-1].clock + unit.paths[-1].t[-1]
    sign, phase, share = pick(rng, -1.0, 1.0), uniform(rng, 0.0, 2 * np.pi), uniform(rng, 0.15, 0.6)
    tau = {"linear": total, "warm_up": total * share,
           "room_cycle": max(p.t[-1] for p in unit.paths) * (0.4 + 2.5 * share)}[kind]
    shape = {"linear": lambda z: z, "warm_up": lambda z: -np.expm1(-z), "room_cycle": lambda z: np.sin(2 * np.pi * z + phase)}
    return Effect({"kind": kind, "tau_s": float(tau), "sign": sign}, TIME,
                  adding(unit, lambda run: sign * shape[kind]((run.path.clock + run.path.t) / tau)), 1.5)

def torque_offset(rng, unit):
    kind, sign = unit.kind("dead_weight", "zero_shift"), pick(rng, -1.0, 1.0)
    share = sign * (np.ones(len(unit.paths)) if kind == "dead_weight" else rng.uniform(0.4, 1.0, len(unit.paths)))
    return Effect({"kind": kind, "share": share.tolist()}, LOAD,
                  lambda run, s: replace(run, q=run.q + s * share[run.index]), 0.15)

def encoder_error(rng, unit):
    kind, waves = unit.kind("single", "with_harmonic"), uniform(rng, 3.0, 14.0)
    second = uniform(rng, 0.3, 0.8) if kind == "with_harmonic" else 0.0
    phases, period = rng.uniform(0.0, 2 * np.pi, 2), 2.0 * unit.reducer.half / waves
    def ripple(run):
        turn = 2 * np.pi * (run.theta + unit.zero) / period
        return np.sin(turn + phases[0]) + second * np.sin(2 * turn + phases[1])
    return Effect({"kind": kind, "period_rad": period, "second": second}, CODE, adding(unit, ripple), 0.2)

def stick_slip(rng, unit):
    kind, red = unit.kind("regular", "irregular"), unit.reducer
    spread, drag = np.exp((0.25 if kind == "irregular" else 0.0) * rng.standard_normal(211)), red.seal_drag
    def act(run, s):
        jumps = breakaway(run.q, run.fr, drag * (1.0 - s), drag * (1.0 - s + 2.0 * s * spread))
        smooth = wedge_play(run.q, run.fr, drag, 0.0, 0.0, 1.0, 1.0)
        return replace(run, theta=run.theta + red.scale * red.seal * (jumps - smooth))
    return Effect({"kind": kind, "mean_drag": drag}, BODY, act, 0.9)

def rate_dependent_friction(rng, unit):
    kind, sign, rates = unit.kind("logarithmic", "stribeck"), pick(rng, -1.0, 1.0), np.array([p.rate for p in unit.paths])
    middle = float(np.exp(np.mean(np.log(rates))))
    change = np.log if kind == "logarithmic" else lambda z: np.exp(-z) - 0.4
    limit = 0.9 / float(np.abs(np.log(rates / middle)).max()) if kind == "logarithmic" else 1.4
    return Effect({"kind": kind, "sign": sign, "middle_rate_per_s": middle}, LOAD, lambda run, s: replace(
        run, fr=run.fr * np.clip(1.0 + sign * s * change(run.path.local / middle), 0.1, 4.0)), limit)

def x_running_in_wear(rng, unit):
    kind, settle = unit.kind("saturating", "steady"), uniform(rng, 1.0, 4.0)
    drag, width = uniform(rng, 0.02, 0.06), uniform(rng, 0.02, 0.06)
    def worn(run):
        cycles = run.path.done + run.path.u
        return (-np.expm1(-cycles / settle) if kind == "saturating" else cycles / 3.0) * np.tanh(play(run.q, drag) / width)
    return Effect({"kind": kind, "settle_cycles": settle, "drag": drag}, BODY, adding(unit, worn), 0.6)

def x_coupling_jump(rng, unit):
    kind, n = unit.kind("once", "each_record"), len(unit.paths)
    place, height = rng.uniform(0.25, 0.75, n), rng.choice([-1.0, 1.0], n) * rng.uniform(0.6, 1.0, n)
    if kind == "once":
        height *= np.arange(n) == rng.integers(n)
    return Effect({"kind": kind, "place": place.tolist(), "height": height.tolist()}, TIME, adding(
        unit, lambda run: height[run.index] * (run.path.t > place[run.index] * run.path.t[-1])), 0.5)

def x_floor_vibration(rng, unit):
    kind, phase, bursts = unit.kind("machine", "bursts"), uniform(rng, 0.0, 2 * np.pi), rng.random((len(unit.paths), 5, 1))
    period = min(p.period for p in unit.paths) / uniform(rng, 12.0, 40.0)
    def hum(run):
        t, z = run.path.t, run.path.t / run.path.t[-1]
        swell = np.exp(-0.5 * ((z - bursts[run.index]) / 0.03) ** 2).sum(axis=0)
        return np.sin(2 * np.pi * t / period + phase) * (
            1.0 + 0.4 * np.sin(2 * np.pi * t / (9.3 * period)) if kind == "machine" else swell)
    return Effect({"kind": kind, "period_s": period}, TIME, adding(unit, hum), 0.3)

def x_chip_in_mesh(rng, unit):
    kind, side, yields = unit.kind("snap", "crush"), pick(rng, -1.0, 1.0), uniform(rng, 0.25, 0.6)
    gone = yields + (0.01 if kind == "snap" else uniform(rng, 0.1, 0.25))
    return Effect({"kind": kind, "side": side, "yields": yields, "gone": gone}, BODY,
                  adding(unit, lambda run: -side * chip_hold(side * run.q, yields, gone)), 0.4)

def x_thixotropic_grease(rng, unit):
    kind, cycles = unit.kind("time", "work"), uniform(rng, 0.5, 1.5)
    age = {"time": lambda p: (p.t - p.t[0]) / (cycles * unit.mean_period), "work": lambda p: p.u / cycles}[kind]
    return Effect({"kind": kind, "cycles": cycles, "tau_s": cycles * unit.mean_period}, LOAD,
                  lambda run, s: replace(run, fr=run.fr * (1.0 + s * np.exp(-age(run.path)))), 2.5)

def x_scuffed_flank(rng, unit):
    flank = unit.kind("pos", "neg")
    return Effect({"kind": flank}, LOAD, lambda run, s: replace(run, **{flank: 1.0 + s}), 2.5)

def x_warming_softens(rng, unit):
    kind, tau = unit.kind("warm_up", "steady"), uniform(rng, 0.5, 1.5) * unit.mean_period
    warm = {"warm_up": lambda z: -np.expm1(-z), "steady": lambda z: z / 4.0}[kind]
    return Effect({"kind": kind, "tau_s": tau}, BODY, lambda run, s: replace(
        run, theta=run.theta * (1.0 + s * warm((run.path.t - run.path.t[0]) / tau))), 0.6)

def x_stalled_interface(rng, unit):
    kind, often, n = unit.kind("random", "periodic"), uniform(rng, 2.0, 6.0), len(unit.paths)
    waits = 1.0 + (0.7 if kind == "random" else 0.0) * rng.uniform(-1.0, 1.0, (n, 64))
    waits[:, 0] = rng.random(n)
    def act(run, s):
        t, held = run.path.t, run.path.t.copy()
        for a in np.cumsum(waits[run.index]) * run.path.period / often:
            held[(t >= a) & (t < a + s * run.path.period)] = a
        return replace(run, theta=np.interp(held, t, run.theta))
    return Effect({"kind": kind, "per_cycle": often}, LAG, act, 0.3 / often)

LISTED = (interface_slip, viscoelastic_creep, asymmetric_stiffness, second_backlash, sensor_lag, thermal_drift,
          torque_offset, encoder_error, stick_slip, rate_dependent_friction)
UNLISTED = (x_running_in_wear, x_coupling_jump, x_floor_vibration, x_chip_in_mesh, x_thixotropic_grease, x_scuffed_flank,
            x_warming_softens, x_stalled_interface)
TRACES = (torque_offset, sensor_lag, thermal_drift, encoder_error)
OUTSIDE = {f.__name__ for f in TRACES + (x_coupling_jump, x_floor_vibration, x_stalled_interface)}

BENCH = Bench(111, FAMILIES, LISTED, tuple((f, s) for f in UNLISTED for s in SIZES[:2]), TRACES, OUTSIDE, draw_unit)

if __name__ == "__main__":
    BENCH.main()
