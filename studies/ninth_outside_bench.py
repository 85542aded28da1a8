"""Ninth outside bench: written without sight of the package it tests, with reducer mechanics of its own.

A virtual test bench for gear reducers: the input shaft is locked, the output shaft is loaded, and the output angle is
recorded against the torque. A reducer is a series of elements between the output flange and the locked input: elastic
members, meshes with clearance and Hertz contact, friction nodes that pass on only what exceeds their drag, and stacks of
micro-slip, bristle or Iwan elements. Effects act inside this chain wherever they have a mechanism there, and on the
channels otherwise. Every clean reducer is odd-symmetric, rate-independent and settles after first loading.

Run it with ``python ninth_outside_bench.py OUT --units 80 --seed 91``. It writes ``OUT/case-01`` and so on (``unit.toml``
and one CSV file per record) and ``OUT/key.json`` (the truth). The same seed gives the same bytes.

Severity: ``rms`` in the key is the rms, over all samples of a unit, of the change of the noise-free angle that remains after
a scale and an offset were refitted in each record, divided by the standard deviation of the angle noise. An effect of size
``s`` has rms ``LEVEL * s`` (option ``--level``). Traces of channel effects are given as plain rms, without any refit.
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np
from numba import njit
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

LEVEL = 3.0  # rms of an effect of size 1, in standard deviations of the angle noise
TRACE_NAMES = ("torque_offset", "sensor_lag", "thermal_drift", "encoder_error")
ARCMIN = math.pi / 10800.0

# ---------------------------------------------------------------------------------------------------------------------
# Kernels. Torque is in units of the rated torque, deflection in units of the reducer's wind-up scale.


@njit
def _up(u, r0, mu, pre):
    """Inner torque of a friction node that slides in the positive direction under the outer torque u."""
    t = u - r0 - mu * pre
    if t > pre:
        return (u - r0) / (1.0 + mu)
    if t < -pre:
        return (u - r0) / (1.0 - mu)
    return t


@njit
def rub(u, f, r0, mu, pre):
    """Inner torque behind a node with the friction f * (r0 + mu * max(|t|, pre)); f is a factor per sample."""
    out = np.empty(u.size)
    t = 0.0
    for i in range(u.size):
        m = min(mu * f[i], 0.95)
        low = _up(u[i], r0 * f[i], m, pre)
        high = -_up(-u[i], r0 * f[i], m, pre)
        t = min(max(t, low), high)
        out[i] = t
    return out


@njit
def rub_stick(u, f, time, draw, r0, mu, pre, excess, over, age, loaded):
    """As rub, with static above kinetic friction: a stuck node breaks away late and lands beyond kinetic balance.

    excess: break-away above the mean friction; over: how far it lands below; age: time constant of the growth of the
    static friction at rest (0: none); draw: random factors, one per event (ones: none); loaded: 1 where the excess grows
    with the load, else 0.
    """
    out = np.empty(u.size)
    t, since, event = 0.0, time[0], 0
    for i in range(u.size):
        m = min(mu * f[i], 0.95)
        grown = excess * draw[event % draw.size] * (1.0 + 3.0 * loaded * abs(t))
        if age > 0.0:
            grown *= 1.0 - math.exp(-(time[i] - since) / age)
        low = _up(u[i], r0 * f[i] + grown, m, pre)
        high = -_up(-u[i], r0 * f[i] + grown, m, pre)
        land = r0 * f[i] - over * grown
        if t < low:
            t = _up(u[i], land, m, pre)
            since = time[i]
            event += 1
        elif t > high:
            t = -_up(-u[i], land, m, pre)
            since = time[i]
            event += 1
        out[i] = t
    return out


@njit
def iwan(u, f, stiff, limit, kb, k3):
    """Displacement of parallel slip elements (Jenkins) beside a hardening spring, under a prescribed torque."""
    n = stiff.size
    z = np.zeros(n)
    out = np.empty(u.size)
    x = 0.0
    for i in range(u.size):
        lo, hi = x - 4.0, x + 4.0
        y = x
        for _ in range(80):
            g = kb * y + k3 * y * y * y - u[i]
            d = kb + 3.0 * k3 * y * y
            for j in range(n):
                q = z[j] + stiff[j] * (y - x)
                lim = limit[j] * f[i]
                if q > lim:
                    g += lim
                elif q < -lim:
                    g -= lim
                else:
                    g += q
                    d += stiff[j]
            if g > 0.0:
                hi = y
            else:
                lo = y
            if abs(g) < 1e-13:
                break
            y -= g / d
            if y <= lo or y >= hi:
                y = 0.5 * (lo + hi)
        for j in range(n):
            lim = limit[j] * f[i]
            z[j] = min(max(z[j] + stiff[j] * (y - x), -lim), lim)
        x = y
        out[i] = x
    return out


@njit
def _contact(v, k, hertz):
    """Force and stiffness of one contact compressed by v > 0: point contact (v**1.5) or linear."""
    if hertz:
        s = math.sqrt(v)
        return k * v * s, 1.5 * k * s
    return k * v, k


@njit
def pins(u, f, k, gap, centre, hertz, mu, bristle, back):
    """Displacement of parallel contacts with their own clearances and bristles that slip in proportion to load.

    back: stiffness factor of the flanks that carry negative torque.
    """
    n = k.size
    z = np.zeros(n)
    out = np.empty(u.size)
    x = 0.0
    for i in range(u.size):
        lo, hi = x - 6.0, x + 6.0
        y = x
        for _ in range(80):
            g = centre * y - u[i]
            d = centre
            for j in range(n):
                force, slope = 0.0, 0.0
                if y > gap[j]:
                    force, slope = _contact(y - gap[j], k[j], hertz)
                elif y < -gap[j]:
                    force, slope = _contact(-y - gap[j], k[j] * back, hertz)
                lim = mu * f[i] * (force + 0.02)
                q = z[j] + bristle[j] * (y - x)
                if q > lim:
                    q = lim
                elif q < -lim:
                    q = -lim
                else:
                    d += bristle[j]
                g += q + (force if y > 0.0 else -force)
                d += slope
            if g > 0.0:
                hi = y
            else:
                lo = y
            if abs(g) < 1e-13 or hi - lo < 1e-15:
                break
            y -= g / d
            if y <= lo or y >= hi:
                y = 0.5 * (lo + hi)
        for j in range(n):
            force = 0.0
            if y > gap[j]:
                force = _contact(y - gap[j], k[j], hertz)[0]
            elif y < -gap[j]:
                force = _contact(-y - gap[j], k[j] * back, hertz)[0]
            lim = mu * f[i] * (force + 0.02)
            z[j] = min(max(z[j] + bristle[j] * (y - x), -lim), lim)
        x = y
        out[i] = x
    return out


@njit
def dahl(u, f, half, centre, k1, k2, limit, sigma, back):
    """Displacement of a mesh (clearance, linear and quadratic flank) in parallel with Dahl friction; exact per step."""
    out = np.empty(u.size)
    x, z = 0.0, 0.0
    for i in range(u.size):
        lo, hi = x - 8.0, x + 8.0
        y = x
        lim = limit * f[i]
        znew = z
        for _ in range(80):
            step = y - x
            s = 1.0 if step >= 0.0 else -1.0
            e = math.exp(-sigma * s * step / lim)
            znew = s * lim + (z - s * lim) * e
            g = centre * y + znew - u[i]
            d = centre + sigma * max(1.0 - s * znew / lim, 1e-6)
            v = abs(y) - half
            if v > 0.0:
                b = 1.0 if y > 0.0 else back
                force = b * (k1 * v + k2 * v * v)
                g += force if y > 0.0 else -force
                d += b * (k1 + 2.0 * k2 * v)
            if g > 0.0:
                hi = y
            else:
                lo = y
            if abs(g) < 1e-13 or hi - lo < 1e-15:
                break
            y -= g / d
            if y <= lo or y >= hi:
                y = 0.5 * (lo + hi)
        z = znew
        x = y
        out[i] = x
    return out


@njit
def _first(q, f, lin, quad, mind, qs):
    """First-loading curve of distributed micro-slip: linear, quadratic (press fit) and Mindlin (rolling contact) parts."""
    a = abs(q)
    y = lin * a + quad * a * a / f
    if mind > 0.0:
        y += mind * f * (1.0 - max(1.0 - a / (qs * f), 0.0) ** (2.0 / 3.0))
    return y if q >= 0.0 else -y


@njit
def masing(u, f, lin, quad, mind, qs):
    """Displacement with Masing's rule and return-point memory (Madelung) over the first-loading curve."""
    out = np.empty(u.size)
    ut = np.zeros(u.size + 2)
    xt = np.zeros(u.size + 2)
    n, direction, last, peak, x = 0, 0, 0.0, 0.0, 0.0
    for i in range(u.size):
        step = u[i] - last
        if step != 0.0:
            s = 1 if step > 0.0 else -1
            if direction != 0 and s != direction:
                ut[n], xt[n] = last, x
                n += 1
            direction = s
            while n >= 2 and (u[i] - ut[n - 2]) * s >= 0.0:
                n -= 2
            if n == 1 and abs(u[i]) >= abs(ut[0]) and abs(u[i]) >= peak:
                n = 0
            if n == 0:
                x = _first(u[i], f, lin, quad, mind, qs)
            else:
                x = xt[n - 1] + 2.0 * _first(0.5 * (u[i] - ut[n - 1]), f, lin, quad, mind, qs)
            peak = max(peak, abs(u[i]))
            last = u[i]
        out[i] = x
    return out


