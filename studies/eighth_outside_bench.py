"""Virtual test bench of robot gear reducers: labelled records of locked-input hysteresis tests.

Usage: python eighth_outside_bench.py OUT [--units 80] [--seed 81] [--jobs 2] [--check]

Writes OUT/case-01 ... OUT/case-NN (unit folders) and OUT/key.json. Every reducer is solved as mechanics: equilibrium of
contacts with clearance, preloaded bearings, friction elements with memory, friction cones, shear-lag chains. Inside, torque
is in units of the rated torque and angle in arcmin; files hold N·m and arcmin or what their column names say. The rms of an
effect is the root of the mean over records of the mean square over samples of (with effect - clean), each record's mean
removed, in standard deviations of a single angle sample.
"""
from __future__ import annotations

import argparse
import gzip
import itertools
import json
import math
import multiprocessing
from pathlib import Path

import numpy as np
from numba import njit

ARCMIN = math.pi / 10800.0
H_FINE, H_COARSE = 1.0 / 1600.0, 1.0 / 400.0
TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
K_LOST = 0.03


# ------------------------------------------------------------------ kernels: equilibrium along a torque path
@njit(cache=False)
def mesh_torque(x, x0, commit, con, jen, qc, qj, lin, fs, nf, asym, dc):
    """Torque of a body at angle x: springs, a magnet, two-flank contacts with load-proportional friction, sliders."""
    tot = lin[0] * x + lin[1] * x * x * x
    if lin[2] > 0.0:
        arg = min(max(x / lin[3], -0.5 * math.pi), 0.5 * math.pi)
        tot += lin[2] * math.sin(arg)
    for i in range(con.shape[0]):
        load = 0.0
        for s in (-1.0, 1.0):
            if con[i, 6] == -s:
                continue
            pen = s * x - con[i, 1] - dc
            if pen > 0.0:
                k = con[i, 0] * (1.0 + asym * s)
                force = k * pen if con[i, 2] == 1.0 else k * pen ** con[i, 2]
                if con[i, 3] > 0.0:
                    force = force / (1.0 + pen / con[i, 3])
                tot += s * force
                load += force
        lim = con[i, 4] * fs * load
        q = min(max(qc[i] + con[i, 5] * (x - x0), -lim), lim)
        tot += q
        if commit:
            qc[i] = q
    for i in range(jen.shape[0]):
        lim = jen[i, 0] * fs * nf
        q = min(max(qj[i] + jen[i, 1] * (x - x0), -lim), lim)
        tot += q
        if commit:
            qj[i] = q
    return tot


@njit(cache=False)
def crossing(torque, m, x0, last, tol, most, args):
    """Angle at which a body that was at x0 carries m: bracketed with a step of about the last one, then regula falsi (Illinois)
    with every fourth step a bisection, at most so many."""
    r0 = torque(x0, x0, False, *args) - m
    if abs(r0) <= tol:
        return x0
    step = max(abs(last), 1e-7)
    a, ra, b, rb = x0, r0, x0, r0
    for _ in range(80):
        b = a - step if r0 > 0 else a + step
        rb = torque(b, x0, False, *args) - m
        if rb * r0 <= 0.0:
            break
        a, ra = b, rb
        step *= 2.0
    side = 0
    x = b
    for it in range(most):
        if abs(rb) < tol or abs(b - a) < 1e-12 * (1.0 + abs(b)):
            return b
        c = b - rb * (b - a) / (rb - ra) if it % 4 != 3 else 0.5 * (a + b)
        rc = torque(c, x0, False, *args) - m
        x = c
        if abs(rc) < tol:
            break
        if rc * rb < 0.0:
            a, ra = b, rb
            side = 0
        else:
            side += 1
            if side > 1:
                ra *= 0.5
        b, rb = c, rc
    return x


@njit(cache=False)
def mesh_march(m, fs, nf, dc, asym, con, jen, lin):
    """Angle of a body (see mesh_torque) under the torque path m, from rest."""
    out = np.zeros(m.size)
    qc, qj = np.zeros(con.shape[0]), np.zeros(jen.shape[0])
    x0, last = 0.0, 1e-4
    for j in range(m.size):
        args = (con, jen, qc, qj, lin, fs[j], nf[j], asym, dc[j])
        x = crossing(mesh_torque, m[j], x0, last, 1e-12, 100, args)
        mesh_torque(x, x0, True, *args)
        if x != x0:
            last = x - x0
        x0 = x
        out[j] = x
    return out


@njit(cache=False)
def chain_march(m, fs, load, link, ground, f0, f1, kj, tension, base, wedge):
    """Angle at node `load` of a chain of springs with friction at every node (tooth belt of a flexspline, wrapped rope).

    Friction limit of node i: f0 + f1 |torque| for tension == 0, else wedge * local rope tension (base +- link force).
    """
    n = ground.size
    u, u0, q0 = np.zeros(n), np.zeros(n), np.zeros(n)
    lim, r, dia = np.zeros(n), np.zeros(n), np.zeros(n)
    up, rhs = np.zeros(n), np.zeros(n)
    out = np.zeros(m.size)
    for j in range(m.size):
        for it in range(60):
            for i in range(n):
                if tension == 0:
                    lim[i] = fs[j] * (f0[i] + f1[i] * abs(m[j]))
                elif i == load:
                    lim[i] = fs[j] * f0[i]
                else:
                    a = min(i, i - 1 if i > load else i)
                    pull = link[a] * (u[a + 1] - u[a])
                    lim[i] = fs[j] * wedge * max(base + pull, 0.02 * base)
            worst = 0.0
            for i in range(n):
                qt = q0[i] + kj[i] * (u[i] - u0[i])
                d = ground[i]
                q = min(max(qt, -lim[i]), lim[i])
                if abs(qt) <= lim[i]:
                    d += kj[i]
                res = ground[i] * u[i] + q
                if i == load:
                    res -= m[j]
                if i > 0:
                    res += link[i - 1] * (u[i] - u[i - 1])
                    d += link[i - 1]
                if i < n - 1:
                    res += link[i] * (u[i] - u[i + 1])
                    d += link[i]
                r[i], dia[i] = -res, d
                worst = max(worst, abs(res))
            if worst < 1e-12:
                break
            up[0], rhs[0] = -link[0] / dia[0], r[0] / dia[0]
            for i in range(1, n):
                den = dia[i] + link[i - 1] * up[i - 1]
                if i < n - 1:
                    up[i] = -link[i] / den
                rhs[i] = (r[i] + link[i - 1] * rhs[i - 1]) / den
            for i in range(n - 2, -1, -1):
                rhs[i] -= up[i] * rhs[i + 1]
            damp = 1.0 if it < 20 else 0.6
            for i in range(n):
                u[i] += damp * rhs[i]
        for i in range(n):
            q0[i] = min(max(q0[i] + kj[i] * (u[i] - u0[i]), -lim[i]), lim[i])
            u0[i] = u[i]
        out[j] = u[load]
    return out


@njit(cache=False)
def sun_residual(x, d0, d1, e, qs, cs, sn, cl, k, ex, ta, ks, kr, lim, asym, dc, g, jac, frc):
    """Radial balance g of a floating sun at rotation x and position (d0, d1); jac its derivative; frc mesh forces."""
    t0, t1 = qs[0] + kr * (d0 - e[0]), qs[1] + kr * (d1 - e[1])
    size = math.sqrt(t0 * t0 + t1 * t1)
    jac[0, 0] = jac[1, 1] = ks
    jac[0, 1] = jac[1, 0] = 0.0
    if size <= lim:
        jac[0, 0] += kr
        jac[1, 1] += kr
    else:
        a, b = t0 / size, t1 / size
        c = kr * lim / size
        jac[0, 0] += c * (1 - a * a)
        jac[1, 1] += c * (1 - b * b)
        jac[0, 1] -= c * a * b
        jac[1, 0] -= c * a * b
        t0, t1 = lim * a, lim * b
    g[0], g[1] = ks * d0 + t0, ks * d1 + t1
    tot = 0.0
    for i in range(cs.size):
        frc[i] = 0.0
        for s in (-1.0, 1.0):
            n0, n1 = -s * sn[i] + ta * cs[i], s * cs[i] + ta * sn[i]
            pen = s * x + n0 * d0 + n1 * d1 - cl[i] - dc
            if pen > 0.0:
                kk = k * (1.0 + asym * s)
                f = kk * pen ** ex
                df = ex * f / pen
                g[0] += f * n0
                g[1] += f * n1
                jac[0, 0] += df * n0 * n0
                jac[0, 1] += df * n0 * n1
                jac[1, 0] += df * n0 * n1
                jac[1, 1] += df * n1 * n1
                tot += s * f
                frc[i] += f
    return tot


