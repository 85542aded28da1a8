"""A fifth virtual bench written without sight of the package: contact and friction mechanics of seven kinds of reducer.

    python studies/fifth_outside_bench.py /tmp/fifth --units 80 --seed 41
    python studies/fifth_outside_bench.py /tmp/fifth --selfcheck --seed 41

One file, no import of the package; units go to OUT/u/case-XX, the key to OUT/u/key.json. Cycloid discs on single pins, floating
planetary stages, strain-wave tooth zones, fretting shaft-hub joints (shear lag, pressure follows the load), filled rubber and
plastic after Kraus, worms with thread friction and preloaded tapers that open. Angle-driven parts are solved for the
torque at every step; all depend on the torque's path only, are odd, and do not depend on the step.
Inside torque is in rated torques, angle in settled peaks of the clean unit at rated torque, time in seconds; SI at the door.
An effect's strength is bisected so that the rms of (faulty angle - clean angle at the recorded torque), every record of equal
weight, after least squares on record offsets, compliance, cubic compliance, clearance and friction scale, is TARGET times the
angle's noise. Indicators are the clean reducer's at rated torque; indicators_by_record at each record's amplitude.
"""

# ruff: noqa: E401, E402, E701, E702, I001
import os
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
import argparse, gzip, json, lzma, pathlib, time
import numpy as np
from numba import njit
from scipy.signal import lfilter

TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
CHANNEL = ["sensor_lag", "thermal_drift", "torque_offset", "encoder_error"]
LISTED = CHANNEL + ["interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "stick_slip",
                    "rate_dependent_friction"]  # fmt: skip
UNLISTED = {
    "x_reversal_ringing": "the frame rings in its own mode after every reversal of the torque",
    "x_dwell_bonding": "contacts bond during holds: a spike of held angle at every restart, stronger after longer holds",
    "x_squeeze_film": "grease delays the crossing of the clearance only; the loaded flanks are prompt",
    "x_warming_compliance": "the whole reducer softens with the laboratory's clock, not with load or work",
    "x_clock_step": "the angle channel is synchronised anew in mid record: its delay steps",
    "x_telegraph": "a bearing seat flips between two places at random times, whatever the torque",
    "x_brake_creep": "the brake of the locked input yields viscously above a torque, in either direction",
    "x_alternating_cycles": "hunting teeth: the clearance under - load differs in every other cycle",
    "x_squeal": "self-excited chatter in a window of torque on one branch",
}
ARCMIN = np.pi / 10800
SORT = {"joint": "flanged", "plastic": "moulded", "taper": "zero-backlash"}


# ------------------------------------------------------------------------------------------------ mechanics (kernels)
@njit(cache=True)
def contact(e, y):
    """Of one contact at angle y: moment arm, normal force and its slope, friction limit and its slope."""
    arm = e[0] * e[1]; gap, soft = arm * y - e[2], 1 + (y * e[8]) ** 2
    n = e[3] * gap ** e[4] if gap > 0 and e[3] > 0 else 0.0; dn = e[4] * n / gap * arm if n > 0 else 0.0
    return arm, n, dn, e[7] / soft + e[6] * n, e[6] * dn - 2 * e[7] * y * e[8] ** 2 / soft**2


@njit(cache=True)
def bundle(m, fs, el, klin):
    """Angle of parallel contacts: rows side, arm, clearance, stiffness, exponent, tangential stiffness, mu, limit, softening."""
    fric, out = np.zeros(len(el)), np.empty(len(m)); x, before, grad = 0.0, 0.0, klin + 1.0
    for k in range(len(m)):
        y, lo, hi = x + (m[k] - before) / grad, -1e300, 1e300
        for _it in range(200):
            r, d = klin * y - m[k], klin
            for j in range(len(el)):
                arm, n, dn, lim, dl = contact(el[j], y); r, d = r + arm * n, d + arm * dn
                tr, lim = fric[j] + el[j, 5] * (y - x), fs[k] * lim; r += min(max(tr, -lim), lim)
                d += el[j, 5] if abs(tr) <= lim else np.sign(tr) * fs[k] * dl
            if r > 0: hi = min(hi, y)
            else: lo = max(lo, y)
            if abs(r) < 1e-12 or hi - lo < 1e-14: break
            z = y - r / d if d > 1e-9 else y - 0.1 * np.sign(r)
            if not (lo < z < hi): z = 0.5 * (lo + hi) if lo > -1e299 and hi < 1e299 else y - np.sign(r) * 0.05
            y = z
        for j in range(len(el)):
            lim = fs[k] * contact(el[j], y)[3]; fric[j] = min(max(fric[j] + el[j, 5] * (y - x), -lim), lim)
        x, before, grad = y, m[k], max(d, 1e-6); out[k] = x
    return out


@njit(cache=True)
def planets(m, fs, play, stiff, kt, mu, f0, kfloat, klin, expo):
    """Angle of a planetary stage whose sun floats on kfloat: rotation and two shifts, planets with unequal play."""
    np_ = len(play); ca, sa = np.cos(2 * np.pi * np.arange(np_) / np_), np.sin(2 * np.pi * np.arange(np_) / np_)
    fric, old, out = np.zeros(np_), np.zeros(np_), np.empty(len(m))
    x, res, jac, cand = np.zeros(3), np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    for k in range(len(m)):
        step, best, tries = np.zeros(3), 1e300, 0; base, lam = x.copy(), 1.0
        for _it in range(300):
            cand[:] = base + lam * step
            res[0], res[1], res[2] = klin * cand[0] - m[k], kfloat * cand[1], kfloat * cand[2]; jac[:] = 0.0
            jac[0, 0], jac[1, 1], jac[2, 2] = klin, kfloat, kfloat
            for i in range(np_):
                v = (1.0, ca[i], sa[i]); d = cand[0] + ca[i] * cand[1] + sa[i] * cand[2]; gap = abs(d) - play[i]
                n = stiff[i] * gap**expo if gap > 0 else 0.0; dn = expo * n / gap if gap > 0 else 0.0
                lim, tr = fs[k] * (f0[i] + mu * n), fric[i] + kt[i] * (d - old[i])
                force, df = np.sign(d) * n + min(max(tr, -lim), lim), dn
                df += kt[i] if abs(tr) <= lim else np.sign(tr * d) * fs[k] * mu * dn
                for a in range(3):
                    res[a] += v[a] * force
                    for b in range(3): jac[a, b] += v[a] * v[b] * df
            norm = np.sqrt(res[0] ** 2 + res[1] ** 2 + res[2] ** 2)
            if norm < 1e-11: break
            if norm < best or tries > 10:
                best, tries, lam = norm, 0, 1.0; base[:] = cand; step = np.linalg.solve(jac, -res)
            else: lam, tries = 0.5 * lam, tries + 1
        x[:] = cand
        for i in range(np_):
            d = x[0] + ca[i] * x[1] + sa[i] * x[2]; gap = abs(d) - play[i]
            lim = fs[k] * (f0[i] + mu * (stiff[i] * gap**expo if gap > 0 else 0.0))
            fric[i] = min(max(fric[i] + kt[i] * (d - old[i]), -lim), lim); old[i] = d
        out[k] = x[0]
    return out


@njit(cache=True)
def shear_lag(m, fs, spring, kt, limit, beta):
    """Angle at the loaded end of a shaft in a hub: slices joined by springs, each held by friction that the load may press."""
    n = len(limit); u, f, old, out = np.zeros(n), np.zeros(n), np.zeros(n), np.empty(len(m))
    diag, rhs, cp, dp, new = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.zeros(n)
    for k in range(len(m)):
        new[:] = u
        for _it in range(100):
            worst = 0.0
            for i in range(n):
                lim = fs[k] * limit[i] * (1 + beta * abs(m[k])); tr = f[i] + kt * (new[i] - old[i])
                d = kt if abs(tr) <= lim else 1e-9; tr = min(max(tr, -lim), lim); r = tr - (m[k] if i == 0 else 0.0)
                a, b = spring if i > 0 else 0.0, spring if i < n - 1 else 0.0
                r += a * (new[i] - new[i - 1]) + b * (new[i] - new[(i + 1) % n]); diag[i], rhs[i] = d + a + b, -r
                worst = max(worst, abs(r))
            if worst < 1e-11: break
            cp[0], dp[0] = -spring / diag[0], rhs[0] / diag[0]
            for i in range(1, n):
                w = diag[i] + spring * cp[i - 1]; cp[i], dp[i] = -spring / w, (rhs[i] + spring * dp[i - 1]) / w
            step = dp[n - 1]
            new[n - 1] += step
            for i in range(n - 2, -1, -1):
                step = dp[i] - cp[i] * step; new[i] += step
        for i in range(n):
            lim = fs[k] * limit[i] * (1 + beta * abs(m[k]))
            f[i] = min(max(f[i] + kt * (new[i] - old[i]), -lim), lim); old[i] = new[i]
        u[:] = new; out[k] = u[0]
    return out