@njit
def relay_gap(u, half, drag, width):
    """Coupling with a clearance that is crossed when the torque overcomes its own drag, in either direction."""
    out = np.empty(u.size)
    x = 0.0
    for i in range(u.size):
        low = half * min(max((u[i] - drag) / width, -1.0), 1.0)
        high = half * min(max((u[i] + drag) / width, -1.0), 1.0)
        x = min(max(x, low), high)
        out[i] = x
    return out


@njit
def clamp_slip(u, hold, give, stop):
    """Slip of a clamp: grows only while |u| loads beyond hold, stays until the other direction slips; |slip| <= stop."""
    out = np.empty(u.size)
    x = 0.0
    for i in range(u.size):
        if u[i] > hold:
            x = max(x, min(give * (u[i] - hold), stop))
        elif u[i] < -hold:
            x = min(x, max(give * (u[i] + hold), -stop))
        out[i] = x
    return out


@njit
def lowpass(time, drive, tau):
    """First-order lag of a piecewise linear signal, exact per step, at equilibrium in the first sample."""
    out = np.empty(drive.size)
    y = drive[0]
    out[0] = y
    for i in range(1, drive.size):
        h = time[i] - time[i - 1]
        if h > 0.0:
            slope = (drive[i] - drive[i - 1]) / h
            e = math.exp(-h / tau)
            y = drive[i] - slope * tau + (y - drive[i - 1] + slope * tau) * e
        out[i] = y
    return out


@njit
def snap(u, up, down):
    """State of a plate that snaps over at the torque up and back at the torque down."""
    out = np.zeros(u.size)
    on = 0.0
    for i in range(u.size):
        if u[i] > up:
            on = 1.0
        elif u[i] < down:
            on = 0.0
        out[i] = on
    return out


# ---------------------------------------------------------------------------------------------------------------------
# Reducers: series of elements from the output flange to the locked input.


def tooth(half, wedge, give, power):
    """Element: a mesh whose teeth float in a clearance (centred by the torque wedge) and then touch with a power law."""
    y = np.concatenate([np.linspace(0.0, half, 300)[:-1] if half > 0 else [], half + 2.0 * give * np.linspace(0, 1, 1500) ** 2])
    soft = wedge * y / half if half > 0 else 0.15 * y / give
    t = soft + (np.maximum(y - half, 0.0) / give) ** power
    return ("table", np.concatenate([-t[:0:-1], t]), np.concatenate([-y[:0:-1], y]))


def preloaded(pre, inside, outside):
    """Element: a preloaded bearing or split gear, stiff while preloaded on both sides and softer beyond, smoothly."""
    t = np.linspace(0.0, 2.0, 2001)
    w = 0.12 * pre
    excess = w * np.logaddexp(0.0, (t - pre) / w) - w * np.logaddexp(0.0, -pre / w)
    y = inside * t + (outside - inside) * excess
    return ("table", np.concatenate([-t[:0:-1], t]), np.concatenate([-y[:0:-1], y]))


def cycloidal(rng, half):
    """Pins of scattered clearance with point contacts, under a lip seal; the disc's pins share the load."""
    n = int(rng.integers(12, 33))
    gap = half * rng.uniform(0.05, 1.0, n) + 0.002
    k = rng.uniform(0.6, 1.4, n) * rng.uniform(1.5, 4.0) / n * 2.0
    mu = rng.uniform(0.05, 0.2)
    return [("lin", rng.uniform(0.2, 0.5)), ("rub", rng.uniform(0.005, 0.03), 0.0, 0.0),
            ("pins", k, gap, rng.uniform(0.02, 0.1) / max(half, 0.3), True, mu, 3.0 * mu * k + 0.1 / n)]


def planetary(rng, half):
    """Two planetary stages: planets that share unevenly at the carrier, then a sun mesh with its own clearance."""
    n = int(rng.integers(3, 6))
    gap = half * rng.uniform(0.4, 1.0, n)
    k = rng.uniform(0.8, 1.2, n) * rng.uniform(2.0, 5.0) / n
    mu = rng.uniform(0.04, 0.12)
    wedge = rng.uniform(0.005, 0.03)
    return [("lin", rng.uniform(0.2, 0.5)), ("rub", rng.uniform(0.004, 0.02), rng.uniform(0.0, 0.04), 0.0),
            ("pins", k, gap, wedge / max(half, 0.05), False, mu, 4.0 * mu * k + 0.2 / n),
            ("rub", rng.uniform(0.002, 0.02), rng.uniform(0.02, 0.06), 0.0),
            tooth(0.3 * half, wedge, rng.uniform(0.1, 0.4), 10.0 / 9.0)]


def strain_wave(rng, half):
    """Flexspline with a soft torsional hysteresis (Iwan) that hardens, and friction of the wave generator's bearing."""
    n = 24
    share = rng.uniform(0.1, 0.3)
    edge = rng.uniform(0.01, 0.05)
    limit = edge * (rng.uniform(8, 25) ** np.linspace(0.0, 1.0, n))
    weight = np.full(n, share / n)
    kb = rng.uniform(0.45, 0.8)
    return [("lin", rng.uniform(0.05, 0.2)), ("rub", rng.uniform(0.002, 0.01), 0.0, 0.0),
            ("iwan", weight * rng.uniform(3.0, 8.0), weight * limit / limit.mean() * rng.uniform(0.3, 0.9), kb,
             rng.uniform(0.1, 0.6)),
            ("rub", rng.uniform(0.004, 0.02), rng.uniform(0.0, 0.05), rng.uniform(0.0, 0.2)), ("lin", rng.uniform(0.05, 0.15))]


