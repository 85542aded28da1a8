"""A virtual bench written without sight of the package: other mechanics, other ways of running a test, by the file format alone.

    python studies/outside_bench.py /tmp/outside --units 60 --seed 5
    python studies/interval_coverage.py run outside=/tmp/outside

It imports nothing of the package and stands in one file, so that it can be read and judged apart. A drive is a chain of bodies in
series; a stage has 3 to 25 tooth pairs, each with its own clearance, Hertzian contact and flank friction; bearings are
Maxwell-slip or Bouc-Wen elements; shafts harden or soften. Tests have dwells, rounded tips, gaps, unequal sampling, two cycles,
any start. OUT/key.json holds effects, severity (rms over the angle's noise 20, 6, 2.5) and the clean loop's indicators.

Inside, torque is in units of the rated torque and angle in units of A0 (half clearance plus wind-up at rated torque).
"""

import argparse
import json
import math
import os
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from numba import njit

ARCMIN = math.pi / 10800.0
K_LOST = 0.03
DQ = 2e-3  # largest motion of a body in one inner step (A0); the solver halves steps in crossings
NEL = 12  # Maxwell-slip elements a bearing
NT = 25  # largest number of tooth pairs a stage
STEP = 1.0 / 2500.0  # largest torque step of the mechanical solution
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
UNLISTED = [
    "x_tooth_damage",
    "x_mount_step",
    "x_sign_gain",
    "x_mains_hum",
    "x_friction_warmup",
    "x_ratchet",
    "x_torque_ripple",
    "x_stiffness_fade",
    "x_knocks",
]
CHANNEL = {
    "sensor_lag",
    "thermal_drift",
    "torque_offset",
    "encoder_error",
    "x_mount_step",
    "x_sign_gain",
    "x_mains_hum",
    "x_knocks",
    "x_torque_ripple",
}
TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
CAP = {
    "interface_slip": 0.30,
    "viscoelastic_creep": 0.35,
    "asymmetric_stiffness": 0.5,
    "second_backlash": 0.40,
    "sensor_lag": 0.03,
    "thermal_drift": 0.30,
    "torque_offset": 0.10,
    "encoder_error": 0.06,
    "stick_slip": 0.16,
    "rate_dependent_friction": 0.35,
    "x_tooth_damage": 0.20,
    "x_mount_step": 0.20,
    "x_sign_gain": 0.10,
    "x_mains_hum": 0.06,
    "x_friction_warmup": 1.5,
    "x_ratchet": 0.25,
    "x_torque_ripple": 0.06,
    "x_stiffness_fade": 0.30,
    "x_knocks": 0.20,
}


# ------------------------------------------------------------------ mechanics
@njit(cache=True)
def mesh(i, x, xo, fo, nt, c, k, p, mu, kt, fm, kneg):
    """Torque through stage i at relative angle x and its slope; all tooth pairs of the stage."""
    m = 0.0
    dm = 0.0
    s = 1.0 if x >= 0 else -1.0
    kk = 1.0 if x >= 0 else kneg
    ax = abs(x)
    for j in range(nt[i]):
        y = ax - c[i, j]
        if y > 0:
            if p[i] == 1.0:
                d = kk * k[i, j]
                n = d * y
            else:
                n = kk * k[i, j] * y ** p[i]
                d = p[i] * n / y
            lim = mu[i] * fm * n
            f = fo[i, j] + kt[i, j] * (x - xo)
            if f > lim:
                m += s * n + lim
                dm += d + mu[i] * fm * s * d
            elif f < -lim:
                m += s * n - lim
                dm += d - mu[i] * fm * s * d
            else:
                m += s * n + f
                dm += d + kt[i, j]
    return m, dm


@njit(cache=True)
def drag(i, q, qo, fe, ke, le, kind, z, dl, x0, fs, kg):
    """Bearing and seal drag of body i at angle q and its slope."""
    if kind[i] == 1:  # Bouc-Wen with n = 1 (Dahl), exact within a step
        dq = q - qo
        if dq >= 0:
            e = math.exp(-dq / x0[i])
            zn = 1.0 + (z[i] - 1.0) * e
            dz = (1.0 - z[i]) * e / x0[i]
        else:
            e = math.exp(dq / x0[i])
            zn = -1.0 + (z[i] + 1.0) * e
            dz = (z[i] + 1.0) * e / x0[i]
        return dl[i] * fs * zn + kg[i] * q, dl[i] * fs * max(dz, 0.0) + kg[i]
    t = kg[i] * q
    dt = kg[i]
    for a in range(fe.shape[1]):
        lim = le[i, a] * fs
        f = fe[i, a] + ke[i, a] * (q - qo)
        if f > lim:
            t += lim
        elif f < -lim:
            t -= lim
        else:
            t += f
            dt += ke[i, a]
    return t, dt