@njit(cache=True)
def threads(m, fs, up, down, f0, weight, power, play, width):
    """Angle of a worm: what each thread passes on is held between a driving and a releasing bound; springs and play behind."""
    q, out = np.zeros(len(up)), np.empty(len(m))
    for k in range(len(m)):
        out[k] = 0.0
        for j in range(len(up)):
            a, b, c = fs[k] * up[j], min(fs[k] * down[j], 0.95), fs[k] * f0[j]; lo, hi = m[k] - c, m[k] + c
            lo = lo / (1 + a) if lo > 0 else lo / (1 - b); hi = hi / (1 - b) if hi > 0 else hi / (1 + a)
            q[j] = min(max(q[j], lo), hi)
            out[k] += weight[j] * (np.sign(q[j]) * abs(q[j]) ** power + play * np.tanh(q[j] / width))
    return out


@njit(cache=True)
def kelvin(t, f, tau, z0):
    """First-order follower of f with time constant tau, exact for f linear between points."""
    out, z = np.full(len(t), z0), z0
    for i in range(1, len(t)):
        h = t[i] - t[i - 1]
        if h > 0: z = (z - f[i - 1]) * np.exp(-h / tau) + f[i] + (f[i] - f[i - 1]) * (tau / h) * np.expm1(-h / tau)
        out[i] = z
    return out


@njit(cache=True)
def crossing(m, drag, width, shape):
    """A clearance of -1/2..1/2 crossed at +-drag over width; shape 0 straight, 1 smooth, 2 two teeth one after the other."""
    out, s = np.empty(len(m)), 0.0
    for k in range(len(m)):
        for side in (-1, 1):  # the bound met by rising torque, then the one met by falling torque
            z = (m[k] + side * drag) / width; b = min(max(z, -0.5), 0.5) if shape == 0 else 0.5 * np.tanh(2 * z)
            if shape == 2: b = 0.3 * np.tanh(4 * (z + 0.4 * side)) + 0.2 * np.tanh(5 * (z - 0.8 * side))
            s = max(s, b) if side < 0 else min(s, b)
        out[k] = s
    return out


@njit(cache=True)
def clamp_slip(m, thr, power):
    """Slip of a clamp: moves only while the load grows beyond thr and beyond what this side has seen, stays until reversed."""
    out, s, seen, last, gain = np.empty(len(m)), 0.0, 0.0, 0, 1.0
    for k in range(len(m)):
        v = abs(m[k]) - thr
        if v > 0:
            side = 1 if m[k] > 0 else -1
            if side != last:
                if last != 0: gain = 2.0
                last, seen = side, 0.0
            if v > seen:
                s += side * gain * 0.5 * ((v / (1 - thr)) ** power - (seen / (1 - thr)) ** power); seen = v
        out[k] = s
    return out


@njit(cache=True)
def sticking(x, m, step, share, rest, grow, window, draws):
    """Position that sticks until x is a step ahead and then jumps to rest of it; steps scatter by draws, grow with the load."""
    out, y, e = np.empty(len(x)), x[0], 0
    for k in range(len(x)):
        h = step * draws[e % len(draws)] * (1 + grow * abs(m[k])); d = x[k] - y
        if abs(m[k]) > window: h *= 0.02
        if abs(d) >= h:
            y = x[k] - np.sign(d) * rest * h; e += 1
        out[k] = x[k] + share * (y - x[k])
    return out


@njit(cache=True)
def stopper(m, width):
    """Stop operator of width, scaled to -1..1."""
    out, s = np.empty(len(m)), 0.0
    for k in range(len(m)):
        s = min(max(s + (m[k] - (m[k - 1] if k else 0.0)) / width, -1.0), 1.0); out[k] = s
    return out


# ------------------------------------------------------------------------------------------------ clean reducers
def scattered(rng, n, total, spread):
    w = np.exp(spread * rng.standard_normal(n))
    return total * w / w.sum()


def drags(rng, total, reach, n=5):
    """Seal and churning friction: n plain stops of total limit that yield within reach."""
    part, at = scattered(rng, n, total, 0.5), reach * np.exp(rng.uniform(-1.6, 0, n))
    return [[1, 1, 0, 0, 1, f / y, 0, f, 0] for f, y in zip(part, at, strict=False)]


def make_bundle(el, klin):
    el = np.array(el, float)
    return lambda m, fs: bundle(m, fs, el, klin)


def make_cycloid(rng):
    n, ecc, k = int(rng.integers(7, 15)), rng.uniform(0.45, 0.85), rng.uniform(0, 1)
    phi = np.pi * (np.arange(n) + 0.1 + 0.8 * k) / n
    arm = np.sin(phi) / np.sqrt(1 + ecc**2 - 2 * ecc * np.cos(phi))
    stiff, expo = 1 / (arm**2.1).sum(), rng.uniform(1.0, 1.15)
    mean = rng.choice([0, 1], p=[0.25, 0.75]) * np.exp(rng.uniform(np.log(0.03), np.log(0.5)))
    play = arm * (mean + rng.exponential(rng.uniform(0.02, 0.2), n))
    mu, kt, f0 = np.exp(rng.uniform(np.log(0.005), np.log(0.2))), rng.uniform(1, 6) * stiff, rng.uniform(0, 0.02) / n
    el = [[s, a, c, stiff, expo, kt * a * a, mu * a, f0 * a, 0] for a, c in zip(arm, play, strict=False) for s in (1, -1)]
    reach = max((play / arm).min(), 0.05) * rng.uniform(0.1, 0.6); el += drags(rng, rng.uniform(0.004, 0.05), reach)
    return [(1.0, make_bundle(el, rng.uniform(0.03, 0.08)))]


def make_strain(rng):
    """Two tooth zones that stiffen as a power of the deflection, with a wear gap or a preload, and the flexspline's torsion."""
    p, zones = rng.uniform(1.3, 3.0), int(rng.integers(1, 4))
    gap = rng.choice([rng.uniform(0.02, 0.3), 0.0, -rng.uniform(0.05, 0.4)], p=[0.5, 0.2, 0.3])
    mu = np.exp(rng.uniform(np.log(0.005), np.log(0.15))); el = []
    for w in scattered(rng, zones, 1.0, 0.3):
        g = gap + (rng.uniform(0, 0.15) if zones > 1 else 0.0)
        kt, f0 = w * rng.uniform(2, 8), w * rng.uniform(0, 0.01)
        el += [[s, 1, g, w, p, kt, mu, f0, 0] for s in (1, -1)]
    el += drags(rng, rng.uniform(0.008, 0.07), rng.uniform(0.03, 0.3))
    zone = make_bundle(el, rng.uniform(0.03, 0.12)); soft = rng.uniform(-0.15, 0.1); share = rng.uniform(0.15, 0.6)
    return [(1 - share, zone), (share, lambda m, fs: m - soft * m**3)]


def make_taper(rng):
    """Opposed contacts pressed together: stiff until the load opens one of them; friction follows the contact forces."""
    n, expo = int(rng.integers(2, 6)), rng.uniform(1.0, 1.6)
    el, mu = [], np.exp(rng.uniform(np.log(0.005), np.log(0.2))); opens = rng.uniform(0.15, 1.1)
    for w in scattered(rng, n, 1.0, 0.4):
        pre, kt = opens * rng.uniform(0.4, 1.2), w * rng.uniform(2, 10)
        el += [[s, 1, -pre, w, expo, kt, mu, 0, 0] for s in (1, -1)]
    el += drags(rng, rng.uniform(0.002, 0.02), rng.uniform(0.02, 0.2), 3); share = rng.uniform(0.05, 0.4)
    return [(1 - share, make_bundle(el, 0.05)), (share, lambda m, fs: m)]