def worm(rng, half):
    """Worm with strong friction in proportion to load, and a worm shaft that floats axially behind a drag."""
    return [("lin", rng.uniform(0.15, 0.4)), ("rub", rng.uniform(0.005, 0.03), 0.0, 0.0),
            ("lin", rng.uniform(0.1, 0.3)), ("rub", rng.uniform(0.003, 0.02), rng.uniform(0.1, 0.4), 0.0),
            tooth(0.6 * half, rng.uniform(0.005, 0.03), rng.uniform(0.3, 0.6), rng.uniform(1.05, 1.3)),
            ("rub", rng.uniform(0.005, 0.03), rng.uniform(0.0, 0.05), 0.0),
            tooth(0.4 * half, rng.uniform(0.01, 0.04), rng.uniform(0.1, 0.3), 1.0)]


def hypoid(rng, half):
    """Hypoid pair on preloaded taper rollers: stiff until the preload is gone, sliding friction, line to point contact."""
    pre = rng.uniform(0.15, 0.5)
    return [("lin", rng.uniform(0.1, 0.3)), ("rub", rng.uniform(0.004, 0.03), rng.uniform(0.02, 0.05), pre),
            preloaded(pre, rng.uniform(0.1, 0.2), rng.uniform(0.3, 0.5)),
            ("rub", rng.uniform(0.002, 0.01), rng.uniform(0.04, 0.15), 0.0),
            tooth(half, rng.uniform(0.006, 0.04), rng.uniform(0.4, 0.8), rng.uniform(1.2, 1.5))]


def capstan(rng, half):
    """Preloaded cable on a drum: friction and stretch distributed along the wrap, no clearance."""
    n = int(rng.integers(18, 31))
    mu = rng.uniform(0.08, 0.3) / n * rng.uniform(1.0, 2.0)
    chain = [("lin", rng.uniform(0.2, 0.4)), ("rub", rng.uniform(0.003, 0.015), 0.0, 0.0)]
    tension = rng.uniform(0.3, 0.8)
    for _ in range(n):
        chain += [("rub", mu * tension, mu, 0.0), ("lin", rng.uniform(0.6, 1.0) / n)]
    return chain + [preloaded(rng.uniform(0.5, 0.9), 0.15, rng.uniform(0.2, 0.4))]


def plastic(rng, half):
    """Moulded spur gears: wide clearance, teeth that stiffen as they wrap, Dahl friction in the mesh, plain bearings."""
    return [("lin", rng.uniform(0.1, 0.3)), ("rub", rng.uniform(0.005, 0.03), rng.uniform(0.02, 0.1), 0.0),
            ("dahl", half, rng.uniform(0.01, 0.04) / max(half, 0.1), rng.uniform(0.5, 1.2), rng.uniform(0.3, 1.5),
             rng.uniform(0.02, 0.08), rng.uniform(0.3, 1.5)),
            ("rub", rng.uniform(0.003, 0.02), rng.uniform(0.03, 0.12), 0.0), ("lin", rng.uniform(0.1, 0.4))]


def spiroid(rng, half):
    """Spiroid: several teeth in line contact, sliding friction, a hub whose press fit slips a little everywhere."""
    n = int(rng.integers(4, 9))
    k = rng.uniform(0.9, 1.1, n) * rng.uniform(2.0, 4.0) / n
    mu = rng.uniform(0.08, 0.25)
    return [("masing", rng.uniform(0.1, 0.3), rng.uniform(0.03, 0.15), 0.0, 1.0),
            ("rub", rng.uniform(0.005, 0.02), rng.uniform(0.05, 0.15), 0.0),
            ("pins", k, half * rng.uniform(0.5, 1.0, n), rng.uniform(0.01, 0.03) / max(half, 0.05), False, mu,
             3.0 * mu * k + 0.2 / n)]


def magnetic(rng, half):
    """Coaxial magnetic gear: sine of the pole angle, Rayleigh hysteresis of the iron, ball bearings; no clearance."""
    reach = rng.uniform(1.25, 2.5)
    t = np.linspace(-1.2, 1.2, 3001)
    return [("rub", rng.uniform(0.002, 0.02), 0.0, 0.0), ("table", t, np.arcsin(t / reach) * reach * rng.uniform(0.6, 0.9)),
            ("masing", rng.uniform(0.05, 0.1), rng.uniform(0.02, 0.12), 0.0, 1.0),
            ("rub", rng.uniform(0.001, 0.01), 0.0, 0.0), ("lin", rng.uniform(0.05, 0.2))]


def split_gear(rng, half):
    """Split anti-backlash gear: springs press both flanks, one leaves when the load passes the preload."""
    pre = rng.uniform(0.1, 0.45)
    return [("lin", rng.uniform(0.15, 0.35)), ("rub", rng.uniform(0.003, 0.015), 0.0, 0.0),
            ("rub", rng.uniform(0.001, 0.01), rng.uniform(0.05, 0.15), pre),
            preloaded(pre, rng.uniform(0.2, 0.35), rng.uniform(0.5, 0.9)),
            ("iwan", np.array([0.6, 0.9, 1.2]), np.array([0.01, 0.025, 0.05]) * rng.uniform(0.3, 1.0),
             rng.uniform(2.0, 5.0), 0.5)]


def traction(rng, half):
    """Ball traction drive: tangential micro-slip of Hertz contacts (Mindlin), a loading cam, no clearance."""
    qs = rng.uniform(1.15, 2.5)
    return [("lin", rng.uniform(0.2, 0.5)), ("rub", rng.uniform(0.003, 0.015), rng.uniform(0.0, 0.03), 0.0),
            ("masing", 0.05, 0.0, qs * rng.uniform(0.4, 0.9), qs), preloaded(rng.uniform(0.3, 0.7), 0.3, rng.uniform(0.1, 0.2))]


def leaf_coupled(rng, half):
    """Spur train behind a leaf-spring coupling: leaves that slip one after another, then a clearance and line contacts."""
    n = int(rng.integers(5, 9))
    stiff = rng.uniform(0.15, 0.35, n)
    limit = np.linspace(0.02, 0.2, n) * stiff * rng.uniform(0.3, 0.9)
    return [("iwan", stiff, limit, rng.uniform(1.0, 2.5), rng.uniform(0.2, 1.5)),
            ("rub", rng.uniform(0.004, 0.02), rng.uniform(0.01, 0.05), 0.0),
            tooth(0.7 * half, rng.uniform(0.005, 0.03), rng.uniform(0.2, 0.5), rng.uniform(1.05, 1.2)),
            ("rub", rng.uniform(0.002, 0.01), rng.uniform(0.01, 0.05), 0.0),
            tooth(0.3 * half, rng.uniform(0.01, 0.03), rng.uniform(0.1, 0.3), 1.1)]


def shrunk_bevel(rng, half):
    """Bevel pair with a shrunk wheel (distributed slip) on crossed rollers whose stiffness rises as rollers join."""
    n = int(rng.integers(6, 11))
    k = np.full(n, rng.uniform(1.0, 2.0) / n)
    return [("masing", rng.uniform(0.1, 0.25), rng.uniform(0.05, 0.25), 0.0, 1.0),
            ("rub", rng.uniform(0.004, 0.02), rng.uniform(0.01, 0.06), rng.uniform(0.0, 0.3)),
            ("pins", k, np.linspace(0.0, rng.uniform(0.1, 0.4), n), 0.6, False, rng.uniform(0.02, 0.06), 0.3 * k + 0.1 / n),
            ("rub", rng.uniform(0.002, 0.015), rng.uniform(0.02, 0.08), 0.0),
            tooth(half, rng.uniform(0.006, 0.03), rng.uniform(0.3, 0.6), 1.5)]