@njit(cache=False)
def sun_torque(x, x0, commit, st, e, qs, qc, qj, cs, sn, cl, prm, jen, fs, asym, dc, g, jac, frc):
    """Torque of the planetary stage at sun rotation x; the sun finds its place between the planets (damped Newton)."""
    k, ex, ta, ks, kr, lim, kw, mu, kt = prm
    d0, d1 = st[0], st[1]
    lim = lim * fs
    tot = sun_residual(x, d0, d1, e, qs, cs, sn, cl, k, ex, ta, ks, kr, lim, asym, dc, g, jac, frc)
    for _ in range(60):
        norm = math.sqrt(g[0] * g[0] + g[1] * g[1])
        if norm < 1e-13:
            break
        det = jac[0, 0] * jac[1, 1] - jac[0, 1] * jac[1, 0]
        s0 = -(jac[1, 1] * g[0] - jac[0, 1] * g[1]) / det
        s1 = -(jac[0, 0] * g[1] - jac[1, 0] * g[0]) / det
        lam = 1.0
        for _k in range(12):
            tot = sun_residual(x, d0 + lam * s0, d1 + lam * s1, e, qs, cs, sn, cl, k, ex, ta, ks, kr, lim, asym, dc,
                               g, jac, frc)
            if g[0] * g[0] + g[1] * g[1] < norm * norm:
                break
            lam *= 0.5
        d0 += lam * s0
        d1 += lam * s1
    st[0], st[1] = d0, d1
    tot += kw * x
    for i in range(cs.size):
        top = mu * fs * frc[i]
        q = min(max(qc[i] + kt * (x - x0), -top), top)
        tot += q
        if commit:
            qc[i] = q
    for i in range(jen.shape[0]):
        top = jen[i, 0] * fs
        q = min(max(qj[i] + jen[i, 1] * (x - x0), -top), top)
        tot += q
        if commit:
            qj[i] = q
    if commit:
        t0, t1 = qs[0] + kr * (d0 - e[0]), qs[1] + kr * (d1 - e[1])
        size = math.sqrt(t0 * t0 + t1 * t1)
        if size > lim:
            t0, t1 = t0 * lim / size, t1 * lim / size
        qs[0], qs[1] = t0, t1
        e[0], e[1] = d0, d1
    return tot


@njit(cache=False)
def sun_march(m, fs, dc, asym, ang, cl, prm, jen):
    """Rotation of a floating-sun planetary stage under the torque path m, from rest with the sun centred."""
    cs, sn = np.cos(ang), np.sin(ang)
    st, e, qs, g = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    jac, frc = np.zeros((2, 2)), np.zeros(ang.size)
    qc, qj = np.zeros(ang.size), np.zeros(jen.shape[0])
    out = np.zeros(m.size)
    x0, last = 0.0, 1e-4
    for j in range(m.size):
        args = (st, e, qs, qc, qj, cs, sn, cl, prm, jen, fs[j], asym, dc[j], g, jac, frc)
        x = crossing(sun_torque, m[j], x0, last, 1e-11, 80, args)
        sun_torque(x, x0, True, *args)
        if x != x0:
            last = x - x0
        x0 = x
        out[j] = x
    return out


@njit(cache=False)
def cone_march(m, fs, lead, rho, comp):
    """Wind-up of a worm shaft behind thread friction: the shaft's torque stays between the two edges of the friction cone."""
    out = np.zeros(m.size)
    w = 0.0
    for j in range(m.size):
        a = m[j] * math.tan(lead - rho * fs[j]) / math.tan(lead)
        b = m[j] * math.tan(min(lead + rho * fs[j], 1.4)) / math.tan(lead)
        w = min(max(w, min(a, b)), max(a, b))
        out[j] = comp * w
    return out


@njit(cache=False)
def wedge_march(m, gain, rho):
    """Normal load of a ball-cam loading device: follows |torque| within its own friction band."""
    out = np.zeros(m.size)
    w = 0.0
    for j in range(m.size):
        a = abs(m[j]) * gain
        w = min(max(w, a * (1 - rho)), a * (1 + rho))
        out[j] = w
    return out


@njit(cache=False)
def play_march(m, r, comp, stop):
    """Slider with threshold r behind a spring of compliance comp, travel limited to +-stop."""
    out = np.zeros(m.size)
    x = 0.0
    for j in range(m.size):
        lo = min(max((m[j] - r) * comp, -stop), stop)
        hi = min(max((m[j] + r) * comp, -stop), stop)
        x = min(max(x, lo), hi)
        out[j] = x
    return out


@njit(cache=False)
def stick_march(t, m, fk, over, comp, rnd, jitter, age):
    """Slider that sticks up to fk + over (jittered, aged with rest time) and then jumps back to fk."""
    out = np.zeros(m.size)
    x, when, n = 0.0, t[0] - 1.0, 0
    for j in range(m.size):
        q = m[j] - x / comp
        top = fk + over * (1.0 + jitter * rnd[n % rnd.size])
        if age > 0.0:
            top = fk + over * min(max(0.4 + 0.25 * math.log1p((t[j] - when) / age), 0.2), 2.5)
        if abs(q) >= top:
            x += comp * (top - fk) * (1.0 if q > 0 else -1.0)
            when = t[j]
            n += 1
        out[j] = x
    return out


@njit(cache=False)
def relax_march(t, drive, tc):
    """First-order response to a piecewise linear drive, exact on every step."""
    out = np.zeros(t.size)
    y = drive[0]
    out[0] = y
    for j in range(1, t.size):
        dt = t[j] - t[j - 1]
        if dt > 0.0:
            v = (drive[j] - drive[j - 1]) / dt
            y = drive[j] - v * tc + (y - drive[j - 1] + v * tc) * math.exp(-dt / tc)
        out[j] = y
    return out


@njit(cache=False)
def ring_march(t, x, om, zeta):
    """Deviation of a lightly damped second-order follower from its input."""
    out = np.zeros(t.size)
    d, v = 0.0, 0.0
    wd = om * math.sqrt(1 - zeta * zeta)
    vin0 = 0.0
    for j in range(1, t.size):
        dt = t[j] - t[j - 1]
        if dt <= 0.0:
            out[j] = d
            continue
        vin = (x[j] - x[j - 1]) / dt
        v -= vin - vin0
        vin0 = vin
        # free motion of d about the quasi-static following error -2 zeta vin / om
        eq = -2 * zeta * vin / om
        a = d - eq
        b = (v + zeta * om * a) / wd
        ex, c, s = math.exp(-zeta * om * dt), math.cos(wd * dt), math.sin(wd * dt)
        d = eq + ex * (a * c + b * s)
        v = ex * ((b * wd - zeta * om * a) * c - (a * wd + zeta * om * b) * s)
        out[j] = d
    return out


# ------------------------------------------------------------------ reducers
def lu(rng, a, b):
    """A log-uniform draw."""
    return float(math.exp(rng.uniform(math.log(a), math.log(b))))


def drag(rng, total, travel, n=4):
    """n sliders that together drag with `total`, each stuck over a few percent of `travel`."""
    share = rng.uniform(0.5, 1.5, n)
    share *= total / share.sum()
    return np.column_stack([share, share / (travel * rng.uniform(0.03, 0.3, n))])


def contact(k, c, n=1.0, x0=0.0, mu=0.0, kt=0.0, side=0.0):
    """One contact row: stiffness, clearance, exponent, softening length, friction share, its stiffness, flank."""
    return [k, c, n, x0, mu, kt, side]


def bearing(rng, windup, preload, expo, mu):
    """Two opposed preloaded bearings that give `windup` at rated torque; friction follows both bearing loads."""
    k = 0.5 / (windup * 0.5) ** expo * rng.uniform(0.7, 1.3)
    p = (preload / k) ** (1.0 / expo)
    kt = rng.uniform(1.5, 4.0) * expo * k * p ** (expo - 1)
    rows = [contact(k, -p, expo, 0.0, mu, kt, s) for s in (1.0, -1.0)]
    return ("mesh", np.array(rows), np.zeros((0, 2)), np.array([0.02 / windup, 0.0, 0.0, 1.0]))


class Reducer:
    """Parts in series under the same torque; each part solved as mechanics."""

    def __init__(self, name, rated, parts, elastic, flags):
        self.name, self.rated, self.parts, self.elastic, self.flags = name, rated, parts, elastic, flags
        self.slider = None

    def run(self, m, fs=None, dc=None, asym=0.0):
        """Angle in arcmin along the torque path m (rated torque = 1)."""
        one = np.ones(m.size)
        fs = one if fs is None else fs
        dc = np.zeros(m.size) if dc is None else dc
        zero = np.zeros(m.size)
        out = self.elastic[0] * m + self.elastic[1] * np.tanh(m / self.elastic[2])
        first = True
        for p in self.parts:
            if p[0] == "mesh":
                nf = one if len(p) < 5 else 1.0 + wedge_march(m, p[4][0], p[4][1])
                out = out + mesh_march(m, fs, nf, dc if first else zero, asym, p[1], p[2], p[3])
            elif p[0] == "chain":
                out = out + chain_march(m, fs, *p[1:])
            elif p[0] == "sun":
                out = out + sun_march(m, fs, dc if first else zero, asym, *p[1:])
            else:
                out = out + cone_march(m, fs, *p[1:])
            first = False
        if self.slider is not None:
            out = out + sum(play_march(m, fk, c, 1e9) for fk, c in self.slider)
        return out


def red_rv(rng):
    """Two-stage cycloidal (RV): two discs on scattered pins, crank needle bearings, planet stage seen through the ratio."""
    w, c = rng.uniform(1.0, 4.0), lu(rng, 0.2, 1.6)
    n = int(rng.integers(9, 15))
    rows, mu = [], rng.uniform(0.04, 0.16)
    lev = np.sin((np.arange(n) + 0.5) / n * math.pi)
    ktot = 1.0 / (0.5 * w) / (2 * np.sum(lev**2))
    for _disc in range(2):
        for v in lev:
            k = ktot * v * v * rng.uniform(0.8, 1.2)
            cl = 0.5 * c * (1 + rng.uniform(0.1, 0.5) * abs(rng.normal())) / v**0.3
            rows.append(contact(k, cl, 1.0 + 0.1 * (n % 2), 0.0, mu, k * rng.uniform(2, 6)))
    f = rng.uniform(0.015, 0.06)
    p1 = ("mesh", np.array(rows), drag(rng, f, c), np.array([0.3 * f / c, 0.0, 0.0, 1.0]))
    p2 = bearing(rng, 0.4 * w, rng.uniform(0.02, 0.1), 10 / 9, rng.uniform(0.03, 0.12))
    return Reducer("rv_cycloidal", lu(rng, 50, 1000), [p1, p2], (0.15 * w, 0.0, 1.0), {"clear", "flank"})