def make_planet(rng):
    stages = []
    for i in range(int(rng.integers(1, 3))):
        play = rng.uniform(0.0, 0.5) * np.exp(rng.uniform(-1.5, 0)) * (1 + rng.uniform(-0.6, 0.6, 3))
        stiff = scattered(rng, 3, 1.0, 0.12)
        f0 = scattered(rng, 3, np.exp(rng.uniform(np.log(0.008), np.log(0.08))), 0.3)
        kt = f0 / (rng.uniform(0.05, 0.3, 3) * (0.1 + play))
        mu, kfl = np.exp(rng.uniform(np.log(0.01), np.log(0.15))), np.exp(rng.uniform(np.log(0.05), np.log(2)))
        args = (play, stiff, kt, mu, f0, kfl, rng.uniform(0.04, 0.1), rng.uniform(1.0, 1.12))
        stages.append((1.0 if i == 0 else rng.uniform(0.15, 0.5), lambda m, fs, a=args: planets(m, fs, *a)))
    b = rng.uniform(-0.1, 0.25)
    return stages + [(rng.uniform(0.1, 0.5), lambda m, fs: m - b * m**3)]


def make_joint(rng):
    n, beta = 45, rng.choice([0.0, rng.uniform(0.1, 0.8)]); z = (np.arange(n) + 0.5) / n
    press = 1 + rng.uniform(-0.6, 2.0) * np.abs(2 * z - 1) ** rng.uniform(1, 4)  # edges or middle pressed harder
    limit = press / press.sum() * rng.uniform(1.15, 2.5); spring = n * np.exp(rng.uniform(np.log(0.2), np.log(1.5)))
    kt = rng.uniform(8, 60) / n
    out = [(rng.uniform(0.4, 0.85), lambda m, fs: shear_lag(m, fs, spring, kt, limit, beta))]
    power = rng.uniform(0.66, 1.0)
    out.append((rng.uniform(0.15, 0.5), lambda m, fs: np.sign(m) * ((np.abs(m) + 0.02) ** power - 0.02**power)))
    if rng.random() < 0.6:
        gap = rng.uniform(0.1, 0.6); el = drags(rng, rng.uniform(0.008, 0.05), gap * rng.uniform(0.1, 0.6))
        el += [[s, 1, gap * rng.uniform(0.7, 1), 3, 1.1, 3.0, 0.08, 0, 0] for s in (1, -1)]; el[-1][2] = el[-2][2]
        out.append((rng.uniform(0.1, 0.5), make_bundle(el, rng.uniform(0.04, 0.1))))
    return out


def make_plastic(rng):
    """A filled polymer: its network's friction breaks down with strain (Kraus) and heals; teeth with play that harden."""
    total, n = np.exp(rng.uniform(np.log(0.015), np.log(0.3))), int(rng.integers(8, 16))
    part = total * np.diff(np.linspace(0, 1, n + 1) ** rng.uniform(0.6, 1.5))
    yields = np.exp(np.linspace(np.log(rng.uniform(0.005, 0.03)), np.log(rng.uniform(0.1, 0.6)), n))
    soft = rng.choice([0.0, 1 / rng.uniform(0.3, 1.2)], p=[0.25, 0.75])
    el = [[1, 1, 0, 0, 1, f / y, 0, f, soft] for f, y in zip(part, yields, strict=False)]
    play = rng.choice([0.0, rng.uniform(0.02, 0.35)], p=[0.4, 0.6])
    for k, e in ((rng.uniform(0.4, 1.0), rng.uniform(1, 1.3)), (rng.uniform(0, 1), 3.0)):
        mu = rng.uniform(0, 0.08); el += [[s, 1, play, k, e, 4 * k, mu, 0, 0] for s in (1, -1)]
    return [(1.0, make_bundle(el, 0.05 + 0.75 * total * soft))]


def make_worm(rng):
    n = int(rng.integers(3, 8)); mu, lock = np.exp(rng.uniform(np.log(0.04), np.log(0.3))), rng.uniform(0.8, 2.2)
    up = mu * np.exp(0.35 * rng.standard_normal(n)); down = np.minimum(up * lock, 0.6)
    f0 = rng.uniform(0.004, 0.05) * np.exp(0.3 * rng.standard_normal(n))
    weight, power = scattered(rng, n, 1.0, 0.3), rng.uniform(0.75, 1.0)
    play, width = rng.choice([0.0, rng.uniform(0.05, 0.6)], p=[0.3, 0.7]), rng.uniform(0.02, 0.1)
    args = (up, down, f0, weight, power, play, width)
    return [(rng.uniform(0.5, 0.9), lambda m, fs: threads(m, fs, *args)), (rng.uniform(0.1, 0.5), lambda m, fs: m)]


FAMILIES = {  # maker, k, rated torque (N m), twist at rated torque (arcmin)
    "cycloid": (make_cycloid, 0.03, (10, 1000), (0.3, 4)), "planetary": (make_planet, 0.03, (0.05, 300), (1.5, 25)),
    "strain-wave": (make_strain, 0.04, (1, 500), (0.5, 6)), "joint": (make_joint, 0.03, (1, 1000), (0.4, 8)),
    "plastic": (make_plastic, 0.03, (0.05, 5), (8, 60)), "worm": (make_worm, 0.03, (0.3, 300), (3, 40)),
    "taper": (make_taper, 0.03, (2, 1000), (0.2, 2)),
}  # fmt: skip


class Reducer:
    """A clean reducer: angle (settled peaks) from a path of torque (rated torques) that begins at rest and without load."""

    def __init__(self, kind, rng):
        self.kind, self.k = kind, FAMILIES[kind][1]
        path = np.r_[np.linspace(0, 1, 101), np.linspace(1, -1, 201)[1:], np.linspace(-1, 1, 201)[1:]]
        for self.tries in range(1, 200):
            parts = FAMILIES[kind][0](rng)
            self.parts = [(w / abs(f(path, np.ones(len(path)))[-1]), f) for w, f in parts]
            scale = sum(w for w, _ in parts); self.parts = [(w / scale, f) for w, f in self.parts]
            lp = self.loop(1.0, 400); self.parts = [(w / lp["peak"], f) for w, f in self.parts]
            lp = self.loop(1.0, 400)
            good = lp["closure"] < 2e-6 and lp["odd"] < 2e-6 and lp["least"] > -1e-7 and lp["slope"] > 0.03
            if good and 0.015 < lp["u"] < 0.6 and lp["steep"] < 30:
                mid = self.loop(1.0, 2000); self.grid, self.mid = mid["m"], 0.5 * (mid["up"] + mid["down"])
                self.least = np.minimum(np.gradient(mid["up"], mid["m"]), np.gradient(mid["down"], mid["m"]))
                return
        raise RuntimeError("no clean reducer of kind " + kind)

    def run(self, m, fs=None):
        return sum(w * f(m, np.ones(len(m)) if fs is None else fs) for w, f in self.parts)

    def loop(self, amp, n=2000):
        """Settled loop of an amplitude with its indicators in inside units."""
        up = np.linspace(-amp, amp, 2 * n + 1); leg = np.r_[up[::-1][1:], up[1:]]
        th = self.run(np.r_[up[n:], leg, leg, leg])
        asc, desc = np.r_[th[-2 * n - 1], th[-2 * n:]], th[-4 * n - 1:-2 * n][::-1]
        w, mid = desc - asc, 0.5 * (asc + desc); work = np.sum(0.5 * (up[n + 1:] + up[n:-1]) * np.diff(asc[n:]))
        work -= np.sum(0.5 * (up[1:n + 1] + up[:n]) * np.diff(desc[:n + 1])); k = min(self.k, amp)
        area = np.trapezoid(w, up); slope = np.r_[np.diff(asc), np.diff(desc)] / (up[1] - up[0])
        return {"m": up, "up": asc, "down": desc, "lost": np.interp(k, up, mid) - np.interp(-k, up, mid), "w0": w[n],
                "area": area, "absorbed": work, "u": area / work, "peak": 0.5 * (asc[-1] - asc[0]),
                "closure": abs(asc[-1] - desc[-1]) + abs(th[-1] - th[-1 - 4 * n]), "odd": np.abs(asc + desc[::-1]).max(),
                "least": w.min(), "slope": slope.min(), "steep": slope.max()}  # fmt: skip