# name: (builder, rated torque in N m, wind-up scale in arcmin, half clearance in wind-ups or None)
FAMILIES = {
    "cycloidal_pins": (cycloidal, (20.0, 1000.0), (0.6, 2.5), (0.05, 0.8)),
    "two_stage_planetary": (planetary, (1.0, 500.0), (2.0, 12.0), (0.1, 1.5)),
    "strain_wave_iwan": (strain_wave, (0.5, 300.0), (2.0, 6.0), None),
    "worm_axial_float": (worm, (0.5, 300.0), (2.0, 15.0), (0.1, 1.5)),
    "hypoid_taper": (hypoid, (10.0, 1000.0), (0.8, 5.0), (0.05, 1.0)),
    "cable_capstan_wrap": (capstan, (0.2, 60.0), (3.0, 20.0), None),
    "plastic_spur": (plastic, (0.05, 3.0), (15.0, 60.0), (0.1, 0.6)),
    "spiroid": (spiroid, (1.0, 200.0), (2.0, 10.0), (0.05, 0.8)),
    "magnetic_coaxial": (magnetic, (0.1, 40.0), (40.0, 300.0), None),
    "split_gear": (split_gear, (0.1, 50.0), (2.0, 15.0), None),
    "ball_traction": (traction, (0.5, 150.0), (1.5, 8.0), None),
    "leaf_coupled_spur": (leaf_coupled, (0.2, 100.0), (5.0, 25.0), (0.05, 1.0)),
    "shrunk_bevel": (shrunk_bevel, (2.0, 600.0), (1.5, 8.0), (0.05, 1.0)),
}


def log_uniform(rng, lo, hi):
    """One draw, log-uniform in [lo, hi]."""
    return float(math.exp(rng.uniform(math.log(lo), math.log(hi))))


def build_reducer(name, rng):
    """Dict of a drawn reducer: elements, rated torque in N m, angle scale in rad, k of its lost motion."""
    make, torque, windup, clearance = FAMILIES[name]
    scale = log_uniform(rng, *windup) * ARCMIN
    half = log_uniform(rng, *clearance) if clearance else 0.0
    return {"name": name, "chain": make(rng, half), "rated": log_uniform(rng, *torque), "scale": scale,
            "k": 0.04 if name == "strain_wave_iwan" else 0.03}


# ---------------------------------------------------------------------------------------------------------------------
# Mechanics of a unit: chain and effects. An effect is a dict with name, variant, s and its own parameters.


def friction_factor(effects, path, moving):
    """Factor of all friction torques per sample, and its mean."""
    f = np.ones(path["t"].size)
    for e in effects:
        s, v, name = e["s"], e["variant"], e["name"]
        if name == "rate_dependent_friction":
            rate = moving if v == "log_local" else np.full(f.size, path["rate"])
            q = np.log(rate / e["rate0"])
            if v == "stribeck":
                g = -np.tanh(q)
            elif v == "viscous":
                g = np.clip(np.expm1(0.4 * q), -1.0, 4.0)
            else:
                g = q
            f = f * np.clip(1.0 + e["sign"] * s * g, 0.15, 6.0)
        elif name == "x_grease_channels":
            f = f * (1.0 + s * np.exp(-path["travel"] / e["wear"]))
        elif name == "x_dither_release":
            for at in e["at"]:
                f = f * (1.0 - min(s, 0.98) * np.exp(-0.5 * ((path["t"] / path["end"] - at) / e["length"]) ** 2))
    return f, float(f.mean())


def chain_angle(chain, u, path, effects, moving):
    """Deflection of the series under the torque u, with every effect that acts inside it."""
    get = {e["name"]: e for e in effects}
    f, fmean = friction_factor(effects, path, moving)
    t = path["t"]
    flank = get.get("asymmetric_stiffness")
    skew = flank["s"] * flank["sign"] if flank and flank["variant"] == "flank" else 0.0
    stick = get.get("stick_slip")
    rubs = [i for i, e in enumerate(chain) if e[0] == "rub"]
    stuck = None
    if stick:
        stuck = rubs[-1] if stick["variant"] == "mesh" else rubs[0]
    soft = np.ones(t.size)
    if "x_warming_compliance" in get:
        e = get["x_warming_compliance"]
        soft = soft + e["s"] * (1.0 - np.exp(-np.maximum(t, 0.0) / e["tau"]))
    if "x_sudden_crack" in get:
        e = get["x_sudden_crack"]
        soft = soft + e["s"] * (path["clock"] + t > e["at"] * e["total"])
    total = np.zeros(t.size)
    for i, e in enumerate(chain):
        kind = e[0]
        if kind == "rub":
            if i == stuck:
                u = rub_stick(u, f, t, stick["draw"], e[1], e[2], e[3], stick["s"], stick["over"], stick["age"],
                              float(stick["variant"] == "mesh"))
            else:
                u = rub(u, f, e[1], e[2], e[3])
        elif kind == "lin":
            total += e[1] * u * soft
        elif kind == "table":
            total += np.interp(u, e[1], e[2]) * np.where(u < 0.0, 1.0 + skew, 1.0) * soft
        elif kind == "iwan":
            total += iwan(u, f, *e[1:]) * soft
        elif kind == "pins":
            total += pins(u, f, *e[1:], 1.0 / (1.0 + skew))
        elif kind == "dahl":
            total += dahl(u, f, *e[1:], 1.0 / (1.0 + skew))
        elif kind == "masing":
            total += masing(u, fmean, *e[1:])
    return total, u


def output_side(e, u, inner, path):
    """Deflection added by one effect at the output side or behind the last element (inner: its torque)."""
    name, v, s, t = e["name"], e["variant"], e["s"], path["t"]
    if name == "interface_slip":
        if v == "distributed":
            return np.mean([clamp_slip(u, h, s, 99.0) for h in np.linspace(e["hold"], min(e["hold"] + 0.25, 0.95), 12)], axis=0)
        if v == "key_gap":
            return clamp_slip(u, e["hold"], s * 12.0, s)
        if v == "spline_return":
            return clamp_slip(rub(u, np.ones(u.size), e["hold"] * 0.5, 0.0, 0.0), e["hold"] * 0.5, s, 99.0)
        return clamp_slip(u, e["hold"], s, 99.0)
    if name == "viscoelastic_creep":
        drive = inner if v == "mesh" else u
        if v == "threshold":
            drive = np.sign(u) * np.maximum(np.abs(u) - e["limit"], 0.0)
        elif v == "cubic":
            drive = u**3
        taus = e["tau"] * np.array([0.2, 1.0, 5.0]) if v == "spectrum" else [e["tau"]]
        return s * np.mean([lowpass(t, drive, tau) for tau in taus], axis=0)
    if name == "asymmetric_stiffness":
        q = e["sign"] * u
        if v == "thrust":
            w = 0.05
            return e["sign"] * s * w * np.logaddexp(0.0, (q - e["knee"]) / w)
        if v == "bracket":
            return e["sign"] * s * u * u
        return 0.0
    if name == "second_backlash":
        if v == "drag_relay":
            return relay_gap(u, s, e["drag"], e["width"])
        if v == "two_keys":
            return relay_gap(u, 0.6 * s, e["drag"], e["width"]) + relay_gap(u, 0.4 * s, 1.35 * e["drag"], e["width"])
        if v == "stage_behind":
            t2 = rub(u, np.ones(u.size), 0.8 * e["drag"], 0.1, 0.0)
            return s * np.clip(t2 / e["width"], -1.0, 1.0)
        away = np.clip((np.abs(u) - e["drag"]) / e["width"], 0.0, 1.0) * np.sign(u)
        return s * away + relay_gap(u, 0.2 * s, 0.5 * e["drag"], e["width"])
    if name == "x_snap_through":
        return s * e["sign"] * snap(e["sign"] * u, e["up"], e["down"])
    if name == "x_ratchet_set":
        gain = np.maximum(np.diff(e["sign"] * u, prepend=u[0] * e["sign"]), 0.0) * (e["sign"] * u > e["above"])
        return s * e["sign"] * np.cumsum(gain * (t >= 0.0))
    return 0.0


