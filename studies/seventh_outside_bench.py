#!/usr/bin/env python3
"""A virtual test bench for gear reducers: labelled units with quasi-static, rate-independent mechanisms.

Every reducer is solved by equilibrium at each torque step (contacts with clearance, Coulomb elements with memory,
micro-slip chains); nothing here is a closed formula of a loop.  Torque is in units of the rated torque and the angle in
units of the mechanism's own scale while solving; both are scaled to N.m and rad afterwards.
"""
import argparse
import gzip
import json
import math
import os
import time
from multiprocessing import get_context

import numpy as np
from numba import njit

ARCMIN = math.pi / 10800.0
K_LOST = 0.03
TARGET = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
LISTED = ["interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "sensor_lag",
          "thermal_drift", "torque_offset", "encoder_error", "stick_slip", "rate_dependent_friction"]
UNLISTED = ["x_heat_softening", "x_wear_in", "x_floor_vibration", "x_mount_jump", "x_grease_squeeze",
            "x_chipped_tooth", "x_clamp_walk", "x_reclamping"]

# ----------------------------------------------------------------------------------------------- root finding


@njit
def root(F, target, x0, step, a):
    """Solve F(x, a) = target for non-decreasing F: bracket from x0, then Chandrupatla's method."""
    f0 = F(x0, a) - target
    if f0 == 0.0:
        return x0
    d = -step if f0 > 0 else step
    x1 = x0 + d
    f1 = F(x1, a) - target
    n = 0
    while f0 * f1 > 0 and n < 200:
        x0, f0 = x1, f1
        d *= 2.0
        x1 = x0 + d
        f1 = F(x1, a) - target
        n += 1
    if f1 == 0.0:
        return x1
    xa, fa, xb, fb = x1, f1, x0, f0
    xc, fc = xa, fa
    t = 0.5
    for _ in range(120):
        xt = xa + t * (xb - xa)
        ft = F(xt, a) - target
        if (ft > 0) == (fa > 0):
            xc, fc = xa, fa
        else:
            xc, fc = xb, fb
            xb, fb = xa, fa
        xa, fa = xt, ft
        xm = xa if abs(fa) < abs(fb) else xb
        tol = 1e-15 * abs(xm) + 2e-14
        tl = tol / abs(xb - xa)
        if tl > 0.5 or ft == 0.0:
            return xm
        xi = (xa - xb) / (xc - xb)
        ph = (fa - fb) / (fc - fb)
        if ph * ph < xi and (1 - ph) * (1 - ph) < 1 - xi:
            t = fa / (fb - fa) * fc / (fb - fc) + (xc - xa) / (xb - xa) * fa / (fc - fa) * fb / (fc - fb)
        else:
            t = 0.5
        t = min(1 - tl, max(tl, t))
    return xa


@njit
def hertz(x, g, k, p):
    y = abs(x) - g
    if y <= 0.0:
        return 0.0
    v = k * y if p == 1.0 else k * y ** p
    return v if x > 0 else -v


@njit
def cl(v, m):
    return m if v > m else (-m if v < -m else v)


@njit
def rubbing(s, J, k, f, dx, fr):
    # s and the torques of joints J, stiff as k, that slip at f
    for j in range(J.size):
        s += cl(J[j] + k[j] * dx, fr * f[j])
    return s


@njit
def slide(J, k, f, dx, fr):
    # the joints after a step
    for j in range(J.size):
        J[j] = cl(J[j] + k[j] * dx, fr * f[j])

# ----------------------------------------------------------------------------------------------- 1 planet set
# Parallel planets, each with its own clearance and crowned-tooth (point) contact; the pin of each planet rubs with
# a constant and a load-carried part; a shaft in series.


@njit
def f_planet(x, a):
    xp, J, g, k, p, kj, f0, mu, kc, fr, gs = a
    s = kc * x
    n = g.size
    for i in range(n):
        m = hertz(x, g[i] * gs, k[i], p)
        s += m
        for q in range(J.shape[1]):
            s += cl(J[i, q] + kj[i, q] * (x - xp), fr * (f0[i, q] + mu[q] * abs(m)))
    return s


@njit
def run_planet(tau, fr, gs, g, k, p, kj, f0, mu, kc, cs):
    J = np.zeros(kj.shape)
    x = 0.0
    out = np.empty(tau.size)
    st = 1e-4
    for i in range(tau.size):
        xp = x
        x = root(f_planet, tau[i], xp, st, (xp, J, g, k, p, kj, f0, mu, kc, fr[i], gs[i]))
        for j in range(g.size):
            m = hertz(x, g[j] * gs[i], k[j], p)
            for q in range(J.shape[1]):
                J[j, q] = cl(J[j, q] + kj[j, q] * (x - xp), fr[i] * (f0[j, q] + mu[q] * abs(m)))
        st = max(1e-6, 0.7 * abs(x - xp))
        out[i] = x + cs * tau[i]
    return out


def make_planet(r):
    n = int(r.integers(3, 7))
    g0 = r.uniform(0.1, 0.9)
    g = g0 * np.abs(1 + 0.35 * r.standard_normal(n))
    k = (1 + 0.15 * r.standard_normal(n)) / n
    ft, mu = r.uniform(0.02, 0.12), r.uniform(0.02, 0.14)
    w = np.array([0.5, 0.3, 0.2])
    f0 = np.outer(np.abs(1 + 0.2 * r.standard_normal(n)) / n, w) * ft
    kj = np.outer(np.ones(n) / n, np.array([ft, ft * 0.6, ft * 0.4]) * w * 3) / (np.array([0.03, 0.12, 0.3]) * (0.4 + g0))
    kj = kj * r.uniform(0.8, 2.0) + 0.02 / n
    return dict(g=g, k=k, p=1.5, kj=kj, f0=f0, mu=mu * w, kc=r.uniform(0.02, 0.1), cs=r.uniform(0.1, 0.6))

# ----------------------------------------------------------------------------------------------- 2 cycloid pins
# A ring of pins; lever sin(phi), tangential Mindlin micro-slip mu*N at lever cos(phi), line contact; an eccentric
# bearing with constant rubbing.


@njit
def f_cycloid(x, a):
    xp, J, Q, gap, sn, cn, k, p, kt, mu, kq, fq, kc, fr, gs = a
    s = kc * x
    for i in range(gap.size):
        d = x * sn[i] - gap[i] * gs
        N = 0.0
        if d > 0:
            N = k * d ** p
            s += N * sn[i]
        s += cn[i] * cl(J[i] + kt * cn[i] * (x - xp), fr * mu * N)
    return rubbing(s, Q, kq, fq, x - xp, fr)


@njit
def run_cycloid(tau, fr, gs, gap, sn, cn, k, p, kt, mu, kq, fq, kc, cs):
    J = np.zeros(gap.size)
    Q = np.zeros(kq.size)
    x = 0.0
    out = np.empty(tau.size)
    st = 1e-4
    for i in range(tau.size):
        xp = x
        x = root(f_cycloid, tau[i], xp, st, (xp, J, Q, gap, sn, cn, k, p, kt, mu, kq, fq, kc, fr[i], gs[i]))
        for j in range(gap.size):
            d = x * sn[j] - gap[j] * gs[i]
            N = k * d ** p if d > 0 else 0.0
            J[j] = cl(J[j] + kt * cn[j] * (x - xp), fr[i] * mu * N)
        slide(Q, kq, fq, x - xp, fr[i])
        st = max(1e-6, 0.7 * abs(x - xp))
        out[i] = x + cs * tau[i]
    return out


def make_cycloid(r):
    h = int(r.integers(7, 14))
    ph = (np.arange(h) + r.uniform(0.2, 0.8)) * np.pi / h
    g = r.uniform(0.02, 0.3) + r.exponential(r.uniform(0.1, 0.4), h)
    sn = np.concatenate([np.sin(ph), -np.sin(ph)])
    cn = np.concatenate([np.cos(ph), np.cos(ph)])
    fq = np.array([0.4, 0.3, 0.3]) * r.uniform(0.01, 0.09)
    return dict(gap=np.concatenate([g, g]), sn=sn, cn=cn, k=2.5 / h, p=10 / 9, kt=r.uniform(1.0, 3.0) / h,
                mu=r.uniform(0.05, 0.2), kq=fq / np.array([0.02, 0.1, 0.35]), fq=fq, kc=r.uniform(0.02, 0.1),
                cs=r.uniform(0.05, 0.4))