# ------------------------------------------------------------------------------------------------ torque paths and sampling
def leg(rng, style, p, q, amp, rate, opt):
    """Knots (duration, torque) of one leg from p to q, and the time in it that is spent waiting."""
    if style == "sine":
        a, b = np.arcsin(np.clip(p / amp, -1, 1)), np.arcsin(np.clip(q / amp, -1, 1))
        ph = np.linspace(a, b, max(8, int(abs(b - a) / np.pi * 120))); om = 2 * np.pi * rate / (4 * amp)
        return np.abs(np.diff(ph)) / om, np.r_[amp * np.sin(ph[1:-1]), q], 0.0
    if style == "trapezoid":
        stops = [0.0, q] if opt["zero_hold"] and p * q < 0 else [q]; d, v, here = [], [], p
        for s in stops:
            d += [abs(s - here) / rate, opt["hold"]]; v, here = v + [s, s], s
        return np.array(d), np.array(v), opt["hold"] * len(stops)
    if style == "weights":
        lv = np.unique(np.r_[-opt["levels"], 0, opt["levels"]]) * amp
        lv = lv[(lv > min(p, q) + 1e-9) & (lv < max(p, q) - 1e-9)]; stops = np.r_[lv if q > p else lv[::-1], q]
        d, v, here = [], [], p
        for s in stops:
            z = np.linspace(0, 1, 9)[1:]; d += [0.2 * abs(s - here) / rate / 8] * 8 + [0.8 * abs(s - here) / rate]
            v, here = v + list(here + (s - here) * z * z * (3 - 2 * z)) + [s], s
        return np.array(d), np.array(v), 0.0
    if style == "hand":
        q = q if abs(q) < 0.5 * amp else q * (1 + 0.025 * rng.standard_normal())
        cut = np.r_[np.sort(rng.uniform(0.03, 0.97, int(rng.integers(4, 11)))), 1.0]; d, v, here = [], [], p
        for c in cut:
            s = p + (q - p) * c; n, sp = 6, rate * np.exp(0.45 * rng.standard_normal())
            z = np.linspace(0, 1, n + 1)[1:]; d += [abs(s - here) / sp / n] * n
            v, here = v + list(here + (s - here) * (z + 0.6 * z * (1 - z) * (2 * z - 1))), s
            if rng.random() < 0.12: d, v = d + [0.03 * amp / rate * rng.exponential()], v + [here]
            if c < 1 and rng.random() < 0.05:
                here = s - np.sign(q - p) * amp * rng.uniform(0.004, 0.02)
                d, v = d + [abs(here - s) / sp], v + [here]
        return np.array(d) + 1e-9, np.array(v), 0.0
    return np.array([abs(q - p) / rate]), np.array([q]), 0.0


def path(rng, style, amp, rate, cycles, start, opt):
    """Knots of a record: times (negative: before the record), torques; total variation over moving time."""
    first, m0 = (1 if rng.random() < 0.8 else -1), 0.0
    if start == "virgin": before = [0.0]
    elif start == "cycled":
        a = amp if rng.random() < 0.6 else 1.0
        before = [0.0, a, -a, 0.0] if rng.random() < 0.6 else [0.0, -a, a, 0.0]
    elif start == "shaken": before = [0.0] + [amp * s * 0.8**i for i, s in enumerate([1, -1] * 7)] + [0.0]
    elif start == "middle":
        m0 = amp * rng.uniform(-0.6, 0.6); before = [0.0, amp * first, -amp * first, m0]
    elif start == "peak": m0, before, first = amp * -first, [0.0, amp * first, -amp * first], first
    else: before = [0.0, 1.12, -1.12, 0.0]
    turns = [first * amp * s for s in [1, -1] * cycles + [1]] + ([0.0] if rng.random() < 0.5 else [])
    t, m, here, idle, var = [0.0], [m0], m0, 0.0, 0.0
    for q in turns:
        d, v, w = leg(rng, style, here, q, amp, rate, opt); t, m = t + list(t[-1] + np.cumsum(d)), m + list(v)
        var += np.abs(np.diff(np.r_[here, v])).sum(); idle, here = idle + w, float(v[-1])
    bt, bm = [0.0], [before[-1]]
    for q in before[-2::-1]:
        bt.append(bt[-1] - abs(q - bm[-1]) / rate)
        bm.append(q)
    t, m = np.r_[bt[:0:-1], t], np.r_[bm[:0:-1], m]; keep = np.r_[True, np.diff(t) > 0]
    return t[keep], m[keep], var / (t[-1] - idle)


def make_grid(kt, km, ts, dm, dt, red):
    """Grid that holds every knot and sample with steps of torque and time below dm and dt; the clean angle on it."""
    n = np.ceil(np.maximum(np.abs(np.diff(km)) / dm, np.diff(kt) / dt)).astype(int)
    fill = [np.linspace(a, b, k + 1)[1:-1] for a, b, k in zip(kt[:-1], kt[1:], n, strict=False) if k > 1]
    t = np.unique(np.concatenate([kt, ts, *fill])); m = np.interp(t, kt, km)
    return {"t": t, "m": m, "i": np.searchsorted(t, ts), "ts": ts, "base": red.run(m)}


def sample_times(rng, kt, km, n, how):
    end = kt[-1]
    if how == "gaps":
        t = np.linspace(0, end, int(n * 1.05))
        for _ in range(int(rng.integers(2, 7))):
            a, b = rng.uniform(0, end), rng.uniform(0.002, 0.012) * end; t = t[(t < a) | (t > a + b)]
        return t
    if how == "uneven":
        d = np.exp(0.4 * rng.standard_normal(n))
        return np.r_[0, np.cumsum(d)[:-1]] * (end / d.sum())
    if how == "by_torque":
        k = kt >= 0; run = np.r_[0, np.cumsum(np.abs(np.diff(km[k])) / np.ptp(km) + 0.15 * np.diff(kt[k]) / end)]
        return np.interp(np.linspace(0, run[-1], n), run, kt[k])
    return np.linspace(0, end, n)