def red_strain_wave(rng):
    """Strain wave: flexspline tooth zone as a shear-lag chain with friction, wave generator balls under light preload."""
    w, n = rng.uniform(2.0, 9.0), 14
    g = np.exp(-np.linspace(0, 1.5, n)) * rng.uniform(0.8, 1.2, n)
    g *= 1.0 / (0.4 * w) / g.sum()
    link = np.full(n - 1, rng.uniform(2, 6) / w * 2)
    fric = rng.uniform(0.03, 0.12)
    f0 = fric / n * rng.uniform(0.3, 1.7, n)
    f1 = rng.uniform(0.05, 0.25) / n * rng.uniform(0.5, 1.5, n)
    kj = g * rng.uniform(2, 6, n)
    p1 = ("chain", 0, link, g, f0, f1, kj, 0, 0.0, 0.0)
    p2 = bearing(rng, 0.35 * w, rng.uniform(0.03, 0.2), 1.5, rng.uniform(0.02, 0.12))
    return Reducer("strain_wave", lu(rng, 2, 400), [p1, p2], (0.25 * w, 0.0, 1.0), set())


def mirrored(vals, n):
    """Planet clearances that are mirror images about planet 0, so that both flanks see the same unit."""
    return np.array([vals[min(i, n - i)] for i in range(n)])


def red_floating(rng, powder=False):
    """Planetary stage with a floating sun between unequal planets; radial coupling friction; carrier compliance."""
    n = 3 if powder else int(rng.integers(3, 6))
    w = rng.uniform(3, 12) if powder else rng.uniform(1.5, 6)
    c = lu(rng, 8, 45) if powder else lu(rng, 1.0, 12)
    spread = rng.uniform(0.1, 0.35)
    cl = mirrored(0.5 * c * (1 + spread * rng.uniform(-1, 1, n)), n)
    ex = 1.0 + (0.12 if powder else 0.05)
    k = 1.0 / (n * (0.6 * w) ** ex)
    ks = 0.04 * k
    f = rng.uniform(0.02, 0.1) if powder else rng.uniform(0.01, 0.05)
    mu = rng.uniform(0.1, 0.3) if powder else rng.uniform(0.03, 0.14)
    prm = np.array([k, ex, math.tan(math.radians(20)), ks, 2 * k, rng.uniform(0.02, 0.25) * f, 0.35 * f / c, mu,
                    k * rng.uniform(2, 5)])
    ang = 2 * math.pi * np.arange(n) / n
    p1 = ("sun", ang, cl, prm, drag(rng, f, c))
    p2 = bearing(rng, 0.25 * w, rng.uniform(0.02, 0.08), 10 / 9, rng.uniform(0.03, 0.15))
    name = "powder_metal_planetary" if powder else "floating_sun_planetary"
    rated = lu(rng, 0.08, 6) if powder else lu(rng, 5, 600)
    return Reducer(name, rated, [p1, p2], (0.15 * w, 0.0, 1.0), {"clear", "flank"})


def red_powder(rng):
    """Small powder-metal planetary: rough teeth, wide clearance, high tooth friction."""
    return red_floating(rng, True)


def red_worm(rng):
    """Worm: thread flanks with clearance, preloaded thrust bearings, shaft wind-up behind the friction cone of the thread."""
    w, c = rng.uniform(2.0, 8.0), lu(rng, 1.0, 15)
    mu = rng.uniform(0.03, 0.12)
    k = 1.0 / (0.4 * w) / 3
    rows = [contact(k * rng.uniform(0.8, 1.2), 0.5 * c * (1 + 0.25 * rng.uniform()), 1.0, 0.0, mu, 4 * k) for _ in range(3)]
    f = rng.uniform(0.02, 0.08)
    p1 = ("mesh", np.array(rows), drag(rng, f, c), np.array([0.3 * f / c, 0.0, 0.0, 1.0]))
    p2 = bearing(rng, 0.3 * w, rng.uniform(0.05, 0.25), 1.5, rng.uniform(0.03, 0.12))
    lead = math.radians(rng.uniform(6, 20))
    p3 = ("cone", lead, lead * rng.uniform(0.15, 0.6), 0.3 * w)
    return Reducer("worm", lu(rng, 1, 300), [p1, p2, p3], (0.1 * w, 0.0, 1.0), {"clear", "flank"})


def red_plastic(rng):
    """Injection-moulded planetary, three stages in series seen through their ratios; teeth soften a little under load."""
    w, c = rng.uniform(15, 70), lu(rng, 12, 50)
    parts, f = [], rng.uniform(0.03, 0.09)
    mu = rng.uniform(0.12, 0.35)
    for stage, (sc, sw) in enumerate(((0.8, 0.7), (0.16, 0.2), (0.04, 0.06))):
        rows = []
        for _ in range(3):
            k = 1.0 / (3 * sw * w) * rng.uniform(0.8, 1.2)
            rows.append(contact(k, 0.5 * sc * c * (1 + rng.uniform(-0.25, 0.25)), 1.0, sw * w * rng.uniform(5, 15), mu,
                                k * rng.uniform(2, 5)))
        ff = f * (1 + 0.15 * stage)
        parts.append(("mesh", np.array(rows), drag(rng, ff, sc * c), np.array([0.4 * ff / (sc * c), 0.0, 0.0, 1.0])))
    return Reducer("plastic_planetary", lu(rng, 0.05, 3), parts, (0.1 * w, 0.0, 1.0), {"clear", "flank"})


def red_hypoid(rng):
    """Hypoid pair: tight mesh of a few teeth, tapered bearings under preload whose friction follows both bearing loads."""
    w, c = rng.uniform(1.0, 5.0), lu(rng, 0.3, 4)
    rows, mu = [], rng.uniform(0.05, 0.2)
    for i in range(4):
        k = 1.0 / (4 * 0.4 * w) * rng.uniform(0.8, 1.2)
        rows.append(contact(k, 0.5 * c + 0.12 * w * i * rng.uniform(0.5, 1), 1.1, 0.0, mu, k * rng.uniform(2, 5)))
    f = rng.uniform(0.02, 0.09)
    p1 = ("mesh", np.array(rows), drag(rng, f, c), np.array([0.3 * f / c, 0.0, 0.0, 1.0]))
    p2 = bearing(rng, 0.35 * w, rng.uniform(0.15, 0.5), 10 / 9, rng.uniform(0.05, 0.2))
    p3 = bearing(rng, 0.2 * w, rng.uniform(0.1, 0.4), 10 / 9, rng.uniform(0.05, 0.2))
    return Reducer("hypoid_preloaded", lu(rng, 10, 800), [p1, p2, p3], (0.1 * w, 0.0, 1.0), {"clear", "flank"})


def red_face(rng):
    """Face gear with two pinions wound against each other: preload closes the clearance until the torque lifts one flank."""
    w, pre = rng.uniform(2, 8), rng.uniform(0.1, 0.6)
    k = 0.8 / w
    p, mu, c = pre / k, rng.uniform(0.04, 0.2), lu(rng, 4, 20)
    kt = k * rng.uniform(2, 4)
    rows = [contact(k, -p, 1.0, 0.0, mu, kt, s) for s in (1.0, -1.0)]
    rows += [contact(k, p + c, 1.0, 0.0, mu, 3 * k, s) for s in (-1.0, 1.0)]
    f = rng.uniform(0.02, 0.08)
    p1 = ("mesh", np.array(rows), drag(rng, f, 0.4 * w), np.array([0.02 / w, 0.0, 0.0, 1.0]))
    p2 = bearing(rng, 0.25 * w, rng.uniform(0.03, 0.2), 1.5, rng.uniform(0.03, 0.1))
    return Reducer("face_gear_split_pinion", lu(rng, 1, 200), [p1, p2], (0.2 * w, 0.0, 1.0), {"flank"})


def red_traction(rng):
    """Roller traction drive: two rolling contacts as brushes under Hertz pressure, ball-cam loading with its own friction."""
    w, parts = rng.uniform(1.5, 8), []
    for share in (0.5, 0.3):
        z = (np.arange(28) + 0.5) / 28 * 2 - 1
        pr = np.sqrt(1 - z * z)
        cap = rng.uniform(1.15, 2.2)
        cam = cap * rng.uniform(0.1, 0.6)
        lim = (cap - cam) * pr / pr.sum()
        kb = np.full(28, 1.0 / (share * w * 28)) * rng.uniform(0.9, 1.1, 28)
        jen = np.column_stack([lim, kb])
        lin = np.array([0.03 / (share * w), 0.0, 0.0, 1.0])
        parts.append(("mesh", np.zeros((0, 7)), jen, lin, (cam / (cap - cam), rng.uniform(0.05, 0.25))))
    return Reducer("roller_traction", lu(rng, 0.5, 150), parts, (0.2 * w, 0.0, 1.0), set())


