"""A third virtual bench written without sight of the package: hysteresis operators and contact bundles of its own kind.

    python studies/third_outside_bench.py /tmp/third --units 80 --seed 21
    python studies/third_outside_bench.py /tmp/third --selfcheck --seed 21

One file, no import of the package. Seven clean reducers: a Preisach operator with a random density (Everett table and reversal
stack), a Coleman-Hodgdon (Duhem) loop integrated in closed form, a generalised Ramberg-Osgood/Masing loop, Segalman's Iwan joint
in series with teeth, wedge-like generalised plays of cone seats, a pin wheel with scattered pins and capstan friction, and a
flexspline ring whose two tooth zones spread with load (both driven by angle, Dahl states advanced exactly, torque balance solved
by a bracketed root). All depend on the torque's path only, are odd, and do not depend on the step (exact between turning points).
Inside torque is in units of the rated torque, angle in units of the clean settled peak at rated torque; SI at the door.
An effect's strength is bisected so that the rms of (faulty angle - clean angle at the recorded torque), after least squares on
offset of each record, compliance, cubic compliance, clearance and friction scale, is TARGET times the angle's noise.
OUT/key.json holds effects, severity and the clean loop's indicators at rated torque (k = 0.03).
"""

import argparse
import gzip
import json
import lzma
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from numba import njit

ARCMIN = np.pi / 10800
TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
LISTED = [
    "interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "sensor_lag",
    "thermal_drift", "torque_offset", "encoder_error", "stick_slip", "rate_dependent_friction",
]  # fmt: skip
UNLISTED = {
    "x_mullins": "the material is stiffer at every record's begin and softens with the work done on it, whatever the time",
    "x_onesided_snap": "a preloaded spring snaps through under + load and back at a lower torque; nothing on the - side",
    "x_cable_bursts": "bad contact in the angle channel's cable: a few short excursions that die out",
    "x_reseating": "rollers seat anew at every zero crossing of torque: random offset until the next crossing",
    "x_shock_release": "knocks on the bench relax part of the hysteresis; the reversal that follows restores it",
    "x_missing_codes": "a few bands of angle that the converter cannot show: flat there, not periodic, single-valued",
    "x_dropped_buffer": "the angle channel freezes for a buffer's length now and then, then catches up",
    "x_plastic_set": "permanent set where torque exceeds all that this record has seen: first loading only",
    "x_flank_friction": "friction under + load is another than under - load; the flanks' stiffness is equal",
    "x_axis_lift": "the shaft lifts in its bearing under load of either sign, with memory: an even loop (butterfly)",
}


# ------------------------------------------------------------------------------------------------ mechanics (kernels)
@njit(cache=True)
def everett(mode, a, b, grid, table, f):
    """Angle between reversal b and value a > b: table of a Preisach density (mode 0) or Masing's doubled skeleton (mode 1)."""
    if mode == 1:
        h = min(0.5 * (a - b) / grid[0], 1.0) ** 0.5 * (len(f) - 1)  # grid uniform in the root of the torque
        i = min(int(h), len(f) - 2)
        return 2 * (f[i] + (f[i + 1] - f[i]) * (h * h - i * i) / (2 * i + 1))
    n = table.shape[0] - 1
    x, y = (a - grid[0]) / (-2 * grid[0]) * n, (b - grid[0]) / (-2 * grid[0]) * n
    i, j = max(0, min(int(x), n - 1)), max(0, min(int(y), n - 1))
    p, q = x - i, y - j
    if i == j:  # the diagonal cell: a triangle of constant density
        return table[i + 1, i] * (p - q) ** 2
    return (1 - p) * ((1 - q) * table[i, j] + q * table[i, j + 1]) + p * ((1 - q) * table[i + 1, j] + q * table[i + 1, j + 1])


@njit(cache=True)
def stack_run(m, mode, grid, table, f):
    """Rate-independent hysteresis from a stack of turning points (virgin at zero), with the wiping-out rule."""
    out = np.empty(m.size)
    sx, sy = np.empty(m.size + 2), np.empty(m.size + 2)
    depth, last, val, up = 0, 0.0, 0.0, True
    for k in range(m.size):
        x = m[k]
        if x != last:
            now = x > last
            if k == 0 or (now != up):
                if not (depth == 0 and last == 0.0):
                    sx[depth], sy[depth] = last, val
                    depth += 1
                up = now
            while depth >= 2 and ((up and x >= sx[depth - 2]) or (not up and x <= sx[depth - 2])):
                depth -= 2
            if depth == 1 and abs(x) >= abs(sx[0]) and (x > 0) != (sx[0] > 0):
                depth = 0
            if depth == 0:
                val = 0.5 * everett(mode, abs(x), -abs(x), grid, table, f) * (1.0 if x > 0 else -1.0)
            elif up:
                val = sy[depth - 1] + everett(mode, x, sx[depth - 1], grid, table, f)
            else:
                val = sy[depth - 1] - everett(mode, sx[depth - 1], x, grid, table, f)
            last = x
        out[k] = val
    return out


@njit(cache=True)
def hodgdon_run(m, alpha, h0, h1):
    """Coleman-Hodgdon: dD = -h(m) dm - alpha |dm| D with h = h0 + h1 |m|, integrated in closed form on every step."""
    out = np.empty(m.size)
    d, last = 0.0, 0.0
    for k in range(m.size):
        parts = 2 if m[k] * last < 0 else 1
        a = last
        for part in range(parts):
            b = 0.0 if parts == 2 and part == 0 else m[k]
            u = abs(b - a)
            if u > 0:
                sign = 1.0 if b > a else -1.0
                slope = h1 * (abs(b) - abs(a)) / u
                e = np.exp(-alpha * u)
                g = (1 - e) / alpha
                d = e * d - sign * ((h0 + h1 * abs(a)) * g + slope * (u - g) / alpha)
            a = b
        last = m[k]
        out[k] = d
    return out


@njit(cache=True)
def wedge_run(m, mu, drag, weight, p):
    """Cone seats: the spring behind a wedge holds its force between m/(1+mu) - drag and m/(1-mu) + drag (generalised play)."""
    out = np.zeros(m.size)
    y = np.zeros(mu.size)
    for k in range(m.size):
        x = m[k]
        for i in range(mu.size):
            low = (x / (1 + mu[i]) if x > 0 else x / (1 - mu[i])) - drag[i]
            high = (x / (1 - mu[i]) if x > 0 else x / (1 + mu[i])) + drag[i]
            y[i] = min(max(y[i], low), high)
            out[k] += weight[i] * y[i] * (y[i] * y[i] + 0.004) ** (0.5 * (p - 1))
    return out


@njit(cache=True)
def teeth_run(m, drag, width, weight, hard):
    """Clearances: crossed when torque overcomes a drag, spread over a width of torque; many teeth or one."""
    out = np.zeros(m.size)
    y = np.zeros(drag.size)
    for k in range(m.size):
        for i in range(drag.size):
            y[i] = min(max(y[i], m[k] - drag[i]), m[k] + drag[i])
            z = y[i] / width[i]
            out[k] += weight[i] * (min(max(z, -1.0), 1.0) if hard else z / (1 + abs(z) ** 3) ** (1 / 3))
    return out