def draw_unit(rng, wanted):
    names = {n for n, _ in wanted}; kind = str(rng.choice(list(FAMILIES))); red = Reducer(kind, rng)
    _, k, (t0, t1), (a0, a1) = FAMILIES[kind]
    unit = {"reducer": red, "rated": float(f"{np.exp(rng.uniform(np.log(t0), np.log(t1))):.2g}"),
            "peak": np.exp(rng.uniform(np.log(a0), np.log(a1))) * ARCMIN, "sd": np.exp(rng.uniform(np.log(6e-4), np.log(5e-3))),
            "torque_sd": np.exp(rng.uniform(np.log(2e-4), np.log(2.5e-3))),
            "white": 1.0 if rng.random() < 0.45 else rng.uniform(0.6, 0.95), "corr": np.exp(rng.uniform(np.log(3), np.log(40))),
            "lsb": rng.choice([0.0, rng.uniform(0.3, 1.6)]), "torque_lsb": rng.choice([0.0, rng.uniform(0.2, 1.5)]),
            "stamp": str(rng.choice(["exact", "jitter", "coarse"], p=[0.6, 0.32, 0.08])),
            "how": str(rng.choice(["even", "gaps", "uneven", "by_torque"], p=[0.55, 0.17, 0.16, 0.12]))}  # fmt: skip
    timed = names & {"viscoelastic_creep", "sensor_lag", "rate_dependent_friction", "x_squeeze_film", "x_brake_creep"}
    holds = "x_dwell_bonding" in names
    style = str(rng.choice(["triangle", "sine", "trapezoid", "weights", "hand", "mixed"], p=[0.42, 0.14, 0.13, 0.09, 0.08, 0.14]))
    if holds: style = str(rng.choice(["trapezoid", "weights"]))
    elif (timed or "x_reversal_ringing" in names) and style in ("weights", "hand"): style = "triangle"
    nrec = int(rng.choice([2, 3, 4, 5], p=[0.25, 0.4, 0.2, 0.15]))
    if timed: nrec = max(nrec, 3)
    cyc0 = np.exp(rng.uniform(np.log(12), np.log(240)))
    span = np.exp(rng.uniform(np.log(8), np.log(30))) if timed else np.exp(rng.uniform(np.log(1.6), np.log(20)))
    rates = 4 / cyc0 * span ** np.linspace(-0.5, 0.5, nrec) * np.exp(rng.uniform(-0.06, 0.06, nrec))
    rates = [float(f"{r * unit['rated']:.3g}") / unit["rated"] for r in rates]
    if rng.random() < 0.5: rates = list(rng.permutation(rates))
    ladder = nrec > 2 and rng.random() < 0.35; amps = np.ones(nrec)
    if ladder:
        some = np.arange(1, nrec)[rng.random(nrec - 1) < 0.6]
        some = some[:max(0, nrec - 3)] if timed else some[:nrec - 2] if "interface_slip" in names else some
        amps[some] = np.round(rng.uniform(0.25, 0.85, len(some)), 2)
    n0 = np.exp(rng.uniform(np.log(1200), np.log(11000)))
    if names & {"stick_slip", "x_squeal", "x_reversal_ringing", "encoder_error"}: n0 = max(n0, 3500)
    lab, recs = rng.uniform(0, 300), []
    opt = {"levels": np.cumsum(np.exp(0.3 * rng.standard_normal(int(rng.integers(5, 12)))))}
    opt["levels"] /= opt["levels"][-1]
    low = 3 if "x_alternating_cycles" in names else 2 if names & {"thermal_drift", "x_warming_compliance"} else 1
    for i, (rate, amp) in enumerate(zip(rates, amps, strict=False)):
        st = style if style != "mixed" else str(rng.choice(["triangle", "sine", "trapezoid"] + ([] if timed else ["hand"])))
        cycles = int(rng.choice([1, 2, 3, 4], p=[0.3, 0.35, 0.22, 0.13])); cycles = max(cycles, low if i < 2 else 1)
        opt |= {"hold": rng.uniform(0.04, 0.3) * 4 * amp / rate, "zero_hold": rng.random() < 0.35}
        start = str(rng.choice(["virgin", "cycled", "shaken", "middle", "peak", "overload"], p=[0.3, 0.28, 0.1, 0.14, 0.1, 0.08]))
        kt, km, mean = path(rng, st, amp, rate, cycles, start, opt)
        n = int(np.clip(n0 * np.exp(rng.uniform(-0.5, 0.5)), max(800, 420 * cycles), 20000))
        ts = sample_times(rng, kt, km, n, unit["how"])
        shown = st in ("triangle", "sine", "trapezoid") and rng.random() < 0.8
        recs.append({"kt": kt, "km": km, "ts": ts, "rate": rate if st in ("triangle", "sine", "trapezoid", "weights") else mean,
                     "amp": float(amp), "style": st, "cycles": cycles, "start": start, "lab": lab, "shown": shown,
                     "offset": rng.uniform(-3, 3), "index": i})  # fmt: skip
        lab += kt[-1] + rng.uniform(15, 300)
    unit |= {"records": recs, "style": style, "plan": "ladder" if (amps < 1).any() else "full", "span": lab, "cycle": cyc0,
             "dt": float(np.median([np.median(np.diff(r["ts"])) for r in recs]))}  # fmt: skip
    for r in recs:
        few = r["ts"][np.unique(np.linspace(0, len(r["ts"]) - 1, 700).astype(int))]
        r["thin"] = make_grid(r["kt"], r["km"], few, 0.006, 4 / r["rate"] / 250, red)
    return unit


# ------------------------------------------------------------------------------------------------ effects
def draw_effect(name, rng, unit, aim):
    """Form of an effect: what is drawn apart from its strength; with a first guess and a bound of the strength."""
    pick, sd, cyc = (lambda *a: str(rng.choice(a))), unit["sd"], unit["cycle"]; size = aim * sd
    f = {"form": "", "sign": float(rng.choice([-1, 1])), "seed": int(rng.integers(2**31)), "guess": 2 * size, "cap": 3.0}
    if name == "interface_slip":
        f |= {"form": pick("front", "slide", "edge"), "threshold": rng.uniform(0.55, 0.86)}
        f["power"] = {"front": 2.0, "slide": 1.0, "edge": 1.5}[f["form"]]
    elif name == "viscoelastic_creep":
        f |= {"form": pick("one", "three", "spectrum", "overload"), "tau": cyc * np.exp(rng.uniform(np.log(0.02), np.log(0.5)))}
        f |= {"power": rng.uniform(1, 1.6), "over": rng.uniform(0.2, 0.5) if f["form"] == "overload" else 0.0}
    elif name == "asymmetric_stiffness":
        f |= {"form": pick("kink", "square", "hertz", "one_flank"), "width": rng.uniform(0.02, 0.2)}
        red = unit["reducer"]  # no branch may run backwards
        f["cap"] = 0.9 / np.max(np.maximum(-f["sign"] * np.gradient(flank(f, red.grid), red.grid), 1e-3) / red.least)
    elif name == "second_backlash":
        f |= {"form": pick("straight", "smooth", "two_teeth"), "drag": rng.uniform(0.15, 0.55), "width": rng.uniform(0.04, 0.16)}
    elif name == "sensor_lag":
        f |= {"form": pick("delay", "first_order", "second_order", "window"), "guess": size * cyc / 6, "cap": 0.1 * cyc}
    elif name == "thermal_drift":
        f |= {"form": pick("warm_up", "straight", "daily", "wander"), "tau": unit["span"] * rng.uniform(0.15, 0.9)}
        f |= {"phase": rng.uniform(0, 2 * np.pi), "guess": 4 * size}
    elif name == "torque_offset": f |= {"form": pick("zero", "weight"), "guess": size / 3, "cap": 0.3}
    elif name == "encoder_error":
        f |= {"form": pick("sine", "two_harmonics", "quadrature"), "phase": rng.uniform(0, 2 * np.pi)}
        f["period"] = np.exp(rng.uniform(np.log(max(0.08, 18 * size)), np.log(max(0.8, 24 * size))))
        f["cap"] = f["period"] / {"sine": 12, "two_harmonics": 22, "quadrature": 16}[f["form"]]
        if f["period"] > 1.1: raise ArithmeticError("too much noise for an encoder's error that stays below the slope")
    elif name == "stick_slip":
        f |= {"form": pick("even", "loaded", "light"), "share": rng.uniform(0.45, 1.0), "rest": rng.uniform(0, 0.5)}
        f |= {"scatter": rng.uniform(0.05, 0.3), "grow": 1.0 if f["form"] == "loaded" else 0.0, "guess": 5 * size}
        f |= {"window": rng.uniform(0.45, 0.7) if f["form"] == "light" else 9.0, "cap": 0.6}
    elif name == "rate_dependent_friction":
        f |= {"form": pick("log", "mixed_film", "seal"), "width": rng.uniform(0.02, 0.08), "guess": 0.1, "cap": 0.9}
        f["r0"] = 4 / cyc * np.exp(rng.uniform(-0.7, 0.7))
        f["cap"] = 0.35 if f["form"] == "log" else 0.15 if f["form"] == "seal" else 0.9
    elif name == "x_reversal_ringing":
        f |= {"period": max(0.02 * cyc, 10 * unit["dt"]) * rng.uniform(1, 2), "decay": rng.uniform(1.5, 4), "guess": 6 * size}
    elif name == "x_dwell_bonding": f |= {"hold": rng.uniform(0.6, 1.0), "t0": 0.02 * cyc, "guess": size, "cap": 0.15}
    elif name == "x_squeeze_film":
        f |= {"drag": rng.uniform(0.01, 0.06), "width": rng.uniform(0.03, 0.1), "tau": cyc * rng.uniform(0.01, 0.05)}
    elif name == "x_warming_compliance": f |= {"tau": unit["span"] * rng.uniform(0.2, 0.8), "guess": 6 * size, "cap": 0.8}
    elif name == "x_clock_step": f |= {"guess": size * cyc / 3, "cap": 0.15 * cyc}
    elif name == "x_telegraph": f |= {"mean": cyc * rng.uniform(0.06, 0.4), "guess": 2.5 * size}
    elif name == "x_brake_creep": f |= {"threshold": rng.uniform(0.3, 0.65), "guess": 8 * size}
    elif name == "x_alternating_cycles": f |= {"drag": rng.uniform(0.02, 0.1), "width": rng.uniform(0.04, 0.2), "guess": 4 * size}
    elif name == "x_squeal":
        a = rng.uniform(0.15, 0.6)
        f |= {"low": a, "high": a + rng.uniform(0.2, 0.35), "period": unit["dt"] * rng.uniform(5, 15), "guess": 5 * size}
    return f