# ----------------------------------------------------------------------------------------------- 3 toothed belt
# Micro-slip of a belt round the output pulley: belt nodes joined by elastic links, spans to the locked pulley at both
# ends, each node rubbing on the pulley and held by its tooth after a clearance.  Newton with line search.


@njit
def belt_force(x, u, dp, J, kt, q, g, ktooth, kw, fr, gs, P, D):
    for j in range(u.size):
        d = x - u[j]
        e = J[j] + kt * (d - dp[j])
        m = q[j] * fr
        t = kw
        v = kw * d
        if e > m:
            v += m
        elif e < -m:
            v -= m
        else:
            v += e
            t += kt
        y = abs(d) - g[j] * gs
        if y > 0:
            v += ktooth * y if d > 0 else -ktooth * y
            t += ktooth
        P[j] = v
        D[j] = t


@njit
def belt_res(x, u, P, kb, ks, tau, R):
    n = u.size
    s = 0.0
    for j in range(n):
        f = -P[j]
        f += (kb * (u[j] - u[j - 1])) if j > 0 else ks * u[0]
        f += (kb * (u[j] - u[j + 1])) if j < n - 1 else ks * u[n - 1]
        R[j] = f
        s += P[j]
    R[n] = s - tau


@njit
def run_belt(tau, fr, gs, kt, q, g, ktooth, kw, kb, ks, cs):
    n = q.size
    u = np.zeros(n)
    x = 0.0
    J = np.zeros(n)
    dp = np.zeros(n)
    P = np.zeros(n)
    D = np.zeros(n)
    R = np.zeros(n + 1)
    un = np.zeros(n)
    out = np.empty(tau.size)
    c1 = np.zeros(n)
    r1 = np.zeros(n)
    r2 = np.zeros(n)
    for i in range(tau.size):
        for it in range(200):
            belt_force(x, u, dp, J, kt, q, g, ktooth, kw, fr[i], gs[i], P, D)
            belt_res(x, u, P, kb, ks, tau[i], R)
            if np.max(np.abs(R)) < 3e-14:
                break
            # bordered tridiagonal: nodes (diag a, off -kb, border -D), pulley sum(D)
            for j in range(n):
                a = D[j] + (kb if j > 0 else ks) + (kb if j < n - 1 else ks)
                b1, b2 = -R[j], D[j]
                if j > 0:
                    w = -kb / c1[j - 1]
                    a -= w * (-kb)
                    b1 -= w * r1[j - 1]
                    b2 -= w * r2[j - 1]
                c1[j] = a
                r1[j] = b1
                r2[j] = b2
            for j in range(n - 1, -1, -1):
                if j < n - 1:
                    r1[j] += kb * r1[j + 1]
                    r2[j] += kb * r2[j + 1]
                r1[j] /= c1[j]
                r2[j] /= c1[j]
            a = 0.0
            b = -R[n]
            for j in range(n):
                a += D[j] * (1 - r2[j])
                b += D[j] * r1[j]
            dx = b / a
            s0 = R[n] * dx
            for j in range(n):
                r1[j] += r2[j] * dx
                s0 += R[j] * r1[j]
            al = 1.0
            for _ls in range(12):
                for j in range(n):
                    un[j] = u[j] + al * r1[j]
                belt_force(x + al * dx, un, dp, J, kt, q, g, ktooth, kw, fr[i], gs[i], P, D)
                belt_res(x + al * dx, un, P, kb, ks, tau[i], R)
                s1 = R[n] * dx
                for j in range(n):
                    s1 += R[j] * r1[j]
                if s1 <= 0.7 * abs(s0) + 1e-26:
                    break
                al *= 0.5
            x += al * dx
            for j in range(n):
                u[j] = un[j]
            if it > 3 and abs(dx) < 1e-15:
                break
        for j in range(n):
            d = x - u[j]
            J[j] = cl(J[j] + kt * (d - dp[j]), q[j] * fr[i])
            dp[j] = d
        out[i] = x + cs * tau[i]
    return out


def make_belt(r):
    n = int(r.integers(7, 14))
    beta = r.uniform(-0.15, 0.15)
    q = np.exp(beta * np.abs(np.arange(n) - (n - 1) / 2)) * (1 + 0.1 * r.standard_normal(n)).clip(0.5)
    q *= r.uniform(0.15, 0.6) / q.sum()
    g = r.uniform(0.05, 0.3) * np.abs(1 + 0.4 * r.standard_normal(n))
    return dict(kt=r.uniform(0.5, 1.5), q=q, g=g, ktooth=r.uniform(0.6, 1.5), kw=r.uniform(0.01, 0.03),
                kb=r.uniform(2, 8), ks=r.uniform(0.7, 1.5), cs=r.uniform(0.0, 0.3))

# ----------------------------------------------------------------------------------------------- 4 spline + bellows
# A splined joint (many teeth, scattered flank gaps, fit friction) in series with a bellows coupling that hardens and
# whose convolutions rub.


@njit
def f_spline(x, a):
    xp, J, g, k, kj, fj, kc, fr, gs = a
    s = kc * x
    for i in range(g.size):
        s += hertz(x, g[i] * gs, k, 1.0)
    return rubbing(s, J, kj, fj, x - xp, fr)


@njit
def f_bellows(x, a):
    xp, J, k1, k3, kj, fj, fr = a
    s = k1 * x + k3 * x * x * x
    return rubbing(s, J, kj, fj, x - xp, fr)


@njit
def run_spline(tau, fr, gs, g, k, kj, fj, kc, k1, k3, kb, fb):
    J = np.zeros(kj.size)
    B = np.zeros(kb.size)
    x = 0.0
    y = 0.0
    out = np.empty(tau.size)
    st = 1e-4
    sy = 1e-4
    for i in range(tau.size):
        xp = x
        yp = y
        x = root(f_spline, tau[i], xp, st, (xp, J, g, k, kj, fj, kc, fr[i], gs[i]))
        y = root(f_bellows, tau[i], yp, sy, (yp, B, k1, k3, kb, fb, fr[i]))
        slide(J, kj, fj, x - xp, fr[i])
        slide(B, kb, fb, y - yp, fr[i])
        st = max(1e-6, 0.7 * abs(x - xp))
        sy = max(1e-6, 0.7 * abs(y - yp))
        out[i] = x + y
    return out


def make_spline(r):
    n = int(r.integers(8, 21))
    g0 = r.uniform(0.1, 0.7)
    g = g0 * np.abs(1 + r.uniform(0.15, 0.45) * r.standard_normal(n))
    fj = np.array([0.35, 0.3, 0.2, 0.15]) * r.uniform(0.04, 0.22)
    fb = np.array([0.5, 0.5]) * r.uniform(0.01, 0.08)
    return dict(g=g, k=r.uniform(1.5, 4) / n, kj=fj / (np.array([0.02, 0.07, 0.2, 0.5]) * r.uniform(0.5, 1.2)), fj=fj,
                kc=r.uniform(0.03, 0.12), k1=r.uniform(0.8, 2), k3=r.uniform(0.2, 4.0),
                kb=fb / np.array([0.05, 0.3]), fb=fb)

# ----------------------------------------------------------------------------------------------- 5 bevel pair
# Straight bevel pair: the mesh force thrusts the gear along its axis whatever its sign, against disc springs and a
# rubbing sleeve; the axial way opens the clearance again.  Two coupled unknowns.


@njit
def f_bevel_axial(z, a):
    ax, zp, S, g, k, p, c, ta, kz, ksl, f0, mu, fr = a
    y = ax - g - c * z
    f = k * y ** p if y > 0 else 0.0
    return kz * z + cl(S + ksl * (z - zp), fr * (f0 + mu * f)) - ta * f