def channel(e, theta, u, path, span):
    """The angle channel's signal after one effect; theta in wind-ups on the fine grid, span its range."""
    name, v, s, t = e["name"], e["variant"], e["s"], path["t"]
    now = path["clock"] + t
    if name == "sensor_lag":
        if v == "delay":
            return np.interp(t - s, t, theta)
        if v == "first_order":
            return lowpass(t, theta, s)
        if v == "two_pole":
            return lowpass(t, lowpass(t, theta, 0.6 * s), 0.4 * s)
        return np.mean([np.interp(t - s * q, t, theta) for q in np.linspace(0.0, 2.0, 9)], axis=0)
    if name == "thermal_drift":
        if v == "linear":
            return theta + s * e["sign"] * now / e["total"]
        if v == "warm_up":
            return theta - s * e["sign"] * np.exp(-np.maximum(now, 0.0) / e["tau"])
        if v == "room":
            return theta + s * np.sin(2.0 * np.pi * now / e["tau"] + e["phase"])
        return theta + s * CubicSpline(np.linspace(-0.3, 1.3, 11) * e["total"], e["knots"])(now)
    if name == "encoder_error":
        p = 2.0 * np.pi * (theta + path["zero"]) / (e["period"] * span) + e["phase"]
        if v == "sine":
            return theta + s * np.sin(p)
        if v == "two_harmonics":
            return theta + s * (0.8 * np.sin(p) + 0.5 * np.sin(2.0 * p + 1.0))
        if v == "quadrature":
            b = min(s * 2.0 * np.pi / (e["period"] * span), 0.6)
            back = np.arctan2(np.sin(p) * (1.0 - b) + 0.5 * b, np.cos(p) * (1.0 + b)) - np.arctan2(np.sin(p), np.cos(p))
            return theta + e["period"] * span / (2.0 * np.pi) * np.angle(np.exp(1j * back))
        return theta + s * np.arcsin(0.95 * np.sin(p))
    if name == "x_load_ripple":
        return theta + s * u * np.sin(2.0 * np.pi * theta / (e["period"] * span) + e["phase"])
    if name == "x_pump_pulsation":
        return theta + s * np.sin(2.0 * np.pi * t / e["period"] + e["phase"]) * (1.0 + 0.5 * np.sin(t / e["period"]))
    if name == "x_fixture_jump":
        return theta + s * e["sign"] * (now > e["at"] * e["total"])
    if name == "x_chip_in_mesh":
        at = e["place"] * span
        return theta + s * e["sign"] * np.exp(-0.5 * ((theta - at) / (e["length"] * span)) ** 2)
    if name == "x_lost_counts":
        return theta - s * np.sum([t > q * path["end"] for q in e["at"]], axis=0)
    return theta


def simulate(unit, rec, effects):
    """Noise-free angle of a record in wind-ups at its samples, with the given effects (empty: the clean unit)."""
    path = rec["path"]
    offset = 0.0
    for e in effects:
        if e["name"] == "torque_offset":
            offset += e["s"] * e["sign"] * (e["share"][rec["index"]] if e["variant"] == "tare_per_record" else 1.0)
    u = path["u"] + offset
    theta, inner = chain_angle(unit["chain"], u, path, effects, path["moving"])
    for e in effects:
        theta = theta + output_side(e, u, inner, path)
    span = unit["span"]
    for e in effects:
        theta = channel(e, theta, u, path, span)
    return np.interp(rec["ts"], path["t"], theta)


# ---------------------------------------------------------------------------------------------------------------------
# Protocols.


def leg_knots(style, a, b, leg, rng, shape):
    """Times and torques of one leg from a to b (the start excluded), lasting about leg seconds per unit of travel."""
    length = abs(b - a) * leg
    if style == "staircase":
        n = max(2, int(round(shape["steps"] * abs(b - a))))
        d = length / n
        t, u = [], []
        for i in range(n):
            v = a + (b - a) * (i + 1) / n
            t += [i * d + shape["ramp"] * d, (i + 1) * d]
            u += [v, v]
        return np.array(t), np.array(u)
    if style == "hand":
        n = int(rng.integers(8, 18))
        du = np.cumsum(rng.gamma(2.0, 1.0, n))
        dt = np.cumsum(rng.gamma(3.0, 1.0, n))
        t, u = list(length * dt / dt[-1]), list(a + (b - a) * du / du[-1])
        if shape["back"] and rng.uniform() < 0.6:
            i = int(rng.integers(2, n - 2))
            dip = u[i] - (b - a) * rng.uniform(0.02, 0.06)
            t.insert(i + 1, 0.6 * t[i] + 0.4 * t[i + 1])
            u.insert(i + 1, dip)
        return np.array(t), np.array(u)
    if style == "sine":
        q = np.linspace(0.0, 1.0, 241)[1:]
        if a == 0.0:
            return length * q, b * np.sin(0.5 * np.pi * q)
        if b == 0.0:
            return length * q, a * np.cos(0.5 * np.pi * q)
        return length * q, 0.5 * (a + b) + 0.5 * (a - b) * np.cos(np.pi * q)
    if style == "trapezoid":
        hold = shape["hold"] * leg
        return np.array([length, length + hold]), np.array([b, b])
    return np.array([length]), np.array([b])


def make_path(style, amplitude, leg, cycles, start, sign, rng, shape):
    """Knots of a record: times (recording starts at 0) and torques in rated torques. leg: seconds per rated torque."""
    a = sign * amplitude
    before = [a, -a, a] if start != "rest" else []
    if start == "cycled":
        before.append(0.0)
    after = ([-a, a] if start != "rest" else [a, -a, a]) + [-a, a] * (cycles - 1)
    t, u, now, mark = [0.0], [0.0], 0.0, 0.0
    for i, b in enumerate(before + after):
        if i == len(before):
            mark = now
        dt, v = leg_knots(style, u[-1], b, leg, rng, shape)
        t += list(now + dt)
        u += list(v)
        now += dt[-1]
    return np.array(t) - mark, np.array(u)


def sample_times(kind, end, n, rng):
    """n increasing sample times in [0, end]."""
    base = np.linspace(0.0, end, n)
    if kind == "random":
        base = np.sort(rng.uniform(0.0, end, n))
    elif kind == "jitter":
        base = np.sort(base + rng.normal(0.0, 0.25 * end / n, n))
    elif kind == "drifting":
        q = base / end
        base = end * (q + rng.choice([-1, 1]) * 0.25 * q * (1.0 - q))
    base = np.clip(base, 0.0, end)
    base[0] = 0.0
    return np.unique(base)