def red_magnetic(rng):
    """Spur train with a magnet that centres the teeth in their clearance; iron hysteresis as sliders; shaft in series."""
    w, c = rng.uniform(2, 12), lu(rng, 3, 30)
    k, mu = 1.0 / (0.7 * w), rng.uniform(0.05, 0.2)
    rows = [contact(0.5 * k, 0.5 * c * s, 1.08, 0.0, mu, 2 * k) for s in (1.0, 1.0 + rng.uniform(0.1, 0.3))]
    mag = rng.uniform(0.06, 0.25)
    lin = np.array([0.1 * mag / c, 0.0, mag, 0.5 * c * rng.uniform(0.7, 1.0)])
    p1 = ("mesh", np.array(rows), drag(rng, rng.uniform(0.02, 0.08), c, 7), lin)
    p2 = bearing(rng, 0.2 * w, rng.uniform(0.02, 0.1), 1.5, rng.uniform(0.03, 0.1))
    return Reducer("magnetic_antibacklash", lu(rng, 0.1, 20), [p1, p2], (0.2 * w, 0.0, 1.0), {"clear", "flank"})


def red_capstan(rng):
    """Cable capstan: two pretensioned ropes on one drum; slip creeps along each wrap, friction follows local rope tension."""
    w, n = rng.uniform(2, 15), 8
    base, wrap = rng.uniform(0.6, 1.1), rng.uniform(0.15, 0.6)
    size = 2 * n + 1
    link = np.full(size - 1, n / (2 * 0.6 * w))
    link[n - 1] = link[n] = 1.0 / (2 * 0.5 * w)
    ground = np.full(size, 1e-9)
    ground[0] = ground[-1] = 5.0 * n / w
    kj = np.full(size, rng.uniform(2, 8) * n / w)
    f0 = np.zeros(size)
    f0[n] = rng.uniform(0.01, 0.05)
    p1 = ("chain", n, link, ground, f0, np.zeros(size), kj, 1, base, wrap / n)
    p2 = bearing(rng, 0.2 * w, rng.uniform(0.03, 0.2), 1.5, rng.uniform(0.03, 0.12))
    return Reducer("cable_capstan", lu(rng, 0.5, 80), [p1, p2], (0.1 * w, 0.0, 1.0), set())


REDUCERS = [red_rv, red_strain_wave, red_floating, red_powder, red_worm, red_plastic, red_hypoid, red_face, red_traction,
            red_magnetic, red_capstan]


# ------------------------------------------------------------------ settled loop and indicators
def settled(red, amp, h=H_FINE):
    """Torque grid and the two branches (ascending, descending) of the settled loop of amplitude amp."""
    n = math.ceil(2 * amp / h / 2) * 2
    up = np.linspace(-amp, amp, n + 1)
    path = np.concatenate([np.linspace(0, amp, n // 2 + 1), up[::-1][1:], up[1:], up[::-1][1:], up[1:], up[::-1][1:], up[1:]])
    th = red.run(path)
    asc, dsc = th[-n - 1:], th[-2 * n - 1:-n][::-1]
    first = th[n // 2 + n:n // 2 + 2 * n + 1]
    second = th[n // 2 + 3 * n:n // 2 + 4 * n + 1]
    return up, asc, dsc, max(np.max(np.abs(first - second)), abs(asc[-1] - dsc[-1]))


def trapz(y, x):
    """Integral by the trapezoid rule."""
    return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))


def indicators(red, amp, h=H_FINE):
    """Indicators of the settled loop (method.md section 1), SI units."""
    tau, asc, dsc, _ = settled(red, amp, h)
    tq, asc, dsc = tau * red.rated, asc * ARCMIN, dsc * ARCMIN
    mid, wid, k = 0.5 * (asc + dsc), dsc - asc, K_LOST
    z = tau.size // 2
    work = trapz(tq[z:], asc[z:]) + trapz(tq[z::-1], dsc[z::-1])
    area = trapz(wid, tq)
    return {"lost_motion_rad": float(np.interp(k, tau, mid) - np.interp(-k, tau, mid)), "backlash_rad": float(wid[z]),
            "area_J": area, "absorbed_J": work, "dissipation_ratio": area / work, "peak_rad": float(0.5 * (asc[-1] - asc[0]))}


# ------------------------------------------------------------------ torque histories
def leg(a, b, h):
    """Nodes from a to b, the first left out."""
    return np.linspace(a, b, max(math.ceil(abs(b - a) / h), 1) + 1)[1:]


def build(spec, h):
    """Dense times and torques of a record, with its past (times below zero); torque in rated units."""
    amp, rate, pts = spec["amp"], spec["rate"], spec["points"]
    t, m = [0.0], [pts[0]]
    for n, (a, b) in enumerate(itertools.pairwise(pts)):
        if spec["style"] == "sine":
            pa, pb = (math.asin(min(max(v / amp, -1.0), 1.0)) for v in (a, b))
            ph = leg(pa, pb, h / amp)
            mm, dt = amp * np.sin(ph), np.full(ph.size, abs(pb - pa) / ph.size / (2 * math.pi * rate / (4 * amp)))
        elif spec["style"] == "staircase":
            mm, dt = [], []
            lev = np.linspace(a, b, max(round(abs(b - a) / spec["step"]), 1) + 1)
            for u, v in itertools.pairwise(lev):
                new = leg(u, v, h)
                rise, whole = 0.15 * abs(v - u) / rate, abs(v - u) / rate
                mm += list(new) + [v] * 6
                dt += [rise / new.size] * new.size + [(whole - rise) / 6] * 6
            mm, dt = np.array(mm), np.array(dt)
        else:
            mm = leg(a, b, h)
            dt = np.full(mm.size, abs(b - a) / mm.size / rate)
            if spec["style"] == "hand":
                f = (np.arange(mm.size) + 0.5) / mm.size
                wob = sum(c * np.sin(2 * math.pi * (i + 1) * f + p) for i, (c, p) in enumerate(spec["wobble"][n % 7]))
                dt = dt * np.exp(wob)
            if spec["style"] == "trapezoid" and abs(b) in (amp, 0.0) and n < len(pts) - 2:
                hold = spec["hold"] * amp / rate
                mm, dt = np.concatenate([mm, np.full(40, b)]), np.concatenate([dt, np.full(40, hold / 40)])
        m += list(mm)
        t += list(t[-1] + np.cumsum(dt))
    if not spec["past"]:
        return np.array(t), np.array(m), 0
    pm = [0.0]
    for a, b in itertools.pairwise(spec["past"]):
        pm += list(leg(a, b, h))
    pm = np.array(pm)
    pt = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(pm)))]) / rate
    pt -= pt[-1] + spec["rest"]
    return np.concatenate([pt, t]), np.concatenate([pm, m]), pm.size


def draw_spec(rng, amp, rate, style, start):
    """Turning points, past and time law of one record."""
    d = 1 if rng.uniform() < 0.8 else -1
    cycles = int(rng.choice([1, 2, 3], p=[0.5, 0.35, 0.15]))
    m0 = {"rest": 0.0, "cycled": 0.0, "tip": -d * amp, "middle": float(rng.uniform(-0.7, 0.7)) * amp}[start]
    pts = [m0]
    for _ in range(cycles):
        pts += [d * amp, -d * amp]
    pts.append(d * amp)
    if start == "tip":
        pts.pop()
        if cycles == 1:
            pts += [d * amp]
    if rng.uniform() < 0.4:
        pts.append(0.0)
    pap = amp if start == "tip" or rng.uniform() < 0.6 else min(1.0, amp * float(rng.uniform(1.0, 1.6)))
    past = [] if start == "rest" else [0.0, d * pap, -d * pap, d * pap, -d * pap, m0]
    if style == "trapezoid" and rng.uniform() < 0.3:
        pts = [pts[0]] + [q for a, b in itertools.pairwise(pts) for q in ([0.0, b] if a * b < 0 else [b])]
    if style == "hand" and rng.uniform() < 0.4:
        new = [pts[0]]
        for a, b in itertools.pairwise(pts):
            if abs(b - a) > amp and rng.uniform() < 0.5:
                x = a + (b - a) * float(rng.uniform(0.3, 0.7))
                new += [x, x - math.copysign(float(rng.uniform(0.02, 0.06)) * amp, b - a)]
            new.append(b)
        pts = new
    wob = [[(float(rng.normal()) * 0.45 / (i + 1) ** 0.5, float(rng.uniform(0, 6.28))) for i in range(5)] for _ in range(7)]
    return {"amp": amp, "rate": rate, "style": style, "start": start, "cycles": cycles, "points": pts, "past": past,
            "wobble": wob,
            "hold": float(rng.uniform(0.1, 0.7)), "step": amp / int(rng.integers(5, 14)), "rest": float(rng.uniform(0.5, 5.0))}