@njit
def f_bevel(x, a):
    xp, zp, S, Q, kq, fq, kc, g, k, p, c, ta, kz, ksl, f0, mu, fr, gs = a
    z = root(f_bevel_axial, 0.0, zp, 1e-5, (abs(x), zp, S, g * gs, k, p, c, ta, kz, ksl, f0, mu, fr))
    y = abs(x) - g * gs - c * z
    f = k * y ** p if y > 0 else 0.0
    s = kc * x + (f if x > 0 else -f)
    return rubbing(s, Q, kq, fq, x - xp, fr)


@njit
def run_bevel(tau, fr, gs, kq, fq, kc, g, k, p, c, ta, kz, ksl, f0, mu, cs):
    Q = np.zeros(kq.size)
    x = 0.0
    z = 0.0
    S = 0.0
    st = 1e-4
    out = np.empty(tau.size)
    for i in range(tau.size):
        xp = x
        zp = z
        x = root(f_bevel, tau[i], xp, st, (xp, zp, S, Q, kq, fq, kc, g, k, p, c, ta, kz, ksl, f0, mu, fr[i], gs[i]))
        z = root(f_bevel_axial, 0.0, zp, 1e-5, (abs(x), zp, S, g * gs[i], k, p, c, ta, kz, ksl, f0, mu, fr[i]))
        y = abs(x) - g * gs[i] - c * z
        f = k * y ** p if y > 0 else 0.0
        S = cl(S + ksl * (z - zp), fr[i] * (f0 + mu * f))
        slide(Q, kq, fq, x - xp, fr[i])
        st = max(1e-6, 0.7 * abs(x - xp))
        out[i] = x + cs * tau[i]
    return out


def make_bevel(r):
    ft = r.uniform(0.02, 0.12)
    fq = ft * np.array([0.3, 0.3, 0.2, 0.2])
    ta = r.uniform(0.2, 0.5)
    return dict(kq=fq / (np.array([0.03, 0.1, 0.3, 0.8]) * r.uniform(0.5, 1.0)), fq=fq, kc=r.uniform(0.05, 0.25),
                g=r.uniform(0.1, 0.8), k=r.uniform(1.5, 4.0), p=r.uniform(1.15, 1.5), c=r.uniform(0.5, 1.0), ta=ta,
                kz=r.uniform(0.25, 0.6), ksl=r.uniform(4, 15), f0=r.uniform(0.005, 0.04), mu=ta * r.uniform(0.15, 0.5),
                cs=r.uniform(0.1, 0.5))

# ----------------------------------------------------------------------------------------------- 6 split gear
# Two mirrored scissors gears: in each the fixed half sits on one flank and the sprung half on the other; the halves rub
# on each other.  Above the preload the sprung half is left behind.


@njit
def both_flanks(x, d, G, k, p):
    # touching one flank with approach d at x=0, the other flank a way G off
    y = x + d
    if y > 0:
        return k * y ** p
    y = -x - G
    if y > 0:
        return -k * y ** p
    return 0.0


@njit
def f_half(y, a):
    x, vp, S, s, Tp, ks, kj, fj, d, G, k, p, fr = a
    # torque on the sprung half: contact on its own (opposite) flank, spring, preload, rubbing of the halves
    v = x - y
    return -s * both_flanks(-s * y, d, G, k, p) - ks * v - cl(S + kj * (v - vp), fr * fj) + s * Tp


@njit
def half_y(x, y0, vp, S, s, Tp, ks, kj, fj, d, G, k, p, fr):
    # -s*y is the approach of the sprung half to its flank; contact pushes +s
    return root(f_half, 0.0, y0, 1e-5, (x, vp, S, s, Tp, ks, kj, fj, d, G, k, p, fr))


@njit
def f_split(x, a):
    xp, Y, V, S, Q, kq, fq, Tp, ks, kj, fj, d, G, k, p, fr, gs = a
    tot = 0.0
    for m in range(2):
        s = 1.0 if m == 0 else -1.0
        y = half_y(x, Y[m], V[m], S[m], s, Tp, ks, kj, fj, d, G * gs, k, p, fr)
        tot += s * both_flanks(s * x, d, G * gs, k, p)
        tot -= s * both_flanks(-s * y, d, G * gs, k, p)
    return rubbing(tot, Q, kq, fq, x - xp, fr)


@njit
def run_split(tau, fr, gs, kq, fq, Tp, ks, kj, fj, d, G, k, p, cs):
    Q = np.zeros(kq.size)
    Y = np.zeros(2)
    V = np.zeros(2)
    S = np.zeros(2)
    x = 0.0
    st = 1e-4
    out = np.empty(tau.size)
    for i in range(tau.size):
        xp = x
        x = root(f_split, tau[i], xp, st, (xp, Y, V, S, Q, kq, fq, Tp, ks, kj, fj, d, G, k, p, fr[i], gs[i]))
        for m in range(2):
            s = 1.0 if m == 0 else -1.0
            y = half_y(x, Y[m], V[m], S[m], s, Tp, ks, kj, fj, d, G * gs[i], k, p, fr[i])
            v = x - y
            S[m] = cl(S[m] + kj * (v - V[m]), fr[i] * fj)
            V[m] = v
            Y[m] = y
        slide(Q, kq, fq, x - xp, fr[i])
        st = max(1e-6, 0.7 * abs(x - xp))
        out[i] = x + cs * tau[i]
    return out


def make_split(r):
    p = r.uniform(1.1, 1.4)
    k = r.uniform(1.5, 3.0)
    Tp = r.uniform(0.1, 0.35)
    ft = r.uniform(0.01, 0.05)
    fq = ft * np.array([0.5, 0.5])
    # at rest both halves carry Tp on their flank: k d^p = Tp
    return dict(kq=fq / np.array([0.02, 0.15]), fq=fq, Tp=Tp, ks=r.uniform(0.1, 0.4), kj=r.uniform(2, 8),
                fj=Tp * r.uniform(0.1, 0.6), d=(Tp / k) ** (1 / p), G=r.uniform(0.05, 0.4), k=k, p=p,
                cs=r.uniform(0.05, 0.4))

# ----------------------------------------------------------------------------------------------- 7 strain-wave cup
# A flexible cup as rings in a row (hardening links), each ring rubbing on the wave generator with a limit that grows
# with the torque (teeth wedge the cup outwards); the last ring meshes with a small clearance.


@njit
def run_wave(tau, fr, gs, a1, a3, q, mu, kj, g, km, kw, cs):
    n = q.size
    u = np.zeros(n)
    up = np.zeros(n)
    J = np.zeros(n)
    un = np.zeros(n)
    R = np.zeros(n)
    dg = np.zeros(n)
    lk = np.zeros(n)
    c1 = np.zeros(n)
    r1 = np.zeros(n)
    out = np.empty(tau.size)
    for i in range(tau.size):
        lim = fr[i] * (1 + mu * abs(tau[i]))
        for j in range(n):
            un[j] = u[j]
            r1[j] = 0.0
        s0 = 0.0
        al = 1.0
        for it in range(400):
            # residual and tangent at un
            for j in range(n):
                e = J[j] + kj[j] * (un[j] - up[j])
                m = q[j] * lim
                if e > m:
                    R[j] = m
                    dg[j] = 0.0
                elif e < -m:
                    R[j] = -m
                    dg[j] = 0.0
                else:
                    R[j] = e
                    dg[j] = kj[j]
            R[0] -= tau[i]
            for j in range(n - 1):
                e = un[j] - un[j + 1]
                f = a1[j] * e + a3[j] * e * e * e
                lk[j] = a1[j] + 3 * a3[j] * e * e
                R[j] += f
                R[j + 1] -= f
                dg[j] += lk[j]
                dg[j + 1] += lk[j]
            e = un[n - 1]
            y = abs(e) - g * gs[i]
            f = kw * e
            t = kw
            if y > 0:
                f += km * y ** 1.3 if e > 0 else -km * y ** 1.3
                t += 1.3 * km * y ** 0.3
            R[n - 1] += f
            dg[n - 1] += t
            if it > 0 and al > 1e-3:
                s1 = 0.0
                for j in range(n):
                    s1 += R[j] * r1[j]
                if s1 > 0.7 * abs(s0) + 1e-26:
                    al *= 0.5
                    for j in range(n):
                        un[j] = u[j] + al * r1[j]
                    continue
            for j in range(n):
                u[j] = un[j]
            if np.max(np.abs(R)) < 3e-14:
                break
            for j in range(n):
                a = dg[j]
                b = -R[j]
                if j > 0:
                    w = -lk[j - 1] / c1[j - 1]
                    a += w * lk[j - 1]
                    b -= w * r1[j - 1]
                c1[j] = a
                r1[j] = b
            for j in range(n - 1, -1, -1):
                if j < n - 1:
                    r1[j] += lk[j] * r1[j + 1]
                r1[j] /= c1[j]
            if it > 3 and np.max(np.abs(r1)) < 1e-15:
                break
            s0 = 0.0
            al = 1.0
            for j in range(n):
                s0 += R[j] * r1[j]
                un[j] = u[j] + r1[j]
        for j in range(n):
            J[j] = cl(J[j] + kj[j] * (u[j] - up[j]), q[j] * lim)
            up[j] = u[j]
        out[i] = u[0] + cs * tau[i]
    return out


