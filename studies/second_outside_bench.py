"""A second virtual bench written without sight of the package: yet other mechanics, other tests, by the file format alone.

    python studies/second_outside_bench.py /tmp/second --units 80 --seed 11
    python studies/second_outside_bench.py /tmp/second --selfcheck --seed 11

It imports nothing of the package and stands in one file, so that it can be read and judged apart. Planetary, cycloidal, worm,
strain-wave, plastic and bevel drives; tests by triangles, sines, by hand and in stairs, amplitudes that differ from record to
record. OUT/key.json holds effects, severity (rms over the angle's noise 20, 6, 2.5) and the clean loop's indicators at the rated
torque; with --selfcheck closure, oddness and step halving of random reducers are printed and nothing is written.

Torque m is in units of the rated torque and angle in units of the clean settled peak inside; SI at the door.
A reducer is a series chain of parts that carry the same torque: a mesh stage (unilateral contacts, Coulomb sliders whose
limit follows the normal load, drag sliders), a frictional continuum (discretised bar with contact to ground), a linear shaft.
Every part is solved for equilibrium at every sample (implicit return mapping), so it depends on the torque path only.
"""

import argparse
import gzip
import json
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from numba import njit

ARCMIN = np.pi / 10800
TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
LISTED = [
    "interface_slip",
    "viscoelastic_creep",
    "asymmetric_stiffness",
    "second_backlash",
    "sensor_lag",
    "thermal_drift",
    "torque_offset",
    "encoder_error",
    "stick_slip",
    "rate_dependent_friction",
]
UNLISTED = {
    "x_encoder_coupling_play": "play in the angle channel's coupling: hysteresis in angle, no torque threshold or drag",
    "x_torque_sensor_hysteresis": "memory of the sensor body or its flange: belongs to the torque channel, not a zero error",
    "x_wear_step": "clearance grows suddenly in mid-session (debris crushed, chip lost): not in time slowly, not with rate",
    "x_gain_change": "amplifier range or lever arm differs between records: a factor on torque, not an offset",
    "x_arm_resonance": "drive cogging excites the loading arm's resonance: oscillates in torque path at one rate",
    "x_tooth_damage": "local weakness of some teeth on one flank: a dip at one angle, flanks equal elsewhere",
    "x_friction_between_records": "temperature or grease state differs between records: friction changes, not with rate",
    "x_count_slip": "encoder loses counts: sudden steps of the angle zero, neither slow nor periodic",
    "x_floor_vibration": "neighbouring machine shakes the optics: periodic in time, not in angle",
    "x_brake_ratchet": "input brake yields in one direction only and never returns: walks on with every cycle",
    "x_grease_runin": "cold grease thins with travel inside every record: friction falls with work, not with rate",
}


# ------------------------------------------------------------------------------------------------ mechanics (kernels)
@njit(cache=True)
def contact_law(pen, stiff, expo, inv_soft):
    """Force and tangent of a unilateral contact: Hertz/Palmgren exponent, hyperbolic softening of a polymer."""
    if pen <= 0.0:
        return 0.0, 0.0
    power, den = pen ** (expo - 1.0), 1.0 + pen * inv_soft
    return stiff * power * pen / den, stiff * power * (expo + (expo - 1.0) * pen * inv_soft) / (den * den)


@njit(cache=True)
def stage_balance(phi, old, held, new, grow, g, asym, flaw, p):
    """Torque carried by a mesh stage at angle phi, and its tangent; slider forces by return mapping from those held."""
    stiff, gap, expo, inv_soft, mu, k_tan, k_seal, k_drag, c_drag = p
    total, slope, dphi = k_seal * phi, k_seal, phi - old
    dent, ddent = 1.0, 0.0
    if flaw[0] != 0.0 and phi > 0.0:
        z = (phi - flaw[1]) / flaw[2]
        bell = flaw[0] * np.exp(-z * z)
        dent, ddent = 1.0 - bell, bell * 2.0 * z / flaw[2]
    n, m = stiff.size, min(mu * g, 0.93)
    for j in range(n):
        up, dup = contact_law(phi - gap[j] - grow, stiff[j] * (1.0 + asym), expo, inv_soft)
        down, ddown = contact_law(-phi - gap[j] - grow, stiff[j] * (1.0 - asym), expo, inv_soft)
        dup = dup * dent + up * ddent
        up *= dent
        total += up - down
        slope += dup + ddown
        limit, f = m * (up + down), held[j] + k_tan[j] * dphi
        if f > limit:
            f = limit
            slope += m * (dup - ddown)
        elif f < -limit:
            f = -limit
            slope -= m * (dup - ddown)
        else:
            slope += k_tan[j]
        new[j] = f
        total += f
    for k in range(k_drag.size):
        f = held[n + k] + k_drag[k] * dphi
        if abs(f) < c_drag[k] * g:
            slope += k_drag[k]
        else:
            f = c_drag[k] * g * np.sign(f)
        new[n + k] = f
        total += f
    return total, slope


@njit(cache=True)
def stage_path(torque, g, grow, asym, flaw, p):
    """Angle of a mesh stage along a torque path: bracketed Newton on a monotone balance, sample by sample."""
    out, held = np.empty(torque.size), np.zeros(p[0].size + p[7].size)
    new, phi = np.zeros(held.size), 0.0
    for i in range(torque.size):
        old = phi
        r, s = stage_balance(phi, old, held, new, grow[i], g[i], asym, flaw, p)
        r -= torque[i]
        if abs(r) > 1e-13:
            side = 1.0 if r < 0 else -1.0
            step = side * max(abs(r) / s, 1e-9)
            near, far, q = phi, phi, r
            while q * side < 0:
                near, far = far, far + step
                q = stage_balance(far, old, held, new, grow[i], g[i], asym, flaw, p)[0] - torque[i]
                step *= 2.0
            lo, hi = min(near, far), max(near, far)
            phi = 0.5 * (lo + hi)
            for _ in range(80):
                q, s = stage_balance(phi, old, held, new, grow[i], g[i], asym, flaw, p)
                r = q - torque[i]
                if abs(r) < 1e-13 or hi - lo < 1e-14:
                    break
                lo, hi = (lo, phi) if r > 0 else (phi, hi)
                phi -= r / s
                if phi <= lo or phi >= hi:
                    phi = 0.5 * (lo + hi)
            stage_balance(phi, old, held, new, grow[i], g[i], asym, flaw, p)
        held[:] = new
        out[i] = phi
    return out


@njit(cache=True)
def bar_residual(u, old, held, new, m, g, asym, p, res, diag, off):
    """Equilibrium of a bar in frictional contact with ground; fills the residual and the tridiagonal tangent."""
    link, hard, k_gnd, free, k_stick, q_fric, press = p
    n = u.size
    res[:] = 0.0
    diag[:] = 0.0
    res[0] = -m
    for i in range(n - 1):
        d = u[i] - u[i + 1]
        f, k = link[i] * d * (1.0 + hard * d * d), link[i] * (1.0 + 3.0 * hard * d * d)
        res[i] += f
        res[i + 1] -= f
        diag[i] += k
        diag[i + 1] += k
        off[i] = -k
    for i in range(n):
        if abs(u[i]) > free[i]:
            side = np.sign(u[i])
            res[i] += k_gnd[i] * (1.0 + side * asym) * (u[i] - side * free[i])
            diag[i] += k_gnd[i] * (1.0 + side * asym)
        f = held[i] + k_stick[i] * (u[i] - old[i])
        limit = q_fric[i] * g * (1.0 + press * abs(m))
        if abs(f) < limit:
            diag[i] += k_stick[i]
        else:
            f = limit * np.sign(f)
        new[i] = f
        res[i] += f
    return np.sqrt(np.sum(res * res))