def flank(f, m):
    """What one flank yields more than the other, for a strength of one."""
    w = f["width"]; g = {"kink": np.sqrt(m * m + w * w), "square": m * m, "hertz": (m * m + w * w) ** (1 / 3)}
    return g[f["form"]] if f["form"] in g else w * np.logaddexp(0, m / w)


def turning(m):
    """Indices where the torque turns."""
    d = np.diff(m); j = np.flatnonzero(d != 0)
    return j[1:][np.sign(d[j][1:]) != np.sign(d[j][:-1])]


def late(t, y, form, s):
    if form == "delay": return np.interp(t - s, t, y)
    if form == "first_order": return kelvin(t, y, s, y[0])
    if form == "second_order": return kelvin(t, kelvin(t, y, 0.5 * s, y[0]), 0.5 * s, y[0])
    area = np.r_[0, np.cumsum(0.5 * (y[1:] + y[:-1]) * np.diff(t))]; wide = 2 * s
    early = np.minimum(t - wide, t[0] + 0 * t)  # before the path began the angle rested at y[0]
    before = np.interp(t - wide, t, area) + np.where(t - wide < t[0], (early - t[0]) * y[0], 0)
    return (area - before) / wide


def additive(name, f, s, t, m, clean, unit, rec):
    """Angle that an effect in series with the reducer adds."""
    sg, rng = f["sign"], np.random.default_rng([f["seed"], rec["index"]]); lab = rec["lab"] + t
    if name == "interface_slip": return s * clamp_slip(m, f["threshold"], f["power"])
    if name == "viscoelastic_creep":
        drive = np.sign(m) * np.maximum(np.abs(m) - f["over"], 0) ** f["power"]
        if f["form"] in ("one", "overload"): return s * kelvin(t, drive, f["tau"], 0.0)
        taus = f["tau"] * (np.array([0.2, 1, 5]) if f["form"] == "three" else 10.0 ** np.linspace(-1.2, 1.2, 8))
        return s * sum(kelvin(t, drive, x, 0.0) for x in taus) / np.sqrt(len(taus))
    if name == "asymmetric_stiffness": return s * sg * flank(f, m)
    if name == "second_backlash":
        return s * crossing(m, f["drag"], f["width"], ["straight", "smooth", "two_teeth"].index(f["form"]))
    if name == "stick_slip":
        draws = np.clip(1 + f["scatter"] * rng.standard_normal(4000), 0.3, 2)
        return sticking(clean, m, s, f["share"], f["rest"], f["grow"], f["window"], draws) - clean
    if name == "x_reversal_ringing":
        out, p = np.zeros(len(t)), f["period"]
        for j in turning(m):
            z = np.maximum(t - t[j], 0)
            out += np.sign(m[j]) * np.exp(-z / (p * f["decay"])) * np.sin(2 * np.pi * z / p)
        return s * out
    if name == "x_dwell_bonding":
        out, j, still = np.zeros(len(t)), 0, np.diff(m) == 0
        while j < len(still):
            if not still[j]:
                j += 1
                continue
            e = j
            while e < len(still) and still[e]: e += 1
            bond = s * np.log1p((t[e] - t[j]) / f["t0"]); j = e
            while j < len(still) and not still[j] and abs(m[j + 1] - m[e]) < bond:
                j += 1; out[j] = -f["hold"] * (clean[j] - clean[e])
            j += j == e
        return out
    if name == "x_squeeze_film":
        z = crossing(m, f["drag"], f["width"], 1)
        return s * (kelvin(t, z, f["tau"], z[0]) - z)
    if name == "x_warming_compliance": return s * sg * (1 - np.exp(-np.maximum(lab, 0) / f["tau"])) * clean
    if name == "x_telegraph":
        n = int(t[-1] / f["mean"]) + 30
        return s * (np.searchsorted(np.cumsum(rng.exponential(f["mean"], n)), t) % 2 - 0.5)
    if name == "x_brake_creep":
        v = np.sign(m) * np.maximum(np.abs(m) - f["threshold"], 0) / unit["cycle"]
        return s * np.r_[0, np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))] * 8
    if name == "x_alternating_cycles":
        z, top = crossing(m, f["drag"], f["width"], 1) - 0.5, np.zeros(len(t))
        for j in turning(m): top[j:] += m[j] > 0.5 * m.max()
        return s * z * (top % 2)
    if name == "x_squeal":
        d = np.r_[0, np.diff(m)] * f["sign"]; z = np.clip((m * sg - f["low"]) / (f["high"] - f["low"]), 0, 1)
        return s * np.where(d < 0, np.sin(np.pi * z) ** 2 * np.sin(2 * np.pi * t / f["period"]), 0.0)
    return 0.0


def channel(name, f, s, t, th, rec, unit):
    """Angle as read after a fault of the angle's channel."""
    rng = np.random.default_rng([f["seed"], 5]); lab = rec["lab"] + t
    if name == "sensor_lag": return late(t, th, f["form"], s)
    if name == "x_clock_step":
        own = np.random.default_rng([f["seed"], rec["index"]]); at = own.uniform(0.3, 0.7) * t[-1]
        return np.where(t > at, np.interp(t - s, t, th), th)
    if name == "thermal_drift":
        lab = np.maximum(lab, 0)
        if f["form"] == "wander":
            g = np.linspace(0, unit["span"] * 1.2, 600); walk = np.cumsum(rng.standard_normal(600)) / np.sqrt(600)
            return th + s * np.interp(lab, g, np.convolve(np.pad(walk, 12, "edge"), np.hanning(27)[1:-1] / 13, "same")[12:-12])
        z = {"warm_up": 1 - np.exp(-lab / f["tau"]), "straight": lab / unit["span"],
             "daily": np.sin(2 * np.pi * lab / (2 * f["tau"]) + f["phase"])}  # fmt: skip
        return th + f["sign"] * s * z[f["form"]]
    if name == "encoder_error":
        ph = 2 * np.pi * (th + rec["offset"]) / f["period"] + f["phase"]
        if f["form"] == "quadrature":
            g, a = 2 * np.pi * s / f["period"], f["phase"]
            read = np.arctan2((1 + 1.2 * g * np.sin(a)) * np.sin(ph) + 0.7 * g, np.cos(ph) + g * np.cos(a))
            e = np.angle(np.exp(1j * (read - ph)))
            return th + e * f["period"] / (2 * np.pi)
        return th + s * (np.sin(ph) + (0.5 * np.sin(2 * ph + 1) if f["form"] == "two_harmonics" else 0))
    return th


def measure(unit, rec, g, effects):
    """Recorded torque and angle of a record at its samples, without noise."""
    t, m, i = g["t"], g["m"], g["i"]; true, shown, fs, red = m, m, None, unit["reducer"]
    eff = {n: (f, s) for n, f, s in effects}
    if "torque_offset" in eff:
        f, s = eff["torque_offset"]
        if f["form"] == "zero": shown = m + f["sign"] * s
        else: true = m + f["sign"] * s
    drive = true
    if "rate_dependent_friction" in eff:
        f, s = eff["rate_dependent_friction"]; r = np.abs(np.diff(m, prepend=m[0]) / np.diff(t, prepend=t[0] - 1))
        r = np.maximum(r[np.maximum.accumulate(np.where(r > 0, np.arange(len(r)), 0))], 0.05 * rec["rate"])  # kept during holds
        if f["form"] == "mixed_film": fs = np.maximum(1 + f["sign"] * s * (2 * np.exp(-r / f["r0"]) - 1), 0.05)
        elif f["form"] == "log": fs = np.maximum(1 + f["sign"] * s * np.log(r * unit["cycle"] / 4), 0.05)
        else: drive = true - f["sign"] * s * np.log(r * unit["cycle"] / 4) / 2 * stopper(true, f["width"])
    clean = g["base"] if drive is m and fs is None else red.run(drive, fs); th = clean.copy()
    for n, (f, s) in eff.items(): th = th + additive(n, f, s, t, true, clean, unit, rec)
    for n in ("encoder_error", "sensor_lag", "x_clock_step", "thermal_drift"):
        if n in eff: th = channel(n, *eff[n], t, th, rec, unit)
    return shown[i], th[i]