def make_wave(r):
    n = int(r.integers(4, 9))
    q = np.abs(1 + 0.4 * r.standard_normal(n)) + 0.1
    q *= r.uniform(0.03, 0.2) / q.sum()
    a1 = np.full(n, r.uniform(0.8, 1.6) * n / 2)
    return dict(a1=a1, a3=a1 * n * n * r.uniform(0.2, 2.5), q=q, mu=r.uniform(0.0, 2.0),
                kj=q / (r.uniform(0.05, 0.25) * np.linspace(1, 0.3, n)), g=r.uniform(0.02, 0.25), km=r.uniform(2, 5),
                kw=r.uniform(0.1, 0.5), cs=r.uniform(0.0, 0.2))


KINDS = {"planet_set": (make_planet, run_planet), "cycloid_pins": (make_cycloid, run_cycloid),
         "toothed_belt": (make_belt, run_belt), "spline_bellows": (make_spline, run_spline),
         "bevel_pair": (make_bevel, run_bevel), "split_gear": (make_split, run_split),
         "strain_wave_cup": (make_wave, run_wave)}


class Reducer:
    def __init__(self, name, r):
        self.name = name
        make, self.run = KINDS[name]
        self.p = make(r)

    def solve(self, tau, fr=1.0, gs=1.0):
        fr = np.full(tau.size, float(fr)) if np.isscalar(fr) else fr
        gs = np.full(tau.size, float(gs)) if np.isscalar(gs) else gs
        return self.run(np.ascontiguousarray(tau), fr, gs, **self.p)

    def settled(self, amp, m=1200, cycles=6):
        """Torque grid and the two branches of the settled loop; also closure and oddness relative to the height."""
        up = np.unique(np.concatenate([np.linspace(-1, 1, 2 * m + 1) * amp, [0.0, K_LOST, -K_LOST]]))
        up = up[np.abs(up) <= amp * (1 + 1e-12)]
        up = 0.5 * (up - up[::-1])
        n = up.size
        cyc = np.concatenate([up[::-1][1:], up[1:]])
        first = up[up > 0]
        x = self.solve(np.concatenate([first] + [cyc] * cycles))
        last = x[-(2 * n - 2) - 1:]
        down = last[:n][::-1]
        asc = last[n - 1:]
        c = 0.5 * (asc[-1] + asc[0])
        h = max(asc.max(), down.max()) - min(asc.min(), down.min())
        closure = abs(asc[-1] - down[-1]) / h
        odd = np.max(np.abs((asc - c) + (down - c)[::-1])) / h
        centre = abs(c) / h
        return up, asc, down, closure, odd, centre


def indicators(tau, a, d, k):
    w = d - a
    def trap(y, x):
        return float(np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x)))
    S = trap(w, tau)
    pos = tau >= 0
    neg = tau <= 0
    W = trap(tau[pos], a[pos]) + trap(tau[neg][::-1], d[neg][::-1])
    mid = 0.5 * (a + d)
    return {"lost_motion_rad": float(np.interp(k, tau, mid) - np.interp(-k, tau, mid)),
            "backlash_rad": float(np.interp(0, tau, w)), "area_J": S, "absorbed_J": W, "dissipation_ratio": S / W,
            "peak_rad": float(0.5 * (a[-1] - a[0]))}

# ----------------------------------------------------------------------------------------------- torque paths


def tri(ps):
    f = np.mod(ps + 0.25, 1.0)
    return np.where(f < 0.5, 4 * f - 1, 3 - 4 * f)


class Path:
    """Torque in units of rated torque against time; the history before t_rec is not recorded."""

    def __init__(self, r, amp, period, style, start, cycles):
        self.amp, self.P, self.style, self.start, self.cycles = amp, period, style, start, cycles
        self.psi0 = {"rest": 0.0, "tip": 2.25 + 0.5 * r.integers(0, 2), "inside": 2.0 + r.uniform(0, 1)}[start]
        self.dwell = r.uniform(0.04, 0.15)
        self.m = int(r.integers(8, 25))
        self.rho = r.uniform(0.25, 0.6)
        ps = np.arange(0.25, self.psi0 + cycles + 1, 0.5)
        if style == "dwell":
            kt, kp, t = [0.0], [0.0], 0.0
            for i, p in enumerate(ps):  # noqa: B007
                t += (p - kp[-1])
                kt += [t, t + self.dwell]
                kp += [p, p]
                t += self.dwell
        elif style == "stairs":
            kt, kp = [0.0], [0.0]
            n = int((self.psi0 + cycles + 1) * 4 * self.m)
            for i in range(n):
                kt += [(i + self.rho) / (4 * self.m), (i + 1.0) / (4 * self.m)]
                kp += [(i + 1.0) / (4 * self.m)] * 2
        else:
            e = self.psi0 + cycles + 1
            kt, kp = [0.0, e], [0.0, e]
        self.kt, self.kp = np.array(kt), np.array(kp)
        self.t_rec = self._t(self.psi0)
        self.t_end = self._t(self.psi0 + cycles)
        self.knots = np.concatenate([self.kt, [self._t(p) for p in ps]])

    def _t(self, p):
        i = np.searchsorted(self.kp, p - 1e-12)
        if i == 0:
            return 0.0
        return float(self.kt[i - 1] + (p - self.kp[i - 1]) / (self.kp[i] - self.kp[i - 1]) * (self.kt[i] - self.kt[i - 1]))

    def tau(self, t):
        p = np.interp(t / self.P, self.kt, self.kp)
        return self.amp * (np.sin(2 * np.pi * p) if self.style == "sine" else tri(p))

    def build(self, ts):
        """ts: sample times from the start of recording (s). Returns the merged grid and the samples' indices."""
        t0 = self.t_rec * self.P
        pf = np.arange(0, self.psi0 + self.cycles, 1 / 600)
        fine = np.interp(pf, self.kp + 1e-13 * np.arange(self.kp.size), self.kt) * self.P
        kn = self.knots * self.P
        t = np.unique(np.round(np.concatenate([fine, kn[kn <= ts[-1] + t0], ts + t0]) / self.P, 11)) * self.P
        t = t[t <= ts[-1] + t0 + 1e-9 * self.P]
        idx = np.searchsorted(t, ts + t0 - 1e-8 * self.P * 1e-2)
        idx = np.clip(idx, 0, t.size - 1)
        return t, idx, t0

# ----------------------------------------------------------------------------------------------- effect kernels


@njit
def play(tau, r):
    y = 0.0
    o = np.empty(tau.size)
    for i in range(tau.size):
        if tau[i] - y > r:
            y = tau[i] - r
        elif tau[i] - y < -r:
            y = tau[i] + r
        o[i] = y
    return o


@njit
def jumpy(tau, fk, dj):
    y = 0.0
    o = np.empty(tau.size)
    m = 0
    for i in range(tau.size):
        e = tau[i] - y
        if abs(e) > fk + dj[m]:
            y = tau[i] - fk if e > 0 else tau[i] + fk
            m = (m + 1) % dj.size
        o[i] = y
    return o