@njit(cache=True)
def chain(tau, fsv, fmv, nt, c, k, p, mu, kt, kind, ke, le, dl, x0, beta, kg, visc, kneg, dqmax):
    """Angle of the output body for a torque history from the virgin state. Balance of bodies in series, input locked.
    Backward Euler in the path length |d tau| (hence independent of rate), damped Newton on a convex problem."""
    n = nt.shape[0]
    N = tau.shape[0]
    out = np.zeros(N)
    q = np.zeros(n + 1)
    qn = np.zeros(n + 1)
    qt = np.zeros(n + 1)
    z = np.zeros(n)
    fe = np.zeros(ke.shape)
    fo = np.zeros(c.shape)
    r = np.zeros(n)
    A = np.zeros(n)
    B = np.zeros(n)
    dxv = np.zeros(n)
    told = 0.0
    worst = 0.0
    frac = 1.0
    for s in range(N):
        tend = tau[s]
        dtot = tend - told
        if abs(dtot) < 1e-9 and s > 0 and fsv[s] == fsv[s - 1]:
            out[s] = out[s - 1]
            continue
        tbeg = told
        done = 0.0
        while done < 1.0:
            h = min(frac, 1.0 - done)
            if 1.0 - done - h < 1e-9:
                h = 1.0 - done
            t = tbeg + (done + h) * dtot if done + h < 1.0 else tend
            ds = abs(h * dtot)
            cd = visc / max(ds, 1e-6)
            load = abs(t)
            for i in range(n + 1):
                qn[i] = q[i]
            best = 1e300
            for _it in range(60):
                res = 0.0
                tin = t
                for i in range(n):
                    m, dm = mesh(i, qn[i] - qn[i + 1], q[i] - q[i + 1], fo, nt, c, k, p, mu, kt, fmv[s], kneg)
                    d, dd = drag(i, qn[i], q[i], fe, ke, le, kind, z, dl, x0, fsv[s] * (1 + beta[i] * load), kg)
                    r[i] = tin - d - cd * (qn[i] - q[i]) - m
                    A[i] = dd + cd + dm
                    if i > 0:
                        A[i] += B[i - 1]
                    B[i] = dm
                    tin = m
                    res += r[i] * r[i]
                best = res
                if res < 1e-22:
                    break
                # tridiagonal solve, symmetric: diag A, off-diag -B[0..n-2]
                for i in range(n):
                    dxv[i] = r[i]
                dg = A.copy()
                for i in range(1, n):
                    w = B[i - 1] / dg[i - 1]
                    dg[i] -= w * B[i - 1]
                    dxv[i] += w * dxv[i - 1]
                dxv[n - 1] /= dg[n - 1]
                for i in range(n - 2, -1, -1):
                    dxv[i] = (dxv[i] + B[i] * dxv[i + 1]) / dg[i]
                step = 1.0
                for _ls in range(14):
                    rr = 0.0
                    tin = t
                    for i in range(n):
                        qt[i] = qn[i] + step * dxv[i]
                    qt[n] = 0.0
                    for i in range(n):
                        m, dm = mesh(i, qt[i] - qt[i + 1], q[i] - q[i + 1], fo, nt, c, k, p, mu, kt, fmv[s], kneg)
                        d, dd = drag(i, qt[i], q[i], fe, ke, le, kind, z, dl, x0, fsv[s] * (1 + beta[i] * load), kg)
                        e = tin - d - cd * (qt[i] - q[i]) - m
                        tin = m
                        rr += e * e
                    if rr < res:
                        break
                    step *= 0.5
                for i in range(n):
                    qn[i] = qt[i]
            if best > worst:
                worst = best
            big = 0.0
            for i in range(n):
                big = max(big, abs(qn[i] - q[i]))
            if big > 1.5 * dqmax and h > 1.0 / 300 and ds > 1e-7:
                frac = max(h * 0.5, 1.0 / 400)
                continue
            frac = min(1.0, h * 1.5 if big < 0.7 * dqmax else max(h, frac if h < frac else h))
            # accept: update the states
            for i in range(n):
                x = qn[i] - qn[i + 1]
                xo = q[i] - q[i + 1]
                kk = 1.0 if x >= 0 else kneg
                for j in range(nt[i]):
                    y = abs(x) - c[i, j]
                    if y > 0:
                        lim = mu[i] * fmv[s] * kk * k[i, j] * y ** p[i]
                        f = fo[i, j] + kt[i, j] * (x - xo)
                        fo[i, j] = min(max(f, -lim), lim)
                    else:
                        fo[i, j] = 0.0
                sc = fsv[s] * (1 + beta[i] * load)
                dq = qn[i] - q[i]
                if kind[i] == 1:
                    if dq >= 0:
                        z[i] = 1.0 + (z[i] - 1.0) * math.exp(-dq / x0[i])
                    else:
                        z[i] = -1.0 + (z[i] + 1.0) * math.exp(dq / x0[i])
                else:
                    for a in range(ke.shape[1]):
                        f = fe[i, a] + ke[i, a] * dq
                        lim = le[i, a] * sc
                        fe[i, a] = min(max(f, -lim), lim)
            for i in range(n):
                q[i] = qn[i]
            done += h
        out[s] = q[0]
        told = tend
    return out, math.sqrt(worst)


@njit(cache=True)
def boucwen(tau, kx, fb, x0, n, sub):
    """Series spring kx with a parallel Bouc-Wen friction (flexspline), torque driven."""
    out = np.zeros(tau.shape[0])
    z = 0.0
    to = 0.0
    for s in range(tau.shape[0]):
        d = (tau[s] - to) / sub
        for _ in range(sub):
            sg = 1.0 if d >= 0 else -1.0
            a = (1 - sg * math.copysign(abs(z) ** n, z)) / x0
            dx = d / (kx + fb * max(a, 0.0))
            zm = z + 0.5 * a * dx
            a = (1 - sg * math.copysign(abs(zm) ** n, zm)) / x0
            dx = d / (kx + fb * max(a, 0.0))
            z = min(max(z + a * dx, -1.0), 1.0)
            to += d
        to = tau[s]
        out[s] = (to - fb * z) / kx
    return out


@njit(cache=True)
def play(tau, r):
    out = np.zeros(tau.shape[0])
    y = 0.0
    for s in range(tau.shape[0]):
        y = min(max(y, tau[s] - r), tau[s] + r)
        out[s] = y
    return out


@njit(cache=True)
def held_slip(tau, r, q):
    out = np.zeros(tau.shape[0])
    y = 0.0
    for s in range(tau.shape[0]):
        a = abs(tau[s]) - r
        if a > 0:
            g = (a / (1 - r)) ** q
            if tau[s] > 0:
                y = max(y, g)
            else:
                y = min(y, -g)
        out[s] = y
    return out


@njit(cache=True)
def relax(t, v, T):
    """First-order lag with time constant T, exact for input linear between samples."""
    out = np.zeros(v.shape[0])
    y = v[0]
    out[0] = y
    for s in range(1, v.shape[0]):
        h = t[s] - t[s - 1]
        if h > 0:
            e = math.exp(-h / T)
            sl = (v[s] - v[s - 1]) / h
            y = v[s] - sl * T + (y - v[s - 1] + sl * T) * e
        out[s] = y
    return out


@njit(cache=True)
def staircase(tau, delta, over, load, rnd):
    """Torque that the drive train feels under stick-slip: held, then jumps when the lag passes the static excess."""
    out = np.zeros(tau.shape[0])
    y = 0.0
    j = 0
    m = rnd.shape[0]
    for s in range(tau.shape[0]):
        d = delta * rnd[j % m] * (1 + load * abs(tau[s]))
        e = tau[s] - y
        if e > d * (1 - over):
            y = tau[s] + d * over
            j += 1
        elif e < -d * (1 - over):
            y = tau[s] - d * over
            j += 1
        out[s] = min(max(y, -1.0), 1.0)
    return out


def draw_teeth(rng, cyc):
    n = int(rng.integers(9, NT + 1)) if cyc else int(rng.integers(3, 10))
    w = np.abs(np.sin(np.pi * (np.arange(n) + rng.uniform(0.2, 0.8)) / n)) + 0.03 if cyc else rng.uniform(0.8, 1.2, n)
    if rng.random() < 0.6:
        e = np.abs(1 + rng.uniform(0.04, 0.35) * rng.standard_normal(n))
    else:  # worn sector
        ph = 2 * np.pi * np.arange(n) / n - rng.uniform(0, 2 * np.pi)
        e = 1 + rng.uniform(0.2, 0.9) * np.maximum(np.cos(ph), 0) ** 2 + 0.04 * rng.standard_normal(n)
    return n, w, np.maximum(e, 0.05)


