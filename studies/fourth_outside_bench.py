"""A fourth virtual bench written without sight of the package: implicit multibody dynamics of six kinds of reducer.

    python studies/fourth_outside_bench.py /tmp/fourth --units 80 --seed 31
    python studies/fourth_outside_bench.py /tmp/fourth --selfcheck --seed 31

It imports nothing of the package and stands in one file, so that it can be read and judged apart. Two-stage gear trains,
strain-wave, pin-cycloid, plastic, split-gear (anti-backlash) and worm drives are chains of bodies with inertia, joined by
unilateral contacts with scattered gaps and by frictional bristles (elasto-plastic, Dahl, static/kinetic). The equations of
motion are stepped by backward Euler with a damped Newton solve in every step; inertias are small enough that a clean unit is
practically rate independent, and every unit is checked for that when it is drawn.

OUT/key.json holds, per case, the effects, their severity (rms over the angle's noise 20, 6, 2.5 after a refit of what a clean
unit's own parameters absorb) and the clean reducer's indicators at the rated torque. With --selfcheck closure, oddness, rate
independence, step halving and the effects' sizes are printed and nothing is written.

Inside, torque m is in rated torques, angle in settled peaks of the clean unit, time in seconds; SI at the door.
"""
import argparse
import gzip
import json
import lzma
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numba  # noqa: E402
import numpy as np  # noqa: E402
from scipy.signal import lfilter  # noqa: E402

TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
CHANNEL = ["sensor_lag", "thermal_drift", "torque_offset", "encoder_error"]
LISTED = CHANNEL + ["interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "stick_slip",
                    "rate_dependent_friction"]
UNLISTED = ["x_ratchet", "x_one_sided_snap", "x_floor_vibration", "x_count_loss", "x_debris", "x_run_in", "x_loosening"]
ARCMIN = np.pi / 10800
STEPS = 3000  # time steps per cycle
SPRING, CONTACT, PLASTIC, DAHL, STICK = 0, 1, 2, 3, 4
TYPE, LO, HI, STIFF, GAP, EXPO, SOFT, FC, MU, GROUP, ARM = range(11)  # columns of an element table; LO = -1 is ground


# ---------------------------------------------------------------------------------------------------------- mechanics
@numba.njit(cache=True)
def element(row, q, q0, z0, lim, grow, asym):
    """Torque and tangent of one element at relative angle q (q0, z0: angle and bristle deflection of the last step)."""
    kind = int(row[TYPE])
    k = row[STIFF]
    if kind == SPRING:
        k *= 1 + asym if q > 0 else 1 - asym
        return k * q * (1 + row[SOFT] * q * q), k * (1 + 3 * row[SOFT] * q * q)
    if kind == CONTACT:
        f, s, a = 0.0, 0.0, row[ARM]
        for side in (1.0, -1.0):
            p = side * a * q - (row[GAP] + grow)
            if p > 0:
                ks = k * (1 + side * asym)
                if row[EXPO] == 1.0:
                    g, d = ks * p, ks
                else:
                    d = ks * p ** (row[EXPO] - 1)
                    g, d = d * p, d * row[EXPO]
                if row[SOFT] > 0:  # polymer flank: hyperbolic softening
                    h = 1 + row[SOFT] * p
                    g, d = g / h, d / h - g * row[SOFT] / (h * h)
                f += side * a * g
                s += a * a * d
        return f, s
    if lim <= 0:
        return 0.0, 0.0
    zc = lim / k
    z0 = min(max(z0, -zc), zc)
    dq = q - q0
    if kind == DAHL:
        if dq == 0:
            return k * z0, k
        sign = 1.0 if dq > 0 else -1.0
        decay = np.exp(-abs(dq) / zc)
        return k * (sign * zc + (z0 - sign * zc) * decay), k * (1 - sign * z0 / zc) * decay
    z = z0 + dq
    if z > zc:
        return lim, 0.0
    if z < -zc:
        return -lim, 0.0
    return k * z, k


@numba.njit(cache=True)
def assemble(xn, x, v, dt, load, tab, z, lim, grow, asym, mass, damp, r, K):
    """Residual and tangent of one backward Euler step; returns the largest residual."""
    n = len(x)
    K[:] = 0
    for i in range(n):
        r[i] = mass[i] * (xn[i] - x[i] - v[i] * dt) / (dt * dt) + damp * (xn[i] - x[i]) / dt
        K[i, i] = mass[i] / (dt * dt) + damp / dt
    r[n - 1] -= load
    for e in range(len(tab)):
        i, j = int(tab[e, LO]), int(tab[e, HI])
        q, q0 = (xn[j] - xn[i], x[j] - x[i]) if i >= 0 else (xn[j], x[j])
        f, s = element(tab[e], q, q0, z[e], lim[e], grow, asym)
        r[j] += f
        K[j, j] += s
        if i >= 0:
            r[i] -= f
            K[i, i] += s
            K[i, j] -= s
            K[j, i] -= s
    return np.max(np.abs(r))