@njit
def keyed_slip(tau, th):
    y = 0.0
    o = np.empty(tau.size)
    o[0] = 0.0
    for i in range(1, tau.size):
        a, b = tau[i - 1], tau[i]
        if b > a and b > th:
            y += b - max(a, th)
        elif b < a and b < -th:
            y += b - min(a, -th)
        o[i] = y
    return o


@njit
def walk(tau, th):
    y = 0.0
    o = np.zeros(tau.size)
    for i in range(1, tau.size):
        if tau[i] > tau[i - 1] and tau[i] > th:
            y += tau[i] - max(tau[i - 1], th)
        o[i] = y
    return o


@njit
def kelvin(t, u, T):
    """y' = (u - y)/T, u piecewise linear, exact."""
    o = np.empty(t.size)
    y = u[0]
    o[0] = y
    for i in range(1, t.size):
        h = t[i] - t[i - 1]
        if h <= 0:
            o[i] = y
            continue
        s = (u[i] - u[i - 1]) / h
        e = math.exp(-h / T)
        y = y * e + (u[i - 1] - s * T) * (1 - e) + s * h
        o[i] = y
    return o


@njit
def eyring(t, u, T, b):
    """y' = sinh(b (u-y)) / (b T), implicit steps."""
    o = np.empty(t.size)
    y = 0.0
    o[0] = y
    for i in range(1, t.size):
        h = t[i] - t[i - 1]
        z = y
        for _ in range(50):
            q = z - y - h / (b * T) * math.sinh(b * (u[i] - z))
            dq = 1 + h / T * math.cosh(b * (u[i] - z))
            st = q / dq
            z -= st
            if abs(st) < 1e-13:
                break
        y = z
        o[i] = y
    return o


@njit
def squeeze(t, u, c):
    """Oil film between two flanks: y' = c u (1 - |y|)^2 towards the flank, in units of the half clearance."""
    o = np.empty(t.size)
    y = 0.0
    o[0] = 0.0
    for i in range(1, t.size):
        n = 8
        h = (t[i] - t[i - 1]) / n
        for m in range(n):
            v = u[i - 1] + (u[i] - u[i - 1]) * (m + 0.5) / n
            s = 1 - y if v > 0 else 1 + y
            # film on the side it moves to: implicit in s
            k = h * c * abs(v)
            s = s / (1 + k * s)
            y = 1 - s if v > 0 else s - 1
        o[i] = y
    return o


class Rec:
    pass


class Effect:
    """One effect on one unit. `mode`: where it enters. `amount(s)` is what the key reports."""
    pass