def draw_reducer(rng):
    """A clean reducer. All torques in T_r, angles in A0."""
    kind = str(rng.choice(["planetary", "cycloidal", "strain-wave"], p=[0.45, 0.35, 0.2]))
    Tr = float("%.3g" % (10 ** rng.uniform(math.log10(0.05), 3)))
    if kind == "strain-wave":
        clear = 10 ** rng.uniform(math.log10(0.2), math.log10(4))
        half = clear / 2 * (1 + 10 ** rng.uniform(math.log10(2), math.log10(15)))
        ns = 1
    else:
        clear = 10 ** rng.uniform(math.log10(0.2), math.log10(60))
        half = clear / 2 * (1 + 10 ** rng.uniform(math.log10(0.25), math.log10(14)))
        ns = int(rng.integers(1, 5)) if kind == "planetary" else int(rng.integers(1, 3))
    half = min(max(half, 0.5), 150.0)
    A0 = half
    ch = clear / 2 / A0  # half clearance in A0
    e = max(1 - ch, 0.05)  # wind-up in A0
    F = 10 ** rng.uniform(-2, math.log10(0.25))
    share = rng.uniform(0.1, 0.9)  # of friction that does not depend on load
    sh = rng.uniform(0.1, 0.5) if kind != "strain-wave" else rng.uniform(0.1, 0.3)
    wu = rng.uniform(0.1, 0.3) if kind == "strain-wave" else 0.0
    bw = rng.uniform(0.1, 0.25) if kind == "strain-wave" or rng.random() < 0.25 else 0.0
    est = e * max(1 - sh - wu - bw, 0.15)
    wc = rng.dirichlet(np.full(ns, 2.0))
    we = rng.dirichlet(np.full(ns, 2.0))
    wf = rng.dirichlet(np.full(ns, 2.0))
    wm = rng.dirichlet(np.full(ns, 2.0))
    P = dict(
        nt=np.zeros(ns, np.int64),
        c=np.zeros((ns, NT)),
        k=np.zeros((ns, NT)),
        p=np.ones(ns),
        mu=np.zeros(ns),
        kt=np.zeros((ns, NT)),
        kind=np.zeros(ns, np.int64),
        ke=np.zeros((ns, NEL)),
        le=np.zeros((ns, NEL)),
        dl=np.zeros(ns),
        x0=np.ones(ns),
        beta=np.zeros(ns),
        kg=np.zeros(ns),
    )
    for i in range(ns):
        n, w, ec = draw_teeth(rng, kind != "planetary")
        p = 1.0 if rng.random() < 0.2 else float(rng.uniform(1.05, 1.5))
        c = ch * wc[i] * ec
        ei = est * we[i]
        xT = c.min() + ei
        k = w / np.sum(w * np.maximum(xT - c, 0) ** p)
        mu = min(F * (1 - share) * wm[i], 0.3)
        xs = ei * 10 ** rng.uniform(-1.6, -0.4)
        P["nt"][i], P["p"][i], P["mu"][i] = n, p, mu
        P["c"][i, :n], P["k"][i, :n] = c, k
        P["kt"][i, :n] = mu * w / w.sum() / xs
        d = F * share * wf[i]
        xb = (ei + 0.3 * ch * wc[i]) * 10 ** rng.uniform(-1.7, -0.3)
        P["beta"][i] = rng.uniform(0, 0.6) if rng.random() < 0.4 else 0.0
        P["kg"][i] = d / 2 * rng.uniform(0.02, 0.5)  # seal: drag grows a little with the angle turned
        kd = int(rng.integers(0, 3))
        if kd == 1:
            P["kind"][i], P["dl"][i], P["x0"][i] = 1, d, xb
        else:
            u = (np.arange(NEL) + 0.5) / NEL
            zt = -xb * np.log(1 - u) if kd == 0 else xb * (0.15 + 1.2 * u**0.3)  # exponential, or crowded at the top
            P["le"][i] = d / NEL
            P["ke"][i] = d / NEL / zt
    P["visc"] = 10 ** rng.uniform(-3.9, -2.9)
    R = dict(
        kind=kind,
        Tr=Tr,
        A0=A0,
        clear=clear,
        F=F,
        share=share,
        ns=ns,
        P=P,
        esh=e * sh,
        ewu=e * wu,
        ebw=e * bw,
        h=rng.uniform(-0.12, 0.15),
        t0=10 ** rng.uniform(-1.5, -0.6),
        nbw=float(rng.choice([1.0, 1.5, 2.0])),
        fbw=F * rng.uniform(0.2, 0.6),
        xbw=e * bw * 10 ** rng.uniform(-1.3, -0.5) if bw else 1.0,
    )
    R["ebw"] = e * bw
    return R


def shaft(R, t):
    y = R["esh"] * t * (1 + R["h"] * t * t) / (1 + R["h"])
    if R["ewu"]:
        y = y + R["ewu"] * np.arcsinh(t / R["t0"]) / math.asinh(1 / R["t0"])
    return y


def run_chain(R, tau, fs=None, fm=None, kneg=1.0, dq=DQ):
    P = R["P"]
    o = np.ones(len(tau))
    y, res = chain(
        np.ascontiguousarray(tau),
        o if fs is None else fs,
        o if fm is None else fm,
        P["nt"],
        P["c"],
        P["k"],
        P["p"],
        P["mu"],
        P["kt"],
        P["kind"],
        P["ke"],
        P["le"],
        P["dl"],
        P["x0"],
        P["beta"],
        P["kg"],
        P["visc"],
        kneg,
        dq,
    )
    R["residual"] = max(R.get("residual", 0.0), res)
    if R["ebw"]:
        y = y + boucwen(tau, (1 - R["fbw"]) / R["ebw"], R["fbw"], R["xbw"], R["nbw"], 4)
    return y


def triangle(cycles, step):
    n = int(round(1 / step))
    up = np.arange(1, n + 1) / n
    one = np.concatenate([1 - up, -up, -1 + up, up])
    return np.concatenate([[0.0], up] + [one] * cycles), n


def indicators(tau, th, Tr, A0):
    """Of one settled cycle +T → −T → +T given on a grid; torque in T_r, angle in A0."""
    n = (len(tau) - 1) // 2
    td, yd = tau[: n + 1][::-1], th[: n + 1][::-1]
    tu, yu = tau[n:], th[n:]
    k = K_LOST
    def mean(x):
        return 0.5 * (np.interp(x, td, yd) + np.interp(x, tu, yu))
    w = np.interp(tu, td, yd) - yu
    S = float(np.sum(0.5 * (w[1:] + w[:-1]) * np.diff(tu)))
    pos = tu >= -1e-12
    neg = td <= 1e-12
    W = float(np.sum(0.5 * (tu[pos][1:] + tu[pos][:-1]) * np.diff(yu[pos])))
    a, b = td[neg][::-1], yd[neg][::-1]
    W += float(np.sum(0.5 * (a[1:] + a[:-1]) * np.diff(b)))
    rad = A0 * ARCMIN
    return {
        "lost_motion_rad": float(mean(k) - mean(-k)) * rad,
        "backlash_rad": float(np.interp(0, td, yd) - np.interp(0, tu, yu)) * rad,
        "area_J": S * rad * Tr,
        "absorbed_J": W * rad * Tr,
        "dissipation_ratio": S / W,
        "peak_rad": float(0.5 * (yd[-1] - yd[0])) * rad,
    }