@numba.njit(cache=True)
def march(t, m, tab, mass, damp, friction, growth, asym, over, under, restick, law, strength, v_ref):
    """Output angle over the path, and the worst residual.

    friction, growth: per step, factor of all friction limits and addition to all gaps. over, under, restick: static and
    kinetic excess of STICK elements and the speed below which they stick again. law: 0 none, 1 logarithmic, 2 Stribeck,
    3 viscous.
    """
    n, ne = len(mass), len(tab)
    x, v, z, lim, load = np.zeros(n), np.zeros(n), np.zeros(ne), np.zeros(ne), np.zeros(8)
    slide = np.zeros(ne)
    r, K, xt = np.zeros(n), np.zeros((n, n)), np.zeros(n)
    out = np.empty(len(m))
    worst, speed = 0.0, v_ref
    for s in range(len(m)):
        dt = t[s] - t[s - 1] if s > 0 else t[1] - t[0]
        fac = friction[s]
        if law == 1:
            fac *= min(max(1 + strength * np.log10((speed + 1e-3 * v_ref) / v_ref), 0.15), 3.0)
        elif law == 2:
            fac *= 1 + strength * (np.exp(-speed / v_ref) - 0.4)
        elif law == 3:
            fac *= 1 + strength * speed / v_ref
        for e in range(ne):
            kind = int(tab[e, TYPE])
            if kind >= PLASTIC:
                lim[e] = fac * (tab[e, FC] + tab[e, MU] * load[int(tab[e, GROUP])])
                if kind == STICK:
                    lim[e] = max(lim[e] + (over if slide[e] == 0 else -under), 1e-4)
        guess = x + v * dt
        xn = guess
        res = assemble(xn, x, v, dt, m[s], tab, z, lim, growth[s], asym, mass, damp, r, K)
        for _ in range(80):
            if res < 1e-9:
                break
            d = r.copy()
            A = K.copy()
            for i in range(n):  # Gauss; the tangent is positive definite
                for j in range(i + 1, n):
                    w = A[j, i] / A[i, i]
                    for c in range(i, n):
                        A[j, c] -= w * A[i, c]
                    d[j] -= w * d[i]
            for i in range(n - 1, -1, -1):
                for c in range(i + 1, n):
                    d[i] -= A[i, c] * d[c]
                d[i] /= A[i, i]
            a = 1.0
            for _back in range(14):
                xt = xn - a * d
                new = assemble(xt, x, v, dt, m[s], tab, z, lim, growth[s], asym, mass, damp, r, K)
                if new < res * (1 - 1e-3 * a):
                    break
                a *= 0.5
            xn, res = xt, new
        worst = max(worst, res)
        load[:] = 0
        for e in range(ne):
            i, j = int(tab[e, LO]), int(tab[e, HI])
            q, q0 = (xn[j] - xn[i], x[j] - x[i]) if i >= 0 else (xn[j], x[j])
            f, _k = element(tab[e], q, q0, z[e], lim[e], growth[s], asym)
            kind = int(tab[e, TYPE])
            if kind == CONTACT:
                side = tab[e, ARM] * q  # normal load: both flanks count where the gap is negative
                up = element(tab[e], abs(q), abs(q), 0.0, 0.0, growth[s], 0.0)[0]
                pre = -tab[e, GAP] - growth[s] - abs(side)
                load[int(tab[e, GROUP])] += abs(up) + (2 * tab[e, STIFF] * pre ** tab[e, EXPO] if pre > 0 else 0.0)
            elif kind >= PLASTIC:
                z[e] = f / tab[e, STIFF]
                if kind == STICK:
                    if slide[e] == 0 and abs(f) >= lim[e] * (1 - 1e-9):
                        slide[e] = 1.0 if f > 0 else -1.0
                    elif slide[e] != 0 and ((q - q0) * slide[e] <= 0 or abs(q - q0) / dt < restick):
                        slide[e] = 0
        v = (xn - x) / dt
        speed += (abs(v[n - 1]) - speed) * 0.1
        x = xn.copy()
        out[s] = x[n - 1]
    return out, worst