def make_record(index, style, amplitude, leg, clock, start, sampling, rng, shape, n, steps):
    """One record: its path on the fine grid, its sample times and what the key says about it."""
    cycles = int(rng.choice([1, 2, 3], p=[0.5, 0.3, 0.2]))
    tk, uk = make_path(style, amplitude, leg, cycles, start, int(rng.choice([-1, 1])), rng, shape)
    end = float(tk[-1])
    ts = sample_times(sampling, end, n, rng)
    t = np.unique(np.concatenate([tk, ts, np.linspace(tk[0], end, steps)]))
    u = np.interp(t, tk, uk)
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(u)))])
    rate = float(np.sum(np.abs(np.diff(uk))) / (tk[-1] - tk[0]))
    ramp = np.abs(np.diff(uk)) / np.diff(tk)
    local = ramp[np.clip(np.searchsorted(tk, t, side="left") - 1, 0, ramp.size - 1)]
    held = np.maximum.accumulate(np.where(local > 0.02 * rate, np.arange(t.size), 0))
    moving = np.maximum(local[held], 0.02 * rate)
    path = {"t": t, "u": u, "rate": rate, "moving": moving, "travel": travel, "end": end, "clock": clock, "zero": 0.0}
    return {"index": index, "path": path, "ts": ts, "tau": np.interp(ts, t, u), "amplitude": amplitude, "cycles": cycles,
            "start": start, "style": style}


def make_records(rng, style, fine):
    """Records of a unit: two to four, at different rates and in half of the units at different amplitudes.

    fine: sample and step finely enough to resolve single jumps.
    """
    n = int(rng.integers(2, 5))
    slow = log_uniform(rng, 15.0, 300.0)
    ratio = log_uniform(rng, 1.5, 3.0) if rng.uniform() < 0.12 else log_uniform(rng, 3.0, 30.0)
    legs = slow / ratio ** np.linspace(0.0, 1.0, n)
    rng.shuffle(legs)
    amplitude = np.ones(n)
    if rng.uniform() < 0.5:
        amplitude[1:] = np.sort(rng.uniform(0.35, 1.0, n - 1))[::-1]
        rng.shuffle(amplitude)
    sampling = str(rng.choice(["uniform", "random", "jitter", "drifting"], p=[0.5, 0.12, 0.2, 0.18]))
    shape = {"steps": rng.uniform(4, 10), "ramp": rng.uniform(0.2, 0.6), "hold": rng.uniform(0.15, 0.8),
             "back": rng.uniform() < 0.6}
    start = str(rng.choice(["rest", "tip", "cycled"], p=[0.55, 0.25, 0.2]))
    samples = log_uniform(rng, 5000.0 if fine else 600.0, 16000.0)
    records, clock = [], 0.0
    for i in range(n):
        count = int(np.clip(samples * rng.uniform(0.8, 1.25), 500, 20000))
        rec = make_record(i, style, float(amplitude[i]), float(legs[i]), clock, start, sampling, rng, shape, count,
                          60000 if fine else 5000)
        clock += rec["path"]["end"] * 1.02 + 5.0
        records.append(rec)
    return records, sampling, clock


# ---------------------------------------------------------------------------------------------------------------------
# Effects: variants, their parameters, and the search for the size.

VARIANTS = {
    "interface_slip": ["clamp", "distributed", "key_gap", "spline_return"],
    "viscoelastic_creep": ["kelvin", "mesh", "spectrum", "threshold", "cubic"],
    "asymmetric_stiffness": ["flank", "thrust", "bracket"],
    "second_backlash": ["drag_relay", "stage_behind", "two_keys", "preloaded_gap"],
    "sensor_lag": ["delay", "first_order", "two_pole", "moving_mean"],
    "thermal_drift": ["linear", "warm_up", "room", "wander"],
    "torque_offset": ["dead_weight", "zero_error", "tare_per_record"],
    "encoder_error": ["sine", "two_harmonics", "quadrature", "triangle"],
    "stick_slip": ["seal", "mesh", "ageing", "random_static"],
    "rate_dependent_friction": ["log_mean", "log_local", "stribeck", "viscous"],
    "x_load_ripple": ["mesh_stiffness"],
    "x_pump_pulsation": ["beating"],
    "x_fixture_jump": ["single"],
    "x_grease_channels": ["exponential"],
    "x_chip_in_mesh": ["bump"],
    "x_snap_through": ["one_sided"],
    "x_ratchet_set": ["plastic"],
    "x_lost_counts": ["one_way"],
    "x_dither_release": ["shocks"],
    "x_warming_compliance": ["exponential"],
    "x_sudden_crack": ["single"],
}
LISTED = [name for name in VARIANTS if not name.startswith("x_")]
UNLISTED = [name for name in VARIANTS if name.startswith("x_")]
LIMITS = {  # largest s that is still physical; where absent, 3 wind-ups (or a factor of 4)
    "asymmetric_stiffness": 1.0, "torque_offset": 0.12, "stick_slip": 0.25, "rate_dependent_friction": 0.6,
    "x_dither_release": 0.95, "x_warming_compliance": 0.5, "x_sudden_crack": 0.6, "x_grease_channels": 1.5,
}
STARTS = {"sensor_lag": 0.05, "x_dither_release": 0.3}


def draw_effect(name, variant, rng, records, total):
    """Parameters of an effect except its scale s."""
    legs = [r["path"]["end"] / (4 * r["cycles"]) for r in records]
    sign = int(rng.choice([-1, 1]))
    e = {"name": name, "variant": variant, "s": 0.0, "sign": sign}
    if name == "interface_slip":
        e["hold"] = float(rng.uniform(0.55, 0.85)) * max(r["amplitude"] for r in records)
    elif name == "viscoelastic_creep":
        e["tau"] = log_uniform(rng, 0.15 * min(legs), 1.0 * max(legs))
        e["limit"] = float(rng.uniform(0.1, 0.4))
    elif name == "asymmetric_stiffness":
        e["knee"] = float(rng.uniform(0.1, 0.4))
    elif name == "second_backlash":
        e["drag"] = float(rng.uniform(0.15, 0.55)) * min(r["amplitude"] for r in records)
        e["width"] = float(rng.uniform(0.02, 0.08))
    elif name == "thermal_drift":
        e["total"] = total
        e["tau"] = float(rng.uniform(0.2, 0.8)) * total
        e["phase"] = float(rng.uniform(0.0, 2.0 * np.pi))
        e["knots"] = np.cumsum(rng.normal(0.0, 0.5, 11))
    elif name == "torque_offset":
        e["share"] = rng.uniform(0.4, 1.6, len(records))
    elif name == "encoder_error":
        e["period"] = 1.0 / log_uniform(rng, 3.0, 15.0)
        e["phase"] = float(rng.uniform(0.0, 2.0 * np.pi))
    elif name == "stick_slip":
        e["over"] = float(rng.uniform(0.3, 1.0))
        e["age"] = 0.3 * min(legs) if variant == "ageing" else 0.0
        e["draw"] = rng.exponential(1.0, 97) ** 1.5 if variant == "random_static" else np.ones(1)
    elif name == "rate_dependent_friction":
        e["rate0"] = float(np.exp(np.mean([np.log(r["path"]["rate"]) for r in records])))
        if variant in ("stribeck", "viscous"):
            e["sign"] = 1
    elif name == "x_load_ripple":
        e["period"], e["phase"] = 1.0 / log_uniform(rng, 5.0, 16.0), float(rng.uniform(0.0, 2.0 * np.pi))
    elif name == "x_pump_pulsation":
        seen = 8.0 * max(r["path"]["end"] / r["ts"].size for r in records)
        e["period"] = max(min(legs) / float(rng.uniform(1.0, 8.0)), seen)
        e["phase"] = float(rng.uniform(0.0, 2.0 * np.pi))
    elif name in ("x_fixture_jump", "x_sudden_crack"):
        rec = records[int(rng.integers(len(records)))]
        e["at"] = (rec["path"]["clock"] + float(rng.uniform(0.3, 0.7)) * rec["path"]["end"]) / total
        e["total"] = total
    elif name == "x_grease_channels":
        e["wear"] = float(rng.uniform(2.0, 6.0))
    elif name == "x_chip_in_mesh":
        e["place"], e["length"] = sign * float(rng.uniform(0.1, 0.35)), float(rng.uniform(0.02, 0.06))
    elif name == "x_snap_through":
        e["up"] = float(rng.uniform(0.4, 0.8)) * min(r["amplitude"] for r in records)
        e["down"] = e["up"] * float(rng.uniform(0.3, 0.8))
    elif name == "x_ratchet_set":
        e["above"] = float(rng.uniform(0.4, 0.75)) * min(r["amplitude"] for r in records)
    elif name == "x_lost_counts":
        e["at"] = np.sort(rng.uniform(0.1, 0.95, int(rng.integers(2, 6))))
    elif name == "x_dither_release":
        e["at"], e["length"] = np.sort(rng.uniform(0.08, 0.95, int(rng.integers(4, 9)))), float(rng.uniform(0.004, 0.01))
    elif name == "x_warming_compliance":
        e["tau"] = float(rng.uniform(0.3, 1.0)) * max(r["path"]["end"] for r in records)
    return e