@njit(cache=True)
def bundle_torque(x, x0, s, lam, gap, stiff, p, mu, k0, drag):
    n = gap.size
    step, sign = abs(x - x0), (1.0 if x > x0 else -1.0)
    e = np.exp(-step / lam[n])
    total = k0 * x + drag * (sign + (s[n] - sign) * e)
    for i in range(n):
        pen = abs(x) - gap[i]
        if pen > 0:
            si = sign + (s[i] - sign) * np.exp(-step / lam[i])
            if x > 0:
                total += stiff[i] * pen**p * np.exp(mu[i] * si)
            else:
                total -= stiff[i] * pen**p * np.exp(-mu[i] * si)
    return total


@njit(cache=True)
def bundle_run(m, lam, gap, stiff, p, mu, k0, drag):
    """Pins that touch one after another, capstan friction by Dahl states of angle; solves torque balance at every sample."""
    n = gap.size
    out = np.empty(m.size)
    s = np.zeros(n + 1)
    x0, t0, stride = 0.0, 0.0, 1e-3
    for k in range(m.size):
        if m[k] != t0:
            sign = 1.0 if m[k] > t0 else -1.0
            a, fa = x0, t0 - m[k]
            h = sign * stride
            b = x0 + h
            fb = bundle_torque(b, x0, s, lam, gap, stiff, p, mu, k0, drag) - m[k]
            while fb * sign < 0:
                a, fa = b, fb
                h *= 2
                b += h
                fb = bundle_torque(b, x0, s, lam, gap, stiff, p, mu, k0, drag) - m[k]
            x, side = b, 0.0
            for it in range(80):  # Illinois, with a bisection now and then
                x = 0.5 * (a + b) if it % 4 == 3 else (a * fb - b * fa) / (fb - fa)
                fx = bundle_torque(x, x0, s, lam, gap, stiff, p, mu, k0, drag) - m[k]
                if abs(fx) < 1e-11 or abs(b - a) < 1e-13:
                    break
                same = 0.5 if side == np.sign(fx) else 1.0
                side = np.sign(fx)
                if fx * sign > 0:
                    b, fb, fa = x, fx, fa * same
                else:
                    a, fa, fb = x, fx, fb * same
            sg = 1.0 if x > x0 else -1.0
            for i in range(n + 1):
                s[i] = sg + (s[i] - sg) * np.exp(-abs(x - x0) / lam[i])
            stride = max(abs(x - x0) * 0.7, 1e-7)
            x0, t0 = x, m[k]
        out[k] = x0
    return out


# ------------------------------------------------------------------------------------------------ clean reducers
FAMILIES = ["preisach", "hodgdon", "masing", "iwan", "cone", "pinwheel", "flexring"]
NO_RETURN = ("hodgdon", "pinwheel", "flexring")  # Duhem and Dahl states: minor loops do not close (an artefact), so none are run
DUMMY, EDGE = np.zeros((2, 2)), 1.6