class Rec:
    """One record: dense history (t, m), first node of the record i0, sample times ts, and draws that effects share."""

    def __init__(self, spec, h, ts=None):
        self.spec = spec
        self.t, self.m, self.i0 = build(spec, h)
        self.ts, self.end = ts, float(self.t[-1])

    def refine(self, th, half):
        """Add nodes where a straight line between two nodes is not good enough for the angle th."""
        jump = np.abs(np.diff(th))
        bend = np.abs(np.diff(jump, prepend=jump[0])) + np.abs(np.diff(jump, append=jump[-1]))
        parts = np.where((bend > 4e-4 * half) & (jump > 4e-4 * half), 12, 1)
        parts = np.where((parts == 1) & (jump > 4e-3 * half), 6, parts)
        if parts.max() == 1:
            return
        pos = np.concatenate([np.repeat(np.arange(jump.size), parts)
                              + (np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(parts, parts),
                              [jump.size]])
        old = np.arange(self.t.size)
        self.i0 = int(np.searchsorted(pos, self.i0))
        self.t, self.m = np.interp(pos, old, self.t), np.interp(pos, old, self.m)

    def at(self, x):
        """Dense quantity at the sample times."""
        return np.interp(self.ts, self.t, x)


def sample_times(rng, end, kind, n):
    """Strictly rising sample times over the record."""
    if kind == "uniform":
        t = np.linspace(0, end, n)
    elif kind == "jitter":
        t = np.linspace(0, end, n)
        t = t + rng.uniform(-0.3, 0.3, n) * (t[1] - t[0])
    elif kind == "drifting":
        t = np.cumsum(np.exp(0.5 * np.sin(np.linspace(0, rng.uniform(5, 20), n)) + 0.05 * rng.normal(size=n)))
        t = (t - t[0]) / (t[-1] - t[0]) * end
    else:
        t = np.sort(rng.uniform(0, end, n))
    t = np.clip(t, 0, end)
    keep = np.concatenate([[True], np.diff(t) > 1e-4 * end / n])
    return t[keep]


# ------------------------------------------------------------------ effects
class Unit:
    """What effects may know of a unit: reducer, records, half range of the clean angle, noise, shortest period."""

    def __init__(self, red, recs, half, noise):
        self.red, self.recs, self.half, self.noise = red, recs, half, noise
        self.amax, self.amin = max(r.spec["amp"] for r in recs), min(r.spec["amp"] for r in recs)
        self.period = min(4 * r.spec["amp"] / r.spec["rate"] for r in recs)
        rates = np.array([r.spec["rate"] for r in recs])
        self.ref = float(np.exp(np.mean(np.log(rates))))


def draw_effect(rng, name, u):
    """Variant and fixed parameters of an effect; `s` is the strength that is found later, within (lo, hi)."""
    e = {"name": name, "s": 0.0, "lo": 1e-6 * u.half, "hi": 0.5 * u.half, "linear": True}

    def pick(*names):
        e["variant"] = str(rng.choice(names))

    if name == "interface_slip":
        pick("slider_hardening", "patch_pressure", "bolt_clearance")
        e["thr"] = float(rng.uniform(0.6, 0.85)) * u.amax
    elif name == "viscoelastic_creep":
        pick("kelvin", "prony", "stress_threshold")
        e["tc"] = float(np.clip(u.period * lu(rng, 0.06, 0.6), 0.5, 200.0))
        e["thr"] = float(rng.uniform(0.2, 0.5)) * u.amax
    elif name == "asymmetric_stiffness":
        pick(*(["flank", "flank", "support", "thrust"] if "flank" in u.red.flags else ["support", "thrust"]))
        e["sign"] = int(rng.choice([-1, 1]))
        e["knee"] = float(rng.uniform(0.05, 0.4))
        if e["variant"] == "flank":
            e.update(linear=False, lo=1e-5, hi=0.6)
    elif name == "second_backlash":
        pick("spline", "teeth", "key_friction")
        e["drag"] = float(rng.uniform(0.2, 0.65)) * u.amin
        e["scatter"] = [float(v) for v in rng.uniform(0.8, 1.25, 6)]
    elif name == "sensor_lag":
        pick("delay", "first_order", "two_pole")
        e.update(linear=False, lo=1e-7 * u.period, hi=0.05 * u.period)
    elif name == "thermal_drift":
        pick("warm_up", "linear", "room", "wander")
        total = sum(r.end for r in u.recs)
        e["tc"] = total * float(rng.uniform(0.2, 1.0))
        e["ph"] = [[float(v) for v in rng.uniform(0, 6.28, 4)] for _ in u.recs]
        e["sign"] = int(rng.choice([-1, 1]))
        e["hi"] = 0.6 * u.half
    elif name == "torque_offset":
        pick("zero_error", "dead_weight", "zero_per_record")
        e["sign"] = int(rng.choice([-1, 1]))
        e["rel"] = [float(v) for v in rng.uniform(0.4, 1.6, len(u.recs))]
        e["arm"] = float(rng.uniform(-1.0, 1.0))
        e.update(linear=False, lo=1e-6, hi=0.1 * u.amax)
    elif name == "encoder_error":
        pick("sine", "harmonics", "gain_mismatch")
        e["per"] = 2 * u.half * lu(rng, 0.06, 0.6)
        e["ph"] = float(rng.uniform(0, 6.28))
        e["hi"] = 0.45 * e["per"] / (2 * math.pi)
    elif name == "stick_slip":
        pick("slider", "jitter", "ageing", "two_sliders")
        e["fk"] = float(rng.uniform(0.05, 0.3)) * u.amin
        e["over"] = float(rng.uniform(0.04, 0.2)) * u.amin
        e["rnd"] = [float(v) for v in rng.uniform(-0.5, 0.5, 101)]
    elif name == "rate_dependent_friction":
        pick("log_rate", "stribeck", "power_local")
        e["sign"] = int(rng.choice([-1, 1]))
        e.update(linear=False, lo=1e-4, hi=0.6)
        if e["variant"] == "stribeck":
            e["sign"], e["hi"] = 1, 1.2
        if e["variant"] == "power_local":
            e["hi"] = 0.6
    elif name == "x_ratchet_set":
        pick("input_lock", "yield")
        e["thr"] = float(rng.uniform(0.5, 0.8)) * u.amin
        e["sign"] = int(rng.choice([-1, 1]))
    elif name == "x_running_in":
        pick("wear_of_flanks")
        e["w0"] = float(rng.uniform(0.3, 1.0)) * sum(4 * r.spec["amp"] * r.spec["cycles"] for r in u.recs)
        e.update(linear=False, lo=1e-5 * u.half, hi=0.4 * u.half)
    elif name == "x_encoder_knock":
        pick("single", "there_and_back")
        e["when"] = [float(v) for v in rng.uniform(0.15, 0.85, len(u.recs))]
        e["hit"] = [bool(v) for v in rng.uniform(size=len(u.recs)) < 0.6]
        e["hit"][int(rng.integers(len(u.recs)))] = True
    elif name == "x_floor_sway":
        pick("steady", "beating")
        e["per"] = u.period * float(rng.uniform(0.05, 0.3))
        e["ph"] = [float(v) for v in rng.uniform(0, 6.28, len(u.recs))]
    elif name == "x_heat_softening":
        pick("own_work", "room")
        e["tc"] = sum(r.end for r in u.recs) * float(rng.uniform(0.2, 0.8))
        e["hi"] = 0.3
    elif name == "x_flank_friction":
        pick("pitted_flank")
        e["sign"] = int(rng.choice([-1, 1]))
        e.update(linear=False, lo=1e-4, hi=0.7)
    elif name == "x_thixotropy":
        pick("grease_rest")
        e["path"] = float(rng.uniform(1.0, 4.0)) * u.amin
        e.update(linear=False, lo=1e-4, hi=1.5)
    elif name == "x_debris_crush":
        pick("one_particle")
        e["sign"] = int(rng.choice([-1, 1]))
        e["rec"] = int(rng.integers(len(u.recs)))
        e["when"] = float(rng.uniform(0.3, 0.7))
        e["knee"] = float(rng.uniform(0.05, 0.15)) * u.amin
    elif name == "x_ringing":
        pick("load_inertia")
        e["om"] = 2 * math.pi / (u.period * float(rng.uniform(0.015, 0.06)))
        e["zeta"] = float(rng.uniform(0.02, 0.08))
        e["lo"], e["hi"] = 1e-4, 2.0
    elif name == "x_remount_clearance":
        pick("reshimmed")
        e["rel"] = [float(v) for v in rng.normal(size=len(u.recs))]
        e.update(linear=False, lo=1e-5 * u.half, hi=0.1 * u.half)
    elif name == "x_channel_clip":
        pick("hard", "soft")
        e["sign"] = int(rng.choice([-1, 1]))
        e.update(linear=False, lo=1e-3 * u.half, hi=0.6 * u.half)
    else:
        pick("bearing_seat")
        e["name"] = "x_telegraph_hop"
        e["flips"] = [[float(v) for v in np.cumsum(rng.exponential(rng.uniform(0.1, 0.4), 60))] for _ in u.recs]
    return e


def moving_rate(r):
    """Local loading rate on the dense path, held through dwells, smoothed by a short window."""
    dt, dm = np.diff(r.t), np.abs(np.diff(r.m))
    v = np.where(dm > 1e-9, dm / np.maximum(dt, 1e-12), np.nan)
    idx = np.where(np.isfinite(v), np.arange(v.size), 0)
    np.maximum.accumulate(idx, out=idx)
    v = v[idx]
    v = np.where(np.isfinite(v), v, r.spec["rate"])
    return np.concatenate([[v[0]], v])


def before(e, u, i, r, m, fs, dc):
    """Effects inside the mechanics: change torque, friction scale or clearance of record i; returns (m, fs, dc, asym)."""
    n, s, asym = e["name"], e["s"], 0.0
    if n == "torque_offset":
        off = s * e["sign"] * (e["rel"][i] if e["variant"] == "zero_per_record" else 1.0)
        if e["variant"] == "dead_weight":
            off = off * np.cos(e["arm"] + 2 * ARCMIN * u.half * r.m)
        m = m - off
    elif n == "asymmetric_stiffness" and e["variant"] == "flank":
        asym = s * e["sign"]
    elif n == "rate_dependent_friction":
        if e["variant"] == "log_rate":
            f = 1 + e["sign"] * s * math.log10(r.spec["rate"] / u.ref)
        elif e["variant"] == "stribeck":
            f = 1 + s * (np.exp(-np.maximum(moving_rate(r), 0.05 * r.spec["rate"]) / u.ref) - 0.37)
        else:
            f = (np.clip(moving_rate(r), 0.1 * r.spec["rate"], 10 * r.spec["rate"]) / u.ref) ** (e["sign"] * s)
        fs = fs * np.clip(f, 0.25, 3.0)
    elif n == "x_flank_friction":
        fs = fs * (1 + e["sign"] * s * np.tanh(r.m / (0.15 * u.amin)))
    elif n == "x_thixotropy":
        path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(r.m)))])
        path = np.where(np.arange(path.size) < r.i0, 1e9, path - path[r.i0])
        fs = fs * (1 + s * np.exp(-path / e["path"]))
    elif n == "x_running_in":
        done = sum(4 * q.spec["amp"] * q.spec["cycles"] for q in u.recs[:i])
        path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(r.m)))])
        dc = dc + s * (1 - np.exp(-(done + np.maximum(path - path[r.i0], 0.0)) / e["w0"]))
    elif n == "x_remount_clearance":
        dc = dc + s * e["rel"][i]
    return m, fs, dc, asym