def change_rms(unit, effects, refit=True):
    """Rms change of the angle by the effects in units of the noise, after an affine refit per record (or without)."""
    total, n = 0.0, 0
    for rec in unit["records"]:
        y, base = simulate(unit, rec, effects), rec["clean"]
        d = y - base
        if refit:
            d = d - d.mean()
            b = base - base.mean()
            d = d - b * (d @ b) / (b @ b)
        total += float(d @ d)
        n += d.size
    return math.sqrt(total / n) / unit["noise"]


def scale_effect(unit, e, target, refit=True, tolerance=0.03):
    """Sets s so that the change has the target rms; the rms reached, or None where s would be unphysical."""
    limit = LIMITS.get(e["name"], 3.0)
    if e["name"] == "sensor_lag":
        limit = 0.25 * min(r["path"]["end"] / (4 * r["cycles"]) for r in unit["records"])
    if e["name"] == "encoder_error":
        limit = 0.9 * e["period"] * unit["span"] / (2.0 * np.pi)
    s, low, high = STARTS.get(e["name"], 0.02), 0.0, limit
    s = min(s, 0.5 * limit)
    for _ in range(16):
        e["s"] = s
        got = change_rms(unit, [e], refit)
        if abs(got / target - 1.0) < tolerance:
            return got
        if got < target:
            low = s
        else:
            high = s
        if low >= 0.98 * limit:
            return None
        s = s * target / got if got > 1e-9 else s * 10.0
        if not low < s < high:
            s = 0.5 * (low + high) if high < limit or low > 0.3 * limit else min(0.99 * limit, max(s, low))
    return None


def resolved(unit, e):
    """Whether the records sample the jumps of stick-slip at least four times each on average; True for other effects."""
    if e["name"] != "stick_slip":
        return True
    travel = sum(float(r["path"]["travel"][-1]) for r in unit["records"])
    return 4.0 * travel / (e["s"] * (1.0 + e["over"]) * float(np.mean(e["draw"]))) < sum(r["ts"].size for r in unit["records"])


# ---------------------------------------------------------------------------------------------------------------------
# Units.


def settled_loop(chain, amplitude, n=1500, cycles=3):
    """Torque and deflection of the virgin leg and some cycles of a clean triangle; n steps per leg of one amplitude."""
    up = np.linspace(-amplitude, amplitude, 2 * n + 1)
    u = np.concatenate([up[n:], *([up[::-1][1:], up[1:]] * cycles)])
    path = {"t": np.arange(u.size, dtype=float), "rate": 1.0, "end": float(u.size), "clock": 0.0}
    x, _ = chain_angle(chain, u, path, [], np.ones(u.size))
    return u, x


def indicators(unit, amplitude):
    """Indicators of the clean settled loop of an amplitude (in rated torques), in SI units."""
    n = 1500
    u, x = settled_loop(unit["chain"], amplitude, n)
    last = u.size - 1
    rise = slice(last - 2 * n, last + 1)
    fall = slice(last - 4 * n, last - 2 * n + 1)
    grid = u[rise]
    plus, minus = x[rise] * unit["scale"], x[fall][::-1] * unit["scale"]
    mean, k = 0.5 * (plus + minus), unit["k"]
    torque = grid * unit["rated"]
    area = float(np.trapezoid(minus - plus, torque))
    ahead = grid >= 0.0
    absorbed = float(np.trapezoid(torque[ahead], plus[ahead]) + np.trapezoid(torque[~ahead | (grid == 0.0)][::-1],
                                                                            minus[~ahead | (grid == 0.0)][::-1]))
    return {"lost_motion_rad": float(np.interp(k, grid, mean) - np.interp(-k, grid, mean)),
            "backlash_rad": float(np.interp(0.0, grid, minus - plus)), "area_J": area, "absorbed_J": absorbed,
            "dissipation_ratio": area / absorbed, "peak_rad": float(0.5 * (plus[-1] - plus[0]))}


def draw_unit(name, style, rng, fine=False):
    """A reducer with its protocol, its clean angles and its noise; fine as in make_records."""
    unit = build_reducer(name, rng)
    unit["records"], unit["sampling"], unit["total"] = make_records(rng, style, fine)
    unit["style"] = style
    _, x = settled_loop(unit["chain"], 1.0)
    unit["span"] = float(x.max() - x.min())
    unit["snr"] = log_uniform(rng, 200.0, 600.0 if fine else 3000.0)
    unit["noise"] = 0.5 * unit["span"] / unit["snr"]
    for rec in unit["records"]:
        rec["path"]["zero"] = float(rng.uniform(0.0, 1.0)) * unit["span"]
        rec["clean"] = simulate(unit, rec, [])
    return unit


def ornstein_uhlenbeck(n, steps, rng):
    """Stationary correlated noise of unit variance with a correlation time in samples."""
    a = math.exp(-1.0 / steps)
    start = rng.normal()
    w = rng.normal(size=n) * math.sqrt(1.0 - a * a)
    return lfilter([1.0], [1.0, -a], w, zi=np.array([a * start]))[0]