def rms(unit, effects, which="thin"):
    """Rms of (faulty - clean at the recorded torque) beyond the refit, in noise units; all records weigh the same."""
    cols, rest, red = [], [], unit["reducer"]
    off = sum(f["sign"] * s for n, f, s in effects if n == "torque_offset" and f["form"] == "zero")
    nr = len(unit["records"])
    for rec in unit["records"]:
        g = rec[which]; mr, th = measure(unit, rec, g, effects)
        c = g["base"] if off == 0 else red.run(g["m"] + off); c, w = c[g["i"]], len(mr) ** -0.5
        own = np.zeros((nr, len(mr))); own[rec["index"]] = 1; gap = crossing(g["m"] + off, 0.03, 0.05, 1)[g["i"]]
        cols.append(np.vstack([own, mr, mr**3, gap, c - np.interp(mr, red.grid, red.mid)]) * w)
        rest.append((th - c) * w)
    x, y = np.hstack(cols).T, np.concatenate(rest); y = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    return np.sqrt((y**2).sum() / nr) / unit["sd"]


def calibrate(unit, name, rng, aim, tries=14, slack=0.02):
    """An effect (name, form, strength) with an rms of aim noises; secant inside a bracket, else bisection."""
    f = draw_effect(name, rng, unit, aim); s, lo, hi, best = min(f["guess"], f["cap"]), 0.0, np.inf, (9.0, 0.0)
    for _ in range(tries):
        v = rms(unit, [(name, f, s)]); best = min(best, (abs(np.log(max(v, 1e-9) / aim)), s))
        if best[0] < slack: return name, f, best[1]
        if v < aim:
            lo = max(lo, s)
            if s >= f["cap"]: break
        else: hi = min(hi, s)
        z = s * np.clip(aim / max(v, 1e-9), 0.05, 20)
        if not lo < z < hi: z = np.sqrt(lo * hi) if lo > 0 and np.isfinite(hi) else 0.5 * s if np.isfinite(hi) else 2 * s
        s = min(z, f["cap"])
    if best[0] < 0.1: return name, f, best[1]
    raise ArithmeticError(name + " cannot reach its strength in this unit")


def build(seed, i, wanted):
    """A unit with the wanted effects and soil; drawn anew until every effect reaches its strength."""
    for attempt in range(60):
        rng = np.random.default_rng([seed, i, attempt])
        try:
            unit = draw_unit(rng, wanted); effs = [calibrate(unit, n, rng, TARGET[s]) for n, s in wanted]; soil = []
            for n in CHANNEL:
                if n not in dict(wanted): soil.append(calibrate(unit, n, rng, rng.uniform(0.03, 0.08), slack=0.08))
        except ArithmeticError:
            continue
        for r in unit["records"]: r["full"] = make_grid(r["kt"], r["km"], r["ts"], 0.0015, 4 / r["rate"] / 800, unit["reducer"])
        facts = {"attempts": attempt + 1, "total": rms(unit, effs, "full") if effs else 0.0,
                 "soil": rms(unit, soil, "full"), "soil_each": {e[0]: rms(unit, [e]) for e in soil},
                 "alone": {e[0]: rms(unit, [e], "full") for e in effs}}  # fmt: skip
        if all(abs(np.log(facts["alone"][n] / TARGET[s])) < 0.2 for n, s in wanted): return unit, effs, soil, facts
    raise RuntimeError(f"no unit for {wanted}")