INSIDE = {"torque_offset", "rate_dependent_friction", "x_flank_friction", "x_thixotropy", "x_running_in", "x_remount_clearance"}


def inside(e):
    """Whether the effect needs the mechanics to be solved again."""
    return e["name"] in INSIDE or (e["name"] == "asymmetric_stiffness" and e["variant"] == "flank")


def series(e, u, i, r, m, th):
    """Effects in series with the reducer, arcmin on the dense path; m is the torque that acts, th the angle so far."""
    n, s, v = e["name"], e["s"], e["variant"]
    if n == "interface_slip":
        g = s / (u.amax - e["thr"])
        if v == "slider_hardening":
            return play_march(m, e["thr"], g, 1e9)
        if v == "bolt_clearance":
            return play_march(m, e["thr"], 3 * g, s)
        thr = np.linspace(e["thr"], u.amax, 7)[:-1]
        return sum(play_march(m, a, 0.3 * s / (u.amax - e["thr"]), 1e9) for a in thr)
    if n == "viscoelastic_creep":
        if v == "kelvin":
            return relax_march(r.t, s * m, e["tc"])
        if v == "prony":
            return sum(relax_march(r.t, 0.3 * s * m, e["tc"] * f) for f in (0.2, 0.6, 1.8, 5.0))
        return relax_march(r.t, s * np.sign(m) * np.maximum(np.abs(m) - e["thr"], 0.0), e["tc"])
    if n == "asymmetric_stiffness":
        if v == "support":
            return s * np.maximum(e["sign"] * m, 0.0) * e["sign"]
        if v == "thrust":
            return s * e["sign"] * (np.sqrt(m * m + e["knee"] ** 2) - e["knee"])
    if n == "second_backlash":
        c, k, d = 0.5 * s, 12.0 / s, e["drag"]
        num = {"spline": 1, "teeth": 6, "key_friction": 2}[v]
        mu = 0.15 if v == "key_friction" else 0.03
        con = np.array([contact(k / num, c * f, 1.0, 0.0, mu, 3 * k / num) for f in e["scatter"][:num]])
        jen = np.array([[d * f, d * f / (0.05 * s)] for f in (0.25, 0.35, 0.4)])
        one = np.ones(m.size)
        return mesh_march(m, one, one, 0 * one, 0.0, con, jen, np.array([0.15 * d / c, 0.0, 0.0, 1.0]))
    if n == "x_ratchet_set":
        dm = np.concatenate([[0.0], np.diff(m)]) * e["sign"]
        go = (m * e["sign"] > e["thr"]) & (dm > 0) & (np.arange(m.size) > r.i0)
        grow = np.where(go, dm, 0.0) / (r.spec["amp"] - e["thr"])
        if v == "yield":
            grow = grow * np.exp(-np.cumsum(grow) / 1.5)
        return s * e["sign"] * np.cumsum(grow)
    if n == "x_heat_softening":
        start = sum(q.end for q in u.recs[:i])
        tt = np.maximum(r.t, 0.0) + start
        h = 1 - np.exp(-tt / e["tc"]) if v == "own_work" else tt / e["tc"]
        return s * h * th
    if n == "x_debris_crush":
        hold = np.ones(m.size) * (i <= e["rec"])
        if i == e["rec"]:
            cand = np.flatnonzero((r.t > e["when"] * r.end) & (m * e["sign"] > 0.5 * r.spec["amp"]))
            if cand.size:
                hold[cand[0]:] = 0.0
            else:
                hold[r.t > e["when"] * r.end] = 0.0
        return -s * e["sign"] * hold / (1 + np.exp(-e["sign"] * m / e["knee"] * 2))
    if n == "x_ringing":
        return s * ring_march(r.t, th, e["om"], e["zeta"])
    return 0.0


def channel(e, u, i, r, t, th):
    """Effects of the angle channel: th is a dense angle; returns a dense angle."""
    n, s, v = e["name"], e["s"], e["variant"]
    if n == "encoder_error":
        x = 2 * math.pi * th / e["per"] + e["ph"]
        if v == "sine":
            return th + s * np.sin(x)
        if v == "harmonics":
            return th + s * (0.7 * np.sin(x) + 0.5 * np.sin(2 * x + 1.0) + 0.12 * np.sin(4 * x + 2.0))
        g = 1 + 2 * s * 2 * math.pi / e["per"]
        err = np.arctan2(g * np.sin(x) + 0.3 * (g - 1), np.cos(x)) - np.arctan2(np.sin(x), np.cos(x))
        return th + (err - 2 * math.pi * np.round(err / (2 * math.pi))) * e["per"] / (2 * math.pi)
    if n == "sensor_lag":
        if v == "delay":
            return np.interp(t - s, t, th)
        y = relax_march(t, th, s if v == "first_order" else 0.5 * s)
        return y if v == "first_order" else relax_march(t, y, 0.5 * s)
    if n == "thermal_drift":
        start = sum(q.end * 1.1 for q in u.recs[:i])
        tt = t + start
        if v == "warm_up":
            return th + e["sign"] * s * (1 - np.exp(-np.maximum(tt, 0) / e["tc"]))
        if v == "linear":
            return th + e["sign"] * s * tt / e["tc"]
        if v == "room":
            return th + s * np.sin(2 * math.pi * tt / (3 * e["tc"]) + e["ph"][0][0])
        tones = zip((0.23, 0.47, 0.83, 1.31), e["ph"][i], strict=False)
        return th + s * sum(np.sin(2 * math.pi * t / r.end * f + p) / f for f, p in tones)
    if n == "x_encoder_knock" and e["hit"][i]:
        a = e["when"][i] * r.end
        on = (t > a) & ((t < a + 0.35 * r.end) if v == "there_and_back" else True)
        return th + s * on
    if n == "x_floor_sway":
        x = 2 * math.pi * t / e["per"] + e["ph"][i]
        return th + s * np.sin(x) * (1 + (0.8 * np.sin(0.13 * x) if v == "beating" else 0.0))
    if n == "x_channel_clip":
        lim = u.half - s
        x = e["sign"] * th
        if v == "hard":
            return e["sign"] * np.minimum(x, lim)
        b = 0.02 * u.half
        return e["sign"] * (x - b * np.logaddexp(0.0, (x - lim) / b))
    if n == "x_telegraph_hop":
        return th + s * (np.searchsorted(np.array(e["flips"][i]) * u.period, t) % 2)
    return th


def angles(u, effs, only=None, base=None):
    """Sampled angles (arcmin) of every record with the effects acting."""
    out = []
    for i, r in enumerate(u.recs):
        m, fs, dc, asym = r.m, np.ones(r.m.size), np.zeros(r.m.size), 0.0
        for e in effs:
            m, fs, dc, a = before(e, u, i, r, m, fs, dc)
            asym += a
        again = base is None or any(inside(e) for e in effs)
        th = u.red.run(m, fs, dc, asym) if again else base[i]
        add = 0.0
        for e in effs:
            if e["name"] == "stick_slip":
                continue
            add = add + series(e, u, i, r, m, th)
        for e in effs:
            if e["name"] == "stick_slip":
                add = add + stick(e, r, m)
        th = th + add
        for e in sorted(effs, key=lambda q: q["name"] != "encoder_error"):
            th = channel(e, u, i, r, r.t, th)
        if only == "dense":
            out.append(th)
        else:
            out.append(r.at(th))
    return out


def stick(e, r, m):
    """What static friction above kinetic friction adds to the clean slider, arcmin on the dense path."""
    rnd = np.array(e["rnd"])
    parts = [(e["fk"], e["over"])] if e["variant"] != "two_sliders" else [(e["fk"], e["over"]), (1.7 * e["fk"], 0.6 * e["over"])]
    jit, age = (1.0 if e["variant"] == "jitter" else 0.0), (0.02 * r.end if e["variant"] == "ageing" else 0.0)
    return sum(stick_march(r.t, m, fk, ov, e["s"] / e["over"], rnd, jit, age) - play_march(m, fk, e["s"] / e["over"], 1e9)
               for fk, ov in parts)


def slider_of(e):
    """Sliders of the clean reducer that a stick-slip unit has (kinetic friction only)."""
    comp = e["s"] / e["over"]
    return [(e["fk"], comp)] if e["variant"] != "two_sliders" else [(e["fk"], comp), (1.7 * e["fk"], comp)]


def rms(a, b):
    """Root mean square over records of the difference, each record's mean removed."""
    return math.sqrt(np.mean([np.mean((x - y - np.mean(x - y)) ** 2) for x, y in zip(a, b, strict=False)]))