def settled(R, step=1 / 3000, cycles=3, dq=DQ / 2):
    tau, n = triangle(cycles, step)
    th = run_chain(R, tau, dq=dq) + shaft(R, tau)
    return tau[-4 * n - 1 :], th[-4 * n - 1 :]


# ------------------------------------------------------------------ test plan
class Path:
    """Piecewise linear torque command; corners may be rounded by a moving mean of width b seconds."""

    def __init__(self, t, v, b):
        self.t, self.v, self.b = np.array(t, float), np.array(v, float), b
        self.I = np.concatenate([[0], np.cumsum(0.5 * (self.v[1:] + self.v[:-1]) * np.diff(self.t))])

    def integral(self, x):
        i = np.clip(np.searchsorted(self.t, x, "right") - 1, 0, len(self.t) - 2)
        dx = x - self.t[i]
        sl = (self.v[i + 1] - self.v[i]) / (self.t[i + 1] - self.t[i])
        return self.I[i] + self.v[i] * dx + 0.5 * sl * dx * dx

    def __call__(self, x):
        x = np.asarray(x, float)
        if self.b <= 0:
            return np.interp(x, self.t, self.v)
        return (self.integral(x + self.b / 2) - self.integral(x - self.b / 2)) / self.b


def plan_record(rng, rate, style, dur, fs, t0):
    """rate in T_r a second. Returns grid (history included), sample times."""
    b = style["round"] * 4 / rate if style["round"] else 0.0
    dw = style["dwell"]
    top = 1 + rate * b / 4
    cyc = style["cycles"]
    start = style["start"]
    if start == "zero":
        v = [0.0] + [top, -top] * cyc + [top]
    elif start == "elsewhere":
        a = style["v0"]
        v = [a] + ([top, -top] * cyc + [top, a] if style["up"] else [-top, top] * cyc + [-top, a])
    else:  # from a tip
        s = style["sgn"]
        v = [s * 1.0] + [-s * top, s * top] * cyc + [-s * 1.0]
    rest = style["rest"]
    tk, vk = [-1.0, rest], [v[0], v[0]]
    for i in range(1, len(v)):
        tk.append(tk[-1] + abs(v[i] - v[i - 1]) / rate)
        vk.append(v[i])
        if dw and i < len(v) - 1:
            tk.append(tk[-1] + dw)
            vk.append(v[i])
    tend = tk[-1]
    tk.append(tend + 10 / rate)
    vk.append(v[-1] - np.sign(v[-1] - v[-2]) * 10)
    path = Path(tk, vk, b)
    # history: random turning points, then to the start, then a pause
    m = int(rng.integers(1, 5))
    hv = [0.0] + list(
        rng.uniform(-1, 1, m) if rng.random() < 0.7 else np.where(np.arange(m) % 2, -1.0, 1.0) * (1 if rng.random() < 0.5 else -1)
    )
    hv.append(v[0])
    if start == "zero" and rng.random() < 0.15:
        hv = [0.0, 0.0]  # virgin
    pause = rng.uniform(1, 20)
    ht, hh = [np.array([0.0])], [np.array([0.0])]
    for a, c in zip(hv[:-1], hv[1:], strict=False):
        n = max(int(abs(c - a) / STEP), 1)
        ht.append(ht[-1][-1] + abs(c - a) / rate * np.arange(1, n + 1) / n)
        hh.append(a + (c - a) * np.arange(1, n + 1) / n)
    ht.append(ht[-1][-1] + pause * np.arange(1, 21) / 21)
    hh.append(np.full(20, v[0]))
    ht, hh = np.concatenate(ht), np.concatenate(hh)
    ht = ht - ht[-1] - pause / 21
    n = int(math.ceil(tend * rate / STEP))
    tg = np.unique(np.concatenate([np.linspace(0, tend, n + 1), [x for x in tk if 0 <= x <= tend]]))
    g = np.concatenate([ht, tg])
    tau = np.concatenate([hh, path(tg)])
    # sampling
    dt = 1 / fs
    N = int(tend * fs)
    if style["sampling"] == "jitter":
        ts = np.cumsum(dt * rng.uniform(0.6, 1.4, N + 50))
    elif style["sampling"] == "burst":
        ts = np.cumsum(dt * np.where((np.arange(int(1.5 * N)) // 200) % 2, 1.5, 0.5))
    else:
        ts = dt * np.arange(N + 1)
    ts = ts[ts <= tend]
    if style["drop"] == "random":
        ts = ts[rng.random(len(ts)) > rng.uniform(0.01, 0.05)]
    elif style["drop"] == "blocks":
        keep = np.ones(len(ts), bool)
        for _ in range(int(rng.integers(2, 6))):
            i = int(rng.integers(0, len(ts) - 70))
            keep[i : i + int(rng.integers(10, 60))] = False
        ts = ts[keep]
    ts = np.round(ts, 6)
    return dict(rate=rate, g=g, tau=tau, ts=ts, tend=tend, path=path, taus=path(ts), t0=t0, fs=fs, first=len(ht))


def plan_unit(rng, R):
    """Three records at r, r/5, 2r in random order."""
    two = rng.random() < 0.2
    D = 10 ** rng.uniform(math.log10(5), math.log10(44 if two else 75))
    r = float("%.3g" % (5 * R["Tr"] / D))
    same = rng.random() < 0.5
    st = dict(round=0.0, dwell=0.0, cycles=1, start="zero", rest=0.0, sampling="equal", drop="none")
    a = rng.random()
    if a < 0.2:
        st["round"] = rng.uniform(0.004, 0.025)
    elif a < 0.45:
        st["dwell"] = rng.uniform(0.1, 0.5)
    a = rng.random()
    if two:
        st["cycles"] = 2
    elif a < 0.15:
        st.update(start="elsewhere", v0=rng.uniform(-0.8, 0.8), up=bool(rng.random() < 0.5))
    elif a < 0.27:
        st.update(start="tip", sgn=int(rng.choice([-1, 1])))
    if rng.random() < 0.3:
        st["rest"] = rng.uniform(0.05, 0.6)
    st["sampling"] = str(rng.choice(["equal", "jitter", "burst"], p=[0.75, 0.15, 0.1]))
    st["drop"] = str(rng.choice(["none", "random", "blocks"], p=[0.8, 0.1, 0.1]))
    rates = [r, r / 5, 2 * r]
    rates = [float(f"{x:g}") for x in rates]
    order = rng.permutation(3)
    recs = []
    t0 = 0.0
    for j in order:
        rt = rates[j] / R["Tr"]
        dur = (5 if st["cycles"] == 1 else 9) / rt
        if same:
            fs = min(max((4000 if not two else 2222) / D, 50), 1000)
        else:
            lo, hi = max(50, 2000 / dur), min(1000, 20000 / dur)
            fs = 10 ** rng.uniform(math.log10(lo), math.log10(max(hi, lo)))
        fs = float(f"{fs:.2g}")
        rec = plan_record(rng, rt, st, dur, fs, t0)
        rec["rate_SI"] = rates[j]
        rec["nominal"] = r / R["Tr"]
        t0 += rec["tend"] + rng.uniform(20, 120)
        rec["G"] = 0.0
        recs.append(rec)
    total = t0
    G = rng.uniform(-2, 2)
    for rec in recs:
        rec["G"] = G + (0.0 if rng.random() < 0.5 else rng.normal(0, 0.2))
        rec["total"] = total
    return recs, st, D


# ------------------------------------------------------------------ effects
def draw_effect(name, rng, R, D):
    e = {"name": name, "seed": int(rng.integers(2**31))}
    def ch(*a):
        return str(rng.choice(a))
    if name == "interface_slip":
        e.update(v=ch("play", "iwan", "power"), r=rng.uniform(0.55, 0.88), q=rng.uniform(1, 2))
    elif name == "viscoelastic_creep":
        e.update(
            v=ch("one", "three", "threshold", "progressive"),
            T=max(D * 10 ** rng.uniform(-1.7, -0.1), 0.4),
            thr=rng.uniform(0.15, 0.5),
        )
    elif name == "asymmetric_stiffness":
        e.update(v=ch("flank", "abs", "square", "saturating"), s=float(rng.choice([-1, 1])), a=rng.uniform(0.3, 0.8))
    elif name == "second_backlash":
        d0 = R["F"] * R["share"]
        d2 = rng.uniform(0.15, 0.65)
        while abs(d2 - d0) < 0.1:
            d2 = rng.uniform(0.15, 0.65)
        n = int(rng.integers(1, 7))
        e.update(
            v=ch("coulomb", "dahl"),
            d=d2,
            n=n,
            ec=np.abs(1 + (0.15 * rng.standard_normal(n) if n > 1 else 0)),
            x=10 ** rng.uniform(-2, -0.8),
        )
    elif name == "sensor_lag":
        e.update(v=ch("delay", "first-order", "both"))
    elif name == "thermal_drift":
        e.update(
            v=ch("linear", "exponential", "slow sine", "random"),
            s=float(rng.choice([-1, 1])),
            T=D * rng.uniform(0.5, 5),
            P=D * rng.uniform(0.8, 4),
            ph=rng.uniform(0, 6.28),
            kn=rng.standard_normal(400),
            dk=D * rng.uniform(0.3, 1),
        )
    elif name == "torque_offset":
        e.update(v=ch("constant", "per record"), s=float(rng.choice([-1, 1])), j=1 + 0.3 * rng.standard_normal(3))
    elif name == "encoder_error":
        e.update(
            v=ch("one", "two harmonics", "triangle"),
            per=2 / 10 ** rng.uniform(math.log10(1.5), math.log10(14)),
            ph=rng.uniform(0, 6.28),
            p2=rng.uniform(0, 6.28),
            h2=rng.uniform(0.2, 0.6),
        )
    elif name == "stick_slip":
        e.update(
            v=ch("regular", "irregular", "grows with load", "fades with rate"),
            over=rng.uniform(0.35, 0.55),
            load=rng.uniform(0.5, 2),
        )
    elif name == "rate_dependent_friction":
        e.update(v=ch("log", "power", "stribeck"), s=float(rng.choice([-1, 1])), who=ch("both", "drag", "tooth", "both"))
    elif name == "x_tooth_damage":
        e.update(x0=rng.uniform(0.3, 0.8) * rng.choice([-1, 1]), w=rng.uniform(0.05, 0.22), s=float(rng.choice([-1, 1])))
    elif name == "x_mount_step":
        e.update(
            n=int(rng.integers(1, 3)), s=float(rng.choice([-1, 1])), f=rng.uniform(0.15, 0.85, (3, 2)), on=(rng.random(3) < 0.6)
        )
        if not e["on"].any():
            e["on"][int(rng.integers(3))] = True
    elif name == "x_sign_gain":
        e.update(s=float(rng.choice([-1, 1])), w=rng.uniform(0.01, 0.03))
    elif name == "x_mains_hum":
        e.update(f=float(rng.choice([50.0, 16.7, 60.0, 24.8])) * (1 + 1e-3 * rng.standard_normal()), ph=rng.uniform(0, 6.28, 3))
    elif name == "x_friction_warmup":
        e.update(T=rng.uniform(0.1, 0.5), s=float(rng.choice([1, 1, -0.5])))
    elif name == "x_ratchet":
        e.update(thr=rng.uniform(0.2, 0.7), s=float(rng.choice([-1, 1])))
    elif name == "x_torque_ripple":
        e.update(n=rng.uniform(4, 18), ph=rng.uniform(0, 6.28))
    elif name == "x_stiffness_fade":
        e.update(T=rng.uniform(0.3, 1.5), s=float(rng.choice([1, 1, -1])))
    elif name == "x_knocks":
        e.update(n=int(rng.integers(2, 7)), f=rng.uniform(1.0, 6.0), d=rng.uniform(0.2, 1.2))
    return e


def simulate(R, rec, j, effs, soil=None, mechanical_only=False, at=None):
    """Noise-free angle (A0) at the sample times; effs is a list of (effect, strength)."""
    g, tau = rec["g"], rec["tau"].copy()
    D = rec["tend"]
    ta = tau.copy()
    fs = fm = None
    kneg = 1.0
    changed = False
    if mechanical_only:
        effs = [(e, p) for e, p in effs if e["name"] not in CHANNEL]
    if soil:
        ta = ta - soil["offset"]
        changed = True
    for e, p in effs:
        n = e["name"]
        if n == "torque_offset":
            ta = ta - p * e["s"] * (e["j"][j] if e["v"] == "per record" else 1.0)
            changed = True
        elif n == "x_torque_ripple":  # the drive's own period: so many ripples a T_r of the nominal ramp
            ta = ta + p * np.sin(2 * np.pi * e["n"] * g * rec["nominal"] / 2 + e["ph"])
            changed = True
        elif n == "rate_dependent_friction":
            x = rec["rate"] / rec["nominal"]
            if e["v"] == "log":
                f = 1 + e["s"] * p * math.log(x)
            elif e["v"] == "power":
                f = x ** (e["s"] * p)
            else:
                f = 1 + e["s"] * p * 3 * (math.exp(-x) - math.exp(-1.0))
            f = np.full(len(g), min(max(f, 0.3), 3.0))
            fs = f if e["who"] != "tooth" else fs
            fm = f if e["who"] != "drag" else fm
            changed = True
        elif n == "x_friction_warmup":
            f = 1 + e["s"] * p * np.exp(-np.maximum(g, 0) / (e["T"] * D))
            fs = f if fs is None else fs * f
            fm = f if fm is None else fm * f
            changed = True
        elif n == "asymmetric_stiffness" and e["v"] == "flank":
            kneg = 1 - p if e["s"] > 0 else 1 / (1 - p)
            changed = True
    tc = ta
    for e, p in effs:
        if e["name"] == "stick_slip":
            rg = np.random.default_rng(e["seed"] + j)
            rnd = np.ones(4000) if e["v"] != "irregular" else rg.uniform(0.4, 1.6, 4000)
            d = p * (rec["nominal"] / rec["rate"]) ** (0.35 if e["v"] == "fades with rate" else 0.0)
            tc = staircase(ta, d, e["over"], e["load"] if e["v"] == "grows with load" else 0.0, rnd)
            changed = True
    if changed:
        y = run_chain(R, tc, fs, fm, kneg)
    else:
        if "phi" not in rec:
            rec["phi"] = run_chain(R, tau)
        y = rec["phi"]
    y = y + shaft(R, ta)
    tp = np.maximum(g, 0)
    for e, p in effs:
        n, v = e["name"], e.get("v")
        if n == "interface_slip":
            if v == "play":
                y = y + p / (1 - e["r"]) * play(ta, e["r"])
            elif v == "iwan":
                rs = np.linspace(e["r"], 0.985, 12)
                y = y + p * sum(play(ta, x) for x in rs) / np.sum(1 - rs)
            else:
                y = y + p * held_slip(ta, e["r"], e["q"])
        elif n == "viscoelastic_creep":
            if v == "threshold":
                u = np.sign(ta) * np.maximum(np.abs(ta) - e["thr"], 0) / (1 - e["thr"])
            elif v == "progressive":
                u = ta * np.abs(ta)
            else:
                u = ta
            if v == "three":
                y = y + p / 3 * (relax(g, u, e["T"] / 4) + relax(g, u, e["T"]) + relax(g, u, e["T"] * 4))
            else:
                y = y + p * relax(g, u, e["T"])
        elif n == "asymmetric_stiffness":
            if v == "abs":
                y = y + p * e["s"] * (np.sqrt(ta**2 + 0.02**2) - 0.02)
            elif v == "square":
                y = y + p * e["s"] * ta**2
            elif v == "saturating":
                y = y + p * e["s"] * ta**2 / (ta**2 + e["a"] ** 2)
        elif n == "second_backlash":
            c = np.zeros((1, NT))
            k = np.zeros((1, NT))
            c[0, : e["n"]] = p * e["ec"]
            ei = 0.15 * p
            k[0, : e["n"]] = 1 / np.sum(np.maximum(c[0, : e["n"]].min() + ei - c[0, : e["n"]], 0) ** 1.3)
            o = np.ones(len(g))
            z1 = np.zeros(1)
            xs = e["x"] * p * (1 + np.arange(NEL) / NEL)
            yy, res = chain(
                ta,
                o,
                o,
                np.array([e["n"]]),
                c,
                k,
                np.array([1.3]),
                np.array([0.05]),
                np.zeros((1, NT)) + 1.0 / ei,
                np.array([1 if v == "dahl" else 0]),
                (e["d"] / NEL / xs)[None, :],
                np.full((1, NEL), e["d"] / NEL),
                np.array([e["d"]]),
                np.array([e["x"] * p]),
                z1,
                z1 + 0.02 * e["d"] / p,
                4e-4 / p,
                1.0,
                DQ,
            )
            R["residual"] = max(R.get("residual", 0.0), res)
            y = y + yy
        elif n == "x_tooth_damage":
            y = y + p * e["s"] * np.exp(-(((y - e["x0"]) / e["w"]) ** 2) / 2)
        elif n == "x_ratchet":
            inc = np.maximum(np.diff(ta, prepend=ta[0]), 0) * (ta > e["thr"]) / (1 - e["thr"])
            y = y + p * e["s"] * np.cumsum(inc)
        elif n == "x_stiffness_fade":
            y = y + e["s"] * p * (1 - np.exp(-tp / (e["T"] * D))) * ta
    if mechanical_only:
        return y
    if soil:
        y = y + soil["even"] * ta**2
    t = g + rec["t0"]
    for e, p in effs:
        n, v = e["name"], e.get("v")
        if n == "thermal_drift":
            if v == "linear":
                d = t / (5 * e["T"] + 1e-9)
            elif v == "exponential":
                d = 1 - np.exp(-np.maximum(t + 20, 0) / e["T"])
            elif v == "slow sine":
                d = np.sin(2 * np.pi * t / e["P"] + e["ph"])
            else:
                from scipy.interpolate import CubicSpline

                d = CubicSpline(e["dk"] * (np.arange(400) - 20), np.cumsum(e["kn"]) * 0.5)(
                    np.clip(t, -15 * e["dk"], 370 * e["dk"])
                )
            y = y + p * e["s"] * d
        elif n == "x_mount_step" and e["on"][j]:
            for q in range(e["n"]):
                y = y + p * e["s"] * (1 if q == 0 else -0.6) / (
                    1 + np.exp(-np.clip((g - e["f"][j, q] * D) / (0.0004 * D), -60, 60))
                )
        elif n == "x_sign_gain":
            s = np.sign(np.diff(ta, prepend=ta[0]))
            s = relax(np.concatenate([[0], np.cumsum(np.abs(np.diff(ta)))]), s, e["w"])
            y = y + p * e["s"] * s * y
        elif n == "x_mains_hum":
            pass
        elif n == "x_knocks":
            pass
    lag = [(e, p) for e, p in effs if e["name"] == "sensor_lag"]
    ts = rec["ts"]
    L = soil["lag"] if soil else 0.0
    for e, p in lag:
        T = p * rec["D"]
        if e["v"] == "delay":
            L += T
        elif e["v"] == "first-order":
            y = relax(g, y, T)
        else:
            L += 0.5 * T
            y = relax(g, y, 0.5 * T)
    th = np.interp(ts - L, g, y)
    if soil:
        th = th + soil["drift"] * ts / D
    for e, p in effs:
        n = e["name"]
        if n == "x_mains_hum":
            th = th + p * np.sin(2 * np.pi * e["f"] * ts + e["ph"][j])
        elif n == "x_knocks":
            rg = np.random.default_rng(e["seed"] + j)
            dd = e["d"] * min(1.0, D / 15)
            ff = e["f"] * max(1.0, 15 / D)
            for _ in range(e["n"]):
                x = ts - rg.uniform(0.05, 0.95) * D
                a = rg.normal(0, 1)
                xp = np.maximum(x, 0)
                th = th + p * a * np.where(x > 0, np.exp(-xp / dd) * np.sin(2 * np.pi * ff * xp), 0)
    th = th + rec["G"]
    for e, p in effs:
        if e["name"] == "encoder_error":
            a = 2 * np.pi * th / e["per"] + e["ph"]
            if e["v"] == "triangle":
                th = th + p * (2 / np.pi) * np.arcsin(np.sin(a))
            else:
                th = th + p * np.sin(a) + (p * e["h2"] * np.sin(2 * a + e["p2"]) if e["v"] == "two harmonics" else 0)
    return th


def refit_rms(recs, a, b):
    s = n = 0
    for rec, x, y in zip(recs, a, b, strict=False):
        X = np.stack([np.ones(len(x)), rec["taus"]], 1)
        d = x - y
        d = d - X @ np.linalg.lstsq(X, d, rcond=None)[0]
        s += d @ d
        n += len(d)
    return math.sqrt(s / n)


def told_rms(U):
    """As refit_rms over the noise, but with torque noise through the local slope in the noise of each sample."""
    s = n = 0
    for rec, x, y in zip(U["recs"], U["both"], U["clean"], strict=False):
        dt = np.gradient(rec["taus"])
        sl = np.where(np.abs(dt) > 0.1 * np.median(np.abs(dt)), np.gradient(y) / np.where(dt == 0, 1, dt), 0.0)
        w = 1 / np.sqrt(U["noise"]["sigma"] ** 2 + (U["noise"]["torque"] * sl) ** 2)
        X = np.stack([np.ones(len(x)), rec["taus"]], 1) * w[:, None]
        d = (x - y) * w
        d = d - X @ np.linalg.lstsq(X, d, rcond=None)[0]
        s += d @ d
        n += len(d)
    return math.sqrt(s / n)


# ------------------------------------------------------------------ units
def make_unit(rng, names, size):
    """Draws a reducer, a plan, effects, and scales them; returns all that is written."""
    ut = 10 ** rng.uniform(math.log10(0.05), math.log10(0.7))
    for attempt in range(400):  # u spread evenly in its logarithm, slender to fat
        R = draw_reducer(rng)
        if (ut > 0.12 and R["F"] < ut / 8) or ("rate_dependent_friction" in names and R["F"] < 0.04):
            continue
        tl, yl = settled(R, 1 / 300, 1, 0.02)
        u = indicators(tl, yl, R["Tr"], R["A0"])["dissipation_ratio"]
        if 0.045 < u < 0.75 and abs(math.log(u / ut)) < (0.15 if attempt < 200 else 0.4):
            break
    tl, yl = settled(R)
    ind = indicators(tl, yl, R["Tr"], R["A0"])
    recs, st, D = plan_unit(rng, R)
    for rec in recs:
        rec["D"] = D
    half = ind["peak_rad"] / ARCMIN / R["A0"]
    sigma = half * 2 * 10 ** rng.uniform(math.log10(0.0003), math.log10(0.004))
    cs = rng.uniform(0.2, 0.75)
    noise = dict(
        sigma=sigma,
        white=sigma * math.sqrt(1 - cs**2),
        corr=sigma * cs,
        tc=10 ** rng.uniform(-2, -1),
        torque=10 ** rng.uniform(math.log10(2e-4), math.log10(3e-3)),
        lsb=sigma * 10 ** rng.uniform(-1, 0.35),
        tlsb=10 ** rng.uniform(-3.7, -2.8) if rng.random() < 0.4 else 0.0,
    )
    clean = [simulate(R, rec, j, []) for j, rec in enumerate(recs)]
    effs, each, capped = [], [], []
    for n in names:
        e = draw_effect(n, rng, R, D)
        if n == "x_mains_hum":  # no hum whose alias is so slow that it would pass for a drift, nor above Nyquist
            fmin = min(r["fs"] for r in recs)
            ok = [f for f in (60.0, 50.0, 24.8, 16.7) if f < 0.45 * fmin]
            e["f"] = (float(rng.choice(ok)) if ok else 8.3) * (1 + 1e-3 * rng.standard_normal())
        target = TARGET[size]
        cap = CAP[n]
        if n == "sensor_lag":
            cap = min(cap, 0.5 / D)
        if n == "x_tooth_damage":  # keeps the angle monotone over the damaged sector
            cap = min(cap, 1.2 * e["w"])
        p = cap * 0.15
        tried = []
        for it in range(9):
            q = refit_rms(recs, [simulate(R, rec, j, [(e, p)]) for j, rec in enumerate(recs)], clean) / sigma
            tried.append((abs(math.log(max(q, 1e-9) / target)), p, q))
            if abs(q / target - 1) < 0.05 or (p >= cap and q < target):
                break
            p = min(p * min(max(target / max(q, 1e-9), 0.02), 20.0) ** (1.0 if it < 4 else 0.6), cap)
        _, p, q = min(tried)
        effs.append((e, p))
        each.append(q)
        capped.append(p >= cap)
    # tiny soil, shrunk till it is far below the noise
    soil = dict(
        offset=rng.normal(0, 3e-4),
        even=rng.normal(0, 0.1) * sigma,
        drift=rng.normal(0, 0.15) * sigma,
        lag=rng.uniform(0, 0.15) * sigma / (half * max(r["rate"] for r in recs)),
    )
    soil["lag"] = min(soil["lag"], 2e-3)
    for _ in range(14):
        sr = refit_rms(recs, [simulate(R, rec, j, [], soil) for j, rec in enumerate(recs)], clean) / sigma
        if sr < 0.12:
            break
        soil = {k: v * 0.6 for k, v in soil.items()}
    both = [simulate(R, rec, j, effs) for j, rec in enumerate(recs)] if effs else clean
    final = [simulate(R, rec, j, effs, soil) for j, rec in enumerate(recs)]
    ratio = refit_rms(recs, both, clean) / sigma if effs else 0.0
    return dict(
        R=R,
        ind=ind,
        recs=recs,
        style=st,
        D=D,
        noise=noise,
        effs=effs,
        each=each,
        capped=capped,
        soil=soil,
        soil_ratio=sr,
        ratio=ratio,
        clean=clean,
        both=both,
        final=final,
        names=names,
        size=size,
        loop=(tl, yl),
    )


def measure(rng, U, rec, th):
    nz, R = U["noise"], U["R"]
    n = len(th)
    w = rng.standard_normal(n)
    ou = np.empty(n)
    a = np.exp(-np.diff(rec["ts"]) / nz["tc"])
    z = rng.standard_normal(n)
    ou[0] = z[0]
    for i in range(1, n):
        ou[i] = a[i - 1] * ou[i - 1] + math.sqrt(1 - a[i - 1] ** 2) * z[i]
    ang = th + nz["white"] * w + nz["corr"] * ou
    ang = np.round(ang / nz["lsb"]) * nz["lsb"]
    tq = rec["taus"] + nz["torque"] * rng.standard_normal(n)
    if nz["tlsb"]:
        tq = np.round(tq / nz["tlsb"]) * nz["tlsb"]
    return rec["ts"] - rec["ts"][0], tq * R["Tr"], ang * R["A0"]


def write_unit(rng, folder, name, U):
    os.makedirs(folder, exist_ok=True)
    R = U["R"]
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f"rated_torque_Nm = {R['Tr']:g}", ""]
    for j, rec in enumerate(U["recs"]):
        t, tq, an = measure(rng, U, rec, U["final"][j])
        f = f"rate-{rec['rate_SI']:g}.csv"
        np.savetxt(
            os.path.join(folder, f),
            np.stack([t, tq, an], 1),
            fmt=["%.6f", "%.7g", "%.8g"],
            delimiter=",",
            header="time_s,torque_Nm,angle_arcmin",
            comments="",
        )
        lines += ["[[record]]", f'file = "{f}"', f"loading_rate_Nm_per_s = {rec['rate_SI']:g}", f"amplitude_Nm = {R['Tr']:g}", ""]
    with open(os.path.join(folder, "unit.toml"), "w") as fh:
        fh.write("\n".join(lines))


def with_effect(U):
    """Extra: the settled loop with the mechanism (no channel fault), third cycle at each rate."""
    R = U["R"]
    out = {}
    tau, n = triangle(3, 1 / 1500)
    for j, rec in enumerate(U["recs"]):
        rr = dict(rec)
        rr.pop("phi", None)
        s = np.concatenate([[0], np.cumsum(np.abs(np.diff(tau)))])
        rr.update(g=s / rec["rate"], tau=tau)
        y = simulate(R, rr, j, U["effs"], mechanical_only=True)
        out["{:g}".format(rec["rate_SI"])] = indicators(tau[-4 * n - 1 :], y[-4 * n - 1 :], R["Tr"], R["A0"])
    return out


def deal(rng, units):
    sc = units / 60
    nl, nx, npair = round(20 * sc), round(9 * sc), round(7 * sc)
    jobs = []
    sev = [1.0, 0.4, 0.2]
    order = list(rng.permutation(LISTED)) * (nl // 10 + 1)
    first = {}
    for i in range(nl):
        n = str(order[i])
        k = (i if n not in first else first[n] + 1 + int(rng.integers(2))) % 3
        first.setdefault(n, k)
        jobs.append(((n,), sev[k], "listed"))
    xs = list(rng.permutation(UNLISTED)) * (nx // len(UNLISTED) + 1)
    for i in range(nx):
        jobs.append(((str(xs[i]),), sev[i % 3], "unlisted"))
    seen = set()
    pool = list(rng.permutation(LISTED)) + list(rng.permutation(LISTED))
    for i in range(npair):
        a, b = str(pool[(2 * i) % 20]), str(pool[(2 * i + 1) % 20])
        while a == b or frozenset((a, b)) in seen:
            b = str(rng.choice(LISTED))
        seen.add(frozenset((a, b)))
        jobs.append(((a, b), sev[i % 3], "pair"))
    while len(jobs) < units:
        jobs.append(((), 0.0, "clean"))
    jobs = jobs[:units]
    return [jobs[i] for i in rng.permutation(len(jobs))]


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument("out")
    ap.add_argument("--units", type=int, default=60)
    ap.add_argument("--seed", type=int, default=5)
    a = ap.parse_args()
    os.makedirs(a.out, exist_ok=True)
    rng0 = np.random.default_rng(a.seed)
    jobs = deal(rng0, a.units)
    key = {}
    for i, (names, size, kind) in enumerate(jobs):
        t = time.time()
        best = None
        for att in range(6):
            rng = np.random.default_rng([a.seed, i, att])
            U = make_unit(rng, list(names), size)
            worst = min([q / TARGET[size] for q in U["each"]], default=1.0)
            if best is None or worst > best[0]:
                best = (worst, U, rng)
            if 0.7 < worst:
                break
        _, U, rng = best
        name = f"case-{i + 1:02d}"
        write_unit(rng, os.path.join(a.out, name), name, U)
        R = U["R"]
        key[name] = {
            "effects": list(names),
            "size": size,
            "rms_over_noise": round(U["ratio"], 3),
            "kind": kind,
            "indicators": {"{:g}".format(r["rate_SI"]): U["ind"] for r in U["recs"]},
            "rms_over_noise_each": {n: round(q, 3) for n, q in zip(names, U["each"], strict=False)},
            "capped": {n: bool(c) for n, c in zip(names, U["capped"], strict=False)},
            "rms_over_noise_with_torque_noise": round(told_rms(U), 3) if names else 0.0,
            "variant": {e["name"]: e.get("v", "") for e, p in U["effs"]},
            "strength": {e["name"]: p for e, p in U["effs"]},
            "parameters": {
                e["name"]: {k: v for k, v in e.items() if isinstance(v, (int, float, str)) and k not in ("name", "seed")}
                for e, p in U["effs"]
            },
            "soil": U["soil"],
            "soil_rms_over_noise": round(U["soil_ratio"], 4),
            "angle_noise_rad": U["noise"]["sigma"] * R["A0"] * ARCMIN,
            "noise": {k: float(v) for k, v in U["noise"].items()},
            "reducer": {
                "type": R["kind"],
                "stages": R["ns"],
                "rated_torque_Nm": R["Tr"],
                "clearance_arcmin": R["clear"],
                "friction_share_of_rated": R["F"],
                "A0_arcmin": R["A0"],
                "bouc_wen": bool(R["ebw"]),
            },
            "style": {k: (v if isinstance(v, (int, str, bool)) else float(v)) for k, v in U["style"].items()},
            "samples": [len(r["ts"]) for r in U["recs"]],
            "solver_residual": R["residual"],
        }
        if any(n not in CHANNEL for n in names):
            key[name]["indicators_with_effect"] = with_effect(U)
        print(
            f"{name} {kind:9s} {'+'.join(names):45s} size {size} ratio {U['ratio']:.2f} u {U['ind']['dissipation_ratio']:.3f} "
            f"{R['kind']} n={key[name]['samples']} {time.time() - t:.1f}s res {R['residual']:.1e}",
            flush=True,
        )
    with open(os.path.join(a.out, "key.json"), "w") as fh:
        json.dump(key, fh, indent=1)


if __name__ == "__main__":
    main()