class Reducer:
    """A clean reducer: run(m, cs, fs) is the angle on a torque path from the virgin state; cs, fs scale clearance, friction."""

    def __init__(self, kind, rng):
        self.kind, self.norm, self.cs, self.fs = kind, 1.0, 1.0, 1.0
        ln = lambda lo, hi: float(np.exp(rng.uniform(np.log(lo), np.log(hi))))  # noqa: E731
        q = self.q = {}
        q["law"] = str(rng.choice(["linear", "hertz", "polymer"]))
        q["p"], q["soft"] = rng.uniform(0.62, 0.92), rng.uniform(0.08, 0.5)
        q["one"] = bool(rng.random() < 0.3)  # one tooth or many
        n = 1 if q["one"] else int(rng.integers(8, 30))
        q["drag"] = ln(0.008, 0.12) * np.exp(0.35 * rng.standard_normal(n))
        q["width"] = ln(0.015, 0.15) * np.exp(0.5 * rng.standard_normal(n)) + (0 if q["one"] else 0.01)
        q["weight"] = rng.dirichlet(np.full(n, 3.0))
        if kind == "preisach":
            g = np.linspace(-EDGE, EDGE, 641)
            c = 0.5 * (g[1:] + g[:-1])
            a, b = np.meshgrid(c, c, indexing="ij")
            mean, half, mu = (a + b) / 2, (a - b) / 2, np.zeros_like(a)
            for _ in range(rng.integers(2, 5)):
                m0, sm, hs = rng.uniform(0, 0.6), rng.uniform(0.1, 0.5), ln(0.04, 0.3)
                bump = np.exp(-(((np.abs(mean) - m0) / sm) ** 2)) * np.exp(-half / hs) * (half / hs + rng.uniform(0.2, 1.5))
                mu += rng.random() * bump / bump[a >= b].sum()
            mu[a < b] = 0
            mu[np.arange(640), np.arange(640)] *= 0.5
            tab = np.zeros((641, 641))  # tab[i, j]: density with b_j < b < a < a_i
            tab[1:, :-1] = np.cumsum(np.cumsum(mu, 0)[:, ::-1], 1)[:, ::-1]
            q["table"], q["grid"] = tab / tab[-1, 0], np.array([-EDGE, EDGE])
        elif kind == "hodgdon":
            q["alpha"], q["share"] = ln(2.0, 14.0), rng.random()
        elif kind == "masing":
            q["n"], q["bend"], q["mode2"] = rng.uniform(1.4, 3.2), rng.uniform(0.45, 1.0), rng.uniform(0.02, 0.4)
        elif kind == "iwan":
            q["chi"], q["eta"], q["phi"] = rng.uniform(-0.8, -0.1), rng.uniform(0.3, 0.6), rng.uniform(0.8, 2.0)
        elif kind == "cone":
            n = int(rng.integers(6, 25))
            q["mu"], q["cd"] = ln(0.03, 0.25) * rng.uniform(0.1, 2, n), ln(0.003, 0.08) * rng.exponential(1, n)
            q["cw"] = rng.dirichlet(np.full(n, 2.0))
        elif kind in ("pinwheel", "flexring"):
            if kind == "pinwheel":
                n = int(rng.integers(10, 41))
                arm = np.abs(np.sin((np.arange(n) + rng.random()) * np.pi / n))
                gap = rng.choice([1, 0]) * np.abs(rng.standard_normal(n)) + rng.exponential(0.4, n) + 0.7
                q["pp"] = float(rng.choice([1.0, 10 / 9, 1.5]))
            else:  # zones spread from the major axis outward; the second zone is entered later
                n = 2 * int(rng.integers(8, 17))
                psi = np.linspace(0, 1, n // 2)
                arm = np.r_[np.cos(psi), np.cos(psi)]
                gap = np.r_[psi**2 * 2.0, rng.uniform(0.1, 0.7) + psi**2 * 2.0] + 0.3
                q["pp"] = float(rng.choice([1.0, 1.2]))
            q["gap"], q["arm"] = gap / gap.mean(), arm * np.exp(0.15 * rng.standard_normal(n)) / arm.sum()
            q["lam"] = ln(0.01, 0.08) * np.exp(0.5 * rng.standard_normal(n + 1))
            q["cap"], q["bdrag"] = ln(0.02, 0.3) * rng.uniform(0.5, 1.5, n), ln(0.003, 0.1)
            q["k0"], q["series"] = ln(0.015, 0.08), rng.uniform(0.1, 0.8)
        self.tune(rng, ln)

    def tune(self, rng, ln):
        """Spread dissipation ratio and lost motion over the range of real reducers: scales of friction and clearance."""
        aim_u, aim_l = ln(0.022, 0.55), 0.0 if rng.random() < 0.25 else rng.uniform(0.02, 0.38)
        for _ in range(2):
            for name, key, aim in (("cs", "lost", aim_l), ("fs", "u", aim_u)):
                lo, hi = np.log(1e-4 if name == "cs" else 0.01), np.log(3.0 if name == "cs" else 12.0)
                for _ in range(14):
                    setattr(self, name, float(np.exp(0.5 * (lo + hi))))
                    lo, hi = (lo, 0.5 * (lo + hi)) if self.loop(500)[key] > aim else (0.5 * (lo + hi), hi)
        self.norm *= self.loop(1000)["peak"]

    def elastic(self, m):
        q = self.q
        if q["law"] == "hertz":
            return m * (m * m + 2e-3) ** (0.5 * (q["p"] - 1))
        return m + (q["soft"] * m**3 if q["law"] == "polymer" else 0.0)

    def run(self, m, cs=1.0, fs=1.0):
        q, cs, fs = self.q, cs * self.cs, fs * self.fs
        m = np.clip(np.ascontiguousarray(m, float), -1.55, 1.55)
        if self.kind in ("pinwheel", "flexring"):
            mu = np.minimum(fs * q["cap"], 1.2)
            pins = bundle_run(m, q["lam"], cs * q["gap"], q["arm"], q["pp"], mu, q["k0"], fs * q["bdrag"])
            return (pins + q["series"] * self.elastic(m)) / self.norm
        drag = np.minimum(fs * q["drag"], 0.3)
        width = q["width"] if q["one"] else np.maximum(q["width"], 0.5 * drag)  # many teeth make one soft step, not a stair
        out = teeth_run(m, drag, width, cs * q["weight"], q["one"])
        if self.kind == "preisach":
            out += fs * 0.5 * stack_run(m, 0, q["grid"], q["table"], DUMMY[0]) + self.elastic(m)
        elif self.kind == "hodgdon":
            h = min(fs, 0.5 if q["law"] == "hertz" else 0.95)  # a loop that never turns back
            out += hodgdon_run(m, q["alpha"], h * q["share"], h * (1 - q["share"])) + self.elastic(m)
        elif self.kind == "masing":
            x = np.sign(m) * ((np.abs(m) + q["mode2"]) ** q["bend"] - q["mode2"] ** q["bend"])
            f = (np.linspace(0, 1, 3000) ** 2 * 2.0) ** q["n"]
            out += fs * stack_run(x, 1, np.array([2.0]), DUMMY, f) + self.elastic(m)
        elif self.kind == "iwan":
            eta = min(fs * q["eta"], 0.9 / (q["chi"] + 2))
            x = np.r_[0, np.geomspace(1e-9, 40, 6000)]
            r = np.minimum(x / q["phi"], 1.0)
            end = 1 - eta * (q["chi"] + 2)
            tq = x * 0 + q["phi"] * r * (1 - eta * r ** (q["chi"] + 1)) + end * np.maximum(x - q["phi"], 0)
            f = np.interp(np.linspace(0, 1, 3000) ** 2 * 2.0, tq, x)
            out += stack_run(m, 1, np.array([2.0]), DUMMY, f) + 0.6 * self.elastic(m)
        elif self.kind == "cone":
            out += wedge_run(m, np.minimum(fs * q["mu"], 0.8), fs * q["cd"], q["cw"], q["p"] if q["law"] == "hertz" else 1.0)
            out += 0.3 * self.elastic(m)
        return out / self.norm

    def loop(self, n, k=0.03):
        """Settled loop of amplitude 1 and its indicators (method.md, section 1)."""
        up = np.linspace(-1, 1, 2 * n + 1)
        path = np.r_[np.linspace(0, 1, n)[:-1], 1, -1, 1, -1, up[::-1], up[1:], up[::-1][1:], up[1:]]
        a = self.run(path)
        asc, desc = a[-2 * n - 1 :], a[-4 * n - 1 : -2 * n][::-1]
        mid, w, trap = 0.5 * (asc + desc), desc - asc, np.trapezoid
        area, lost = trap(w, up), float(np.interp(k, up, mid) - np.interp(-k, up, mid))
        work = trap(up[n:], asc[n:]) + trap(up[: n + 1][::-1], desc[: n + 1][::-1])
        return {
            "up": up, "asc": asc, "desc": desc, "lost": lost / asc[-1],
            "backlash": w[n], "area": area, "absorbed": work, "u": area / work, "peak": 0.5 * (asc[-1] - desc[0]),
            "closure": max(abs(w[0]), abs(w[-1])), "odd": np.abs(asc + desc[::-1]).max(), "least": w.min(),
            "slope": min(np.diff(asc).min(), np.diff(desc).min()) * n, "lost_abs": lost,
        }  # fmt: skip


# ------------------------------------------------------------------------------------------------ the tests
STYLES = ["triangle", "sine", "dwell", "deadweights", "hand", "servo", "random"]


def turning_points(rng, style, amp, cycles, minor):
    s = rng.choice([1, -1])
    jit = {"hand": 0.03, "random": 0.004, "deadweights": 0.0}.get(style, 0.002)
    tip = lambda sign: sign * amp * (1 - abs(jit * rng.standard_normal()))  # noqa: E731
    pts = [0.0]
    if style == "random":
        pts += list(amp * rng.uniform(-0.9, 0.9, rng.integers(4, 9)))
    where = int(rng.integers(0, cycles)) if minor else -1
    for c in range(cycles):
        for sign in (s, -s):
            if c == where and sign == s and c > 0:  # a minor loop on the way
                x = rng.uniform(-0.3, 0.7) * amp * s
                pts += [x, x - s * amp * rng.uniform(0.2, 0.6)]
            pts.append(tip(sign))
    return np.array(pts + ([0.0] if rng.random() < 0.5 else [tip(s)]))


def path(rng, style, pts, rate, n):
    """Times and torque at n samples along turning points; the mechanics sees just these samples."""
    t, p = [0.0], [pts[0]]
    hold = rng.uniform(0.1, 0.5) / rate
    levels = int(rng.integers(5, 11))
    for a, b in zip(pts[:-1], pts[1:], strict=True):
        dur = max(abs(b - a), 0.02) / rate * (np.exp(0.35 * rng.standard_normal()) if style == "hand" else 1.0)
        if style in ("sine", "hand"):
            x = np.linspace(0, 1, 61)[1:]
            y = 0.5 - 0.5 * np.cos(np.pi * x) if style == "sine" else x + 0.10 * rng.uniform(-1, 1) * np.sin(2 * np.pi * x)
            if style == "hand":
                x = x + 0.03 * rng.uniform(-1, 1) * np.sin(4 * np.pi * x)
            t += list(t[-1] + dur * x)
            p += list(a + (b - a) * y)
        elif style == "deadweights":
            m = max(2, round(levels * abs(b - a)))
            for i in range(1, m + 1):
                t += [t[-1] + 0.15 * dur / m, t[-1] + dur / m]
                p += [a + (b - a) * i / m] * 2
        else:
            t.append(t[-1] + dur)
            p.append(b)
            if style in ("dwell", "servo"):
                t.append(t[-1] + hold)
                p.append(b)
    t, p = np.array(t), np.array(p)
    if style == "servo":  # second-order servo behind a trapezoid: overshoots by a few per cent at each stop
        dt = t[-1] / 40000
        w, z, y, v = rng.uniform(0.012, 0.04), rng.uniform(0.35, 0.7), p[0], 0.0
        tt = np.arange(40001) * dt
        w, cmd, yy = 2 / (w * 2 / rate), np.interp(np.arange(40001) * dt, t, p), np.empty(40001)
        for i in range(40001):
            v += dt * (w * w * (cmd[i] - y) - 2 * z * w * v)
            y += dt * v
            yy[i] = y
        t, p = tt, yy
    ts = np.linspace(0, t[-1], n)
    if style == "hand" or rng.random() < 0.15:
        ts[1:-1] += rng.uniform(-0.35, 0.35, n - 2) * ts[1]
    return ts, np.interp(ts, t, p)


def plan_unit(rng, severity):
    """A reducer on a bench: scales, noise, records with what came before them."""
    lg = lambda lo, hi: float(np.exp(rng.uniform(np.log(lo), np.log(hi))))  # noqa: E731
    while True:
        red = Reducer(str(rng.choice(FAMILIES)), rng)
        lp = red.loop(1500)
        sound = lp["slope"] > 0 and lp["least"] > -1e-6 and lp["closure"] < 1e-6
        if 0.018 < lp["u"] < 0.62 and -1e-6 < lp["lost"] < 0.42 and sound:
            break
    unit = {"reducer": red, "rated": float(f"{lg(0.05, 1000):.2g}"), "peak": lg(0.5, 60) * ARCMIN}
    unit["style"] = str(rng.choice(STYLES))
    unit["noise"] = 2 * lg(2e-4, 4e-3 if severity < 1 else 1.6e-3)  # in units of the peak
    unit["white"], unit["quant"] = float(rng.choice([1.0, 0.7, 0.4])), bool(rng.random() < 0.35)
    unit["torque_noise"] = unit["noise"] * rng.uniform(0.05, 0.45)
    unit["plan"] = str(rng.choice(["equal", "sweep", "minor"], p=[0.5, 0.25, 0.25]))
    if red.kind in NO_RETURN:
        unit["plan"] = "equal" if unit["plan"] == "minor" else unit["plan"]
        unit["style"] = "triangle" if unit["style"] == "random" else unit["style"]
    nrec = int(rng.integers(2, 6))
    fast, span = 4 / lg(5, 40), lg(10, 100)
    rates = fast / np.geomspace(1, span, min(nrec, 3))
    rates = [float(f"{r:.2g}") for r in np.r_[rates, rng.choice(rates, nrec - len(rates))]]
    amps = np.ones(nrec)
    if unit["plan"] == "sweep" and nrec > 2:
        amps[2:] = np.round(rng.uniform(0.35, 0.85, nrec - 2), 2)
    elif unit["plan"] == "sweep":
        amps[1] = 0.7
    clock, n0 = 0.0, lg(300, 6000)
    unit["records"] = []
    for i in rng.permutation(nrec):
        pts = turning_points(rng, unit["style"], amps[i], int(rng.integers(3, 5)), unit["plan"] == "minor")
        n = int(np.clip(n0 * lg(0.7, 1.4), 300, 6000))
        rate = rates[i]
        t, p = path(rng, unit["style"], pts, rate, n)
        pre = np.zeros(0)
        if rng.random() < 0.5:  # the reducer was loaded before this record
            tip = rng.uniform(0.3, 1.0, 3) * amps[i] * rng.choice([1, -1]) * np.array([1, -1, 1])
            pre = np.interp(np.linspace(0, 4, 400), np.arange(5), np.r_[0, tip, p[0]])[:-1]
        pause = 30 + 300 * rng.random()
        tp = -np.arange(len(pre), 0, -1) * (max(np.abs(np.diff(pre)).max(), 1e-3) / rate if len(pre) else 1.0)
        rec = {"t": np.r_[tp, t], "p": np.r_[pre, p], "keep": slice(len(pre), None), "clock": clock + pause}
        rec |= {"amp": float(amps[i])}
        rec |= {"rate": rate if unit["style"] in ("triangle", "dwell") else float(f"{np.abs(np.diff(p)).sum() / t[-1]:.3g}")}
        rec |= {"full": bool(amps[i] > 0.95), "period": float(t[-1] / (np.abs(np.diff(p)).sum() / 4 / amps[i])), "index": int(i)}
        clock += pause + t[-1]
        rec["base"] = red.run(rec["p"])
        unit["records"].append(rec)
    unit["session"] = clock
    unit["vmax"] = max(r["rate"] for r in unit["records"])
    unit["vmin"] = min(r["rate"] for r in unit["records"])
    cols = []
    for k, rec in enumerate(unit["records"]):  # what a clean unit's own parameters could absorb
        s = rec["keep"]
        base, moved = rec["base"][s], [red.run(rec["p"], cs=1.1)[s], red.run(rec["p"], fs=1.1)[s]]
        own = [base, rec["p"][s] ** 3, *(x - base for x in moved)]
        cols.append(np.column_stack([np.full(len(own[0]), float(j == k)) for j in range(nrec)] + own))
    a = np.vstack(cols)
    u, sv, _ = np.linalg.svd(a / np.maximum(np.linalg.norm(a, axis=0), 1e-12), full_matrices=False)
    unit["basis"] = u[:, sv > 1e-7]
    return unit


# ------------------------------------------------------------------------------------------------ effects
class Sig:
    """One record on its way: plan p, true torque m, recorded torque r, drag torque, angle a."""

    def __init__(self, unit, rec):
        self.unit, self.rec, self.t, self.p = unit, rec, rec["t"], rec["p"]
        self.m, self.r, self.drag, self.factor, self.zero, self.a = self.p, self.p, 0.0, 1.0, 0.0, None


@njit(cache=True)
def play(x, r):
    """Play operator whose half width r may change from sample to sample."""
    y, out = 0.0, np.empty(x.size)
    for i in range(x.size):
        y = min(max(y, x[i] - r[i % r.size]), x[i] + r[i % r.size])
        out[i] = y
    return out


@njit(cache=True)
def one_way(x, y0):
    """Keeps the larger of what loading to either side gives: up by y0 at +x, down by -y0 at -x, stays in between."""
    s, out = 0.0, np.empty(x.size)
    for i in range(x.size):
        if x[i] > 0 and y0[i] > s:
            s = y0[i]
        elif x[i] < 0 and -y0[i] < s:
            s = -y0[i]
        out[i] = s
    return out


@njit(cache=True)
def lowpass(t, x, tau):
    """First-order response to a piecewise linear input, exact."""
    y, out = x[0], np.empty(x.size)
    out[0] = y
    for i in range(1, x.size):
        h = t[i] - t[i - 1]
        if h > 0:
            c = (x[i] - x[i - 1]) / h
            y = x[i] - c * tau + (y - x[i - 1] + c * tau) * np.exp(-h / tau)
        out[i] = y
    return out


@njit(cache=True)
def direction(m, span):
    """Sign of motion, turned over gradually within a span of torque after each reversal (Dahl)."""
    s, out = 0.0, np.empty(m.size)
    for i in range(m.size):
        d = m[i] - (m[i - 1] if i else 0.0)
        if d != 0.0:
            g = 1.0 if d > 0 else -1.0
            s = g + (s - g) * np.exp(-abs(d) / span)
        out[i] = s
    return out


@njit(cache=True)
def stick(a, gate, h):
    """Angle sticks until it lags by h[i], then jumps to where it belongs; only where the gate is open."""
    y, j, out = a[0], 0, np.empty(a.size)
    for i in range(a.size):
        if gate[i] < 0.5 or abs(a[i] - y) > h[j % h.size]:
            j += gate[i] > 0.5
            y = a[i]
        out[i] = y
    return out


def speed(sig):
    """|dm/dt| smoothed; a rest keeps the value of the last motion."""
    dt = np.maximum(np.diff(sig.t, prepend=sig.t[0] - 1), 1e-9)
    v = np.abs(np.diff(sig.p, prepend=sig.p[0])) / dt
    moving = v > 0.02 * sig.rec["rate"]
    last = np.maximum.accumulate(np.where(moving, np.arange(v.size), 0))
    v = np.clip(np.where(moving[last], v[last], sig.rec["rate"]), 0.1 * sig.unit["vmin"], 3 * sig.unit["vmax"])
    k = np.ones(9) / 9
    return np.exp(np.convolve(np.pad(np.log(v), 4, "edge"), k, "valid"))


def ramp(x, e):
    z = np.clip(x / e, 0, 1)
    return z * z * (3 - 2 * z)


def draw(name, rng, unit):
    """A random, physically plausible form of an effect. 'top' bounds the strength."""
    u = lambda lo, hi: float(rng.uniform(lo, hi))  # noqa: E731
    pick = lambda *c: str(rng.choice(list(c)))  # noqa: E731
    d = {"seed": int(rng.integers(1 << 30)), "sign": float(rng.choice([1, -1])), "top": 0.6}
    periods = sorted(r["period"] for r in unit["records"])
    if name == "interface_slip":
        d |= {"form": pick("clamp_returns", "key_travel", "microslip"), "at": u(0.55, 0.82), "e": u(0.03, 0.12)}
        d |= {"p": u(1.2, 2.0), "hys": u(0.1, 0.25), "top": 3.0}
    elif name == "viscoelastic_creep":
        d |= {"form": pick("one_time", "two_times", "spectrum", "nonlinear"), "top": 1.5}
        lo, hi = np.log(0.05 * periods[0]), np.log(0.6 * periods[-1])
        n = {"two_times": 2, "spectrum": 8}.get(d["form"], 1)
        d["tau"] = list(np.exp(np.linspace(lo, hi, 8) if n == 8 else lo + (hi - lo) * rng.uniform(0.15, 0.85, n)))
    elif name == "asymmetric_stiffness":
        d |= {"form": pick("flank_linear", "flank_hardening", "flank_contact"), "p": u(1.4, 2.2), "top": 1.5}
    elif name == "second_backlash":
        d |= {"form": pick("preloaded_stage", "dragged_stage"), "at": u(0.15, 0.45), "hys": u(0.02, 0.1), "e": u(0.02, 0.07)}
    elif name == "sensor_lag":
        d |= {"form": pick("angle_delay", "angle_lowpass", "torque_lowpass", "torque_delay"), "top": 0.2 * periods[0]}
    elif name == "thermal_drift":
        d |= {"form": pick("linear", "warm_up", "wander", "compliance"), "tau": u(0.2, 0.8) * unit["session"], "top": 3.0}
    elif name == "torque_offset":
        d |= {"form": pick("sensor_zero", "dead_weight"), "top": 0.2}
    elif name == "encoder_error":
        d |= {"form": pick("sine", "two_harmonics", "triangle"), "period": 2 / u(1.6, 9), "phase": u(0, 2 * np.pi), "top": 0.5}
        d["top"] = 0.6 * d["period"] / (2 * np.pi)
    elif name == "stick_slip":
        d |= {"form": pick("in_motion", "under_load", "breakaway"), "at": u(0.4, 0.75), "top": 0.5}
    elif name == "rate_dependent_friction":
        d |= {"form": pick("logarithmic", "viscous", "stribeck"), "load": u(0, 1), "top": 0.3}
        d["vs"] = unit["vmin"] * (unit["vmax"] / unit["vmin"]) ** u(0.3, 0.8)
    elif name == "x_onesided_snap":
        d |= {"form": "snap", "at": u(0.3, 0.7), "hys": u(0.1, 0.3), "e": 0.02}
    elif name == "x_mullins":
        d |= {"form": "softening", "work": u(0.8, 3.0), "top": 0.8}
    elif name == "x_axis_lift":
        d |= {"form": "butterfly", "r": u(0.15, 0.4), "top": 2.0}
    else:
        d |= {"form": name[2:], "top": 0.8 if name == "x_flank_friction" else 1.5}
    return d


PRE = ("torque_offset", "rate_dependent_friction", "x_flank_friction", "thermal_drift", "x_mullins")
ORDER = [
    *PRE, "interface_slip", "second_backlash", "asymmetric_stiffness", "viscoelastic_creep", "x_onesided_snap", "x_reseating",
    "x_plastic_set", "x_axis_lift", "x_shock_release", "stick_slip", "encoder_error", "x_missing_codes", "sensor_lag",
    "x_dropped_buffer", "x_cable_bursts",
]  # fmt: skip


def act(name, s, d, x):
    """Apply an effect of strength x to a record on its way."""
    form, g, t, m, unit = d["form"], d["sign"], s.t, s.m, s.unit
    rng = np.random.default_rng([d["seed"], s.rec["index"]])
    dm = np.abs(np.diff(m, prepend=m[0]))
    if name == "torque_offset":
        if form == "dead_weight":
            s.m = m + g * x
        else:
            s.r = s.r + g * x
    elif name == "rate_dependent_friction":
        v = speed(s)
        if form == "logarithmic":  # rises or falls with the logarithm of speed
            phi = np.clip(np.log(v / unit["vmin"]) / np.log(unit["vmax"] / unit["vmin"]), 0, 1.2)
            phi = phi if g > 0 else 1.2 - phi
        else:
            phi = v / unit["vmax"] if form == "viscous" else np.exp(-v / d["vs"])
        s.drag = s.drag + x * phi * (1 - d["load"] + d["load"] * np.abs(m))
    elif name == "x_flank_friction":
        s.drag = s.drag + x * np.maximum(g * m, 0)
    elif name == "x_mullins":
        work = np.cumsum(np.abs(m) * dm * (np.arange(m.size) >= s.rec["keep"].start))
        s.factor = s.factor * (1 - x * np.exp(-work / d["work"]))
    elif name == "thermal_drift":
        clock = (s.rec["clock"] + t) / unit["session"]
        if form == "linear":
            s.zero = g * x * clock
        elif form == "compliance":
            s.factor = s.factor * (1 + g * x * (1 - np.exp(-np.maximum(clock, 0) * unit["session"] / d["tau"])))
        elif form == "warm_up":
            s.zero = g * x * (1 - np.exp(-(s.rec["clock"] + t) / d["tau"]))
        else:
            one = np.random.default_rng(d["seed"])
            f, ph, c = one.uniform(0.2, 3.0, 4), one.uniform(0, 6.3, 4), one.standard_normal(4)
            s.zero = x * sum(ci * np.sin(2 * np.pi * fi * clock + pi) / (1 + fi) for fi, pi, ci in zip(f, ph, c, strict=True))
    elif name == "interface_slip":
        if form == "clamp_returns":
            y = play(m, np.array([d["hys"]]))
            s.a = s.a + x * np.sign(y) * np.maximum(np.abs(y) - d["at"] + d["hys"], 0)
        else:
            z = ramp(np.abs(m) - d["at"], d["e"]) if form == "key_travel" else np.maximum(np.abs(m) - d["at"], 0) ** d["p"] * 3
            s.a = s.a + x * one_way(m, z)
    elif name == "second_backlash":
        if form == "preloaded_stage":
            y = play(m, np.array([d["hys"]]))
            s.a = s.a + x * (ramp(y - d["at"], d["e"]) - ramp(-y - d["at"], d["e"]))
        else:
            s.a = s.a + x * one_way(m, ramp(np.abs(m) - d["at"], d["e"]))
    elif name == "asymmetric_stiffness":
        pos = np.maximum(g * m, 0)
        if form == "flank_contact":
            s.a = s.a + x * g * 0.5 * (1 - np.exp(-pos / 0.4))
        else:
            s.a = s.a + x * g * (pos if form == "flank_linear" else pos ** d["p"])
    elif name == "viscoelastic_creep":
        load = m * np.abs(m) if form == "nonlinear" else m
        s.a = s.a + x * sum(lowpass(t, load, tau) for tau in d["tau"]) / len(d["tau"])
    elif name == "x_onesided_snap":
        y = play(g * m - d["at"] + d["hys"] / 2, np.array([d["hys"] / 2]))
        s.a = s.a + x * g * ramp(y, d["e"])
    elif name == "x_reseating":
        cross = np.cumsum(np.diff(np.sign(m), prepend=np.sign(m[0])) != 0)
        off = np.random.default_rng(d["seed"] + s.rec["index"]).standard_normal(cross.max() + 1)
        prev, top = np.r_[0, off][cross], np.abs(m)
        for c in range(cross.max() + 1):
            top[cross == c] = np.maximum.accumulate(top[cross == c])
        s.a = s.a + x * (prev + (off[cross] - prev) * ramp(top, 0.06))
    elif name == "x_plastic_set":
        on = np.arange(m.size) >= s.rec["keep"].start
        top = np.maximum.accumulate(np.where(on, m, 0)) - np.maximum.accumulate(np.where(on, -m, 0))
        s.a = s.a + x * top
    elif name == "x_axis_lift":
        s.a = s.a + g * x * np.abs(play(m, np.array([d["r"]])))
    elif name == "x_shock_release":
        turn = np.r_[0, np.diff(np.sign(np.diff(m, prepend=m[0]))) != 0]
        leg = np.cumsum(np.abs(turn))
        free = np.zeros(m.size)
        for k in sorted(rng.choice(np.arange(5, m.size - 5), 7, replace=False)):
            rest = np.arange(k, m.size)
            stop = np.searchsorted(leg[k:], leg[k] + 1)  # until the next reversal, then fades over a span of torque
            run = np.cumsum(np.where(np.arange(rest.size) > stop, dm[k:], 0.0))
            free[k:] += np.sign(m[k] - m[k - 4]) * np.exp(-run / 0.15)
        s.a = s.a + x * np.clip(free, -1, 1)
    elif name == "stick_slip":
        gate = np.ones(m.size) if form != "under_load" else (np.abs(m) > d["at"]).astype(float)
        if form == "breakaway":  # only within a span after a reversal
            gate = (direction(m, 0.12) * np.sign(np.diff(m, prepend=m[0])) < 0.9).astype(float)
        s.a = stick(s.a, gate, x * np.exp(0.3 * rng.standard_normal(64)))
    elif name == "encoder_error":
        ph = 2 * np.pi * s.a / d["period"] + d["phase"]
        if form == "triangle":
            e = np.arcsin(np.sin(ph)) * 2 / np.pi
        else:
            e = np.sin(ph) + (0.4 * np.sin(2 * ph + 1.0) if form == "two_harmonics" else 0.0)
        s.a = s.a + x * e
    elif name == "x_missing_codes":
        one = np.random.default_rng(d["seed"])
        for c in one.uniform(-0.85, 0.85, int(one.integers(2, 5))):
            w = x * one.uniform(0.5, 1.5)
            s.a = np.where(np.abs(s.a - c) < w / 2, c - w / 2, s.a)
    elif name == "sensor_lag":
        if form == "angle_delay":
            s.a = np.interp(t - x, t, s.a)
        elif form == "angle_lowpass":
            s.a = lowpass(t, s.a, x)
        elif form == "torque_delay":
            s.r = np.interp(t - x, t, s.r)
        else:
            s.r = lowpass(t, s.r, x)
    elif name == "x_dropped_buffer":
        n, a = m.size, s.a.copy()
        for k in rng.choice(n, 8):
            w = max(2, int(n * x * 0.05 * rng.uniform(0.5, 1.5)))
            a[k : k + w] = a[k]
        s.a = a
    elif name == "x_cable_bursts":
        for _ in range(6):
            k, w = int(rng.integers(s.rec["keep"].start, m.size)), max(3, int(m.size * rng.uniform(0.002, 0.02)))
            j = np.arange(m.size - k)
            s.a = s.a.copy()
            s.a[k:] += x * rng.uniform(0.5, 1.5) * rng.choice([1, -1]) * np.exp(-j / w) * np.cos(j / w * rng.uniform(0, 6))


def respond(unit, rec, effs):
    """Recorded torque and angle, and the clean angle at the recorded torque."""
    s = Sig(unit, rec)
    effs = sorted(effs, key=lambda e: ORDER.index(e[0]))
    for name, d, x in effs:
        if name in PRE:
            act(name, s, d, x)
    eff = play(s.m, s.drag) if np.any(s.drag) else s.m  # the drag holds back what the springs get
    base = rec["base"] if eff is s.p or np.array_equal(eff, s.p) else unit["reducer"].run(eff)
    s.a = base * s.factor + s.zero
    for name, d, x in effs:
        if name not in PRE:
            act(name, s, d, x)
    clean = rec["base"] if s.r is s.p else unit["reducer"].run(s.r)
    return s.r[rec["keep"]], s.a[rec["keep"]], clean[rec["keep"]]


def rms(unit, effs):
    """Rms of faulty minus clean angle after the clean unit's own parameters took what they can, over the noise."""
    d = np.concatenate([a - c for _, a, c in (respond(unit, r, effs) for r in unit["records"])])
    d = d - unit["basis"] @ (unit["basis"].T @ d)
    return float(np.sqrt(np.mean(d**2))) / unit["noise"]


def calibrate(unit, name, rng, target, tries=10, tol=0.02):
    for _ in range(tries):
        d = draw(name, rng, unit)
        hi = d["top"]
        if rms(unit, [(name, d, hi)]) < target:
            continue
        lo, x, got = hi * 1e-5, hi, 0.0
        for it in range(40):  # bisection in the logarithm, helped by a secant on the last value
            x = x * target / got if got > 0 and it % 2 and lo < x * target / got < hi else np.sqrt(lo * hi)
            got = rms(unit, [(name, d, x)])
            if abs(got / target - 1) < tol:
                return (name, d, float(x)), got
            lo, hi = (x, hi) if got < target else (lo, x)
            if hi / lo < 1.0005:
                break
    return None, 0.0


def deal(rng, n):
    """What each unit gets: [(effect, severity)], 30 % clean, 45 % single, 13 % unlisted, 12 % pairs."""
    nc, nu, npair = round(0.30 * n), round(0.13 * n), round(0.12 * n)
    ns = n - nc - nu - npair
    sev = list(TARGET)
    out = [[] for _ in range(nc)]
    names = [x for _ in range(ns // 10 + 1) for x in rng.permutation(LISTED)][:ns]
    sevs = [x for _ in range(ns // 3 + 1) for x in rng.permutation(sev)][:ns]
    out += [[(str(a), float(b))] for a, b in zip(names, sevs, strict=True)]
    odd = [x for _ in range(nu // len(UNLISTED) + 1) for x in rng.permutation(list(UNLISTED))][:nu]
    out += [[(str(a), [1.0, 0.4][i % 2])] for i, a in enumerate(odd)]
    out += [[(str(a), float(rng.choice([1.0, 0.4]))) for a in rng.choice(LISTED, 2, replace=False)] for _ in range(npair)]
    return [out[i] for i in rng.permutation(n)]


def build(seed, index, wanted):
    for attempt in range(30):
        rng = np.random.default_rng([seed, index, attempt])
        unit = plan_unit(rng, max([s for _, s in wanted], default=rng.choice([0.2, 1.0])))
        effs, alone = [], {}
        for name, sev in wanted:
            e, got = calibrate(unit, name, rng, TARGET[sev])
            if e is None:
                break
            effs.append(e)
            alone[name] = got
        else:
            soil = [calibrate(unit, n, rng, rng.uniform(0.03, 0.09), 2, 0.15)[0] for n in LISTED if n not in alone]
            soil = [e for e in soil if e]
            while rms(unit, soil) > 0.29:
                soil = [(n, d, 0.9 * x) for n, d, x in soil]
            total = rms(unit, effs) if effs else 0.0
            return unit, effs, soil, {"total": total, "alone": alone, "soil": rms(unit, soil), "attempts": attempt + 1}
    raise RuntimeError(f"no unit for {wanted}")


# ------------------------------------------------------------------------------------------------ measurement and files
T_UNITS = {"s": 1.0, "ms": 1e3}
M_UNITS = {"Nm": 1.0, "mNm": 1e3, "N·m": 1.0}
A_UNITS = {"rad": 1.0, "mrad": 1e3, "deg": 180 / np.pi, "arcmin": 10800 / np.pi, "arcsec": 648000 / np.pi, "rev": 0.5 / np.pi}


def write_unit(folder, name, unit, effs, soil, rng):
    os.makedirs(folder, exist_ok=True)
    rated, peak, own = unit["rated"], unit["peak"], rng.random() < 0.6
    tu, mu, au = (str(rng.choice(list(x))) for x in (T_UNITS, M_UNITS, A_UNITS)) if own else ("s", "Nm", "arcmin")
    minus, extra = own and rng.random() < 0.3, own and rng.random() < 0.3
    coarse, say_rate = rng.random() < 0.06, rng.random() < 0.75
    heads = [f"t [{tu}]", f"M [{mu}]", f"phi [{au}]"] if own else ["time_s", "torque_Nm", "angle_arcmin"]
    ext = str(rng.choice([".csv", ".csv", ".csv.gz", ".csv.xz"]))
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f"rated_torque_Nm = {rated:g}"]
    zero, same_zero = rng.uniform(-40, 40), rng.random() < 0.5
    for i, rec in enumerate(unit["records"], 1):
        r, a, _ = respond(unit, rec, [*effs, *soil])
        n, sd, w = a.size, unit["noise"], unit["white"]
        quantum = 2.0 * sd if unit["quant"] else 0.0  # takes a third of the variance: q^2/12
        left = sd * np.sqrt(1 - (1 / 3 if quantum else 0))
        c, keep = np.zeros(n), np.exp(-1 / rng.uniform(1.5, 6))
        e = rng.standard_normal(n)
        c[0] = e[0]
        for k in range(1, n):
            c[k] = keep * c[k - 1] + np.sqrt(1 - keep**2) * e[k]
        a = a + (zero if same_zero else rng.uniform(-40, 40))
        a = a + left * (np.sqrt(w) * rng.standard_normal(n) + np.sqrt(1 - w) * c)
        a = np.round(a / quantum) * quantum if quantum else a
        r = r + unit["torque_noise"] * rng.standard_normal(n)
        t = rec["t"][rec["keep"]]
        t = (np.floor(t / (3 * t[-1] / n)) * 3 * t[-1] / n if coarse else t) * T_UNITS[tu]
        cols = [t, r * rated * M_UNITS[mu], a * peak * A_UNITS[au] * (-1 if minus else 1)]
        rec["file"] = f"run-{i:02d}{ext}"
        head = heads + (["temp [degC]"] if extra else [])
        cols += [21 + np.cumsum(rng.standard_normal(n)) * 0.01] if extra else []
        rows = "\n".join([",".join(head)] + [",".join(f"{v:.9g}" for v in row) for row in zip(*cols, strict=True)]) + "\n"
        pack = {"gz": lambda b: gzip.compress(b, mtime=0), "xz": lzma.compress}.get(ext[-2:], bytes)
        with open(os.path.join(folder, rec["file"]), "wb") as h:
            h.write(pack(rows.encode()))
        lines += ["", "[[record]]", f'file = "{rec["file"]}"']
        say = [f"loading_rate_Nm_per_s = {rec['rate'] * rated:g}", f"amplitude_Nm = {rec['amp'] * rated:g}"]
        lines += say if say_rate else []
        if own:
            sign = "-" if minus else ""
            lines += ["[record.columns]", f'time = "{heads[0]}"', f'torque = "{heads[1]}"', f'angle = "{sign}{heads[2]}"']
    with open(os.path.join(folder, "unit.toml"), "w", encoding="utf-8") as h:
        h.write("\n".join(lines) + "\n")


def plain(x):
    if isinstance(x, dict):
        return {str(k): plain(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [plain(v) for v in x]
    if isinstance(x, (bool, np.bool_, str)):
        return bool(x) if not isinstance(x, str) else x
    return int(x) if isinstance(x, (int, np.integer)) else float(f"{x:.8g}")


def key_entry(unit, effs, soil, facts, wanted):
    rated, peak, lp = unit["rated"], unit["peak"], unit["reducer"].loop(20000)
    ind = {"lost_motion_rad": lp["lost_abs"] * peak, "backlash_rad": lp["backlash"] * peak, "area_J": lp["area"] * peak * rated}
    ind |= {"absorbed_J": lp["absorbed"] * peak * rated, "dissipation_ratio": lp["u"], "peak_rad": lp["peak"] * peak}
    kind = "clean" if not wanted else "unlisted" if wanted[0][0][:2] == "x_" else "pair" if len(wanted) == 2 else "single"
    return plain({
        "effects": [n for n, _ in wanted], "size": max([s for _, s in wanted], default=0.0), "sizes": dict(wanted),
        "rms_over_noise": facts["total"], "rms_alone": facts["alone"], "soil_over_noise": facts["soil"], "kind": kind,
        "indicators": {"%g" % (r["rate"] * rated): ind for r in unit["records"] if r["full"]}, "k": 0.03,
        "variant": {n: d["form"] for n, d, _ in effs}, "strengths": {n: {**d, "strength": x} for n, d, x in effs},
        "reducer": unit["reducer"].kind,
        "return_point_memory": unit["reducer"].kind not in NO_RETURN, "style": unit["style"],
        "amplitude_plan": unit["plan"], "rated_torque_Nm": rated,
        "peak_arcmin": peak / ARCMIN, "noise_sd_rad": unit["noise"] * peak, "noise_over_peak_to_peak": unit["noise"] / 2,
        "torque_noise_over_rated": unit["torque_noise"], "white_share": unit["white"], "quantised": unit["quant"],
        "soil": {n: {"form": d["form"], "strength": x} for n, d, x in soil}, "attempts": facts["attempts"],
        "records": [{"file": r["file"], "rate_Nm_per_s": r["rate"] * rated, "amplitude_Nm": r["amp"] * rated, "full": r["full"],
                     "samples": r["base"][r["keep"]].size} for r in unit["records"]],
        "loop_check": {k: lp[k] for k in ("closure", "odd", "least", "slope")},
    })  # fmt: skip


def selfcheck(seed):
    print("family     closure      odd  least w  min slope  rate indep.  halving  minor loop open     u range       lost range")
    for kind in FAMILIES:
        rows = []
        for i in range(12):
            rng = np.random.default_rng([seed, i, 5])
            red = Reducer(kind, rng)
            lp, fine = red.loop(1000), red.loop(2000)
            pts = np.r_[0, rng.uniform(-1, 1, 5), -1, 1, -1, 0.7, 0.2, 0.7, -0.3, 1]
            knots, x = np.arange(len(pts)), np.unique(np.r_[np.linspace(0, len(pts) - 1, 401), np.arange(len(pts))])
            warp = np.unique(np.r_[x, rng.uniform(0, x[-1], 7000)])  # the same path, sampled otherwise
            a, b = red.run(np.interp(warp, knots, pts))[np.isin(warp, x)], red.run(np.interp(x, knots, pts))
            rows.append([lp["closure"], lp["odd"], lp["least"], lp["slope"], np.abs(a - b).max()])
            rows[-1] += [np.abs(fine["asc"][::2] - lp["asc"]).max(), abs(b[x == 11][0] - b[x == 9][0]), lp["u"], lp["lost"]]
        r, q = np.max(rows, 0), np.min(rows, 0)
        print(f"{kind:9s} {r[0]:8.1e} {r[1]:8.1e} {q[2]:8.1e} {q[3]:9.3f} {r[4]:12.1e} {r[5]:9.1e} {r[6]:13.1e} "
              f"{q[7]:11.3f}-{r[7]:.3f} {q[8]:9.3f}-{r[8]:.3f}")  # fmt: skip
    print("effect                     asked   got (rms / noise)                    strength, form")
    for i, name in enumerate([*LISTED, *UNLISTED]):
        for j, (sev, aim) in enumerate(TARGET.items()):
            if name[:2] == "x_" and sev < 0.4:
                continue
            unit, effs, soil, facts = build(seed, 9000 + 10 * i + j, [(name, sev)])
            print(f"{name:26s} {aim:5.1f} {facts['total']:7.2f}  soil {facts['soil']:.3f} ({len(soil)}) tries {facts['attempts']}"
                  f"{effs[0][2]:10.4g} {effs[0][1]['form']:16s} {unit['reducer'].kind}/{unit['style']}", flush=True)  # fmt: skip


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("out")
    p.add_argument("--units", type=int, default=80)
    p.add_argument("--seed", type=int, default=21)
    p.add_argument("--selfcheck", action="store_true")
    a = p.parse_args()
    if a.selfcheck:
        return selfcheck(a.seed)
    key, began = {}, time.time()
    os.makedirs(a.out, exist_ok=True)
    for i, wanted in enumerate(deal(np.random.default_rng([a.seed, 0]), a.units), 1):
        name = f"case-{i:02d}"
        unit, effs, soil, facts = build(a.seed, i, wanted)
        write_unit(os.path.join(a.out, name), name, unit, effs, soil, np.random.default_rng([a.seed, i, 77777]))
        key[name] = key_entry(unit, effs, soil, facts, wanted)
        print(f"{time.time() - began:7.1f} s {name} {unit['reducer'].kind:9s} {unit['style']:12s} {facts['attempts']:2d} "
              f"{facts['total']:7.3f} {facts['soil']:.3f} {wanted}", flush=True)  # fmt: skip
    with open(os.path.join(a.out, "key.json"), "w") as h:
        json.dump(key, h, indent=1)


if __name__ == "__main__":
    main()