def make_effect(name, U, r):
    """Draw a variant. Returns a dict with the functions needed; s is the strength."""
    recs, A = U.recs, U.amax
    Pmin, Pmax = min(q.path.P for q in recs), max(q.path.P for q in recs)
    E = dict(name=name, par={}, smax=1e9)
    def pick(*v):
        return v[int(r.integers(len(v)))]
    if name == "interface_slip":
        th = r.uniform(0.6, 0.85) * A
        v = pick("keyed_hub", "progressive_clamp")
        if v == "keyed_hub":
            E["add"] = lambda q, tau: keyed_slip(tau, th)
        else:
            rs = np.linspace(th, 0.97 * A, 8)            # rings of the clamp let go one after another
            E["add"] = lambda q, tau: sum(keyed_slip(tau, x) for x in rs)
        E["par"] = dict(threshold=th)
    elif name == "viscoelastic_creep":
        v = pick("kelvin_chain", "eyring", "power_law")
        T0 = float(np.clip(np.exp(r.uniform(np.log(0.02), np.log(0.3))) * math.sqrt(Pmin * Pmax), 0.4, 60))
        if v == "kelvin_chain":
            Ts = T0 * np.array([1.0, 4.0])[: int(r.integers(1, 3))]
            E["add"] = lambda q, tau: sum(kelvin(q.t, tau, x) for x in Ts) - U.lin * tau * 0
        elif v == "eyring":
            b = r.uniform(1.5, 4)
            E["add"] = lambda q, tau: eyring(q.t, tau, T0, b)
            E["par"]["b"] = b
        else:
            Ts = T0 * 4.0 ** np.arange(-2, 3)
            E["add"] = lambda q, tau: sum(x ** 0.25 * kelvin(q.t, tau, x) for x in Ts)
        E["par"]["T0_s"] = T0
    elif name == "asymmetric_stiffness":
        v = pick("one_flank_contact", "flank_lever")
        sg = pick(-1.0, 1.0)
        if v == "one_flank_contact":
            ex = r.uniform(0.67, 1.3)
            E["add"] = lambda q, tau: np.maximum(sg * tau, 0) ** ex * sg
            E["par"] = dict(side=sg, exponent=ex)
        else:
            E["tau"] = lambda q, tau, s: np.where(sg * tau > 0, tau * (1 + s), tau)
            E["smax"] = 0.8
            E["par"] = dict(side=sg)
    elif name == "second_backlash":
        v = pick("floating_stage", "scattered_spline")
        a_small = min(q.path.amp for q in recs)
        d = r.uniform(0.25, 0.6) * a_small
        if v == "floating_stage":
            w = r.uniform(0.02, 0.08) * A
            E["add"] = lambda q, tau: np.clip(play(tau, d) / w, -1, 1)
            E["par"] = dict(drag=d, width=w)
        else:
            ds = d * np.abs(1 + 0.15 * r.standard_normal(12))
            w = 0.02 * A
            E["add"] = lambda q, tau: sum(np.clip(play(tau, x) / w, -1, 1) for x in ds) / ds.size
            E["par"] = dict(drag=d, teeth=12)
    elif name == "sensor_lag":
        v = pick("pure_delay", "first_order", "two_pole")
        E["lag"] = v
        E["smax"] = 0.1 * Pmin
    elif name == "thermal_drift":
        v = pick("steady", "warm_up", "hall_cycle")
        L = max(q.ts[-1] for q in recs)
        Tw = r.uniform(0.4, 1.5) * L
        f, ph = r.uniform(0.5, 1.4) / L, r.uniform(0, 6.28)
        sg = pick(-1.0, 1.0)
        t00 = {q.file: 0.0 for q in recs}
        if v == "steady":
            E["chan"] = lambda q, th: sg * q.ts / L
        elif v == "warm_up":
            c = 0.0
            for q in U.session:
                t00[q.file] = c
                c += q.ts[-1] + 0.1 * L
            E["chan"] = lambda q, th: sg * -np.exp(-(q.ts + t00[q.file] * 0.5) / Tw)
            E["par"] = dict(Tw_s=Tw)
        else:
            E["chan"] = lambda q, th: sg * (0.7 * q.ts / L + 0.5 * np.sin(2 * np.pi * f * q.ts + ph))
            E["par"] = dict(freq_Hz=f)
    elif name == "torque_offset":
        v = pick("sensor_zero", "dead_weight", "rezeroed")
        sg = pick(-1.0, 1.0)
        m = {q.file: sg for q in recs}
        if v == "rezeroed":
            for q in recs:
                m[q.file] = sg * float(np.clip(1 + 0.4 * r.standard_normal(), 0.2, 2))
        if v == "dead_weight":
            E["tau"] = lambda q, tau, s: tau + sg * s
        else:
            E["tau"] = lambda q, tau, s: tau - s * m[q.file]
            E["reading"] = lambda q, s: s * m[q.file]      # applied as a shift of the torque column
        E["smax"] = 0.3 * A
        E["par"] = dict(factors=m)
    elif name == "encoder_error":
        v = pick("sine", "two_harmonics")
        per = U.span / r.uniform(2.5, 12)
        ph, ph2, h2 = r.uniform(0, 6.28), r.uniform(0, 6.28), r.uniform(0.3, 0.8)
        if v == "sine":
            E["chan"] = lambda q, th: np.sin(2 * np.pi * th / per + ph)
        else:
            E["chan"] = lambda q, th: np.sin(2 * np.pi * th / per + ph) + h2 * np.sin(4 * np.pi * th / per + ph2)
        # an interpolation error does not make the reading run backwards
        E["smax"] = 0.7 * per / (2 * np.pi * (1 if v == "sine" else 1 + 2 * h2))
        E["par"] = dict(period_rad=per)
    elif name == "stick_slip":
        v = pick("regular", "scattered", "two_seals")
        fk, dj = r.uniform(0.04, 0.2) * A, r.uniform(0.06, 0.18) * A
        js = np.full(1, dj) if v != "scattered" else dj * np.exp(0.35 * r.standard_normal(97))
        if v == "two_seals":
            f2, j2 = fk * 0.5, dj * 0.618
            E["add"] = lambda q, tau: (jumpy(tau, fk, js) - play(tau, fk)
                                       + 0.7 * (jumpy(tau, f2, np.full(1, j2)) - play(tau, f2)))
        else:
            E["add"] = lambda q, tau: jumpy(tau, fk, js) - play(tau, fk)
        E["par"] = dict(kinetic=fk, excess=dj)
    elif name == "rate_dependent_friction":
        v = pick("log_law", "power_law")
        sg = pick(-1.0, 1.0)
        r0 = float(np.exp(np.mean([np.log(q.rate_n) for q in recs])))
        if v == "log_law":
            E["fric"] = lambda q, s: np.full(q.t.size, max(0.1, 1 + sg * s * math.log(q.rate_n / r0)))
            E["smax"] = 1.5
        else:
            def fric(q, s):
                rt = np.abs(np.gradient(q.path.tau(q.t), q.t))
                rt = np.maximum(rt, 0.3 * q.rate_n) if q.path.style == "sine" else np.full(q.t.size, q.rate_n)
                return np.clip((rt / r0) ** (sg * s), 0.1, 8)
            E["fric"] = fric
            E["smax"] = 1.2
        E["par"] = dict(sign=sg)
    elif name == "x_heat_softening":
        v = pick("linear", "saturating")
        L = max(q.ts[-1] for q in recs)
        def add(q, tau):
            z = np.maximum(q.t - q.t0, 0) / L
            z = z if v == "linear" else 1 - np.exp(-3 * z)
            return z * q.clean
        E["add"] = add
        E["smax"] = 1.0
    elif name == "x_wear_in":
        v = pick("per_travel", "saturating")
        def wear(q, s):
            z = np.concatenate([[0], np.cumsum(np.abs(np.diff(q.path.tau(q.t))))]) / (4 * A)
            z = np.maximum(z - np.interp(q.t0, q.t, z), 0)
            return 1 + s * (z if v == "per_travel" else 1 - np.exp(-z))
        E["gap"] = wear
        E["smax"] = 3.0
    elif name == "x_floor_vibration":
        v = pick("tone", "beat")
        fs = min((q.ts.size - 1) / q.ts[-1] for q in recs)
        f1 = float(min(fs / 5, r.uniform(15, 60) / Pmin))
        E["chan"] = lambda q, th: np.sin(2 * np.pi * f1 * q.ts + q.ph) * (1 if v == "tone" else np.sin(0.13 * np.pi * f1 * q.ts) * 1.4)  # noqa: E501
        E["par"] = dict(freq_Hz=f1)
    elif name == "x_mount_jump":
        v = pick("one", "two")
        n = 1 if v == "one" else 2
        js = {q.file: [(r.uniform(0.15, 0.85) * q.ts[-1], pick(-1, 1) * r.uniform(0.6, 1.2)) for _ in range(n)] for q in recs}
        E["chan"] = lambda q, th: sum(a * (q.ts > tj) for tj, a in js[q.file])
    elif name == "x_grease_squeeze":
        v = pick("film", "thick_film")
        c = (60 if v == "film" else 20) * r.uniform(0.6, 1.6) / math.sqrt(Pmin * Pmax) / A
        E["add"] = lambda q, tau: squeeze(q.t, tau, c)
        E["par"] = dict(c=c)
    elif name == "x_chipped_tooth":
        v = pick("loading_only", "both_ways")
        a_small = min(q.path.amp for q in recs)
        tc, w, sg = r.uniform(0.3, 0.7) * a_small * pick(-1, 1), r.uniform(0.07, 0.16) * a_small, pick(-1.0, 1.0)
        E["smax"] = 1.2 * w * U.peak / A
        def add(q, tau):
            b = np.exp(-0.5 * ((tau - tc) / w) ** 2) * sg
            if v == "loading_only":
                g = np.gradient(np.abs(tau))
                b = b * ((g > 0) | ((g == 0) & (np.abs(play(tau, 1e-9)) < np.abs(tau))))
            return b
        E["add"] = add
        E["par"] = dict(at=tc, width=w)
    elif name == "x_clamp_walk":
        v = pick("plus_side", "minus_side")
        th = r.uniform(0.5, 0.8) * min(q.path.amp for q in recs)
        E["add"] = lambda q, tau: walk(tau, th) if v == "plus_side" else -walk(-tau, th)
        E["par"] = dict(threshold=th)
    elif name == "x_reclamping":
        v = pick("linear", "hardening")
        m = {q.file: float(x) for q, x in zip(recs, r.permutation(np.linspace(-1, 1, len(recs))), strict=False)}
        E["add"] = lambda q, tau: m[q.file] * (tau if v == "linear" else A * np.sinh(2 * tau / A) / 3.6)
        E["par"] = dict(factors=m)
    E["variant"] = v
    return E


def angle(U, q, effs):
    """Angle (rad) at the samples of record q with effects [(E, s)], and the shift of the torque column."""
    tau = q.tau.copy()
    fr = np.ones(tau.size)
    gs = np.ones(tau.size)
    mech = False
    shift = 0.0
    for E, s in effs:
        if "tau" in E:
            if U.final and "reading" in E:
                shift += E["reading"](q, s)
            else:
                tau = E["tau"](q, tau, s)
                mech = True
        if "fric" in E:
            fr = fr * E["fric"](q, s)
            mech = True
        if "gap" in E:
            gs = gs * E["gap"](q, s)
            mech = True
    th = U.scale * U.red.solve(tau, fr, gs) if mech else q.clean.copy()
    for E, s in effs:
        if "add" in E:
            key = (E["name"], q.file)
            if mech and "tau" in "".join(k for e, _ in effs for k in e):
                D = E["add"](q, tau)
            else:
                if key not in U.cache:
                    U.cache[key] = E["add"](q, tau)
                D = U.cache[key]
            th = th + s * D
    th = th + q.G
    for E, s in effs:
        if "lag" in E:
            if E["lag"] == "pure_delay":
                th = np.interp(q.t - s, q.t, th)
            elif E["lag"] == "first_order":
                th = kelvin(q.t, th, s)
            else:
                th = kelvin(q.t, kelvin(q.t, th, s / 2), s / 2)
    y = th[q.idx]
    y0 = y
    for E, s in effs:
        if "chan" in E:
            y = y + s * E["chan"](q, y0)
    return y, shift


def build_basis(U):
    cols = []
    for f in (lambda q: U.scale * U.red.solve(q.tau * 1.01), lambda q: U.scale * U.red.solve(q.tau, 1.05, 1.0),
              lambda q: U.scale * U.red.solve(q.tau, 1.0, 1.05)):
        cols.append(np.concatenate([(f(q) - q.clean)[q.idx] for q in U.recs]))
    cols.append(np.concatenate([q.clean[q.idx] for q in U.recs]))
    n = cols[0].size
    i = 0
    for q in U.recs:
        c = np.zeros(n)
        c[i:i + q.idx.size] = 1
        i += q.idx.size
        cols.append(c)
    B = []
    for c in reversed(cols):
        c = c.copy()
        n0 = np.linalg.norm(c)
        if n0 == 0:
            continue
        for _ in range(2):
            for b in B:
                c -= b * (b @ c)
        if np.linalg.norm(c) > 1e-7 * n0:
            B.append(c / np.linalg.norm(c))
    U.basis = B
    U.y0 = np.concatenate([q.clean[q.idx] + q.G for q in U.recs])