def set_strength(e, u, target):
    """Find the strength that gives the asked rms (arcmin); False when the physical range does not reach it."""
    dense = [u.red.run(r.m) for r in u.recs]
    clean = [r.at(d) for r, d in zip(u.recs, dense, strict=False)]

    def size(s):
        e["s"] = s
        return rms(angles(u, [e], base=dense), clean)

    if e["linear"]:
        s = math.sqrt(e["lo"] * e["hi"])
        for _ in range(3):
            got = size(s)
            if got <= 0:
                return False
            s *= target / got
            if not e["lo"] < s < e["hi"]:
                return False
        e["s"] = s
        return abs(size(s) / target - 1) < 0.02
    lo, hi = e["lo"], e["hi"]
    if size(hi) < target:
        return False
    s, tried = min(hi, target / max(size(hi), 1e-12) * hi), []
    for _ in range(22):
        got = size(s)
        tried.append((s, got))
        if abs(got / target - 1) < 0.01:
            return True
        if got < target:
            lo = s
        else:
            hi = s
        new = s * target / max(got, 1e-12)
        s = new if lo < new < hi and len(tried) < 8 else math.sqrt(lo * hi)
    return False


# ------------------------------------------------------------------ a unit
def draw_unit(rng, effects, turn):
    """Reducer, records (specs), sampling; None when the clean reducer is outside the ranges."""
    pool = REDUCERS
    need_clear = {"x_running_in", "x_remount_clearance", "x_debris_crush"} & set(effects)
    red = pool[int(rng.integers(len(pool))) if turn is None else turn % len(pool)](rng)
    if need_clear and "clear" not in red.flags:
        return None
    ind = indicators(red, 1.0, H_COARSE)
    if not 0.03 < ind["dissipation_ratio"] < 0.6 or ind["backlash_rad"] > 60 * ARCMIN:
        return None
    nrec = int(rng.choice([2, 3, 4, 5], p=[0.2, 0.45, 0.25, 0.1]))
    factor = lu(rng, 2, 10)
    per = lu(rng, 15, 300)
    rates = np.exp(np.linspace(0, math.log(factor), nrec)) * 4 / (per * factor)
    if rng.uniform() < 0.5:
        rng.shuffle(rates)
    if rng.uniform() < 0.5:
        amps = np.full(nrec, 1.0 if rng.uniform() < 0.6 else round(float(rng.uniform(0.6, 1.0)), 2))
    else:
        amps = np.round(np.linspace(rng.uniform(0.3, 0.6), 1.0, nrec), 3)
        if rng.uniform() < 0.6:
            rng.shuffle(amps)
    styles = ["triangle", "sine", "trapezoid", "staircase", "hand"]
    style = str(rng.choice(styles, p=[0.52, 0.16, 0.13, 0.09, 0.10]))
    start = str(rng.choice(["rest", "cycled", "tip", "middle"], p=[0.4, 0.25, 0.2, 0.15]))
    pairs = zip(amps, rates, strict=False)
    specs = [draw_spec(rng, float(a), float(v), style, start if rng.uniform() < 0.8 else "rest") for a, v in pairs]
    kind = str(rng.choice(["uniform", "jitter", "drifting", "random"], p=[0.6, 0.15, 0.15, 0.1]))
    num = lu(rng, 600, 18000)
    if "x_ringing" in effects:
        num = max(num, 5000)
    times = []
    for sp in specs:
        end = float(build(sp, 0.05)[0][-1])
        times.append(sample_times(rng, end, kind, int(np.clip(num * lu(rng, 0.7, 1.3), 510, 20000))))
    return red, specs, times, style, kind


def make_unit(job):
    """One unit: draw until every asked effect is physical and of the asked size; write files; return its key entry."""
    out, seed, index, kind, effects, size = job
    case = f"case-{index + 1:02d}"
    for attempt in range(400):
        rng = np.random.default_rng([seed, index, attempt])
        drawn = draw_unit(rng, effects, index if attempt < 8 else None)
        if drawn is None:
            continue
        red, specs, times, style, sampling = drawn
        recs = [Rec(s, H_COARSE, t) for s, t in zip(specs, times, strict=False)]
        halves = [indicators(red, s["amp"], H_COARSE)["peak_rad"] / ARCMIN for s in specs]
        floor = 300 * max(halves) / min(halves) * 1.05
        if floor > 2000:
            continue
        snr = lu(rng, floor, 2900)
        noise = max(halves) / snr
        u = Unit(red, recs, max(halves), noise)
        effs, good = [], True
        for name in effects:
            e = draw_effect(rng, name, u)
            e["size"] = size[name]
            good = set_strength(e, u, TARGET[size[name]] * noise)
            if good and name == "stick_slip":
                good = e["s"] / e["over"] * (u.amax - e["fk"]) < 0.5 * u.half
            if not good:
                break
            effs.append(e)
        if not good:
            continue
        for e in effs:
            if e["name"] == "stick_slip":
                red.slider = slider_of(e)
        entry = finish(out, case, rng, red, specs, times, style, sampling, noise, effs)
        if entry is None:
            continue
        entry["kind"] = kind
        entry["attempts"] = attempt + 1
        return case, entry
    raise RuntimeError(f"{case}: no feasible draw for {effects}")