@njit(cache=True)
def bar_path(torque, g, asym, p):
    """Twist of the loaded end along a torque path, by semi-smooth Newton with line search; second output: worst residual."""
    n = p[2].size
    z = np.zeros((10, n))
    u, old, held, new, res, diag, off, c, d, trial = z[0], z[1], z[2], z[3], z[4], z[5], z[6], z[7], z[8], z[9]
    out, worst = np.empty(torque.size), 0.0
    for i in range(torque.size):
        old[:] = u
        norm = bar_residual(u, old, held, new, torque[i], g[i], asym, p, res, diag, off)
        for _ in range(100):
            if norm < 1e-12:
                break
            c[0] = off[0] / diag[0]
            d[0] = res[0] / diag[0]
            for j in range(1, n):
                den = diag[j] - off[j - 1] * c[j - 1]
                c[j] = off[j] / den if j < n - 1 else 0.0
                d[j] = (res[j] - off[j - 1] * d[j - 1]) / den
            for j in range(n - 2, -1, -1):
                d[j] -= c[j] * d[j + 1]
            a = 1.0
            for _ in range(12):
                trial[:] = u - a * d
                after = bar_residual(trial, old, held, new, torque[i], g[i], asym, p, res, diag, off)
                if after < norm:
                    break
                a *= 0.5
            norm = after
            u[:] = trial
        held[:] = new
        worst, out[i] = max(worst, norm), u[0]
    return out, worst


# ------------------------------------------------------------------------------------------------ reducers
NO_FLAW = np.zeros(3)


class Reducer:
    """Parts in series; main is the index of the part that carries flank asymmetry, wear and tooth damage."""

    def __init__(self, kind, parts, main, gap=0.0, note=None):
        self.kind, self.parts, self.main, self.gap, self.note = kind, parts, main, gap, note or {}
        self.scale = 1.0
        self.worst = 0.0
        loop = self.settled_loop(400)
        self.scale = 1.0 / loop["peak"]

    def solve(self, m, g=None, grow=None, asym=0.0, flaw=NO_FLAW):
        """Output angle over the torque path m (relative units); g scales friction, grow widens the clearance."""
        g = np.ones(m.size) if g is None else g
        none = np.zeros(m.size)
        grow = none if grow is None else grow
        theta = np.zeros(m.size)
        for i, (name, p) in enumerate(self.parts):
            mine = i == self.main
            if name == "shaft":
                theta += p * m
            elif name == "stage":
                theta += stage_path(m, g, grow / self.scale if mine else none, asym * mine, flaw if mine else NO_FLAW, p)
            else:
                phi, worst = bar_path(m, g, asym * mine, p)
                self.worst = max(self.worst, worst)
                theta += phi
        return theta * self.scale

    def settled_loop(self, per_quarter=2000, cycles=4):
        """Both branches of the settled loop to +-1 on one torque grid, with the indicators in relative units."""
        n = per_quarter
        leg = np.arange(-n, n + 1) / n
        down, up = leg[::-1][1:], leg[1:]
        m = np.concatenate([leg[n:]] + [down, up] * cycles)
        th, grid = self.solve(m), leg
        minus = np.concatenate([[th[-4 * n - 1]], th[-4 * n : -2 * n]])[::-1]
        plus, before = np.concatenate([[th[-2 * n - 1]], th[-2 * n :]]), th[-6 * n - 1 : -4 * n]
        w, mean = minus - plus, 0.5 * (plus + minus)
        peak, k = 0.5 * (plus[-1] - minus[0]), int(round(0.03 * n))
        area = float(np.sum(0.5 * (w[1:] + w[:-1]) * np.diff(grid)))
        mid = 0.5 * (grid[1:] + grid[:-1])
        absorbed = float(np.sum(mid[n:] * np.diff(plus[n:])) - np.sum(mid[:n] * np.diff(minus[: n + 1])))
        gap = float(np.max(np.abs(before - plus)) / peak)
        if gap > 1e-7 and cycles < 60:  # slow shake-down of the fit: later cycle
            return self.settled_loop(per_quarter, 3 * cycles)
        return {
            "m": grid,
            "plus": plus,
            "minus": minus,
            "w": w,
            "peak": float(peak),
            "lost": float(mean[n + k] - mean[n - k]),
            "backlash": float(w[n]),
            "area": area,
            "absorbed": absorbed,
            "u": area / absorbed,
            "closure": gap,
            "odd": float(np.max(np.abs(plus + minus[::-1] - plus[-1] - minus[0])) / peak),
        }


def uni(rng, a, b):
    return float(rng.uniform(a, b))


def log_uni(rng, a, b):
    return float(np.exp(rng.uniform(np.log(a), np.log(b))))


def drag_sliders(rng, total, reach, count):
    """Iwan set for seals and bearings: break-away displacements spread around reach, forces add up to total."""
    share = rng.dirichlet(np.full(count, 3.0)) * total
    where = reach * np.exp(rng.uniform(-0.9, 0.9, count))
    return share / where, share


def patches(rng, stiff, gap, k_tan, count):
    """Each contact cut into patches whose tangential stiffness spreads about k_tan: micro-slip before gross slip."""
    spread = np.exp(np.linspace(-1, 1, count) * uni(rng, 0.4, 1.1))
    return np.repeat(stiff, count) / count, np.repeat(gap, count), np.outer(k_tan / count, spread).ravel()


def make_planetary(rng):
    n, g0 = int(rng.integers(3, 6)), log_uni(rng, 0.02, 0.55)
    spread = uni(rng, 0.05, 0.6)
    gap, stiff = g0 * (1 + spread * rng.uniform(0, 1, n)), (1 + rng.uniform(-0.15, 0.15, n)) / n
    expo, mu = uni(rng, 1.0, 1.13), log_uni(rng, 0.03, 0.25)
    k_tan, drag = stiff * uni(rng, 2.5, 9), log_uni(rng, 0.008, 0.07)
    kd, cd = drag_sliders(rng, drag, uni(rng, 0.01, 0.06), int(rng.integers(3, 6)))
    seal = log_uni(rng, 0.015, 0.12)
    stiff, gap, k_tan = patches(rng, stiff, gap, k_tan, 4)
    part = (stiff, gap, expo, 0.0, mu, k_tan, seal, kd, cd)
    note = {"planets": n, "mu": mu, "drag": drag, "gap_model": g0, "exponent": expo}
    return Reducer("planetary", [("stage", part), ("shaft", uni(rng, 0.05, 0.6))], 0, g0, note)


def make_cycloid(rng):
    n = int(rng.integers(5, 13))
    arm, preload = np.sin((np.arange(n) + 0.5) / n * np.pi), log_uni(rng, 0.02, 0.5)
    expo = 10 / 9 if rng.random() < 0.6 else 1.5
    stiff = arm ** (1 + expo)
    stiff, mu = stiff / stiff.sum(), log_uni(rng, 0.03, 0.35)
    drag = log_uni(rng, 0.005, 0.06)
    kd, cd = drag_sliders(rng, drag, uni(rng, 0.01, 0.08), int(rng.integers(3, 6)))
    stiff, gap, k_tan = patches(rng, stiff, -preload / arm, stiff * uni(rng, 3, 10), 3)
    part = (stiff, gap, expo, 0.0, mu, k_tan, 0.02, kd, cd)
    note = {"rollers": n, "mu": mu, "preload_model": preload, "exponent": expo, "drag": drag}
    return Reducer("cycloid", [("stage", part), ("shaft", uni(rng, 0.02, 0.3))], 0, 0.0, note)