def size_of(U, E, s):
    d = np.concatenate([angle(U, q, [(E, s)])[0] for q in U.recs]) - U.y0
    for b in U.basis:
        d = d - b * (b @ d)
    return float(np.sqrt(np.mean(d * d)) / U.sd)


def find_strength(U, E, target):
    lo, hi = None, None
    s = min(U.sd if "add" in E or "chan" in E else 1e-3, E["smax"])
    if "lag" in E:
        s = E["smax"] * 1e-3
    for _ in range(40):
        v = size_of(U, E, s)
        if abs(v / target - 1) < 0.01:
            return s, v
        if v < target:
            lo = s
            if s >= E["smax"]:
                return None, v
            s = min(E["smax"], s * float(np.clip(target / max(v, 1e-9), 1.5, 30))) if hi is None else math.sqrt(lo * hi)
        else:
            hi = s
            s = s * float(np.clip(target / v, 1e-3, 0.97)) if lo is None else math.sqrt(lo * hi)
    return None, v

# ----------------------------------------------------------------------------------------------- a unit


class Unit:
    pass


RATES = [[0.2, 1.0, 2.0], [0.5, 1.0, 2.0], [0.25, 1.0], [0.1, 0.5, 1.0], [0.3, 1.0, 3.0], [0.2, 0.5, 1.0, 2.0],
         [0.5, 1.0, 1.0, 2.0], [0.2, 0.4, 0.8, 1.0, 1.6], [0.2, 1.0]]


def draw(job, r):
    U = Unit()
    U.final = False
    U.cache = {}
    U.lin = 0.0
    U.red = Reducer(job["reducer"], r)
    U.rated = float(f"{math.exp(r.uniform(math.log(0.05), math.log(1000))):.3g}")
    U.peak = math.exp(r.uniform(math.log(0.2), math.log(60))) * ARCMIN
    rates = list(RATES[int(r.integers(len(RATES)))])
    r.shuffle(rates)
    base = math.exp(r.uniform(math.log(10), math.log(120)))
    A = float(pick(r, [1.0, 1.0, 1.0, 0.8, 0.9, 1.2]))
    many = r.random() < 0.35
    amps = [A] * len(rates)
    if many:
        amps = [A * float(pick(r, [0.4, 0.5, 0.7, 1.0])) for _ in rates]
        amps[int(r.integers(len(amps)))] = A
    ustyle = pick(r, ["triangle"] * 13 + ["sine"] * 3 + ["dwell"] * 3 + ["stairs"] * 2)
    if ustyle == "stairs" and "rate_dependent_friction" in job["effects"]:
        ustyle = "triangle"
    U.style = ustyle
    U.amax = max(amps)
    nsamp = math.exp(r.uniform(math.log(600), math.log(5000)))
    uneven = r.random() < 0.2
    gaps = r.random() < 0.15
    U.uneven, U.gaps = uneven, gaps
    G0 = r.uniform(-0.4, 0.4) * U.peak
    rez = r.random() < 0.5
    U.recs = []
    ustart = pick(r, ["rest", "rest", "mixed", "mixed", "tip", "inside"])
    for i, (rr, am) in enumerate(zip(rates, amps, strict=False)):
        q = Rec()
        q.rel = rr
        start = pick(r, ["rest", "tip", "inside"]) if ustart == "mixed" else ustart
        cyc = float(pick(r, [1.25, 1.5, 2.0, 2.25])) if start == "rest" else float(pick(r, [1.0, 1.2, 1.5, 2.0]))
        if start == "inside":
            cyc += 0.3
        style = ustyle if (ustyle == "triangle" or r.random() < 0.7) else "triangle"
        q.path = Path(r, am, base * (am / A) / rr, style, start, cyc)
        D = (q.path.t_end - q.path.t_rec) * q.path.P
        n = int(np.clip(nsamp * (0.7 + 0.6 * r.random()) * (1.3 if rr < 0.4 else 1.0), 500, 8000))
        fs0 = float(pick(r, [100, 200, 500, 1000, 2000, 5000]))
        step = max(1, round(D * fs0 / n)) / fs0            # whole-number thinning of the logger's rate
        step = step if 500 <= D / step <= 7999 else D / n
        ts = np.arange(0, D * (1 + 1e-12), step)[:8000]
        if uneven:
            ts[1:-1] += r.uniform(-0.35, 0.35, ts.size - 2) * step
        if gaps:
            keep = np.ones(ts.size, bool)
            for _ in range(int(r.integers(1, 4))):
                a = int(r.integers(20, ts.size - 60))
                keep[a:a + int(ts.size * r.uniform(0.005, 0.025))] = False
            if keep.sum() >= 500:
                ts = ts[keep]
        q.ts, q.step, q.fs0 = ts, step, fs0
        q.t, q.idx, q.t0 = q.path.build(ts)
        q.tau = q.path.tau(q.t)
        ext = q.tau[q.t >= q.t0 - 1e-9]
        q.rate_n = float(np.sum(np.abs(np.diff(ext))) / D)
        q.G = G0 + (r.uniform(-0.2, 0.2) * U.peak if rez else 0.0)
        q.ph = r.uniform(0, 6.28)
        q.file = f"run-{i + 1}.csv"
        U.recs.append(q)
    U.session = U.recs
    # scale
    up, a, d, c1, o1, z1 = U.red.settled(U.amax)
    U.scale = U.peak / (0.5 * (a[-1] - a[0]))
    U.loops = {}
    U.check = [c1, o1, z1]
    for am in sorted(set(amps)):
        L = U.red.settled(am)
        U.loops[am] = L
        U.check = [max(x, y) for x, y in zip(U.check, L[3:], strict=False)]
    for q in U.recs:
        q.clean = U.scale * U.red.solve(q.tau)
    U.span = max(np.ptp(q.clean[q.idx]) for q in U.recs)
    U.snr = math.exp(r.uniform(math.log(300), math.log(3000)))
    U.sd = U.span / U.snr
    return U


def pick(r, v):
    return v[int(r.integers(len(v)))]


def ou(r, ts, T):
    o = np.empty(ts.size)
    y = r.standard_normal()
    for i in range(ts.size):
        if i:
            e = math.exp(-(ts[i] - ts[i - 1]) / T)
            y = y * e + math.sqrt(1 - e * e) * r.standard_normal()
        o[i] = y
    return o