def finish(out, case, rng, red, specs, times, style, sampling, noise, effs):
    """Solve on the fine path, check the rms, add traces and noise, write the unit folder."""
    recs = [Rec(s, H_FINE, t) for s, t in zip(specs, times, strict=False)]
    inds = [indicators(red, s["amp"]) for s in specs]
    halves = [d["peak_rad"] / ARCMIN for d in inds]
    gap = max(settled(red, a)[3] for a in {s["amp"] for s in specs})
    if gap > min(2e-5 * max(halves), 0.05 * noise) or not all(0.03 < d["dissipation_ratio"] < 0.6 for d in inds):
        return None
    u = Unit(red, recs, max(halves), noise)
    if not 300 <= min(halves) / noise or max(halves) / noise > 3000:
        return None
    for with_effects in (False, True)[:1 + bool(effs)]:
        for r, th in zip(recs, angles(u, effs if with_effects else [], only="dense"), strict=False):
            r.refine(th, max(halves))
    dense = [red.run(r.m) for r in recs]
    clean = [r.at(d) for r, d in zip(recs, dense, strict=False)]
    got = {}
    for e in effs:
        got[e["name"]] = rms(angles(u, [e], base=dense), clean) / noise
        # the coarse path decides the strength; one correction on the fine path keeps the size within a few percent
        want = TARGET[e["size"]]
        if abs(got[e["name"]] / want - 1) > 0.03 and e["name"] != "stick_slip":
            e["s"] *= want / got[e["name"]]
            got[e["name"]] = rms(angles(u, [e], base=dense), clean) / noise
        if abs(got[e["name"]] / want - 1) > 0.1:
            return None
    full = angles(u, effs, base=dense)
    if len(effs) > 1:
        got["together"] = rms(full, clean) / noise
    traces, trace_rms = make_traces(rng, u, dense, noise)
    folder = Path(out) / case
    folder.mkdir(parents=True, exist_ok=True)
    share = float(rng.choice([0.0, 0.2, 0.4, 0.6]))
    corr = float(rng.uniform(0.01, 0.05)) * u.period
    tnoise = lu(rng, 3e-5, 6e-4)
    aq = noise * float(rng.uniform(0.3, 2.0)) if rng.uniform() < 0.3 else 0.0
    tq = float(rng.choice([5e-5, 1e-4, 3e-4, 1e-3])) if rng.uniform() < 0.25 else 0.0
    gaps = bool(rng.uniform() < 0.2)
    zip_it = bool(rng.uniform() < 0.3)
    foreign = str(rng.choice(["default", "bench", "si"], p=[0.7, 0.2, 0.1]))
    sign = -1.0 if foreign == "bench" and rng.uniform() < 0.3 else 1.0
    give = bool(rng.uniform() < 0.7)
    where = float(rng.uniform(-20, 20)) if rng.uniform() < 0.6 else 0.0
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{case}"', f"rated_torque_Nm = {red.rated:.6g}"]
    records = []
    for i, r in enumerate(recs):
        a = full[i] + traces[i] + where + noise * coloured(rng, r.ts, share, corr)
        m = r.at(r.m) + tnoise * rng.normal(size=r.ts.size)
        if aq > 0:
            a = np.round(a / aq) * aq
        if tq > 0:
            m = np.round(m / tq) * tq
        keep = np.ones(r.ts.size, bool)
        if gaps:
            for _ in range(int(rng.integers(1, 4))):
                a0 = int(rng.integers(0, r.ts.size))
                keep[a0:a0 + int(r.ts.size * rng.uniform(0.005, 0.03))] = False
        file = f"rec-{i + 1}.csv" + (".gz" if zip_it else "")
        write_csv(folder / file, r.ts[keep], m[keep] * red.rated, a[keep], foreign, sign, red.rated)
        lines += ["", "[[record]]", f'file = "{file}"']
        rate = r.spec["rate"] * red.rated
        if give:
            lines += [f"loading_rate_Nm_per_s = {rate:.6g}", f"amplitude_Nm = {r.spec['amp'] * red.rated:.6g}"]
        if foreign != "default":
            names = head(foreign, red.rated)
            lines += ["[record.columns]", f'time = "{names[0]}"', f'torque = "{names[1]}"',
                      f'angle = "{"-" if sign < 0 else ""}{names[2]}"']
        records.append({"file": file, "amplitude_Nm": r.spec["amp"] * red.rated, "rate_Nm_per_s": rate, "style": r.spec["style"],
                        "start": r.spec["start"], "cycles": r.spec["cycles"], "samples": int(keep.sum()),
                        "snr": halves[i] / noise, "indicators": inds[i]})
    (folder / "unit.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    names = sorted(e["name"] for e in effs)
    sizes = {e["name"]: e["size"] for e in effs}
    variant = {e["name"]: {k: v for k, v in e.items() if k in ("variant", "s", "thr", "tc", "sign", "drag", "per", "fk", "over",
                                                              "size", "om", "zeta", "knee")} for e in effs}
    return {"effects": names, "size": None if not effs else (sizes[names[0]] if len(effs) == 1 else sizes),
            "reducer": red.name, "style": style, "variant": variant, "rms": {**got, "traces": trace_rms},
            "rated_torque_Nm": red.rated, "k": K_LOST, "snr": max(halves) / noise, "noise_rad": noise * ARCMIN,
            "noise_correlated_share": share, "torque_noise_Nm": tnoise * red.rated, "sampling": sampling,
            "quantum_angle_rad": aq * ARCMIN, "quantum_torque_Nm": tq * red.rated, "gaps": gaps, "records": records}


def make_traces(rng, u, dense, noise):
    """Traces of channel faults (offset, lag, drift, encoder wave), each below a tenth of the noise; per record, arcmin."""
    forms = {"torque_offset": [], "sensor_lag": [], "thermal_drift": [], "encoder_error": []}
    per, ph = 2 * u.half * lu(rng, 0.1, 0.6), float(rng.uniform(0, 6.28))
    start = 0.0
    for r, th in zip(u.recs, dense, strict=False):
        dm = np.gradient(th) * np.sign(np.gradient(r.m)) / np.maximum(np.abs(np.gradient(r.m)), 1e-4)
        forms["torque_offset"].append(-r.at(np.where(np.abs(np.gradient(r.m)) < 1e-7, 0.0, dm)))
        forms["sensor_lag"].append(r.at(np.interp(r.t - 0.002 * u.period, r.t, th) - th))
        forms["thermal_drift"].append((r.ts + start) / r.end)
        start += r.end
        forms["encoder_error"].append(np.sin(2 * math.pi * r.at(th) / per + ph))
    total, sizes = [np.zeros(r.ts.size) for r in u.recs], {}
    for name, f in forms.items():
        f = [x - x.mean() for x in f]
        unit = rms(f, [np.zeros(x.size) for x in f])
        want = float(rng.uniform(0.02, 0.095))
        sizes[name] = want
        total = [a + x * want * noise / max(unit, 1e-15) for a, x in zip(total, f, strict=False)]
    return total, sizes


@njit(cache=False)
def ar_filter(dt, w, tc):
    """Stationary first-order correlated noise of unit variance at unequal steps."""
    y = np.empty(w.size)
    y[0] = w[0]
    for j in range(1, w.size):
        a = math.exp(-dt[j - 1] / tc)
        y[j] = a * y[j - 1] + math.sqrt(1 - a * a) * w[j]
    return y


def coloured(rng, ts, share, tc):
    """Noise of unit variance: white, and a share of the variance correlated over tc seconds."""
    w, c = rng.normal(size=ts.size), rng.normal(size=ts.size)
    return math.sqrt(1 - share) * w + math.sqrt(share) * ar_filter(np.diff(ts), c, tc)


def head(foreign, rated):
    """Column names of a file."""
    if foreign == "bench":
        return ["t [ms]", "M [mNm]" if rated < 2 else "M [Nm]", "phi [deg]"]
    if foreign == "si":
        return ["t_s", "tau_Nm", "theta_mrad"]
    return ["time_s", "torque_Nm", "angle_arcmin"]


def write_csv(path, t, m, a, foreign, sign, rated):
    """One record file; units as its header says."""
    names = head(foreign, rated)
    if foreign == "bench":
        t, m, a = t * 1e3, m * (1e3 if rated < 2 else 1.0), sign * a / 60.0
    elif foreign == "si":
        a = a * ARCMIN * 1e3
    text = [",".join(names)] + [f"{x:.9g},{y:.8g},{z:.9g}" for x, y, z in zip(t, m, a, strict=False)]
    data = ("\n".join(text) + "\n").encode("utf-8")
    if path.suffix == ".gz":
        with open(path, "wb") as raw, gzip.GzipFile("", "wb", 5, raw, 0) as f:
            f.write(data)
    else:
        path.write_bytes(data)


# ------------------------------------------------------------------ plan, command line, self-check
LISTED = ["interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "sensor_lag", "thermal_drift",
          "torque_offset", "encoder_error", "stick_slip", "rate_dependent_friction"]
UNLISTED = ["x_ratchet_set", "x_running_in", "x_encoder_knock", "x_floor_sway", "x_heat_softening", "x_flank_friction",
            "x_thixotropy", "x_debris_crush", "x_ringing", "x_remount_clearance", "x_channel_clip", "x_telegraph_hop"]


def plan(rng, units):
    """Shuffled list of (kind, effects, sizes) in the fixed proportions 24 : 30 : 16 : 10."""
    single = round(units * 30 / 80)
    other = round(units * 16 / 80)
    pairs = round(units * 10 / 80)
    jobs = [("clean", [], {}) for _ in range(units - single - other - pairs)]
    grid = [(n, s) for s in (1.0, 0.4, 0.2) for n in LISTED]
    jobs += [("listed", [n], {n: s}) for n, s in (grid[i % 30] for i in (range(single) if single >= 30 else
                                                                         rng.permutation(30)[:single]))]
    names = [str(v) for v in rng.permutation(UNLISTED)]
    for i in range(other):
        n = names[i % len(names)]
        jobs.append(("unlisted", [n], {n: (1.0, 0.4)[(i + i // len(names)) % 2]}))
    firsts = [str(v) for v in rng.permutation(LISTED)]
    for i in range(pairs):
        a, b = firsts[i % 10], firsts[(i + 1 + (i // 10) * 2 + i % 3) % 10]
        if a == b:
            b = firsts[(i + 2) % 10]
        jobs.append(("pair", sorted([a, b]), {a: float(rng.choice([1.0, 0.4])), b: float(rng.choice([1.0, 0.4]))}))
    return [jobs[i] for i in rng.permutation(len(jobs))]


def check(seed):
    """Self-check of the clean reducers: closure, oddness, dissipation, step refinement."""
    for f in REDUCERS:
        for trial in range(6):
            rng = np.random.default_rng([seed, trial])
            red = f(rng)
            ind = indicators(red, 1.0)
            _, _, _, gap = settled(red, 1.0)
            path = np.concatenate([[0.0], leg(0, 1, 2e-3), leg(1, -1, 2e-3), leg(-1, 0.5, 2e-3), leg(0.5, -0.2, 2e-3),
                                   leg(-0.2, 1, 2e-3)])
            a, b = red.run(path), red.run(-path)
            half = ind["peak_rad"] / ARCMIN
            g1, u1, d1, _ = settled(red, 1.0, H_FINE)
            g2, u2, d2, _ = settled(red, 1.0, H_FINE / 2)
            dif = np.concatenate([u1 - np.interp(g1, g2, u2), d1 - np.interp(g1, g2, d2)])
            mid = np.concatenate([np.interp(g2, g1, u1) - u2, np.interp(g2, g1, d1) - d2])
            wid = np.min(d1 - u1) / half
            print(f"{red.name:24s} peak {half:7.2f}' w0 {ind['backlash_rad'] / ARCMIN:6.2f}' lost "
                  f"{ind['lost_motion_rad'] / ARCMIN:6.2f}' u {ind['dissipation_ratio']:.3f} closure {gap / half:.1e} odd "
                  f"{np.max(np.abs(a + b)) / half:.1e} step {np.sqrt(np.mean(dif**2)) / half:.1e} "
                  f"interp {np.sqrt(np.mean(mid**2)) / half:.1e} min width {wid:.1e}")


def warm():
    """Compile every kernel once, before the processes split."""
    for f in REDUCERS:
        f(np.random.default_rng(1)).run(np.linspace(0, 0.1, 5))
    t = np.linspace(0, 1, 5)
    stick_march(t, t, 0.1, 0.1, 1.0, t, 0.0, 0.0)
    play_march(t, 0.1, 1.0, 1.0)
    relax_march(t, t, 1.0)
    ring_march(t, t, 5.0, 0.1)
    ar_filter(np.diff(t), t, 1.0)


def main():
    """Command line."""
    ap = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    ap.add_argument("out")
    ap.add_argument("--units", type=int, default=80)
    ap.add_argument("--seed", type=int, default=81)
    ap.add_argument("--jobs", type=int, default=2)
    ap.add_argument("--check", action="store_true", help="only check the clean reducers")
    a = ap.parse_args()
    warm()
    if a.check:
        check(a.seed)
        return
    out = Path(a.out)
    out.mkdir(parents=True, exist_ok=True)
    todo = plan(np.random.default_rng([a.seed, 999]), a.units)
    jobs = [(str(out), a.seed, i, kind, eff, size) for i, (kind, eff, size) in enumerate(todo)]
    if a.jobs > 1:
        with multiprocessing.get_context("fork").Pool(a.jobs) as pool:
            done = list(pool.imap_unordered(make_unit, jobs))
    else:
        done = [make_unit(j) for j in jobs]
    (out / "key.json").write_text(json.dumps(dict(sorted(done)), indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