def make_worm(rng):
    n = int(rng.integers(1, 4))
    stiff = rng.dirichlet(np.full(n, 6.0))
    preload, expo = log_uni(rng, 0.02, 0.25) * (1 + rng.uniform(0, 0.5, n)), uni(rng, 1.0, 1.11)
    mu, drag = uni(rng, 0.18, 0.66), log_uni(rng, 0.005, 0.04)
    kd, cd = drag_sliders(rng, drag, uni(rng, 0.01, 0.06), 4)
    stiff, gap, k_tan = patches(rng, stiff, -preload, stiff * uni(rng, 4, 16), 6)
    part = (stiff, gap, expo, 0.0, mu, k_tan, 0.02, kd, cd)
    note = {"mu": mu, "preload_model": float(preload[0]), "exponent": expo, "drag": drag}
    return Reducer("worm", [("stage", part), ("shaft", uni(rng, 0.03, 0.4))], 0, 0.0, note)


def make_harmonic(rng):
    """Flexspline cup (hardening torsion) into a toothed rim that slides in the circular spline under pressure."""
    n = int(rng.integers(14, 28))
    x = (np.arange(n) + 0.5) / n
    free = np.sort(rng.uniform(0, uni(rng, 0.1, 0.5), n)) * uni(rng, 0.5, 1.0)  # teeth take load one after another
    free[: max(2, n // 6)] = 0.0
    k_gnd = np.full(n, uni(rng, 1.5, 5.0) / n) * (1 + rng.uniform(-0.1, 0.1, n))
    profile = np.exp(-(((x - uni(rng, 0.2, 0.8)) / uni(rng, 0.25, 0.8)) ** 2))
    total = log_uni(rng, 0.04, 0.35)
    q = profile / profile.sum() * total
    stick = np.full(n, 1.0) * q / (uni(rng, 0.008, 0.04) * (0.3 + 1.4 * rng.random(n)))
    link, order = np.full(n - 1, uni(rng, 0.8, 4.0) * n * 0.3), rng.permutation(n)
    part = (link, uni(rng, 0.0, 3.0), k_gnd, free[order], stick, q, uni(rng, 0.0, 1.5))
    kd, cd = drag_sliders(rng, log_uni(rng, 0.02, 0.2), uni(rng, 0.02, 0.2), 6)  # wave generator bearing
    cup = (np.zeros(0), np.zeros(0), 1.0, 0.0, 0.0, np.zeros(0), uni(rng, 1.5, 6.0), kd, cd)
    note = {"teeth_nodes": n, "rim_friction": total, "pressure": part[-1]}
    return Reducer("harmonic", [("bar", part), ("stage", cup)], 0, 0.0, note)


def make_plastic(rng):
    n, g0 = int(rng.integers(1, 4)), log_uni(rng, 0.02, 0.5)
    gap = g0 * (1 + uni(rng, 0.0, 0.3) * rng.uniform(0, 1, n))
    stiff, mu = rng.dirichlet(np.full(n, 8.0)) * 1.6, log_uni(rng, 0.05, 0.35)
    drag = log_uni(rng, 0.01, 0.09)
    kd, cd = drag_sliders(rng, drag, uni(rng, 0.02, 0.08), 4)
    soft = uni(rng, 0.15, 0.65)
    stiff, gap, k_tan = patches(rng, stiff, gap, stiff * uni(rng, 2, 6), 5)
    part = (stiff, gap, 1.0 + 0.05 * rng.random(), soft, mu, k_tan, log_uni(rng, 0.02, 0.12), kd, cd)
    km, cm = drag_sliders(rng, uni(rng, 0.05, 0.5), uni(rng, 0.05, 0.3), 8)  # material and web hysteresis
    web = (np.zeros(0), np.zeros(0), 1.0, 0.0, 0.0, np.zeros(0), uni(rng, 1.2, 5.0), km, cm)
    note = {"mu": mu, "drag": drag, "softening": soft, "gap_model": g0}
    return Reducer("plastic", [("stage", part), ("stage", web)], 0, g0, note)


def make_spline_bevel(rng):
    """Bevel mesh with one clearance in series with a long spline or shrink fit whose slip front walks in from one end."""
    n = int(rng.integers(16, 30))
    x = (np.arange(n) + 0.5) / n
    press, total = 1 + uni(rng, -0.7, 0.7) * (2 * x - 1), uni(rng, 0.3, 1.6)
    q, k_gnd = press / press.sum() * total, np.zeros(n)
    k_gnd[-1] = uni(rng, 0.8, 4)
    link, stick = np.full(n - 1, n * uni(rng, 0.6, 3.0)), q / uni(rng, 0.004, 0.02)
    bar = (link, 0.0, k_gnd, np.zeros(n), stick, q, uni(rng, 0.0, 0.6))
    g0, stiff = log_uni(rng, 0.015, 0.4), np.array([uni(rng, 1.0, 3.0)])
    mu, drag = log_uni(rng, 0.03, 0.2), log_uni(rng, 0.01, 0.08)
    kd, cd = drag_sliders(rng, drag, uni(rng, 0.01, 0.05), 4)
    stiff, gap, k_tan = patches(rng, stiff, np.array([g0]), stiff * uni(rng, 2.5, 8), 6)
    mesh = (stiff, gap, uni(rng, 1.0, 1.12), 0.0, mu, k_tan, log_uni(rng, 0.02, 0.1), kd, cd)
    note = {"fit_capacity": total, "mu": mu, "drag": drag, "gap_model": g0}
    return Reducer("spline_bevel", [("stage", mesh), ("bar", bar)], 0, g0, note)


MAKERS = {
    "planetary": make_planetary,
    "cycloid": make_cycloid,
    "worm": make_worm,
    "harmonic": make_harmonic,
    "plastic": make_plastic,
    "spline_bevel": make_spline_bevel,
}
PEAKS = {
    "planetary": (0.5, 90),
    "cycloid": (0.3, 8),
    "worm": (0.5, 60),
    "harmonic": (0.4, 25),
    "plastic": (10, 200),
    "spline_bevel": (0.5, 60),
}
TORQUES = {
    "planetary": (0.1, 1000),
    "cycloid": (5, 1000),
    "worm": (0.5, 500),
    "harmonic": (0.3, 600),
    "plastic": (0.05, 5),
    "spline_bevel": (1, 1000),
}


# ------------------------------------------------------------------------------------------------ test paths
def fold(s):
    """Triangle wave of amplitude 1 over path length: 0 at 0, +1 at 1, -1 at 3."""
    return 1 - np.abs(np.mod(s + 1, 4) - 2)


def smooth_noise(rng, n, width):
    """Unit-variance noise, correlated over about width samples."""
    z = rng.standard_normal(n + 8 * int(width) + 8)
    k = np.exp(-0.5 * (np.arange(-3 * int(width) - 1, 3 * int(width) + 2) / width) ** 2)
    y = np.convolve(z, k, "same")[4 * int(width) + 4 :][:n]
    return (y - y.mean()) / y.std()


def draw_path(rng, style, amp, rate, layout):
    """Time (s from 0), torque (rated torques) of one record; rate in rated torques per second (mean |dm/dt|)."""
    start, length = layout
    seconds = length * amp / rate
    fs = min(1000.0, uni(rng, 4200, 5990) / seconds)
    n = int(seconds * fs) + 1
    t = np.arange(n) / fs
    q = np.linspace(0, 1, n) * (t[-1] / seconds)
    if style.startswith("triangle"):
        m = fold(start + length * q)
    elif style == "sine":
        m = np.sin(0.5 * np.pi * (start + length * q))
    elif style == "hand":
        v = np.exp(uni(rng, 0.3, 0.7) * smooth_noise(rng, n, n / uni(rng, 30, 90)))
        s = np.concatenate([[0], np.cumsum(v[:-1])])
        m = fold(start + length * s / s[-1])
        wob, size = smooth_noise(rng, n, n / uni(rng, 200, 500)), uni(rng, 0.001, 0.003)
        ends = np.flatnonzero(np.diff(np.sign(np.diff(m)))) + 2
        while True:  # largest counter-movement must stay within .45 %
            y = m + size * wob
            legs = [leg * np.sign(leg[-1] - leg[0]) for leg in np.split(y, ends) if leg.size > 9]
            if max(np.max(np.maximum.accumulate(leg) - leg) for leg in legs) <= 0.0045:
                break
            size *= 0.8
        m = np.clip(y, -1.004, 1.004)
        if rng.random() < 0.35:  # unequal sampling
            keep = np.sort(rng.choice(np.arange(1, n - 1), int(0.7 * n), replace=False))
            keep = np.concatenate([[0], keep, [n - 1]])
            t, m = t[keep], m[keep]
    else:
        steps, ramp = int(round(length * rng.integers(24, 60))), uni(rng, 0.2, 0.5)
        z = q * steps
        base = np.floor(z)
        z = base + np.clip((z - base) / ramp, 0, 1)
        m = fold(start + length * z / steps)
    return t, m * amp


def draw_history(rng, m0, amp, rate):
    """A random earlier loading that ends at torque m0: times before zero and torques."""
    count, sign = int(rng.integers(2, 5)), rng.choice([-1, 1])
    turns = [0.0] + [sign * (-1) ** k * uni(rng, 0.25, 1.0) * amp for k in range(count)] + [m0]
    m, t = [0.0], [0.0]
    for a, b in zip(turns[:-1], turns[1:], strict=False):
        n = max(8, int(abs(b - a) / 0.004))
        m += list(a + (b - a) * np.arange(1, n + 1) / n)
        t += list(t[-1] + abs(b - a) / rate * np.arange(1, n + 1) / n)
    pause = log_uni(rng, 0.3, 8.0)
    m += [m0] * 24
    t += list(t[-1] + pause * np.arange(1, 25) / 25)
    t = np.array(t)
    return t - t[-1] - pause / 25, np.array(m)


STYLES = ["triangle_zero", "triangle_tip", "sine", "hand", "staircase"]


def draw_records(rng, need):
    """Records of one unit: list of dicts with t, m (history included), nh, rate, amp, full, clock; style and plan names."""
    style = str(rng.choice(STYLES, p=[0.3, 0.22, 0.17, 0.16, 0.15]))
    count = int(rng.integers(max(2, need), 6))
    span = log_uni(rng, 4, 100) if count > 2 else log_uni(rng, 4, 30)
    mid = log_uni(rng, 0.025, 0.7)  # rated torques per second
    rates = mid * span ** np.linspace(-0.5, 0.5, count)
    rates[1:-1] *= np.exp(rng.uniform(-0.12, 0.12, count - 2))
    rates *= min(1.0, 2.5 / rates[-1])
    rates *= max(1.0, 1 / (220 * rates[0])) if rates[-1] / (220 * rates[0]) < 2.5 else 1.0
    rates = [float(f"{r:.3g}") for r in rates]
    plan = str(rng.choice(["equal", "scatter", "extra"], p=[0.5, 0.25, 0.25]))
    amps = [1.0] * count if plan != "scatter" else [float(f"{a:.3g}") for a in rng.uniform(0.92, 1.08, count)]
    jobs = [(r, a, True) for r, a in zip(rates, amps, strict=False)]
    if plan == "extra":
        jobs = jobs[:3] + jobs[3:][-1:]  # at most five records, the span kept
        jobs.append((jobs[int(rng.integers(len(jobs)))][0], float(f"{rng.uniform(0.3, 0.6):.3g}"), False))
    order = rng.permutation(len(jobs)) if rng.random() < 0.5 else np.arange(len(jobs))
    if style == "triangle_zero":
        layout = (0.0, 5.0)
    elif style == "triangle_tip":
        layout = (float(rng.choice([1, 3])), 4 * float(rng.choice([1.5, 2.0, 2.5, 3.0])))
    else:
        layout = (
            (0.0, 5.0) if rng.random() < 0.5 else (float(rng.choice([0, 1, 2, 3])), 4 * float(rng.choice([1.25, 1.5, 2, 2.5])))
        )
    records, clock = [], 0.0
    for i in order:
        rate, amp, full = jobs[i]
        t, m = draw_path(rng, style, amp, rate, layout)
        th, mh = draw_history(rng, m[0], amp, rate)
        clock += log_uni(rng, 5, 60) - th[0]
        records.append(
            {
                "t": np.concatenate([th, t]),
                "m": np.concatenate([mh, m]),
                "nh": th.size,
                "rate": rate,
                "amp": amp,
                "full": full,
                "clock": clock,
                "index": len(records),
            }
        )
        clock += t[-1]
    return records, style, plan


# ------------------------------------------------------------------------------------------------ effects: kernels
@njit(cache=True)
def keyed_slip(m, thresholds, weights):
    """Clamp patches, each a Coulomb joint in parallel with its key; total slip per unit weight."""
    out = np.zeros(m.size)
    for k in range(thresholds.size):
        x, h = 0.0, weights[k] / (1.0 - thresholds[k])
        for i in range(m.size):
            x = min(max(x, h * (m[i] - thresholds[k])), h * (m[i] + thresholds[k]))
            out[i] += x
    return out


@njit(cache=True)
def ploughing_slip(m, threshold, power, ratchet):
    """Clamp that ploughs on while |m| rises past its last high-water mark; the mark is lost on slip the other way."""
    out = np.zeros(m.size)
    x, high, side = 0.0, threshold, 0.0
    for i in range(m.size):
        a = abs(m[i])
        s = 1.0 if m[i] > 0 else -1.0
        if ratchet:
            if m[i] < 0.0:
                high = threshold
            elif a > high:
                x += ((a - threshold) ** power - (high - threshold) ** power) / (1.0 - threshold) ** power
                high = a
        elif a > threshold:
            if s != side:
                side, high = s, threshold
            if a > high:
                x += s * ((a - threshold) ** power - (high - threshold) ** power) / (1.0 - threshold) ** power
                high = a
        out[i] = x
    return out


@njit(cache=True)
def kelvin(t, drive, taus, weights):
    """Strain of Kelvin elements under a piecewise linear drive (exact step)."""
    out = np.zeros(t.size)
    for k in range(taus.size):
        x = 0.0
        for i in range(1, t.size):
            h = t[i] - t[i - 1]
            e, b = np.exp(-h / taus[k]), (drive[i] - drive[i - 1]) / h
            x = drive[i] - b * taus[k] + (x - drive[i - 1] + b * taus[k]) * e
            out[i] += weights[k] * x
    return out


@njit(cache=True)
def dragged_play(m, half, drag, centre, soft):
    """A later stage free by +-half, moved only past its own drag torque; soft: contact compliance behind the stops."""
    out, x = np.zeros(m.size), 0.0
    for i in range(m.size):
        x = min(max(x, (m[i] - drag) * half / centre), (m[i] + drag) * half / centre)
        x, over = min(max(x, -half), half), abs(m[i]) - drag - centre
        out[i] = x + (soft * half * over**0.7 * np.sign(m[i]) if over > 0 else 0.0)
    return out


@njit(cache=True)
def play(x, half):
    out, y = np.empty(x.size), x[0]
    for i in range(x.size):
        y = min(max(y, x[i] - half), x[i] + half)
        out[i] = y
    return out


@njit(cache=True)
def stick_release(m, level, load, over, dice):
    """Torque that reaches the reducer behind junctions with static strength and no kinetic strength (plus overshoot)."""
    out, y = np.empty(m.size), m[0]
    k = 0
    for i in range(m.size):
        limit, d = level * (1.0 + load * abs(m[i])) * dice[k % dice.size], m[i] - y
        if abs(d) > limit:
            y = m[i] + (over * limit if d > 0 else -over * limit)
            k += 1
        out[i] = y
    return out


@njit(cache=True)
def second_order(t, x, omega, zeta):
    """Second-order low-pass of x(t), trapezoidal in sub-steps."""
    out = np.empty(x.size)
    y, v = x[0], 0.0
    out[0] = y
    for i in range(1, x.size):
        h = t[i] - t[i - 1]
        n = min(400, max(1, int(h * omega / 0.05) + 1))
        dt = h / n
        for k in range(n):
            xa = x[i - 1] + (x[i] - x[i - 1]) * (k + 0.5) / n
            a = v + 0.5 * dt * omega * omega * (2.0 * xa - 2.0 * y - 0.5 * dt * v) - 0.5 * dt * 2.0 * zeta * omega * v
            vn = a / (1.0 + dt * zeta * omega + 0.25 * dt * dt * omega * omega)
            y += 0.5 * dt * (v + vn)
            v = vn
        out[i] = y
    return out


def delayed(t, x, form, tau):
    if form == "delay":
        return np.interp(t - tau, t, x)
    if form == "first_order":
        return x[0] + kelvin(t, x - x[0], np.array([tau]), np.array([1.0]))
    if form == "second_order":
        return second_order(t, x, 1.4 / tau, 0.7)
    area = np.concatenate([[0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t))])  # moving average of width 2 tau
    low = np.interp(t - 2 * tau, t, area) + np.minimum(t - 2 * tau - t[0], 0) * x[0]
    return (area - low) / (2 * tau)


# ------------------------------------------------------------------------------------------------ effects: forms
def draw_form(rng, name, unit):
    """A form of the effect: dict with its shape, a first guess and a cap of the strength."""
    recs = unit["records"]
    rates = np.array([r["rate"] for r in recs])
    v_mid = float(np.exp(np.mean(np.log([rates.min(), rates.max()]))))
    session, sign = recs[-1]["clock"] + recs[-1]["t"][-1] + 10.0, float(rng.choice([-1, 1]))
    f = {"guess": 0.05, "cap": 0.6, "v_mid": v_mid}
    if name == "interface_slip":
        form = str(rng.choice(["keyed", "two_patches", "ploughing"]))
        top = uni(rng, 0.45, 0.88)
        n = 2 if form == "two_patches" else 1
        f.update(
            form=form,
            threshold=np.array([top, uni(rng, 0.4, 0.9)])[:n],
            weight=np.array([1.0, uni(rng, 0.3, 1.5)])[:n],
            power=float(rng.choice([1.0, 1.5, 2.0])),
        )
    elif name == "viscoelastic_creep":
        form = str(rng.choice(["kelvin1", "kelvin2", "kelvin3", "power", "stretched", "threshold"]))
        if form == "power":
            tau = np.logspace(-2, 4, 19)
            w = tau ** uni(rng, 0.1, 0.35)
            w /= np.sum(w * (1 - np.exp(-1 / v_mid / tau)))
        elif form == "stretched":
            t0, b = log_uni(rng, 0.5, 40), uni(rng, 0.35, 0.7)
            edge = np.logspace(-3, 3, 25) * t0
            tau = np.sqrt(edge[1:] * edge[:-1])
            w = np.exp(-((edge[:-1] / t0) ** b)) - np.exp(-((edge[1:] / t0) ** b))
        else:
            n = 1 if form == "threshold" else int(form[-1])
            tau = np.sort(np.array([log_uni(rng, 0.15, 3.0) / v_mid for _ in range(n)]).clip(0.3, 120))
            w = rng.dirichlet(np.full(n, 4.0))
        f.update(form=form, tau=tau, weight=w, floor=uni(rng, 0.2, 0.6) if form == "threshold" else 0.0, cap=0.8)
    elif name == "asymmetric_stiffness":
        f.update(form=str(rng.choice(["flank", "flank", "mount", "hertz_flank"])), sign=sign, power=uni(rng, 0.6, 0.8), cap=0.55)
    elif name == "second_backlash":
        f.update(form=str(rng.choice(["hard", "centred", "soft_stop"])), drag=log_uni(rng, 0.05, 0.5), cap=0.6)
        f["centre"] = uni(rng, 0.05, 0.15) if f["form"] == "centred" else uni(rng, 0.008, 0.03)
        f["soft"] = uni(rng, 0.1, 0.5) if f["form"] == "soft_stop" else 0.0
    elif name == "sensor_lag":
        f.update(
            form=str(rng.choice(["delay", "first_order", "second_order", "moving_average"])),
            guess=0.01 / rates.max(),
            cap=0.3 / rates.max(),
        )
    elif name == "thermal_drift":
        f.update(
            form=str(rng.choice(["linear", "warming", "room"])),
            sign=sign,
            session=session,
            tau=uni(rng, 0.15, 1.2),
            period=uni(rng, 0.4, 2.5),
            phase=uni(rng, 0, 6.28),
            guess=0.1,
            cap=1.2,
        )
    elif name == "torque_offset":
        f.update(
            form=str(rng.choice(["sensor_zero", "dead_weight", "rezeroed"])),
            sign=sign,
            guess=0.03,
            cap=0.3,
            tilt=uni(rng, 0.3, 1.0),
            per=1 + rng.uniform(-0.25, 0.25, len(recs)),
        )
    elif name == "encoder_error":
        n, period = int(rng.integers(1, 4)), 2 * log_uni(rng, 1 / 30, 2.0)
        w = np.concatenate([[1.0], rng.uniform(0.1, 0.7, n - 1)])
        f.update(
            form=f"{n}_harmonics",
            period=period,
            weight=w,
            phase=rng.uniform(0, 6.28, n),
            guess=0.02,
            cap=min(0.3, 0.75 * period / (6.2832 * np.sum(w * np.arange(1, n + 1)))),
        )
    elif name == "stick_slip":
        form = str(rng.choice(["regular", "random", "load", "slow_only"]))
        f.update(
            form=form,
            load=uni(rng, 0.5, 3) if form == "load" else 0.0,
            over=uni(rng, 0.0, 0.6),
            dice=np.exp(rng.normal(0, 0.35 if form == "random" else 0.06, 400)),
            guess=0.02,
            cap=0.14,
            fall=uni(rng, 0.2, 0.6) if form == "slow_only" else 0.0,
        )
    elif name == "rate_dependent_friction":
        form = str(rng.choice(["stribeck", "viscous", "log_rising", "log_falling"]))
        f.update(form=form, v_knee=v_mid * log_uni(rng, 0.3, 3), rates=rates, guess=0.2, cap=0.75)
    elif name == "x_encoder_coupling_play":
        f.update(form="play", cap=0.4)
    elif name == "x_torque_sensor_hysteresis":
        n = int(rng.integers(3, 6))
        f.update(form="one_sided", half=np.linspace(0.05, 0.45, n), weight=rng.dirichlet(np.full(n, 3.0)), cap=0.25)
    elif name == "x_wear_step":
        k = int(rng.integers(0, len(recs)))
        f.update(form="clearance", record=k, when=uni(rng, 0.25, 0.75), cap=0.4)
    elif name == "x_gain_change":
        f.update(form="gain", per=np.where(np.arange(len(recs)) % 2, 1, -1) * rng.uniform(0.5, 1.0, len(recs)), cap=0.15)
    elif name == "x_arm_resonance":
        teeth = uni(rng, 9, 22)
        f.update(
            form="cogging",
            teeth=teeth,
            omega=6.2832 * teeth * float(rng.choice(rates)) * uni(rng, 0.93, 1.07),
            zeta=uni(rng, 0.03, 0.1),
            guess=0.003,
            cap=0.05,
        )
    elif name == "x_tooth_damage":
        f.update(form="dent", where=uni(rng, 0.45, 0.85), width=uni(rng, 0.12, 0.3), cap=0.3)
        f["cap"] = 0.9 * f["width"] / (0.86 * f["where"])
    elif name == "x_friction_between_records":
        rank = np.argsort(np.argsort(rates, kind="stable"), kind="stable")
        f.update(
            form="temperature", per=np.where(rank % 2, 1.0, -1.0) * rng.uniform(0.5, 1, len(recs)) * sign, guess=0.2, cap=0.7
        )
    elif name == "x_count_slip":
        f.update(
            form="steps",
            hits=[
                [
                    (uni(rng, 0.1, 0.9), float(rng.choice([-1, 1])) * float(rng.integers(1, 4)))
                    for _ in range(int(rng.integers(1, 3)) if rng.random() < 0.75 or k == 0 else 0)
                ]
                for k in range(len(recs))
            ],
            guess=0.02,
            cap=0.4,
        )
    elif name == "x_floor_vibration":
        step = min(np.median(np.diff(r["t"][r["nh"] :])) for r in recs)
        f.update(form="hum", freq=min(uni(rng, 0.02, 0.07) / step, 20.0), phase=rng.uniform(0, 6.28, 8), guess=0.02, cap=0.2)
    elif name == "x_brake_ratchet":
        f.update(form="one_way", threshold=uni(rng, 0.4, 0.8), power=float(rng.choice([1.0, 1.5])), sign=sign, cap=0.5)
    elif name == "x_grease_runin":
        f.update(form="travel", travel=uni(rng, 0.8, 3.0), guess=0.3, cap=1.4)
    return f


def friction_factor(rec, effects):
    """Scale of all friction limits over the record, from rate law, temperature and grease."""
    t, m = rec["t"], rec["m"]
    g = np.ones(t.size)
    if "rate_dependent_friction" in effects:
        f, s = effects["rate_dependent_friction"]
        speed = np.abs(np.gradient(m, t))
        tau = 0.06 * rec["amp"] / rec["rate"]  # the film follows the speed with a lag
        v = rec["rate"] + kelvin(t, speed - rec["rate"], np.array([tau]), np.array([1.0]))
        v = np.maximum(v, 0.08 * rec["rate"])
        law = {
            "stribeck": lambda x: np.exp(-x / f["v_knee"]),
            "viscous": lambda x: x,
            "log_rising": np.log,
            "log_falling": lambda x: -np.log(x),
        }[f["form"]]
        norm = np.max(np.abs(law(f["rates"]) - law(f["v_mid"])))
        g *= np.clip(1 + s * (law(v) - law(f["v_mid"])) / norm, 0.15, 2.2)
    if "x_friction_between_records" in effects:
        f, s = effects["x_friction_between_records"]
        g *= 1 + s * f["per"][rec["index"]]
    if "x_grease_runin" in effects:
        f, s = effects["x_grease_runin"]
        travel = np.concatenate([[0], np.cumsum(np.abs(np.diff(m)))])
        travel = np.maximum(travel - travel[rec["nh"]], 0)
        g *= 1 + s * np.exp(-travel / f["travel"])
    return g


ORDER = [
    "torque_offset",
    "x_gain_change",
    "x_torque_sensor_hysteresis",
    "x_arm_resonance",
    "stick_slip",
    "asymmetric_stiffness",
    "x_wear_step",
    "x_tooth_damage",
    "interface_slip",
    "second_backlash",
    "viscoelastic_creep",
    "x_brake_ratchet",
    "thermal_drift",
    "x_floor_vibration",
    "x_encoder_coupling_play",
    "encoder_error",
    "x_count_slip",
    "sensor_lag",
]


def simulate(unit, rec, effects):
    """Noise-free angle reading over one record, in settled peaks; effects: {name: (form, strength)}."""
    red, t, m, k = unit["reducer"], rec["t"], rec["m"], rec["index"]
    asym, grow, flaw, true, give, turn = 0.0, None, NO_FLAW, m, 0.0, 6.2832
    travel = np.concatenate([[0], np.cumsum(np.abs(np.diff(m)))])
    ordered = [(n, *effects[n]) for n in ORDER if n in effects]
    for name, f, s in ordered:  # torque that reaches the reducer, state of the reducer
        if name == "torque_offset":
            tilt = np.cos(f["tilt"] + unit["peak"] * m) / np.cos(f["tilt"])
            true = true + f["sign"] * s * {"sensor_zero": 1.0, "rezeroed": f["per"][k], "dead_weight": tilt}[f["form"]]
        elif name == "x_gain_change":
            true = true * (1 + s * f["per"][k])
        elif name == "x_torque_sensor_hysteresis":
            x = np.maximum(m, 0)  # the flange seats anew under one direction only
            true = true + s * sum(w * (play(x, h) - x) for w, h in zip(f["weight"], f["half"], strict=False))
        elif name == "x_arm_resonance":
            ripple = s * np.minimum(1, travel / 0.2) * np.sin(turn * f["teeth"] * travel)
            true = true + second_order(t, ripple, f["omega"], f["zeta"])
        elif name == "stick_slip":
            true = stick_release(true, s * (rec["rate"] / f["v_mid"]) ** -f["fall"], f["load"], f["over"], f["dice"])
        elif name == "asymmetric_stiffness" and f["form"] == "flank":
            asym = f["sign"] * s
        elif name == "x_wear_step":
            grow = s * (t >= f["when"] * t[-1] if k == f["record"] else np.full(t.size, k > f["record"])).astype(float)
        elif name == "x_tooth_damage":
            flaw = np.array([s, f["where"] * 0.8 / red.scale, f["width"] * 0.8 / red.scale])
    for name, f, s in ordered:  # parts in series with the reducer
        if name == "asymmetric_stiffness" and f["form"] != "flank":  # one-sided mount, or Hertz contact on one flank
            power = 1.0 if f["form"] == "mount" else f["power"]
            give = give + f["sign"] * s * np.maximum(f["sign"] * true, 0) ** power
        elif name == "interface_slip" and f["form"] == "ploughing":
            give = give + s * ploughing_slip(true, f["threshold"][0], f["power"], False)
        elif name == "interface_slip":
            give = give + keyed_slip(true, f["threshold"], s * f["weight"])
        elif name == "second_backlash":
            give = give + dragged_play(true, 0.5 * s, f["drag"], f["centre"], f["soft"])
        elif name == "viscoelastic_creep":
            give = give + s * kelvin(t, np.sign(true) * np.maximum(np.abs(true) - f["floor"], 0), f["tau"], f["weight"])
        elif name == "x_brake_ratchet":
            give = give + f["sign"] * s * ploughing_slip(f["sign"] * true, f["threshold"], f["power"], True)
    theta = red.solve(true, friction_factor(rec, effects), grow, asym, flaw) + give
    now = t + rec["clock"]
    for name, f, s in ordered:  # measuring channel
        if name == "thermal_drift":
            x = now / f["session"]
            theta = (
                theta
                + f["sign"]
                * s
                * {"linear": x, "warming": 1 - np.exp(-x / f["tau"]), "room": np.sin(turn * x / f["period"] + f["phase"])}[
                    f["form"]
                ]
            )
        elif name == "x_floor_vibration":
            beat = 1 + 0.4 * np.sin(turn * f["freq"] * now / 17.3 + f["phase"][1])
            theta = theta + s * beat * np.sin(turn * f["freq"] * now + f["phase"][0])
        elif name == "x_encoder_coupling_play":
            theta = play(theta, 0.5 * s)
        elif name == "encoder_error":
            x = turn * (theta + unit["offsets"][k] % f["period"]) / f["period"]
            theta = theta + s * sum(
                w * np.sin((h + 1) * x + p) for h, (w, p) in enumerate(zip(f["weight"], f["phase"], strict=False))
            )
        elif name == "x_count_slip":
            theta = theta + s * sum(size / 2 * (t >= when * t[-1]) for when, size in f["hits"][k])
        elif name == "sensor_lag":
            theta = delayed(t, theta, f["form"], s)
    return theta[rec["nh"] :]


def severity(unit, effects):
    """rms over all samples of (with - without), offset and linear torque term refitted per record, over the noise sd."""
    total, count = 0.0, 0
    for rec, clean in zip(unit["records"], unit["clean"], strict=False):
        d = simulate(unit, rec, effects) - clean
        a = np.column_stack([np.ones(d.size), rec["m"][rec["nh"] :]])
        d = d - a @ np.linalg.lstsq(a, d, rcond=None)[0]
        total += float(d @ d)
        count += d.size
    return float(np.sqrt(total / count) / unit["noise"])


def find_strength(unit, name, form, target, tol=0.03):
    """Strength at which the effect alone has the target severity, or None when that needs more than the cap."""
    lo, hi, slo, shi = 0.0, None, 0.0, None
    s = min(form["guess"], form["cap"])
    for _ in range(24):
        v = severity(unit, {name: (form, s)})
        if abs(v / target - 1) < tol:
            return s, v
        if v > target:
            hi, shi = s, v
        else:
            if s >= form["cap"] * 0.9999:
                return None
            lo, slo = s, v
        if hi is None:
            s = min(form["cap"], s * min(8.0, 1.02 * target / max(v, 1e-9)))
        else:
            w = (target - slo) / (shi - slo) if shi > slo else 0.5
            s = lo + (hi - lo) * min(0.93, max(0.07, w))
    return None


# ------------------------------------------------------------------------------------------------ units
def draw_unit(rng, kind, need_records):
    """A reducer with a rig: records, noise, offsets; angles in settled peaks, torques in rated torques."""
    for _ in range(200):
        red = MAKERS[kind](rng)
        loop = red.settled_loop(400)
        peak = log_uni(rng, *PEAKS[kind])
        clearance = 2 * red.gap * red.scale * peak
        if clearance <= 60 and 0.004 < loop["u"] < 0.82 and loop["w"].min() > -1e-9 and loop["backlash"] < 1.3:
            break
    records, style, plan = draw_records(rng, need_records)
    rated = float(("%.1g" if rng.random() < 0.3 else "%.3g") % log_uni(rng, *TORQUES[kind]))
    unit = {
        "reducer": red,
        "peak": peak * ARCMIN,
        "clearance_arcmin": clearance,
        "rated": rated,
        "records": records,
        "style": style,
        "plan": plan,
        "noise": 2 * log_uni(rng, 0.0003, 0.006),
        "white_share": uni(rng, 0.5, 0.95),
    }
    spread, same = log_uni(rng, 0.3, 30), rng.random() < 0.5
    base = uni(rng, -spread, spread)
    unit["offsets"] = np.array([base if same else uni(rng, -spread, spread) for _ in records])
    unit["clean"] = [simulate(unit, r, {}) for r in records]
    return unit


SOIL = ["sensor_lag", "thermal_drift", "torque_offset", "asymmetric_stiffness", "viscoelastic_creep", "encoder_error"]


def draw_soil(rng, unit, taken):
    """Traces of common effects; their severities add up to less than .12."""
    names = [n for n in rng.permutation(SOIL) if n not in taken][: int(rng.integers(3, 5))]
    share = rng.dirichlet(np.full(len(names), 4.0)) * uni(rng, 0.04, 0.1)
    soil = {}
    for name, want in zip(names, share, strict=False):
        form = draw_form(rng, str(name), unit)
        if name == "sensor_lag":
            form["form"] = str(rng.choice(["delay", "first_order"]))
        s = form["guess"]
        for _ in range(4):
            v = severity(unit, {name: (form, s)})
            if v < 1e-12 or 0.85 < v / want < 1.1:
                break
            s = min(form["cap"], s * want / v)
        if severity(unit, {name: (form, s)}) < 1.2 * want:
            soil[str(name)] = (form, s)
    total = severity(unit, soil) if soil else 0.0
    return (soil, total) if total < 0.12 else ({}, 0.0)


def build_case(seed, index, wanted):
    """Draw until the wanted effects reach their sizes within plausible strengths: (unit, effects, soil, facts)."""
    kinds, need = list(MAKERS), 2
    names = [n for n, _ in wanted]
    if {"x_wear_step", "x_tooth_damage"} & set(names):
        kinds = ["planetary", "plastic", "spline_bevel"]
    need = 4 if "x_friction_between_records" in names else 3 if "x_gain_change" in names else 2
    for attempt in range(300):
        rng = np.random.default_rng([seed, index, attempt])
        unit = draw_unit(rng, kinds[(index + attempt) % len(kinds)], need)
        effects, alone = {}, {}
        for name, size in wanted:
            form = draw_form(rng, name, unit)
            got = find_strength(unit, name, form, TARGET[size])
            if got is None:
                break
            effects[name] = (form, got[0])
            alone[name] = got[1]
        if len(effects) < len(wanted):
            continue
        soil, soil_total = draw_soil(rng, unit, names)
        return (
            unit,
            effects,
            soil,
            {
                "attempts": attempt + 1,
                "alone": alone,
                "soil": soil_total,
                "total": severity(unit, effects) if effects else soil_total,
            },
        )
    raise RuntimeError(f"no plausible unit for {wanted}")


def deal(rng, units):
    """List of lists of (effect, size); for 80 units: 28 clean, 30 single, 11 unlisted, 11 pairs; scaled otherwise."""
    sizes, n_un = [1.0, 0.4, 0.2], max(1, round(units * 11 / 80))
    n_pair, n_one = max(1, round(units * 11 / 80)), round(units * 30 / 80)
    singles = (
        [[(e, s)] for s in sizes for e in LISTED][:n_one]
        if n_one >= 30
        else [[(e, sizes[i % 3])] for i, e in enumerate(rng.permutation(LISTED)[:n_one])]
    )
    while len(singles) < n_one:
        singles.append([(str(rng.choice(LISTED)), float(rng.choice(sizes)))])
    odd = list(rng.permutation(list(UNLISTED)))
    unlisted = [[(str(odd[i % len(odd)]), sizes[i % 3])] for i in range(n_un)]
    pairs, seen = [], set()
    while len(pairs) < n_pair:
        a, b = (str(x) for x in rng.choice(LISTED, 2, replace=False))
        if (a, b) in seen or (b, a) in seen:
            continue
        seen.add((a, b))
        pairs.append([(a, float(rng.choice(sizes))), (b, float(rng.choice(sizes)))])
    cases = singles + unlisted + pairs
    cases += [[] for _ in range(units - len(cases))]
    return [cases[i] for i in rng.permutation(len(cases))]


# ------------------------------------------------------------------------------------------------ files
TIME_UNITS = [("time_s", 1.0), ("t [s]", 1.0), ("t [ms]", 1e3), ("time_ms", 1e3)]
TORQUE_UNITS = [("torque_Nm", 1.0), ("M [N·m]", 1.0), ("M [Nm]", 1.0), ("torque [mNm]", 1e3), ("M_mNm", 1e3)]
ANGLE_UNITS = [
    ("angle_arcmin", 1 / ARCMIN),
    ("phi [deg]", 180 / np.pi),
    ("phi [mrad]", 1e3),
    ("angle_deg", 180 / np.pi),
    ("theta [arcsec]", 60 / ARCMIN),
    ("theta [rad]", 1.0),
]


def correlated(rng, t, share):
    """Noise of unit variance: white share of the variance, the rest an Ornstein-Uhlenbeck process."""
    n, tau = t.size, log_uni(rng, 0.0015, 0.03) * (t[-1] - t[0])
    z, e = rng.standard_normal(n), np.exp(-np.diff(t, prepend=t[0]) / tau)
    y = np.empty(n)
    y[0] = z[0]
    for i in range(1, n):
        y[i] = e[i] * y[i - 1] + np.sqrt(1 - e[i] ** 2) * z[i]
    return np.sqrt(share) * rng.standard_normal(n) + np.sqrt(1 - share) * y


def digits(quantum):
    return max(0, int(np.ceil(-np.log10(quantum))) + 1)


def write_unit(folder, name, unit, effects, soil, rng):
    os.makedirs(folder, exist_ok=True)
    default = rng.random() < 0.4
    cols = (
        [TIME_UNITS[0], TORQUE_UNITS[0], ANGLE_UNITS[0]]
        if default
        else [opts[int(rng.integers(len(opts)))] for opts in (TIME_UNITS, TORQUE_UNITS, ANGLE_UNITS)]
    )
    flip, declare = (not default) and rng.random() < 0.15, rng.random() < 0.5
    packed, lsb_angle = rng.random() < 0.3, unit["noise"] * unit["peak"] * log_uni(rng, 0.05, 1.2)
    lsb_torque, torque_noise = unit["rated"] * log_uni(rng, 2e-5, 6e-4), log_uni(rng, 5e-5, 6e-4)
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f"rated_torque_Nm = {unit['rated']:g}"]
    if rng.random() < 0.5:
        lines.append(f"reduction_ratio = {int(log_uni(rng, 5, 300))}")
    for rec in unit["records"]:
        k = rec["index"]
        t, m = rec["t"][rec["nh"] :], rec["m"][rec["nh"] :]
        theta = simulate(unit, rec, {**soil, **effects}) + unit["offsets"][k]
        theta = theta + unit["noise"] * correlated(rng, t, unit["white_share"])
        angle = np.round(theta * unit["peak"] / lsb_angle) * lsb_angle
        torque = (m + torque_noise * rng.standard_normal(m.size)) * unit["rated"]
        torque = np.round(torque / lsb_torque) * lsb_torque
        data = [
            (t * cols[0][1], 6 if cols[0][1] == 1 else 3),
            (torque * cols[1][1], digits(lsb_torque * cols[1][1])),
            (angle * cols[2][1] * (-1 if flip else 1), digits(lsb_angle * cols[2][1])),
        ]
        text = [",".join(c[0] for c in cols)]
        text += [",".join(row) for row in zip(*([f"{v:.{d}f}" for v in a] for a, d in data), strict=False)]
        zipped = packed or rng.random() < 0.1
        file = f"run-{k + 1:02d}.csv" + (".gz" if zipped else "")
        raw = ("\n".join(text) + "\n").encode()
        with open(os.path.join(folder, file), "wb") as h:
            h.write(gzip.compress(raw, 6, mtime=0) if zipped else raw)
        rec["file"] = file
        lines += ["[[record]]", f'file = "{file}"']
        if declare:
            lines += [
                f"loading_rate_Nm_per_s = {rec['rate'] * unit['rated']:.6g}",
                f"amplitude_Nm = {rec['amp'] * unit['rated']:.6g}",
            ]
        if not default:
            lines += [
                "[record.columns]",
                f'time = "{cols[0][0]}"',
                f'torque = "{cols[1][0]}"',
                f'angle = "{"-" if flip else ""}{cols[2][0]}"',
            ]
    with open(os.path.join(folder, "unit.toml"), "w", encoding="utf-8") as h:
        h.write("\n".join(lines) + "\n")
    return {"declared": declare, "columns": [c[0] for c in cols], "flipped": flip}