def deal(rng, n):
    """What is wanted of n units: about 30 % clean, 15 % unlisted, 12 % pairs, the rest single effects at three severities."""
    nc, nu, npair = round(0.3 * n), round(0.15 * n), round(0.12 * n); ns = n - nc - nu - npair
    out, pool = [[] for _ in range(nc)], []
    while len(pool) < ns:
        sizes = {k: rng.permutation(list(TARGET)) for k in LISTED}
        for j in range(3): pool += [[(str(k), float(sizes[k][j]))] for k in rng.permutation(LISTED)]
    out += pool[:ns]
    odd = [str(x) for _ in range(nu // len(UNLISTED) + 1) for x in rng.permutation(list(UNLISTED))][:nu]
    out += [[(x, float(rng.choice([1.0, 0.4])))] for x in odd]
    out += [[(str(x), float(rng.choice([1.0, 0.4]))) for x in rng.choice(LISTED, 2, replace=False)] for _ in range(npair)]
    return [out[j] for j in rng.permutation(n)]


# ------------------------------------------------------------------------------------------------ files
def noisy(unit, rec, effects, rng):
    """Time stamps, torque and angle as written, in SI (radians)."""
    m, th = measure(unit, rec, rec["full"], effects); n, sd, w = len(m), unit["sd"], unit["white"]
    noise = w * rng.standard_normal(n)
    if w < 1:
        a = np.exp(-1 / unit["corr"])
        noise += np.sqrt(1 - w * w) * lfilter([np.sqrt(1 - a * a)], [1, -a], rng.standard_normal(n + 400))[400:]
    th = th + rec["offset"] + sd * noise; m = m + unit["torque_sd"] * rng.standard_normal(n)
    if unit["lsb"]:
        q = unit["lsb"] * sd; th = np.round(th / q) * q
    if unit["torque_lsb"]:
        q = unit["torque_lsb"] * unit["torque_sd"]; m = np.round(m / q) * q
    t = rec["ts"] + 0.0; step = np.median(np.diff(t))
    if unit["stamp"] == "jitter":
        d = np.minimum(np.diff(t, prepend=-step), np.diff(t, append=t[-1] + step))
        t = t + 0.25 * d * rng.uniform(-1, 1, n)
    elif unit["stamp"] == "coarse":
        q = 10.0 ** np.floor(np.log10(2.5 * step)); t = np.floor(t / q) * q
    return t - t[0], m * unit["rated"], th * unit["peak"], step


def write_unit(folder, name, unit, effects, soil, rng):
    os.makedirs(folder, exist_ok=True)
    own, minus, ext = rng.random() < 0.35, rng.random() < 0.3, str(rng.choice([".csv.gz", ".csv", ".csv.xz"], p=[0.7, 0.2, 0.1]))
    ms, milli = rng.random() < 0.5, unit["rated"] < 2 and rng.random() < 0.6
    angle = str(rng.choice(["deg", "arcsec", "mrad", "rad", "arcmin"]))
    heads, ku = ["time_s", "torque_Nm", "angle_arcmin"], [1.0, 1.0, 1 / ARCMIN]
    if own:
        heads = [f"t [{'ms' if ms else 's'}]", f"Torque [{'mNm' if milli else 'Nm'}]", f"phi [{angle}]"]
        per = {"deg": 180 / np.pi, "arcsec": 648000 / np.pi, "mrad": 1e3, "rad": 1.0, "arcmin": 1 / ARCMIN}[angle]
        ku = [1e3 if ms else 1.0, 1e3 if milli else 1.0, per * (-1 if minus else 1)]
    lines, files = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f"rated_torque_Nm = {unit['rated']:.6g}"], []
    if unit["reducer"].k == 0.04 or rng.random() < 0.5:
        lines.append(f'description = "{SORT.get(unit["reducer"].kind, unit["reducer"].kind)} reducer"')
    if rng.random() < 0.4: lines.append(f"reduction_ratio = {int(rng.choice([11, 30, 50, 64, 81, 100, 120, 160]))}")
    for rec in unit["records"]:
        t, m, th, step = noisy(unit, rec, [*effects, *soil], rng); file = f"r{rec['index'] + 1}-{rec['style']}{ext}"
        fine = [step * ku[0] / 50, unit["torque_sd"] * unit["rated"] * ku[1] / 30, unit["sd"] * unit["peak"] * abs(ku[2]) / 30]
        row = ",".join(f"%.{int(np.clip(np.ceil(-np.log10(x)), 0, 12))}f" for x in fine)
        data = ("\n".join([",".join(heads), *(row % v for v in zip(t * ku[0], m * ku[1], th * ku[2]))]) + "\n").encode()  # noqa: B905
        pack = {".csv.gz": lambda x: gzip.compress(x, 6, mtime=0), ".csv.xz": lambda x: lzma.compress(x, preset=3)}
        pathlib.Path(folder, file).write_bytes(pack.get(ext, bytes)(data))
        lines += ["", "[[record]]", f'file = "{file}"']
        if rec["shown"]: lines.append(f"loading_rate_Nm_per_s = {rec['rate'] * unit['rated']:.6g}")
        if rng.random() < 0.5 and rec["style"] != "hand": lines.append(f"amplitude_Nm = {rec['amp'] * unit['rated']:.6g}")
        if own:
            sign = "-" if minus else ""
            lines += ["[record.columns]", f'time = "{heads[0]}"', f'torque = "{heads[1]}"', f'angle = "{sign}{heads[2]}"']
        files.append({"file": file, "rate_Nm_per_s": float(f"{rec['rate'] * unit['rated']:.6g}"), "full": rec["amp"] == 1.0,
                      "amplitude_Nm": rec["amp"] * unit["rated"], "samples": len(t), "style": rec["style"],
                      "cycles": rec["cycles"], "start": rec["start"]})  # fmt: skip
    pathlib.Path(folder, "unit.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return files


def plain(x):
    if isinstance(x, dict): return {str(k): plain(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)): return [plain(v) for v in x]
    if isinstance(x, (bool, np.bool_, str)): return bool(x) if not isinstance(x, str) else x
    return int(x) if isinstance(x, (int, np.integer)) else float(f"{x:.8g}")


def si(q, unit):
    tr, pk = unit["rated"], unit["peak"]
    return {"lost_motion_rad": q["lost"] * pk, "backlash_rad": q["w0"] * pk, "area_J": q["area"] * tr * pk,
            "absorbed_J": q["absorbed"] * tr * pk, "dissipation_ratio": q["u"], "peak_rad": q["peak"] * pk}  # fmt: skip


def key_entry(unit, effs, soil, facts, wanted, files):
    red, tr, pk = unit["reducer"], unit["rated"], unit["peak"]
    loops = {a: red.loop(a, 10000) for a in {1.0, *(r["amp"] for r in unit["records"])}}
    lp, names = loops[1.0], [n for n, _ in wanted]
    kind = "clean" if not names else "pair" if len(names) > 1 else "unlisted" if names[0].startswith("x_") else "single"
    return plain({
        "effects": names, "size": max([s for _, s in wanted], default=0.0), "sizes": dict(wanted),
        "rms_over_noise": facts["total"], "rms_alone": facts["alone"], "soil_over_noise": facts["soil"], "kind": kind,
        "indicators": {f"{f['rate_Nm_per_s']:.6g}": si(lp, unit) for f in files if f["full"]}, "k": red.k,
        "indicators_by_record": {f["file"]: si(loops[r["amp"]], unit) for f, r in zip(files, unit["records"], strict=False)},
        "variant": {n: f["form"] for n, f, _ in effs}, "strengths": {n: {**f, "strength": s} for n, f, s in effs},
        "reducer": red.kind, "style": unit["style"], "amplitude_plan": unit["plan"], "rated_torque_Nm": tr,
        "peak_arcmin": pk / ARCMIN, "noise_sd_rad": unit["sd"] * pk, "noise_over_peak_to_peak": unit["sd"] / 2,
        "torque_noise_over_rated": unit["torque_sd"], "white_share": unit["white"], "correlation_samples": unit["corr"],
        "quantised": unit["lsb"], "sampling": unit["how"], "stamps": unit["stamp"],
        "soil": {n: {"form": f["form"], "strength": s, "rms": facts["soil_each"][n]} for n, f, s in soil},
        "attempts": facts["attempts"], "records": files, "loop_check": {k: lp[k] for k in ("closure", "odd", "least", "slope")},
    })  # fmt: skip


def selfcheck(seed, draws=10, cases=2):
    print("all in settled peaks; 'stepping': same path on 0.0015 and on 0.0002 steps; 'pace': same path, random pace and samples")
    print("family       closure      odd  least w  slope      pace  stepping  S error  tries        u         lost          w(0)")
    for kind in FAMILIES:
        rows = []
        for i in range(draws):
            rng = np.random.default_rng([seed, i, 5]); red = Reducer(kind, rng)
            lp, fine = red.loop(1.0, 1000), red.loop(1.0, 20000)
            pts = np.r_[0, 1, -1, 0.4, -0.2, 0.7, -0.6, 0.9, -1, 1, 0]; kn = np.arange(len(pts), dtype=float)
            at = np.linspace(0, kn[-1], 301); a = make_grid(kn, pts, at, 0.0015, 1, red)
            b = make_grid(kn, pts, at, 0.0002, 1, red)
            c = make_grid(kn, pts, np.sort(np.r_[at, rng.uniform(0, kn[-1], 9000)]), 0.0015, rng.uniform(0.001, 1), red)
            stepping = np.abs(a["base"][a["i"]] - b["base"][b["i"]]).max()
            pace = np.abs(np.interp(at, c["t"], c["base"]) - a["base"][a["i"]]).max()
            polygon = np.r_[fine["up"], fine["down"][::-1]]  # area by the shoelace rule around the closed loop
            mm = np.r_[fine["m"], fine["m"][::-1]]
            area = 0.5 * abs(np.sum(polygon * np.roll(mm, -1) - mm * np.roll(polygon, -1)))
            s_err = max(abs(area / fine["area"] - 1), abs(lp["area"] / fine["area"] - 1))
            rows.append([fine["closure"], fine["odd"], fine["least"], fine["slope"], pace, stepping, s_err, red.tries,
                         fine["u"], fine["lost"], fine["w0"]])  # fmt: skip
        r, q = np.max(rows, 0), np.min(rows, 0)
        print(f"{kind:11s} {r[0]:8.1e} {r[1]:8.1e} {q[2]:8.1e} {q[3]:6.3f}  {r[4]:8.1e}  {r[5]:8.1e} {r[6]:8.1e}  {r[7]:5.0f}  "
              f"{q[8]:.3f}-{r[8]:.3f}  {q[9]:.3f}-{r[9]:.3f}  {q[10]:.4f}-{r[10]:.3f}", flush=True)  # fmt: skip
    print("severities reached (rms / noise), draws of the unit, soil in all")
    for i, name in enumerate([*LISTED, *UNLISTED]):
        line = []
        for j, sev in enumerate(TARGET):
            if name[:2] == "x_" and sev < 0.4: continue
            for c in range(cases):
                _, effs, soil, facts = build(seed, 9000 + 50 * i + 10 * j + c, [(name, sev)])
                line.append(f"{facts['total']:6.2f} ({facts['attempts']:d}, {facts['soil']:.2f})")
        print(f"{name:25s}", " ".join(line), flush=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("out")
    for n, d in (("--units", 80), ("--seed", 41)): p.add_argument(n, type=int, default=d)
    p.add_argument("--selfcheck", action="store_true")
    a = p.parse_args()
    if a.selfcheck: return selfcheck(a.seed)
    key, began, top = {}, time.time(), os.path.join(a.out, "u")
    os.makedirs(top, exist_ok=True)
    for i, wanted in enumerate(deal(np.random.default_rng([a.seed, 0]), a.units), 1):
        name = f"case-{i:02d}"; unit, effs, soil, facts = build(a.seed, i, wanted)
        files = write_unit(os.path.join(top, name), name, unit, effs, soil, np.random.default_rng([a.seed, i, 77777]))
        key[name] = key_entry(unit, effs, soil, facts, wanted, files)
        print(f"{time.time() - began:7.1f} s {name} {len(files)} records {facts['attempts']:3d} draws", flush=True)
    pathlib.Path(top, "key.json").write_text(json.dumps(key, indent=1))


if __name__ == "__main__": main()