def write_unit(unit, effects, folder, rng):
    """Writes unit.toml and the records; the part of the key that describes the channels and the records."""
    folder.mkdir(parents=True, exist_ok=True)
    rated, scale = unit["rated"], unit["scale"]
    noise = unit["noise"] * scale
    share = float(rng.choice([0.0, 0.0, 0.0, 0.2, 0.4, 0.6]))
    steps = float(rng.uniform(3.0, 30.0))
    torque_noise = rated * min(log_uniform(rng, 2e-5, 2e-4), 0.5 / unit["snr"])
    quantum_angle = quantum_torque = 0.0
    if rng.uniform() < 0.25:
        which = int(rng.integers(3))
        quantum_angle = noise * log_uniform(rng, 0.5, 2.5) if which != 1 else 0.0
        quantum_torque = rated * log_uniform(rng, 1e-4, 8e-4) if which != 0 else 0.0
    gaps = bool(rng.uniform() < 0.15)
    shifted = rng.uniform() < 0.4
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{folder.name}"', f"rated_torque_Nm = {rated:.6g}"]
    key = []
    for rec in unit["records"]:
        n = rec["ts"].size
        angle = simulate(unit, rec, effects) * scale
        torque = rec["tau"] * rated
        for e in effects:
            if e["name"] == "torque_offset" and e["variant"] == "zero_error":  # the sensor errs, the load is centred
                off = e["s"] * e["sign"]
                moved = dict(rec, path=dict(rec["path"], u=rec["path"]["u"] - off))
                angle, torque = simulate(unit, moved, effects) * scale, torque - off * rated
        white = rng.normal(size=n)
        angle = angle + noise * (math.sqrt(1.0 - share) * white + math.sqrt(share) * ornstein_uhlenbeck(n, steps, rng))
        torque = torque + torque_noise * rng.normal(size=n)
        if shifted:
            angle = angle + rec["path"]["zero"] * scale * 0.2
        if quantum_angle:
            angle = np.round(angle / quantum_angle) * quantum_angle
        if quantum_torque:
            torque = np.round(torque / quantum_torque) * quantum_torque
        keep = np.ones(n, dtype=bool)
        if gaps:
            for _ in range(int(rng.integers(1, 4))):
                a = int(rng.integers(n // 20, n - n // 20))
                keep[a:a + max(2, int(n * rng.uniform(0.004, 0.02)))] = False
        file = f"rec-{rec['index'] + 1}.csv"
        with open(folder / file, "w", encoding="ascii", newline="\n") as f:
            f.write("time_s,torque_Nm,angle_arcmin\n")
            table = np.column_stack([rec["ts"], torque, angle / ARCMIN])[keep]
            np.savetxt(f, table, fmt=["%.12g", "%.9g", "%.9g"], delimiter=",")
        rate = rec["path"]["rate"] * rated
        amplitude = rec["amplitude"] * rated
        lines += ["", "[[record]]", f'file = "{file}"', f"loading_rate_Nm_per_s = {rate:.6g}", f"amplitude_Nm = {amplitude:.6g}"]
        ind = indicators(unit, rec["amplitude"])
        key.append({"file": file, "amplitude_Nm": amplitude, "rate_Nm_per_s": rate, "style": rec["style"], "start": rec["start"],
                    "cycles": rec["cycles"], "samples": int(keep.sum()), "snr": ind["peak_rad"] / noise, "indicators": ind})
    (folder / "unit.toml").write_text("\n".join(lines) + "\n", encoding="ascii")
    return {"rated_torque_Nm": rated, "k": unit["k"], "snr": unit["snr"], "noise_rad": noise, "noise_correlated_share": share,
            "torque_noise_Nm": torque_noise, "sampling": unit["sampling"], "quantum_angle_rad": quantum_angle,
            "quantum_torque_Nm": quantum_torque, "gaps": gaps, "records": key}


def plan(units, rng):
    """List of (kind, [(effect, variant, size), ...]) in the proportions 24 : 30 : 16 : 10, shuffled."""
    singles, pairs = round(units * 30 / 80), round(units * 10 / 80)
    strange = round(units * 16 / 80)
    order = {name: list(rng.permutation(VARIANTS[name])) for name in VARIANTS}
    count = dict.fromkeys(VARIANTS, 0)

    def pick(name):
        count[name] += 1
        return str(order[name][(count[name] - 1) % len(order[name])])

    jobs = []
    for i in range(singles):
        name = LISTED[i % len(LISTED)]
        jobs.append(("single", [(name, pick(name), (1.0, 0.4, 0.2)[(i // len(LISTED)) % 3])]))
    odd = list(rng.permutation(UNLISTED))
    for i in range(strange):
        name = str(odd[i % len(odd)])
        jobs.append(("unlisted", [(name, pick(name), (1.0, 0.4)[i % 2])]))
    ring = [str(n) for n in rng.permutation(LISTED)]
    for i in range(pairs):
        both = sorted([ring[i % len(ring)], ring[(i + 1 + i // len(ring)) % len(ring)]])
        jobs.append(("pair", [(name, pick(name), 1.0) for name in both]))
    jobs += [("clean", [])] * (units - len(jobs))
    return [jobs[i] for i in rng.permutation(len(jobs))]


def plain(value):
    """A value as JSON can hold it."""
    if isinstance(value, np.ndarray):
        return [float(v) for v in value]
    return value


def make_unit(job, family, style, seed, index, folder, level):
    """Draws a unit until its effects reach their sizes, writes it, and returns its entry of the key."""
    kind, wanted = job
    fine = any(name == "stick_slip" for name, _, _ in wanted)
    for attempt in range(1, 61):
        rng = np.random.default_rng([seed, index, attempt])
        if attempt > 5:
            family = str(rng.choice(list(FAMILIES)))
        unit = draw_unit(family, style, rng, fine)
        effects, rms = [], {}
        for name, variant, size in wanted:
            e = draw_effect(name, variant, rng, unit["records"], unit["total"])
            got = scale_effect(unit, e, level * size)
            if got is None or not resolved(unit, e):
                break
            e["size"] = size
            effects.append(e)
            rms[name] = got
        if len(effects) == len(wanted):
            break
    else:
        raise RuntimeError(f"no unit found for {wanted}")
    if len(effects) > 1:
        rms["together"] = change_rms(unit, effects)
    traces, traced = [], {}
    names = [e["name"] for e in effects]
    for name in TRACE_NAMES:
        if name in names or rng.uniform() < 0.15:
            continue
        e = draw_effect(name, VARIANTS[name][0], rng, unit["records"], unit["total"])
        got = scale_effect(unit, e, float(rng.uniform(0.02, 0.09)), refit=False, tolerance=0.08)
        if got is not None:
            traces.append(e)
            traced[name] = got
    key = {"effects": names, "size": None, "reducer": family, "style": style,
           "variant": {e["name"]: {k: plain(v) for k, v in e.items() if k != "name"} for e in effects},
           "rms": {**rms, "traces": traced}}
    if len(wanted) == 1:
        key["size"] = wanted[0][2]
    elif wanted:
        key["size"] = {name: size for name, _, size in wanted}
    key.update(write_unit(unit, effects + traces, folder, rng))
    key.update({"kind": kind, "attempts": attempt})
    return key


def main():
    """Writes the units and the key."""
    parser = argparse.ArgumentParser(description="Ninth outside bench: virtual gear reducers with a withheld key.")
    parser.add_argument("out", type=Path)
    parser.add_argument("--units", type=int, default=80)
    parser.add_argument("--seed", type=int, default=91)
    parser.add_argument("--level", type=float, default=LEVEL, help="rms of an effect of size 1, in noise deviations")
    args = parser.parse_args()
    rng = np.random.default_rng([args.seed, 0])
    jobs = plan(args.units, rng)
    turn = {"clean": 0, "other": 0}
    deck = {group: [str(n) for n in rng.permutation(list(FAMILIES))] for group in turn}
    styles = rng.choice(["triangle", "sine", "trapezoid", "hand", "staircase"], args.units, p=[0.4, 0.2, 0.16, 0.12, 0.12])
    key = {}
    for i, job in enumerate(jobs):
        group = "clean" if job[0] == "clean" else "other"
        family = deck[group][turn[group] % len(FAMILIES)]
        turn[group] += 1
        case = f"case-{i + 1:02d}"
        key[case] = make_unit(job, family, str(styles[i]), args.seed, i + 1, args.out / case, args.level)
    (args.out / "key.json").write_text(json.dumps(key, indent=1) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