def plain(x):
    """Numpy values made fit for JSON, floats to six figures."""
    if isinstance(x, dict):
        return {k: plain(v) for k, v in x.items()}
    if isinstance(x, (list, tuple, np.ndarray)):
        return [plain(v) for v in x]
    if isinstance(x, (np.bool_, bool)):
        return bool(x)
    if isinstance(x, (np.integer, int)):
        return int(x)
    if isinstance(x, (np.floating, float)):
        return float(f"{x:.8g}")
    return x


def key_entry(unit, effects, soil, facts, wanted, files):
    loop = unit["reducer"].settled_loop(2000)
    rated, peak = unit["rated"], unit["peak"]
    values = {
        "lost_motion_rad": loop["lost"] * peak,
        "backlash_rad": loop["backlash"] * peak,
        "area_J": loop["area"] * peak * rated,
        "absorbed_J": loop["absorbed"] * peak * rated,
        "dissipation_ratio": loop["u"],
        "peak_rad": loop["peak"] * peak,
    }
    kind = "clean" if not wanted else "unlisted" if wanted[0][0].startswith("x_") else "pair" if len(wanted) == 2 else "listed"
    show = {
        n: {"strength": s, **{a: b for a, b in f.items() if a not in ("guess", "dice", "rates", "v_mid")}}
        for n, (f, s) in effects.items()
    }
    return plain(
        {
            "effects": [n for n, _ in wanted],
            "size": max([s for _, s in wanted], default=0.0),
            "sizes": dict(wanted),
            "rms_over_noise": facts["total"],
            "rms_alone": facts["alone"],
            "soil_over_noise": facts["soil"],
            "kind": kind,
            "indicators": {"%g" % (r["rate"] * rated): values for r in unit["records"] if r["full"]},
            "variant": {n: f["form"] for n, (f, _) in effects.items()},
            "strengths": show,
            "reducer": unit["reducer"].kind,
            "reducer_facts": unit["reducer"].note,
            "style": unit["style"],
            "amplitude_plan": unit["plan"],
            "rated_torque_Nm": rated,
            "peak_arcmin": peak / ARCMIN,
            "clearance_arcmin": unit["clearance_arcmin"],
            "noise_sd_rad": unit["noise"] * peak,
            "noise_over_peak_to_peak": unit["noise"] / 2,
            "white_share": unit["white_share"],
            "soil": {n: {"form": f["form"], "strength": s} for n, (f, s) in soil.items()},
            "attempts": facts["attempts"],
            "records": [
                {"file": r["file"], "rate_Nm_per_s": r["rate"] * rated, "amplitude_Nm": r["amp"] * rated, "full": r["full"]}
                for r in unit["records"]
            ],
            "loop_check": {
                "closure": loop["closure"],
                "odd": loop["odd"],
                "least_width": float(loop["w"].min()),
                "worst_residual": unit["reducer"].worst,
            },
            **files,
        }
    )