class Reducer:
    """Element table, inertias; angles are divided by the clean settled peak."""

    def __init__(self, kind, rows, omega):
        self.kind, self.tab = kind, np.array(rows, float)
        self.n = int(self.tab[:, HI].max()) + 1
        self.omega, self.peak = omega, 1.0

    def run(self, t, m, friction=1.0, growth=0.0, gaps=1.0, asym=0.0, stick=(0.0, 0.0, 0.0), law=(0, 0.0, 1.0)):
        tab = self.tab.copy()
        tab[:, GAP] *= gaps
        mass = np.full(self.n, 1 / self.omega**2)
        ones = np.ones(len(m))
        out, self.worst = march(t, m, tab, mass, 0.02 / self.omega, ones * friction, ones * growth * self.peak, asym, stick[0],
                                stick[1], stick[2] * self.peak, law[0], law[1], law[2] * self.peak)
        return out / self.peak

    def loop(self, steps=STEPS, period=100.0, warm=2):
        """Settled loop: torque from -1 up to 1 (steps/2 + 1 points), ascending and descending angle on it."""
        s = np.linspace(0, 4 * warm + 7, (4 * warm + 7) * steps // 4 + 1)
        th = self.run(s * period / 4, fold(s))
        h = steps // 2
        self.closure = abs(th[-1 - h] - th[-1 - h - steps])
        up, down = th[-1 - h - h // 1: -h][: h + 1], th[-1 - h:][::-1]
        return np.linspace(-1, 1, h + 1), up, down


def indicators(red, k, steps=12000):
    """Indicators of the clean settled loop in relative units, by the definitions of method.md."""
    m, up, down = red.loop(steps, 400.0)
    mid, w, h = (up + down) / 2, down - up, len(m) // 2
    trap = lambda y, x: float(np.sum((y[1:] + y[:-1]) * np.diff(x)) / 2)  # noqa: E731
    area = trap(w, m)
    absorbed = trap(m[h:], up[h:]) + trap(m[: h + 1][::-1], down[: h + 1][::-1])
    return dict(lost=float(np.interp(k, m, mid) - np.interp(-k, m, mid)), w0=float(w[h]), area=area, absorbed=absorbed,
                u=area / absorbed, peak=float(up[-1] - down[0]) / 2)


# ----------------------------------------------------------------------------------------------------------- families
def lu(rng, a, b):
    return float(np.exp(rng.uniform(np.log(a), np.log(b))))


def mesh(rng, i, j, stiff, gap, count, expo, soft, group):
    """Tooth pairs of one mesh: scattered gaps, the first one an edge contact of low stiffness."""
    gaps = gap * np.sort(rng.uniform(0.75, 1.25, count)) if gap > 0 else gap * rng.uniform(0.6, 1.4, count)
    k = stiff / count * rng.uniform(0.6, 1.4, count)
    edge = (CONTACT, i, j, stiff * lu(rng, 0.03, 0.12), gap * rng.uniform(0.3, 0.6), 1.0, 0, 0, 0, group, 1)
    rows = [(CONTACT, i, j, k[p], gaps[p], expo, soft, 0, 0, group, 1) for p in range(count)]
    return rows + ([edge, film(rng, i, j, gap)] if gap > 0 else [])


def film(rng, i, j, gap):
    """Runout, cages and grease: a few per cent of the rated torque carry a body across its clearance."""
    return (SPRING, i, j, lu(rng, 0.012, 0.05) / gap, 0, 1, 0, 0, 0, 0, 1)


def friction(rng, i, j, fc, mu, group, reach, count, kind):
    """Bristles with spread break-away angles; limits fc + mu * normal load in all."""
    share, far = rng.dirichlet(np.full(count, 3.0)), reach * np.exp(rng.normal(0, 0.6, count))
    level = max(fc + 0.5 * mu, 1e-4)
    return [(kind, i, j, s * level / d, 0, 1, 0, s * fc, s * mu, group, 1) for s, d in zip(share, far, strict=False)]


def output_seal(rng, j, fc):
    return [(STICK, -1, j, fc / lu(rng, 0.01, 0.08), 0, 1, 0, fc, 0, 0, 1)]


def make_train(rng):
    """Two-stage spur or planetary train: two meshes, intermediate body with bearing, output shaft."""
    k1, k2, ks = lu(rng, 1.5, 6), lu(rng, 1.5, 4), lu(rng, 2, 10)
    gap = lu(rng, 0.01, 0.35)
    rows = mesh(rng, -1, 0, k1, gap * rng.uniform(0.2, 0.5), rng.integers(2, 6), rng.choice([1.0, 1.1, 1.2]), 0, 0)
    rows += mesh(rng, 0, 1, k2, gap * rng.uniform(0.5, 0.8), rng.integers(2, 6), rng.choice([1.0, 1.1]), 0, 1)
    rows += [(SPRING, 1, 2, ks, 0, 1, 0, 0, 0, 0, 1)]
    rows += friction(rng, -1, 0, lu(rng, 0.005, 0.05), lu(rng, 0.01, 0.1), 0, lu(rng, 0.03, 0.3), 3, DAHL)
    rows += friction(rng, 0, 1, lu(rng, 0.005, 0.05), lu(rng, 0.01, 0.15), 1, lu(rng, 0.03, 0.3), 3, PLASTIC)
    return rows + output_seal(rng, 2, lu(rng, 0.006, 0.06))


def make_strainwave(rng):
    """Wave generator with a small clearance, hardening flexspline, bristles in the toothed rim."""
    rows = mesh(rng, -1, 0, lu(rng, 4, 12), lu(rng, 0.002, 0.05), 3, 1.2, 0, 0)
    rows += friction(rng, -1, 0, lu(rng, 0.005, 0.04), lu(rng, 0.01, 0.06), 0, lu(rng, 0.02, 0.2), 3, PLASTIC)
    rows += [(SPRING, 0, 1, lu(rng, 0.6, 1.5), 0, 1, lu(rng, 0.05, 1.2), 0, 0, 0, 1)]
    rows += friction(rng, 0, 1, lu(rng, 0.02, 0.18), lu(rng, 0.003, 0.04), 0, lu(rng, 0.05, 0.6), 8, PLASTIC)
    rows += friction(rng, 0, 1, lu(rng, 0.01, 0.05), 0, 0, lu(rng, 0.02, 0.2), 2, DAHL)
    return rows + output_seal(rng, 1, lu(rng, 0.005, 0.04))


def make_cycloid(rng):
    """Disc on 10 to 30 pins with scattered gaps and Hertz exponents; then the pins of the output flange."""
    count, expo = int(rng.integers(10, 31)), rng.choice([10 / 9, 1.2, 1.5])
    arms = np.sin((np.arange(count) + rng.uniform(0.2, 0.8)) * np.pi / count)
    gap = lu(rng, 0.003, 0.2)
    gaps = gap * np.clip(rng.normal(1, rng.uniform(0.1, 0.35), count), 0.2, 2)
    k = lu(rng, 3, 10) / count
    rows = [(CONTACT, -1, 0, k, g, expo, 0, 0, 0, 0, a) for g, a in zip(gaps, arms, strict=False)]
    rows += [film(rng, -1, 0, gap)]
    rows += mesh(rng, 0, 1, lu(rng, 3, 8), gap * rng.uniform(0.1, 0.5), int(rng.integers(4, 9)), 1.1, 0, 1)
    rows += [(SPRING, 1, 2, lu(rng, 3, 12), 0, 1, 0, 0, 0, 0, 1)]
    rows += friction(rng, -1, 0, lu(rng, 0.01, 0.1), lu(rng, 0.01, 0.12), 0, lu(rng, 0.03, 0.3), 4, DAHL)
    rows += friction(rng, 0, 1, lu(rng, 0.005, 0.04), lu(rng, 0.01, 0.08), 1, lu(rng, 0.03, 0.3), 3, PLASTIC)
    return rows + output_seal(rng, 2, lu(rng, 0.005, 0.05))


def make_plastic(rng):
    """Two plastic meshes with softening tooth flexure and high friction."""
    rows, gap = [], lu(rng, 0.02, 0.3)
    for stage in range(2):
        rows += mesh(rng, stage - 1, stage, lu(rng, 1.5, 4), gap * rng.uniform(0.3, 0.7), rng.integers(2, 4), 1.0,
                     lu(rng, 0.1, 1.2), stage)
        rows += friction(rng, stage - 1, stage, lu(rng, 0.01, 0.06), lu(rng, 0.08, 0.5), stage, lu(rng, 0.05, 0.4), 4,
                         PLASTIC if rng.random() < 0.5 else DAHL)
    return rows + output_seal(rng, 1, lu(rng, 0.01, 0.08))


def make_split(rng):
    """Two counter-wound split gears: both flanks preloaded, preload lost tooth by tooth; friction grows with the preload."""
    k = lu(rng, 1.0, 3)
    rows = mesh(rng, -1, 0, k, -lu(rng, 0.02, 0.5) / k, int(rng.integers(3, 7)), rng.choice([1.0, 1.2]), 0, 0)
    rows += friction(rng, -1, 0, lu(rng, 0.005, 0.05), lu(rng, 0.02, 0.15), 0, lu(rng, 0.02, 0.2), 5, PLASTIC)
    rows += [(SPRING, 0, 1, lu(rng, 1.5, 8), 0, 1, lu(rng, 0.01, 0.3), 0, 0, 0, 1)]
    return rows + output_seal(rng, 1, lu(rng, 0.005, 0.06))


def make_worm(rng):
    """Worm with axial bearings (end play), wheel mesh near self-locking: friction follows the flank load."""
    rows = mesh(rng, -1, 0, lu(rng, 2, 6), lu(rng, 0.003, 0.06), 2, 1.2, 0, 0)
    rows += friction(rng, -1, 0, lu(rng, 0.01, 0.04), lu(rng, 0.02, 0.1), 0, lu(rng, 0.03, 0.2), 2, DAHL)
    rows += mesh(rng, 0, 1, lu(rng, 1.5, 4), lu(rng, 0.01, 0.2), int(rng.integers(2, 5)), 1.1, 0, 1)
    rows += friction(rng, 0, 1, lu(rng, 0.01, 0.06), rng.uniform(0.2, 0.75), 1, lu(rng, 0.05, 0.5), 5, PLASTIC)
    return rows + output_seal(rng, 1, lu(rng, 0.01, 0.06))


FAMILIES = {  # maker, peak angle in arcmin, rated torque in N*m
    "train": (make_train, (3, 40), (0.5, 600)), "strainwave": (make_strainwave, (0.5, 6), (3, 800)),
    "cycloid": (make_cycloid, (0.5, 8), (20, 1000)), "plastic": (make_plastic, (12, 60), (0.05, 8)),
    "split": (make_split, (0.8, 12), (0.3, 60)), "worm": (make_worm, (1.5, 25), (1, 300))}


def draw_reducer(rng, kind):
    """A reducer in the range of real ones whose settled loop closes and is odd."""
    k = 0.04 if kind == "strainwave" else 0.03
    while True:
        red = Reducer(kind, FAMILIES[kind][0](rng), lu(rng, 3e3, 2e4))
        m, up, down = red.loop(800)
        red.peak *= (up[-1] - down[0]) / 2
        q = indicators(red, k, STEPS)
        odd = np.max(np.abs(red.loop()[1] + red.loop()[2][::-1]))
        if 0.02 < q["u"] < 0.6 and q["lost"] < 0.4 and red.closure < 5e-5 and odd < 1e-4 and red.worst < 1e-6:
            red.k = k
            return red


# ----------------------------------------------------------------------------------------------------- torque and test
def fold(s):
    """Triangle wave of amplitude 1 over path length: 0 at 0, +1 at 1, -1 at 3."""
    return 1 - np.abs((s - 1) % 4 - 2) if np.isscalar(s) else 1 - 2 * np.abs(((s + 1) % 4) / 2 - 1)


def wave(style, s, levels):
    if style == "sine":
        return np.sin(np.pi / 2 * s)
    if style == "steps":
        x = s * levels
        b = np.clip((x - np.floor(x) - 0.6) / 0.4, 0, 1)
        return fold((np.floor(x) + b * b * (3 - 2 * b)) / levels)
    return fold(s)


def draw_records(rng):
    """Records of a unit, each a dict: time grid t (0 at its first sample), torque m, samples ts, period, amplitude, clock."""
    style = str(rng.choice(["triangle", "sine", "steps"], p=[0.72, 0.18, 0.1]))
    count = int(rng.choice([2, 3, 4], p=[0.2, 0.6, 0.2]))
    fast, decades = lu(rng, 8, 40), rng.uniform(1, 2)
    periods = fast * 10 ** (decades * np.linspace(0, 1, count))
    amps, plan = np.ones(count), "rated"
    if count > 2 and rng.random() < 0.35:
        periods[-1] = periods[int(rng.integers(0, count - 1))]
        amps[-1], plan = rng.choice([0.4, 0.5, 0.6, 0.7, 0.8]), "one smaller"
    order = rng.permutation(count)
    records, clock, levels = [], 0.0, int(rng.integers(5, 11))
    for p, a in zip(periods[order], amps[order], strict=False):
        start, cycles = str(rng.choice(["virgin", "zero", "anywhere"], p=[0.25, 0.35, 0.4])), int(rng.integers(2, 4))
        s0 = 0 if start != "anywhere" else rng.uniform(0, 4)
        warm = 0 if start == "virgin" else 8
        end = warm + s0 + 4 * cycles + (4 if start == "virgin" else rng.uniform(0, 1.5))
        s = np.linspace(0, end, int(end * STEPS / 4) + 1)
        if start == "virgin" and style != "sine":
            s = np.maximum(s, 0)
        t = s * p / 4
        t -= (warm + s0) * p / 4
        n = int(lu(rng, 400, 4000))
        ts = np.linspace(0, t[-1], n)
        if rng.random() < 0.15:
            ts = np.sort(np.clip(ts + rng.uniform(-0.3, 0.3, n) * ts[1], 0, t[-1]))
        records.append(dict(t=t, m=a * wave(style, s, levels), ts=ts, period=p, amp=a, clock=clock))
        clock += t[-1] + lu(rng, 20, 300)
    fast = min(r["period"] for r in records)
    slow = max(r["period"] for r in records)
    return records, style, plan, fast, slow


# ------------------------------------------------------------------------------------------------------------- effects
@numba.njit(cache=True)
def generalised_play(m, lower, upper):
    y, out = 0.0, np.empty(len(m))
    for i in range(len(m)):
        y = min(max(y, lower[i]), upper[i])
        out[i] = y
    return out


def play_set(m, halves, weights):
    return sum(w * generalised_play(m, m - h, m + h) for h, w in zip(halves, weights, strict=False))


@numba.njit(cache=True)
def centred_slip(steps, back):
    """Sum of slip steps; a weak centring slows slip away from the middle, so that it cannot walk off."""
    x, out = 0.0, np.empty(len(steps))
    for i in range(len(steps)):
        x += steps[i] * max(1 - 0.5 * back * x * np.sign(steps[i]), 0.0)
        out[i] = x
    return out


def kelvin(dt, drive, taus, weights):
    """Strain of Kelvin elements on a uniform time grid."""
    out = np.zeros(len(drive))
    for tau, w in zip(taus, weights, strict=False):
        a = np.exp(-dt / tau)
        out += w * lfilter([1 - a], [1, -a], drive)
    return out


def lagged(t, y, kind, tau):
    if kind == "delay":
        return np.interp(t - tau, t, y)
    if kind == "average":
        return sum(np.interp(t - w * tau, t, y) for w in np.linspace(0, 2, 9)) / 9
    dt = t[1] - t[0]
    tau, times = (tau / 2, 2) if kind == "second" else (tau, 1)
    a = np.exp(-dt / tau) if tau > 1e-3 * dt else 0.0
    b = (1 - a) * tau / dt
    for _ in range(times):  # exact for an input that is linear between the steps
        y = lfilter([1 - b, b - a], [1, -a], y, zi=[b * y[0]])[0]
    return y


def draw_form(rng, name, unit):
    """A form of the effect: its shape, first guess and cap of the strength."""
    f, fast, slow = dict(name=name, guess=0.05, cap=0.5), unit["fast"], unit["slow"]
    pick = lambda *names: str(rng.choice(names))  # noqa: E731
    if name == "interface_slip":
        f.update(form=pick("creeping", "patches"), thr=rng.uniform(0.55, 0.85), power=rng.uniform(0, 1.5))
        f["halves"] = np.clip((1 + f["thr"]) / 2 + rng.uniform(-0.04, 0.04, 4), 0.7, 0.95)
    elif name == "viscoelastic_creep":
        f.update(form=pick("one", "two", "broad"), on=pick("torque", "angle"))
        count = {"one": 1, "two": 2, "broad": 6}[f["form"]]
        mid, wide = lu(rng, 0.15 * fast, 0.4 * slow), 10 ** rng.uniform(0.5, 1)
        f["taus"] = mid * wide ** np.linspace(-1, 1, count) if count > 1 else np.array([mid])
        f["weights"] = rng.dirichlet(np.full(count, 6.0))
    elif name == "asymmetric_stiffness":
        f.update(form=pick("flanks", "key"), power=rng.choice([1.0, 1.3, 1.6]), cap=0.7, sign=rng.choice([-1, 1]))
    elif name == "second_backlash":
        f.update(form=pick("dragged", "preloaded"), at=rng.uniform(0.25, 0.6), band=rng.uniform(0.02, 0.08), guess=0.1)
    elif name == "sensor_lag":
        f.update(form=pick("delay", "first", "second", "average"), on=pick("angle", "angle", "torque"), guess=0.01 * fast,
                 cap=0.12 * fast)
    elif name == "thermal_drift":
        f.update(form=pick("zero", "zero", "compliance"), shape=pick("warm-up", "linear", "room"), sign=rng.choice([-1, 1]))
        f.update(tau=unit["duration"] * rng.uniform(0.1, 0.6), phase=rng.uniform(0, 6.28))
    elif name == "torque_offset":
        f.update(form=pick("constant", "rezeroed"), sign=rng.choice([-1, 1]), guess=0.02, cap=0.3,
                 share=rng.uniform(0.7, 1.3, 9))
    elif name == "encoder_error":
        f.update(form=pick("sine", "interpolation"), periods=lu(rng, 1.5, 14), phase=rng.uniform(0, 6.28, 2), guess=0.01,
                 cap=0.3, second=rng.uniform(0.2, 0.8))
    elif name == "stick_slip":
        f.update(form=pick("sawtooth", "break-away", "slow only", "joint"), guess=0.02, cap=0.3, seed=int(rng.integers(1 << 30)))
        typical = 4 / np.sqrt(fast * slow)
        f["restick"] = {"sawtooth": 60 / fast, "slow only": 2.0 * typical}.get(f["form"], 0.0)
    elif name == "rate_dependent_friction":
        f.update(form=int(rng.integers(1, 4)), guess=0.1, cap=0.9)
        f.update(sign=rng.choice([-1, 1]) if f["form"] == 1 else 1)
        typical = {1: np.sqrt(fast * slow), 2: np.sqrt(fast * slow), 3: fast}[f["form"]]
        f["v_ref"] = 4 / typical * lu(rng, 0.6, 1.6)
    elif name == "x_ratchet":
        f.update(thr=rng.uniform(0.3, 0.8), life=rng.uniform(1, 6), sign=rng.choice([-1, 1]))
    elif name == "x_one_sided_snap":
        f.update(at=rng.uniform(0.5, 0.85), back=rng.uniform(0.1, 0.35), sign=rng.choice([-1, 1]), guess=0.1)
    elif name == "x_floor_vibration":
        f.update(hertz=rng.uniform(5, 25) / fast, phase=rng.uniform(0, 6.28, 2), guess=0.02, cap=0.2)
    elif name == "x_count_loss":
        f.update(seed=int(rng.integers(1 << 30)), guess=0.05)
    elif name == "x_debris":
        f.update(at=rng.uniform(-0.6, 0.6), width=rng.uniform(0.06, 0.2), back=rng.uniform(0, 0.3))
    elif name == "x_run_in":
        f.update(life=rng.uniform(1.5, 8), cap=2.0, guess=0.2)
    elif name == "x_loosening":
        f.update(power=rng.uniform(0.6, 1.6))
    return f


def simulate(unit, index, effects, friction=1.0, gaps=1.0):
    """Angle (peaks) and measured torque on the record's time grid; effects: list of (form, strength)."""
    rec, red = unit["records"][index], unit["reducer"]
    t, m = rec["t"], rec["m"]
    dt, drive, opt = t[1] - t[0], m, {}
    clock = rec["clock"] + t
    done = np.clip(clock / unit["duration"], 0, 1)
    f_path, g_path = np.full(len(t), friction), np.zeros(len(t))
    has = {f["name"]: (f, s) for f, s in effects}
    for name, (f, s) in has.items():
        if name == "torque_offset":
            drive = m - s * f["sign"] * (f["share"][index] if f["form"] == "rezeroed" else 1)
        elif name == "asymmetric_stiffness" and f["form"] == "flanks":
            opt["asym"] = s * f["sign"]
        elif name == "stick_slip" and f["form"] != "joint":
            opt["stick"] = (s, 0.5 * s, f["restick"])
        elif name == "rate_dependent_friction":
            opt["law"] = (f["form"], s * f["sign"], f["v_ref"])
        elif name == "x_run_in":
            cycle = sum(r["t"][-1] / r["period"] for r in unit["records"][:index]) + np.maximum(t, 0) / rec["period"]
            f_path = f_path * (1 + s * np.exp(-cycle / f["life"]))
        elif name == "x_loosening":
            g_path = s * done ** f["power"]
    plain = not opt and drive is m and friction == 1.0 and gaps == 1.0 and not {"x_run_in", "x_loosening"} & set(has)
    if plain and "clean" in rec:
        th = rec["clean"].copy()
    else:
        th = red.run(t, drive, friction=f_path, growth=g_path, gaps=gaps, **opt)
    base, rise = th.copy(), np.diff(drive, prepend=drive[0])
    for name, (f, s) in has.items():
        if name == "interface_slip":
            if f["form"] == "patches":
                x = play_set(drive, f["halves"], np.full(4, 0.25 / (1 - f["halves"].mean())))
            else:
                far = np.clip((np.abs(drive) - f["thr"]) / (1 - f["thr"]), 0, None)
                x = centred_slip(far ** f["power"] * rise * (far > 0) * (rise * drive > 0) / (1 - f["thr"]), f["power"] + 1)
            th = th + s * x
        elif name == "viscoelastic_creep":
            th = th + s * kelvin(dt, drive if f["on"] == "torque" else base, f["taus"], f["weights"])
        elif name == "asymmetric_stiffness" and f["form"] == "key":
            th = th + s * f["sign"] * np.abs(drive) ** f["power"]
        elif name == "second_backlash":
            h = lambda x: np.clip(x, 0, 1) ** 2 * (3 - 2 * np.clip(x, 0, 1))  # noqa: E731
            a, b = f["at"], f["band"]
            if f["form"] == "dragged":
                th = th + s * generalised_play(drive, 2 * h((drive - a + b) / b) - 1, 1 - 2 * h((-drive - a + b) / b)) / 2
            else:
                th = th + s * (h((drive - a) / b) - h((-drive - a) / b)) / 2
        elif name == "stick_slip" and f["form"] == "joint":
            dice = np.random.default_rng([f["seed"], index])
            held, need, joint = drive[0], s, np.empty(len(drive))
            for i, x in enumerate(drive):  # a joint in series holds its torque until the difference breaks it
                if abs(x - held) > need:
                    held, need = x, s * dice.uniform(0.5, 1.5)
                joint[i] = held
            th = th + 0.5 * (joint - drive)
        elif name == "x_ratchet":
            d = f["sign"] * drive
            tired = np.exp(-np.maximum(t, 0) / rec["period"] / f["life"])
            x = np.cumsum(np.maximum(f["sign"] * rise, 0) * (d > f["thr"]) * tired)
            th = th + s * f["sign"] * x / (1 - f["thr"]) / 2
        elif name == "x_one_sided_snap":
            d = f["sign"] * drive
            on = generalised_play(d, np.clip((d - f["at"]) / 0.03, 0, 1), np.clip((d - f["at"] + f["back"]) / 0.03, 0, 1))
            th = th + s * f["sign"] * on
        elif name == "x_floor_vibration":
            w = 6.2832 * f["hertz"] * clock
            th = th + s * np.sin(w + f["phase"][0]) * (1 + 0.5 * np.sin(0.13 * w + f["phase"][1]))
        elif name == "x_count_loss":
            dice = np.random.default_rng([f["seed"], index])
            for _ in range(int(dice.integers(2, 6))):
                th = th + s * dice.choice([-1, 1]) * (t > dice.uniform(0.05, 0.95) * t[-1])
        elif name == "x_debris":
            th = th - s * np.exp(-((base - f["at"]) / f["width"]) ** 2 / 2) * np.where(rise > 0, 1, f["back"])
    if "thermal_drift" in has:
        f, s = has["thermal_drift"]
        shape = {"warm-up": 1 - np.exp(-clock / f["tau"]), "linear": clock / unit["duration"],
                 "room": np.sin(2.5 * clock / f["tau"] + f["phase"]) / 2}[f["shape"]]
        th = th + s * f["sign"] * shape * (1 if f["form"] == "zero" else th)
    if "encoder_error" in has:
        f, s = has["encoder_error"]
        x = np.pi * f["periods"] * th
        e = np.sin(x + f["phase"][0]) + (f["second"] * np.sin(2 * x + f["phase"][1]) if f["form"] == "interpolation" else 0)
        th = th + s * e
    if "sensor_lag" in has and has["sensor_lag"][1] > 0:
        f, s = has["sensor_lag"]
        if f["on"] == "angle":
            th = lagged(t, th, f["form"], s)
        else:
            m = lagged(t, m, f["form"], s)
    return th, m


def prepare(unit):
    """Clean angles, and the directions that a clean unit's own parameters absorb."""
    clean, basis = [], []
    for i, rec in enumerate(unit["records"]):
        rec.pop("clean", None)
        rec["clean"] = simulate(unit, i, [])[0]
        rec["at"] = lambda y, r=rec: np.interp(r["ts"], r["t"], y)
        gap = simulate(unit, i, [], gaps=1.05)[0] - rec["clean"]
        fric = simulate(unit, i, [], friction=1.05)[0] - rec["clean"]
        cols = [rec["at"](c) for c in (rec["clean"], rec["m"], rec["m"] ** 3, gap, fric)]
        own = np.zeros((len(unit["records"]), len(rec["ts"])))
        own[i] = 1
        basis.append(np.vstack([*cols, own]))
        clean.append(cols[0])
    a = np.concatenate(basis, 1).T
    scale = np.linalg.norm(a, axis=0)
    u, s, _ = np.linalg.svd(a[:, scale > 1e-9] / scale[scale > 1e-9], full_matrices=False)
    unit["basis"] = u[:, s > 1e-6 * s[0]]


def severity(unit, effects):
    """rms of (faulty - clean on the measured torque), clean parameters refitted, over the noise sd."""
    parts = []
    for i, rec in enumerate(unit["records"]):
        th, m = simulate(unit, i, effects)
        ref = rec["clean"] if m is rec["m"] else unit["reducer"].run(rec["t"], m)
        parts.append(rec["at"](th - ref))
    d = np.concatenate(parts)
    d = d - unit["basis"] @ (unit["basis"].T @ d)
    return float(np.sqrt(np.mean(d * d)) / unit["sd"])


def find_strength(unit, form, target):
    """Strength of the effect with the target severity (bracketed secant), or None beyond its cap."""
    s, lo, hi = min(form["guess"], form["cap"]), 0.0, np.inf
    for _ in range(16):
        sev = severity(unit, [(form, s)])
        if abs(sev / target - 1) < 0.03:
            return s
        lo, hi = (max(lo, s), hi) if sev < target else (lo, min(hi, s))
        new = s * np.clip(target / max(sev, 1e-9), 0.1, 8)
        if not lo < new < hi:
            new = (lo + hi) / 2 if np.isfinite(hi) else lo * 2
        if lo >= form["cap"]:
            return None
        s = min(new, form["cap"])
    return None


def draw_unit(rng, kind, quiet=1.0):
    """A reducer on a rig, clean unit practically rate independent."""
    while True:
        red = draw_reducer(rng, kind)
        records, style, plan, fast, slow = draw_records(rng)
        last = records[-1]
        sd = 2 * lu(rng, 2e-4, max(4e-3 * quiet, 4e-4))
        unit = dict(reducer=red, records=records, style=style, plan=plan, fast=fast, slow=slow, sd=sd,
                    duration=last["clock"] + last["t"][-1], rated=lu(rng, *FAMILIES[kind][2]),
                    peak=lu(rng, *FAMILIES[kind][1]) * ARCMIN)
        unit["drift"], unit["halving"] = rate_change(unit), step_change(unit)
        if unit["drift"] < 0.25 and unit["halving"] < 0.25:
            prepare(unit)
            return unit


def rate_change(unit, steps=STEPS):
    a, b = (np.concatenate(unit["reducer"].loop(steps, p)[1:]) for p in (unit["fast"], unit["slow"]))
    return float(np.sqrt(np.mean((a - b) ** 2)) / unit["sd"])


def step_change(unit):
    coarse, fine = (np.concatenate([b[::k] for b in unit["reducer"].loop(k * STEPS)[1:]]) for k in (1, 2))
    return float(np.sqrt(np.mean((fine - coarse) ** 2)) / unit["sd"])


def draw_soil(rng, unit, taken):
    """Traces of the channel effects, together below .3 noise."""
    soil = []
    share = rng.dirichlet(np.ones(len(CHANNEL))) ** 0.5 * rng.uniform(0.1, 0.28)
    for name, w in zip(CHANNEL, share, strict=False):
        form = draw_form(rng, name, unit)
        if name not in taken:
            s = form["guess"] * 0.1
            s *= w / max(severity(unit, [(form, s)]), 1e-9)
            soil.append((form, min(s, form["cap"])))
    total = severity(unit, soil)
    while total > 0.3:
        soil = [(f, 0.7 * s) for f, s in soil]
        total = severity(unit, soil)
    return soil, total


def build_case(seed, index, wanted):
    for attempt in range(60):
        rng = np.random.default_rng([seed, index, attempt])
        names = [n for n, _ in wanted]
        kind = list(FAMILIES)[(index + attempt) % len(FAMILIES)]
        unit = draw_unit(rng, kind, 0.75**attempt)
        effects = []
        for name, size in wanted:
            form = draw_form(rng, name, unit)
            s = find_strength(unit, form, TARGET[size])
            if s is None:
                break
            effects.append((form, s))
        else:
            total = severity(unit, effects) if effects else 0.0
            if effects and not 0.7 < total / np.linalg.norm([TARGET[size] for _, size in wanted]) < 1.5:  # no run-away pair
                continue
            soil, dirt = draw_soil(rng, unit, names)
            return unit, effects, soil, dict(total=total, soil=dirt, attempts=attempt + 1)
    raise RuntimeError(f"no unit found for {wanted}")


def deal(rng, units):
    """List of lists of (effect, size): 30 % clean, 45 % single, 13 % unlisted, 12 % pairs."""
    n_single, n_un, n_pair = round(0.45 * units), round(0.13 * units), round(0.12 * units)
    order, odd = rng.permutation(LISTED), rng.permutation(UNLISTED)
    sizes = np.array([1.0, 0.4, 0.2])
    cases = []
    for i in range(n_single):
        lap, slot = divmod(i, len(order))
        cases.append([(str(order[slot]), float(sizes[(slot + lap) % 3]))])
    cases += [[(str(odd[i % len(odd)]), float(sizes[(i // len(odd) + i) % 2]))] for i in range(n_un)]
    for _ in range(n_pair):
        cases.append([(str(n), float(rng.choice(sizes[:2]))) for n in rng.choice(LISTED, 2, replace=False)])
    cases += [[] for _ in range(units - len(cases))]
    return [cases[i] for i in rng.permutation(len(cases))]


# ------------------------------------------------------------------------------------------------------ files and key
DIALECTS = [  # column names of time, torque, angle; units per s, N*m, rad
    (None, 1, 1, 1 / ARCMIN), (None, 1, 1, 1 / ARCMIN), (("t [ms]", "M [mNm]", "phi [deg]"), 1e3, 1e3, 180 / np.pi),
    (("Time_s", "Torque_Nm", "Angle_mrad"), 1, 1, 1e3), (("t [s]", "T_out [Nm]", "theta [arcsec]"), 1, 1, 60 / ARCMIN),
    (("clock_ms", "load_Nm", "encoder_rad"), 1e3, 1, 1), (("TIME [s]", "TORQUE [Nm]", "POSITION [rev]"), 1, 1, 0.5 / np.pi)]


def angle_noise(rng, unit, ts):
    """Noise of sd unit["sd"]: white and coloured parts; an encoder's quantum is left to the writer."""
    share = rng.uniform(0.3, 1) if unit["noise"] == "coloured" else 1.0
    n = len(ts)
    a = np.exp(-1 / rng.uniform(2, 12))
    slow = lfilter([np.sqrt(1 - a * a)], [1, -a], rng.normal(size=n + 200))[200:]
    return unit["sd"] * unit["white"] * (np.sqrt(share) * rng.normal(size=n) + np.sqrt(1 - share) * slow)


def write_unit(folder, name, unit, effects, soil, rng):
    os.makedirs(folder, exist_ok=True)
    cols, ct, cm, ca = DIALECTS[int(rng.integers(len(DIALECTS)))]
    sign, suffix = (-1 if cols and rng.random() < 0.4 else 1), str(rng.choice([".csv", ".csv", ".csv.gz", ".csv.xz"]))
    unit["noise"] = str(rng.choice(["white", "coloured", "quantised"], p=[0.45, 0.35, 0.2]))
    quantum = unit["sd"] * rng.uniform(1, 2.5) if unit["noise"] == "quantised" else 0.0
    unit["white"] = np.sqrt(1 - quantum**2 / 12 / unit["sd"] ** 2)
    zero, torque_sd = rng.uniform(-3, 3), lu(rng, 1e-4, 2e-3)
    head = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f'rated_torque_Nm = {unit["rated"]:.6g}', ""]
    files, coarse = [], rng.random() < 0.06
    for i, rec in enumerate(unit["records"]):
        th, m = simulate(unit, i, effects + soil)
        ts = rec["ts"]
        tau = (rec["at"](m) + torque_sd * rng.normal(size=len(ts))) * unit["rated"]
        th = rec["at"](th) + zero + angle_noise(rng, unit, ts)
        if quantum:
            th = np.round(th / quantum) * quantum
        tick = 2.5 * ts[-1] / len(ts)
        stamp = np.floor(ts / tick) * tick if coarse else ts
        names = cols or ("time_s", "torque_Nm", "angle_arcmin")
        lines = [",".join(names)] + [f"{a:.9g},{b:.7g},{c:.9g}" for a, b, c in
                                     zip(stamp * ct, tau * cm, sign * th * unit["peak"] * ca, strict=False)]
        file, rate = f"run-{i + 1:02d}{suffix}", 4 * rec["amp"] / rec["period"] * unit["rated"]
        opener = gzip.open if suffix.endswith("gz") else lzma.open if suffix.endswith("xz") else open
        with opener(os.path.join(folder, file), "wt") as h:
            h.write("\n".join(lines) + "\n")
        head += ["[[record]]", f'file = "{file}"', f"loading_rate_Nm_per_s = {rate:.6g}",
                 f'amplitude_Nm = {rec["amp"] * unit["rated"]:.6g}']
        if cols:
            head += ["[record.columns]", f'time = "{cols[0]}"', f'torque = "{cols[1]}"',
                     f'angle = "{"-" if sign < 0 else ""}{cols[2]}"']
        head.append("")
        files.append(dict(file=file, rate_Nm_per_s=float(f"{rate:.6g}"), amplitude_Nm=float(f'{rec["amp"] * unit["rated"]:.6g}'),
                          full=bool(rec["amp"] > 0.95)))
    with open(os.path.join(folder, "unit.toml"), "w") as h:
        h.write("\n".join(head))
    return files


def key_entry(unit, effects, soil, facts, wanted, files):
    q = indicators(unit["reducer"], unit["reducer"].k)
    tr, pk = unit["rated"], unit["peak"]
    ind = dict(lost_motion_rad=q["lost"] * pk, backlash_rad=q["w0"] * pk, area_J=q["area"] * tr * pk,
               absorbed_J=q["absorbed"] * tr * pk, dissipation_ratio=q["u"], peak_rad=q["peak"] * pk)
    names = [n for n, _ in wanted]
    kind = "clean" if not names else "pair" if len(names) > 1 else "unlisted" if names[0].startswith("x_") else "single"
    strengths = {f["name"]: dict(form=str(f.get("form", "")), strength=float(s)) for f, s in effects}
    return dict(effects=names, size=max([s for _, s in wanted], default=0), rms_over_noise=float(f"{facts['total']:.4g}"),
                kind=kind, sizes=dict(wanted), rated_torque_Nm=float(f"{tr:.6g}"), reducer=unit["reducer"].kind,
                style=unit["style"], amplitude_plan=unit["plan"], noise_sd_rad=unit["sd"] * pk, noise=unit["noise"],
                k=unit["reducer"].k, soil_over_noise=facts["soil"], strengths=strengths, records=files,
                indicators={f"{r['rate_Nm_per_s']:.6g}": ind for r in files})


def selfcheck(seed, count=36):
    print("family      closure   oddness   rate/noise  halving   residual   u     lost  w0    peak")
    for i in range(count):
        rng = np.random.default_rng([seed, 999, i])
        unit = draw_unit(rng, list(FAMILIES)[i % len(FAMILIES)])
        red = unit["reducer"]
        q = indicators(red, red.k)
        _, up, down = red.loop()
        print(f"{red.kind:11s} {red.closure:.1e}  {np.max(np.abs(up + down[::-1])):.1e}  {unit['drift']:.3f}       "
              f"{unit['halving']:.3f}     {red.worst:.0e}     {q['u']:.3f} {q['lost']:.3f} {q['w0']:.3f} {q['peak']:.5f}")
    for name in LISTED + UNLISTED:
        line = []
        for size in TARGET if name in LISTED else (1.0, 0.4):
            for k in range(2):
                unit, effects, soil, facts = build_case(seed, 5000 + k, [(name, size)])
                line.append(f"{facts['total']:.2f} ({effects[0][1]:.3g}, draws {facts['attempts']}, soil {facts['soil']:.2f})")
        print(f"{name:24s}", "; ".join(line), flush=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("out")
    p.add_argument("--units", type=int, default=80)
    p.add_argument("--seed", type=int, default=31)
    p.add_argument("--selfcheck", action="store_true")
    a = p.parse_args()
    if a.selfcheck:
        return selfcheck(a.seed)
    cases = deal(np.random.default_rng([a.seed, 0]), a.units)
    key, began = {}, time.time()
    for i, wanted in enumerate(cases, 1):
        name = f"case-{i:02d}"
        unit, effects, soil, facts = build_case(a.seed, i, wanted)
        files = write_unit(os.path.join(a.out, name), name, unit, effects, soil, np.random.default_rng([a.seed, i, 77777]))
        key[name] = key_entry(unit, effects, soil, facts, wanted, files)
        print(f"{time.time() - began:7.1f} s {name} {unit['reducer'].kind:10s} {unit['style']:9s} {facts['attempts']:3d} "
              f"{facts['total']:7.3f} {facts['soil']:.3f}", flush=True)
    with open(os.path.join(a.out, "key.json"), "w") as h:
        json.dump(key, h, indent=1)


if __name__ == "__main__":
    main()