def generate(job, seed, out):
    for attempt in range(25):
        r = np.random.default_rng([seed, job["n"], attempt])
        if attempt >= 4:                       # another reducer when this one cannot show the effect
            job = dict(job, reducer=pick(r, list(KINDS)))
        U = draw(job, r)
        if not (U.check[0] < 1e-7 and U.check[1] < 5e-7) or not np.isfinite(U.scale):
            why = f"loop {U.check}"
            continue
        if job["effects"]:
            build_basis(U)
        effs, var, ok = [], {}, True
        for name, sev in zip(job["effects"], job["sev"], strict=False):
            E = make_effect(name, U, r)
            s, v = find_strength(U, E, TARGET[sev])
            if s is None:
                ok, why = False, f"{name} {E['variant']} reaches {v:.2f} of {TARGET[sev]}"
                break
            effs.append((E, s))
            var[name] = dict(variant=E["variant"], strength=s, severity=sev, rms_over_noise=v, **E["par"])
        if ok:
            break
    else:
        raise RuntimeError(f"unit {job['n']} {job['effects']}: {why}")
    U.final = True
    folder = os.path.join(out, job["case"])
    os.makedirs(folder, exist_ok=True)
    # soil: four small channel faults
    per = U.span / r.uniform(3, 10)
    lv = {k: float(r.uniform(0.03, 0.09)) for k in ("drift", "torque_offset", "lag", "encoder")}
    sg = {k: float(pick(r, [-1, 1])) for k in lv}
    ftau = np.concatenate([np.gradient(q.clean, np.maximum.accumulate(q.t + 1e-12 * np.arange(q.t.size)))[q.idx] for q in U.recs])
    dtau = np.concatenate([(U.scale * U.red.solve(q.tau + 1e-3) - q.clean)[q.idx] / 1e-3 for q in U.recs])
    def rms(x):
        return float(np.sqrt(np.mean(x * x)))
    o_soil = sg["torque_offset"] * lv["torque_offset"] * U.sd / rms(dtau)
    lag_soil = lv["lag"] * U.sd / rms(ftau)
    drift = sg["drift"] * lv["drift"] * U.sd / float(np.std(np.concatenate([q.ts / q.ts[-1] for q in U.recs])))
    max(q.ts[-1] for q in U.recs)
    ouf = float(pick(r, [0.0, 0.2, 0.35, 0.5]))
    qa = float(r.uniform(0.4, 1.2)) * U.sd if r.random() < 0.25 else 0.0
    trel = r.uniform(0.1, 0.6)
    sd_tau = trel * U.sd / rms(dtau)
    qt = float(r.uniform(0.5, 1.5)) * sd_tau if r.random() < 0.2 else 0.0
    ouT = math.exp(r.uniform(math.log(3), math.log(60)))
    names = pick(r, ["default", "default", "default", "other", "other2"])
    packed = r.random() < 0.4
    tell = r.random() < 0.75
    recs_key, by_rec, ind = [], {}, {}
    toml = ['schema = "backdrive-bayes/unit/1"', f'name = "{job["case"]}"', f"rated_torque_Nm = {U.rated!r}", ""]
    for q in U.recs:
        y, shift = angle(U, q, effs)
        # soil lag on the clean motion (a delay), drift, encoder
        y = y + (np.interp(q.t[q.idx] - lag_soil, q.t, q.clean) - q.clean[q.idx])
        y = y + drift * q.ts / q.ts[-1]
        y = y + lv["encoder"] * U.sd * math.sqrt(2) * np.sin(2 * np.pi * y / per + 1.3 * sg["encoder"])
        e = math.sqrt(1 - ouf) * r.standard_normal(q.ts.size)
        if ouf:
            e = e + math.sqrt(ouf) * ou(r, q.ts, ouT * q.step)
        y = y + U.sd * e
        if qa:
            y = np.round(y / qa) * qa
        tau = q.tau[q.idx] + shift + o_soil + sd_tau * r.standard_normal(q.ts.size)
        if qt:
            tau = np.round(tau / qt) * qt
        tau = tau * U.rated
        file = q.file + (".gz" if packed else "")
        c = {"default": ("time_s", "torque_Nm", "angle_arcmin"), "other": ("t [ms]", "M [mNm]", "phi [deg]"),
             "other2": ("time [s]", "torque [Nm]", "angle [mrad]")}[names]
        tt = q.ts * (1e3 if names == "other" else 1.0)
        mm = tau * (1e3 if names == "other" else 1.0)
        aa = y * {"default": 1 / ARCMIN, "other": 180 / math.pi, "other2": 1e3}[names]
        assert np.all(np.isfinite(tt)) and np.all(np.isfinite(mm)) and np.all(np.isfinite(aa)) and 500 <= tt.size <= 8000
        text = ",".join(c) + "\n" + "\n".join(f"{a:.9g},{b:.9g},{d:.9g}" for a, b, d in zip(tt, mm, aa, strict=False)) + "\n"
        if packed:
            with open(os.path.join(folder, file), "wb") as f:
                f.write(gzip.compress(text.encode(), mtime=0))
        else:
            with open(os.path.join(folder, file), "w") as f:
                f.write(text)
        rate = q.rate_n * U.rated
        toml += ["[[record]]", f'file = "{file}"']
        if tell:
            toml += [f"loading_rate_Nm_per_s = {float(f'{rate:.6g}')!r}", f"amplitude_Nm = {float(f'{q.path.amp * U.rated:.6g}')!r}"]  # noqa: E501
        if names != "default":
            toml += ["[record.columns]", f'time = "{c[0]}"', f'torque = "{c[1]}"', f'angle = "{c[2]}"']
        toml.append("")
        L = U.loops[q.path.amp]
        I = indicators(L[0] * U.rated, L[1] * U.scale, L[2] * U.scale, K_LOST * U.rated)  # noqa: E741
        by_rec[file] = I
        recs_key.append(dict(file=file, rate_Nm_per_s=rate, amplitude_Nm=q.path.amp * U.rated, relative_rate=q.rel,
                             style=q.path.style, start=q.path.start, cycles=q.path.cycles, samples=int(q.ts.size)))
    with open(os.path.join(folder, "unit.toml"), "w") as f:
        f.write("\n".join(toml))
    ind = dict(by_rec)
    if len(U.loops) == 1:
        for k in recs_key:
            ind[str(k["relative_rate"])] = by_rec[k["file"]]
    sev = job["sev"]
    return job["case"], dict(
        effects=job["effects"], size=(max(sev) if sev else None), sizes=dict(zip(job["effects"], sev, strict=False)), kind=job["kind"],  # noqa: E501
        reducer=U.red.name, style=U.style, rated_torque_Nm=U.rated, k=K_LOST, noise_sd_rad=U.sd, variant=var,
        snr=U.snr, torque_noise_sd_Nm=sd_tau * U.rated, ou_share=ouf, angle_quantum_rad=qa, torque_quantum_Nm=qt * U.rated,
        uneven=U.uneven, gaps=U.gaps, soil=lv, closure=U.check[0], oddness=U.check[1], centre=U.check[2],
        attempts=attempt + 1, records=recs_key, indicators_by_record=by_rec, indicators=ind)


def jobs_for(n, seed):
    r = np.random.default_rng(seed)
    J = [dict(kind="clean", effects=[], sev=[]) for _ in range(24)]
    J += [dict(kind="single", effects=[e], sev=[s]) for e in LISTED for s in (1.0, 0.4, 0.2)]
    while True:
        a, b = list(r.permutation(LISTED)), list(r.permutation(LISTED))
        if all(x != y for x, y in zip(a, b, strict=False)) and len({frozenset(p) for p in zip(a, b, strict=False)}) == 10:
            break
    J += [dict(kind="pair", effects=[str(x), str(y)], sev=[pick(r, [1.0, 0.4]), pick(r, [1.0, 0.4])]) for x, y in zip(a, b, strict=False)]  # noqa: E501
    J += [dict(kind="unlisted", effects=[e], sev=[s]) for e in UNLISTED for s in (1.0, 0.4)]
    ks = []
    while len(ks) < len(J):
        ks += list(r.permutation(list(KINDS)))
    for j, k in zip(J, ks, strict=False):
        j["reducer"] = str(k)
    J = [J[i] for i in r.permutation(len(J))]
    if n < len(J):
        J = J[:n]
    for i, j in enumerate(J):
        j["n"], j["case"] = i, f"case-{i + 1:02d}"
    return J


def work(a):
    t = time.time()
    job, seed, out = a
    res = generate(job, seed, out)
    return res, time.time() - t


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument("--units", type=int, default=80)
    ap.add_argument("--seed", type=int, default=71)
    ap.add_argument("--out", required=True)
    ap.add_argument("--jobs", type=int, default=2)
    o = ap.parse_args()
    os.makedirs(o.out, exist_ok=True)
    t0 = time.time()
    jobs = [(j, o.seed, o.out) for j in jobs_for(o.units, o.seed)]
    key = {}
    for k in KINDS:                                        # compile before the processes part
        Reducer(k, np.random.default_rng(0)).solve(np.linspace(0, 0.5, 5))
    with get_context("fork").Pool(o.jobs) as p:
        for (case, k), dt in p.imap_unordered(work, jobs):
            key[case] = k
            print(f"{case} {k['reducer']:16s} {k['kind']:9s} {'+'.join(k['effects']):40s} {k['size']} snr {k['snr']:.0f} "
                  f"try {k['attempts']} odd {k['oddness']:.1e} {dt:.1f}s", flush=True)
    key = {k: key[k] for k in sorted(key)}
    with open(os.path.join(o.out, "key.json"), "w") as f:
        json.dump(key, f, indent=1)
    print(f"{len(key)} units in {time.time() - t0:.0f} s")


if __name__ == "__main__":
    main()