def selfcheck(seed, count=60):
    """Closure, oddness, step halving, width and dissipation ratio over random reducers; prints the worst per kind."""
    rng = np.random.default_rng([seed, 999])
    for kind in MAKERS:
        rows = []
        for _ in range(count // 6):
            red = MAKERS[kind](rng)
            a, b = red.settled_loop(1000), red.settled_loop(2000)
            gone = max(
                abs(a["lost"] - b["lost"]),
                abs(a["backlash"] - b["backlash"]),
                abs(a["area"] / b["area"] - 1),
                abs(a["absorbed"] / b["absorbed"] - 1),
                abs(a["u"] / b["u"] - 1),
                abs(a["peak"] / b["peak"] - 1),
            )
            rows.append([b["closure"], b["odd"], gone, b["w"][1:-1].min(), b["u"], b["backlash"], b["lost"], red.worst])
        rows = np.array(rows)
        print(
            f"{kind:13s} closure {rows[:, 0].max():.1e} odd {rows[:, 1].max():.1e} halving {rows[:, 2].max():.1e} "
            f"width {rows[:, 3].min():.1e} u {rows[:, 4].min():.3f}-{rows[:, 4].max():.3f} w0 {rows[:, 5].min():.3f}-"
            f"{rows[:, 5].max():.3f} lost {rows[:, 6].min():.3f}-{rows[:, 6].max():.3f} residual {rows[:, 7].max():.1e}"
        )


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("out")
    p.add_argument("--units", type=int, default=80)
    p.add_argument("--seed", type=int, default=11)
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
        print(
            f"{time.time() - began:7.1f} s {name} {unit['reducer'].kind:12s} {unit['style']:13s} {facts['attempts']:3d} "
            f"{facts['total']:7.3f} {facts['soil']:.3f} {wanted}",
            flush=True,
        )
    with open(os.path.join(a.out, "key.json"), "w") as h:
        json.dump(key, h, indent=1)


if __name__ == "__main__":
    main()
