"""Tenth outside bench: written without sight of the package it tests, with reducer mechanics of its own.

A virtual test bench for gear reducers: the input shaft is locked, the output shaft is loaded, and the output angle is
recorded against the torque. Nine families of reducers, different in kind: a Bouc-Wen lattice with a slip-lock (pinching), a
gear train of Hertz meshes behind drags that grow with the load, a cycloidal drive solved pin by pin, planetary stages with
unequal planets, a strain wave drive with wave-generator kinematics behind a spectrum of plays, a self-locking worm with
axial float, a Preisach density, an elastomer member with Berg friction, and a splined shaft with Mindlin micro-slip. Every
clean reducer is odd-symmetric, rate-independent and settles after first loading. Effects act in the reducer where they have
a mechanism there (a node in front of it, a member in series), and on the channels otherwise.

Run it with ``python tenth_outside_bench.py OUT --units 80 --seed 101``. It writes ``OUT/case-01`` and so on (``unit.toml``
and one CSV file per record) and ``OUT/key.json`` (the truth). The same seed gives the same bytes.

Severity: ``rms`` in the key is the rms, over all samples of a unit, of the change of the noise-free angle that remains after
a scale and an offset were refitted in each record, divided by the standard deviation of the angle noise. An effect of size
``s`` has rms ``LEVEL * s`` (option ``--level``). Traces of channel effects have sizes 0.05 to 0.1 of an effect of size 1.0;
they are scaled and given as plain rms, without any refit (option ``--trace`` multiplies them).

Indicators: ``indicators`` of a record is the truth about the reducer as it stands, from its noise-free settled loop at the
amplitude of the record (triangle at the rate of the record): the clean reducer with those effects that are part of it
(``PARTS``), without channel effects, traces, stick-slip or what never settles. ``indicators_clean`` is the same for the
clean reducer alone; it differs only where a unit has an effect in ``PARTS``. Lost motion is taken at ``k`` times the rated
torque, ``backlash_rad`` is the width at zero torque, ``peak_rad`` half the range of the angle; ``snr`` is peak over noise.
"""

import argparse
import json
import math
from pathlib import Path

import numpy as np
from numba import njit

LEVEL = 3.0
ARCMIN = math.pi / 10800.0
LISTED = ("torque_offset", "sensor_lag", "encoder_error", "thermal_drift", "viscoelastic_creep", "rate_dependent_friction",
          "asymmetric_stiffness", "stick_slip", "second_backlash", "interface_slip")
UNLISTED = ("x_cycle_ratchet", "x_running_in", "x_mesh_wave_with_load", "x_one_sided_gap", "x_gain_step", "x_lost_counts",
            "x_debris_bump", "x_clock_skew")
CHANNEL = ("torque_offset", "sensor_lag", "thermal_drift", "encoder_error")
PARTS = ("viscoelastic_creep", "rate_dependent_friction", "asymmetric_stiffness", "second_backlash", "interface_slip",
         "x_mesh_wave_with_load", "x_one_sided_gap")


# ---- Kernels: torque (in parts of the rated torque) goes in, an inner torque or an angle comes out, from the virgin state.

@njit(cache=False)
def load_play(x, drag, mu, out, weight):
    """Add to ``out`` the torque that passes a node whose friction is ``drag[i] + mu * |passed torque|``."""
    y = 0.0
    for i in range(x.size):
        low, high = x[i] - drag[i], x[i] + drag[i]
        low = low / (1.0 + mu) if low > 0.0 else low / (1.0 - mu)
        high = high / (1.0 - mu) if high > 0.0 else high / (1.0 + mu)
        y = min(max(y, low), high)
        out[i] += weight * y


@njit(cache=False)
def bouc_wen(x, alpha, beta, power, yield_at):
    """Torque-driven Bouc-Wen element; returns its angle and its hysteretic variable (in parts of its limit)."""
    angle, hyst = np.zeros(x.size), np.zeros(x.size)
    phi, last = 0.0, 0.0
    for i in range(x.size):
        step = (x[i] - last) / 4.0
        for j in range(4):
            slope = 0.0
            base = phi
            for k in range(2):
                at = last + (j + 0.5 * k) * step
                z = (at - alpha * base) / (1.0 - alpha) / yield_at
                turn = 1.0 if z * step > 0.0 else -1.0
                grow = 1.0 - min(abs(z), 1.0) ** power * (beta + (1.0 - beta) * turn)
                slope = 1.0 / (alpha + (1.0 - alpha) * grow)
                base = phi + 0.5 * slope * step
            phi += slope * step
        last = x[i]
        angle[i] = phi
        hyst[i] = (last - alpha * phi) / (1.0 - alpha) / yield_at
    return angle, hyst


@njit(cache=False)
def contact_state(phi, start, arm, gap, stiff, power, weak, shear, hold, mu, force, new):
    """Torque of contacts with gaps plus a sticking-sliding contact (limit grows with its load) beside each of them."""
    total = weak * phi
    size = abs(phi)
    for i in range(arm.size):
        over = size * arm[i] - gap[i]
        normal = stiff[i] * arm[i] * over ** power if over > 0.0 else 0.0
        total += normal if phi > 0.0 else -normal
        limit = hold[i] + mu[i] * normal
        f = force[i] + shear[i] * (phi - start)
        f = min(max(f, -limit), limit)
        new[i] = f
        total += f
    return total


@njit(cache=False)
def contacts(x, arm, gap, stiff, power, weak, shear, hold, mu):
    """Angle of a set of parallel contacts under the torque ``x`` (bisection by false position, every sample)."""
    out = np.zeros(x.size)
    force, new = np.zeros(arm.size), np.zeros(arm.size)
    phi, rate = 0.0, 1.0
    for i in range(x.size):
        start = phi
        at = contact_state(phi, start, arm, gap, stiff, power, weak, shear, hold, mu, force, new) - x[i]
        width = max(abs(at) * rate, 1e-9)
        a, fa = phi, at
        b, fb = phi, at
        for _ in range(60):
            b = a - width if at > 0.0 else a + width
            fb = contact_state(b, start, arm, gap, stiff, power, weak, shear, hold, mu, force, new) - x[i]
            if fb * fa <= 0.0:
                break
            width *= 2.0
        for n in range(80):
            if abs(fb - fa) < 1e-15 or abs(b - a) < 1e-11:
                break
            c = (a * fb - b * fa) / (fb - fa) if n % 3 != 2 else 0.5 * (a + b)
            fc = contact_state(c, start, arm, gap, stiff, power, weak, shear, hold, mu, force, new) - x[i]
            if abs(fc) < 1e-11:
                a, fa, b, fb = c, fc, c, fc
                break
            if fc * fa <= 0.0:
                b, fb = c, fc
            else:
                a, fa = c, fc
        phi = 0.5 * (a + b)
        contact_state(phi, start, arm, gap, stiff, power, weak, shear, hold, mu, force, new)
        force[:] = new
        if i > 0 and abs(x[i] - x[i - 1]) > 1e-12:
            rate = max(abs(phi - start) / abs(x[i] - x[i - 1]), 1e-3)
        out[i] = phi
    return out


@njit(cache=False)
def berg(x, k1, k3, limit, half):
    """Elastomer member: odd stiffening beside Berg's friction (a hyperbola; doubled from a reversal on, with memory)."""
    out = np.zeros(x.size)
    turn_x, turn_phi, turn_f = np.zeros(4000), np.zeros(4000), np.zeros(4000)
    m, phi, force, last, sign = 0, 0.0, 0.0, 0.0, 0.0
    for i in range(x.size):
        step = x[i] - last
        if step == 0.0:
            out[i] = phi
            continue
        now = 1.0 if step > 0.0 else -1.0
        if now != sign and sign != 0.0 and m < 3999:
            turn_x[m], turn_phi[m], turn_f[m] = last, phi, force
            m += 1
        sign, last = now, x[i]
        while m >= 2 and now * (x[i] - turn_x[m - 2]) >= 0.0:
            m -= 2
        if m == 1 and now * x[i] >= abs(turn_x[0]):
            m = 0
        part, origin, held = 1.0, 0.0, 0.0
        if m > 0:
            part, origin, held = 2.0, turn_phi[m - 1], turn_f[m - 1]
        low, high = 0.0, abs(x[i] - held) / k1 + 2.0 * abs(origin) + 1.0
        for _ in range(60):
            way = 0.5 * (low + high)
            phi = origin + now * way
            force = held + now * part * limit * way / (part * half + way)
            if now * (k1 * phi + k3 * phi * phi * phi + force - x[i]) > 0.0:
                high = way
            else:
                low = way
        out[i] = phi
    return out


@njit(cache=False)
def everett(table, span, a, b, limit):
    """Everett function: bilinear from a table, or Mindlin's micro-slip law if the table is empty."""
    if table.shape[0] < 2:
        return 1.0 - (1.0 - min(0.5 * (a - b) / limit, 0.9999)) ** (2.0 / 3.0)
    n = table.shape[0] - 1
    u = min(max((a + span) / (2.0 * span), 0.0), 0.999999) * n
    v = min(max((b + span) / (2.0 * span), 0.0), 0.999999) * n
    i, j = int(u), int(v)
    u, v = u - i, v - j
    return ((1.0 - u) * ((1.0 - v) * table[i, j] + v * table[i, j + 1])
            + u * ((1.0 - v) * table[i + 1, j] + v * table[i + 1, j + 1]))


@njit(cache=False)
def nested_memory(x, table, span, limit):
    """Hysteresis with a memory of its reversals (Madelung's rules), from its virgin curve."""
    out = np.zeros(x.size)
    turn_x, turn_f = np.zeros(4000), np.zeros(4000)
    m, last, value, sign = 0, 0.0, 0.0, 0.0
    for i in range(x.size):
        step = x[i] - last
        if step == 0.0:
            out[i] = value
            continue
        now = 1.0 if step > 0.0 else -1.0
        if now != sign and sign != 0.0 and m < 3999:
            turn_x[m], turn_f[m] = last, value
            m += 1
        sign, last = now, x[i]
        while m >= 2 and now * (x[i] - turn_x[m - 2]) >= 0.0:
            m -= 2
        if m == 1 and now * x[i] >= abs(turn_x[0]):
            m = 0
        if m == 0:
            value = math.copysign(everett(table, span, abs(x[i]), -abs(x[i]), limit), x[i])
        elif now > 0.0:
            value = turn_f[m - 1] + 2.0 * everett(table, span, x[i], turn_x[m - 1], limit)
        else:
            value = turn_f[m - 1] - 2.0 * everett(table, span, turn_x[m - 1], x[i], limit)
        out[i] = value
    return out


@njit(cache=False)
def first_order(t, x, time_constant):
    """First-order follower on an uneven time axis, at rest at the first sample."""
    out = np.zeros(x.size)
    out[0] = x[0]
    for i in range(1, x.size):
        r = (t[i] - t[i - 1]) / time_constant
        e = math.exp(-r)
        gain = (1.0 - e) / r
        out[i] = e * out[i - 1] + (gain - e) * x[i - 1] + (1.0 - gain) * x[i]
    return out


@njit(cache=False)
def sticking(x, level, over, draws, age, t, hold):
    """Node that sticks until its level is passed and then jumps ``over`` the torque by a part of that level."""
    out = np.zeros(x.size)
    y, n, since = 0.0, 0, t[0]
    for i in range(x.size):
        now = level * draws[n % draws.size]
        if age > 0.0:
            now *= 1.0 + age * math.log1p((t[i] - since) / hold)
        gap = x[i] - y
        if abs(gap) > now:
            y = x[i] + over * now * (1.0 if gap > 0.0 else -1.0)
            n += 1
            since = t[i]
        out[i] = y
    return out


@njit(cache=False)
def clamp_creepage(x, start, power):
    """Slip of a clamp that moves only above its torque and only while the load grows; it stays until it is reversed."""
    out = np.zeros(x.size)
    s = 0.0
    for i in range(1, x.size):
        step = x[i] - x[i - 1]
        over = abs(0.5 * (x[i] + x[i - 1])) - start
        if over > 0.0 and step * x[i] > 0.0:
            s += over ** power * step
        out[i] = s
    return out


def soft_node(x, drag, mu, spread, scale=1.0):
    """Friction node with a spread of drags: the mean of six load-dependent plays side by side."""
    out = np.zeros_like(x)
    share = np.linspace(-1.0, 1.0, 6)
    for s in share:
        load_play(x, np.ascontiguousarray(np.broadcast_to(drag * (1.0 + spread * s) * scale, x.shape)),
                  mu * (1.0 + spread * s), out, 1.0 / share.size)
    return out


# ---- Reducers: each function draws one and returns a function from torque (parts of the rated torque) to angle (any unit).

def draw(rng, low, high):
    """Log-uniform draw."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def bouc_wen_lattice(rng):
    """One or two Bouc-Wen members; a slip-lock (Baber and Noori) opens where the hysteretic force passes zero."""
    n = int(rng.integers(1, 3))
    alpha = rng.uniform(0.25, 0.7, n)
    beta = rng.uniform(0.35, 0.8, n)
    power = rng.uniform(1.0, 2.2, n)
    limit = rng.uniform(0.1, 0.6, n)
    pinch, sharp = draw(rng, 0.02, 0.6), rng.uniform(0.12, 0.4)
    cubic = rng.uniform(-0.3, 0.1)

    def run(x):
        out = x / (1.0 + 2.0 * cubic * x * x)
        for i in range(n):
            phi, hyst = bouc_wen(x, alpha[i], beta[i], power[i], limit[i])
            out = out + phi / n
            if i == 0:
                out = out + pinch * np.tanh(hyst / sharp)
        return out
    return run


def hertz_curve(rng, teeth, clearance):
    """Angle of a mesh against its torque: teeth touch one after the other, each a Hertz contact; weak centring in the gap."""
    gap = clearance * (1.0 + rng.uniform(0.0, 1.0) * np.sort(rng.uniform(0.0, 1.0, teeth)))
    stiff = rng.uniform(0.6, 1.6, teeth)
    power = rng.uniform(1.1, 1.5)
    weak = rng.uniform(0.01, 0.06) / max(clearance, 1e-6)
    phi = np.concatenate([np.linspace(0.0, clearance * 2.2, 3000), clearance * 2.2 + np.geomspace(1e-4, 6.0, 3000)])
    load = weak * np.minimum(phi, clearance) + np.sum(
        stiff[:, None] * np.maximum(phi[None, :] - gap[:, None], 0.0) ** power, axis=0)
    load += 1e-9 * np.arange(phi.size)
    scale = load[-1] if load[-1] < 1.5 else 1.5
    keep = load <= scale * 1.3
    return lambda y: np.sign(y) * np.interp(np.abs(y), load[keep], phi[keep])


def gear_train(rng):
    """Shafts and two or three meshes in a row; bearings and flanks between them pass on only what exceeds their friction."""
    stages = int(rng.integers(2, 4))
    drag = [draw(rng, 0.004, 0.12) for _ in range(stages)]
    mu = [rng.uniform(0.02, 0.2) for _ in range(stages)]
    spread = [rng.uniform(0.3, 0.9) for _ in range(stages)]
    size = draw(rng, 0.01, 0.9)
    mesh = [hertz_curve(rng, int(rng.integers(2, 6)), size * rng.uniform(0.3, 1.0) / (i + 1)) for i in range(stages)]
    shaft = rng.uniform(0.1, 0.9, stages + 1)
    weight = rng.uniform(0.3, 1.0, stages)

    def run(x):
        out = shaft[0] * x
        y = x
        for i in range(stages):
            y = soft_node(y, drag[i], mu[i], spread[i])
            out = out + shaft[i + 1] * y + weight[i] * mesh[i](y)
        return out
    return run


def cycloid_pins(rng):
    """Cycloidal disc on many pins with sinusoidal arms and profile gaps; friction at each pin goes with its own load."""
    pins = int(rng.integers(10, 19))
    at = (np.arange(pins) + rng.uniform(0.3, 0.7)) / pins * math.pi
    eccentric = rng.uniform(0.3, 0.6)
    arm = np.sin(at) / np.sqrt(1.0 + eccentric ** 2 - 2.0 * eccentric * np.cos(at))
    gap = draw(rng, 0.005, 0.6) * (0.3 + (1.0 - np.sin(at)) ** rng.uniform(1.0, 2.0)) + rng.uniform(0.0, 0.02, pins)
    stiff = np.full(pins, 4.0 / pins)
    mu = rng.uniform(0.04, 0.25) * rng.uniform(0.7, 1.3, pins)
    hold = draw(rng, 0.01, 0.12) / pins * rng.uniform(0.4, 1.6, pins)
    shear = rng.uniform(2.0, 8.0) / pins * rng.uniform(0.3, 2.5, pins)
    power, weak = rng.uniform(1.0, 1.15), rng.uniform(0.03, 0.2)
    rollers, roll_drag = rng.uniform(0.2, 0.8), draw(rng, 0.005, 0.05)
    roll_gap, roll_width = draw(rng, 0.003, 0.15), rng.uniform(0.03, 0.1)

    def run(x):
        disc = contacts(x, arm, gap, stiff, power, weak, shear, hold, mu)
        y = soft_node(x, roll_drag, 0.03, 0.6)
        return disc + rollers * y + roll_gap * np.tanh(y / roll_width)
    return run


def planet_stages(rng):
    """Two stages in a row, each with three to five planets of unequal pin clearance which come to share the load."""
    stage = []
    for _ in range(2):
        n = int(rng.integers(3, 6))
        gap = draw(rng, 0.01, 0.25) * rng.uniform(0.1, 1.0, n)
        stiff = rng.uniform(0.6, 1.4, n) * 1.6 / n
        hold = draw(rng, 0.01, 0.12) / n * rng.uniform(0.3, 1.7, n)
        mu = rng.uniform(0.03, 0.25) * rng.uniform(0.6, 1.4, n)
        shear = rng.uniform(1.0, 6.0) / n * rng.uniform(0.3, 2.5, n)
        stage.append((np.ones(n), gap, stiff, rng.uniform(1.0, 1.35), rng.uniform(0.02, 0.25), shear, hold, mu,
                      rng.uniform(0.3, 1.0)))
    carrier, seat = rng.uniform(0.1, 0.6), draw(rng, 0.01, 0.05)

    def run(x):
        y = soft_node(x, seat, 0.02, 0.8)
        out = carrier * x
        for k, (arm, gap, stiff, power, weak, shear, hold, mu, weight) in enumerate(stage):
            out = out + weight * contacts(y if k else x, arm, gap, stiff, power, weak, shear, hold, mu)
        return out
    return run


def strain_wave(rng):
    """Flexspline (arctangent) and wave generator (logarithm) under what a Weibull spectrum of plays lets pass."""
    shape, scale = rng.uniform(0.8, 2.0), draw(rng, 0.03, 0.3)
    level = (np.arange(24) + 0.5) / 24.0
    drag = scale * (-np.log(1.0 - level)) ** (1.0 / shape)
    mu = rng.uniform(0.0, 0.12)
    flex, flex_bend = rng.uniform(0.4, 1.0), rng.uniform(0.3, 1.2)
    wave, wave_bend = rng.uniform(0.2, 0.9), draw(rng, 1.0, 12.0)
    tooth, tooth_width = draw(rng, 0.002, 0.1), rng.uniform(0.04, 0.15)
    stiff, soft = rng.uniform(0.2, 0.8), max(0.0, rng.uniform(-2.0, 2.5))

    def run(x):
        y = np.zeros_like(x)
        for d in drag:
            load_play(x, np.full(x.shape, d), mu, y, 1.0 / drag.size)
        return (stiff * (x + soft * x ** 3) + flex * np.arctan(flex_bend * y) / flex_bend + tooth * np.tanh(y / tooth_width)
                + wave * np.sign(y) * np.log1p(wave_bend * np.abs(y)) / wave_bend)
    return run


def worm_axial(rng):
    """Self-locking worm: steep friction at the flank, axial float between the bearings, leaf (Belleville) springs behind."""
    drag, mu = draw(rng, 0.01, 0.1), rng.uniform(0.1, 0.35)
    axial_drag, axial_gap, axial_width = draw(rng, 0.02, 0.15), draw(rng, 0.01, 0.4), rng.uniform(0.03, 0.1)
    leaf_mu, leaf, leaf_bend = rng.uniform(0.05, 0.2), rng.uniform(0.2, 0.8), rng.uniform(-0.25, 0.5)
    flank, flank_power = rng.uniform(0.2, 0.6), rng.uniform(0.65, 0.95)
    wheel = rng.uniform(0.3, 1.0)

    def run(x):
        y = soft_node(x, drag, mu, 0.5)
        z = soft_node(y, axial_drag, leaf_mu, 0.7)
        hertz = np.sign(y) * ((np.abs(y) + 0.01) ** flank_power - 0.01 ** flank_power)
        return wheel * x + flank * hertz + axial_gap * np.tanh(z / axial_width) + leaf * z / (1.0 + leaf_bend * np.abs(z))
    return run


def preisach_density(rng):
    """A Preisach density: a lognormal hill of relay widths, a ridge of gap relays, and a hill that grows with the load."""
    n, span = 420, 1.3
    grid = np.linspace(-span, span, n + 1)
    a, b = np.meshgrid(grid, grid, indexing="ij")
    half, mid = np.maximum(0.5 * (a - b), 1e-6), 0.5 * (a + b)
    centre, width = draw(rng, 0.04, 0.25), rng.uniform(0.4, 0.8)
    hill = np.exp(-0.5 * (np.log(half / centre) / width) ** 2) / half * np.exp(-0.5 * (mid / rng.uniform(0.4, 1.0)) ** 2)
    gap_at, gap_wide = draw(rng, 0.04, 0.2), rng.uniform(0.03, 0.08)
    ridge = np.exp(-0.5 * ((half - gap_at) / (0.5 * gap_at)) ** 2 - 0.5 * (mid / gap_wide) ** 2)
    grown = np.exp(-0.5 * ((half - 0.25 * np.abs(mid)) / 0.06) ** 2) * np.abs(mid) / (0.3 + np.abs(mid))
    inside = a >= b
    density = sum(weight * part * inside / np.sum(part * inside * (a <= 1.0) * (b >= -1.0)) for weight, part in
                  ((rng.uniform(0.3, 1.0), hill), (draw(rng, 0.03, 0.7), ridge), (rng.uniform(0.0, 0.4), grown)))
    table = np.cumsum(np.cumsum(density, axis=0)[:, ::-1], axis=1)[:, ::-1].copy()
    linear, cubic = rng.uniform(0.5, 2.5), rng.uniform(-0.12, 0.25)

    def run(x):
        return nested_memory(x, table, span, 0.0) + linear * (x + cubic * x ** 3)
    return run


def elastomer_member(rng):
    """Plastic or elastomer members: stiffening odd spring beside Berg friction, a splash of free play at the hub."""
    k1 = rng.uniform(0.35, 1.0)
    k3 = k1 * draw(rng, 0.03, 1.5)
    limit, half = draw(rng, 0.05, 0.35), draw(rng, 0.02, 0.3)
    hub, hub_drag, hub_width = draw(rng, 0.002, 0.8), draw(rng, 0.005, 0.06), draw(rng, 0.02, 0.12)
    core = rng.uniform(0.0, 0.5)

    def run(x):
        y = soft_node(x, hub_drag, 0.03, 0.8)
        return berg(x, k1, k3, limit, half) + hub * np.tanh(y / hub_width) + core * y
    return run


def mindlin_spline(rng):
    """Splined shaft: three micro-slip contacts after Mindlin, teeth with index errors that engage in turn, a seal drag."""
    limit = rng.uniform(1.12, 2.2, 3)
    limit[0] = rng.uniform(1.08, 1.25)
    share = rng.uniform(0.2, 1.0, 3)
    teeth = np.sort(draw(rng, 0.005, 0.8) * rng.uniform(0.1, 1.0, int(rng.integers(6, 13))))
    phi = np.linspace(0.0, 4.0, 12001)
    load = 0.04 * np.minimum(phi, 0.5) / 0.5 + np.sum(2.5 / teeth.size * np.maximum(phi[None, :] - teeth[:, None], 0.0), axis=0)
    seal, mu = draw(rng, 0.004, 0.12), rng.uniform(0.0, 0.1)
    shaft = rng.uniform(0.3, 1.5)
    none = np.zeros((1, 1))

    def run(x):
        y = soft_node(x, seal, mu, 0.8)
        out = shaft * x + np.sign(y) * np.interp(np.abs(y), load, phi)
        for p, s in zip(limit, share, strict=True):
            out = out + s * p * nested_memory(x, none, 1.0, p)
        return out
    return run


FAMILIES = (bouc_wen_lattice, gear_train, cycloid_pins, planet_stages, strain_wave, worm_axial, preisach_density,
            elastomer_member, mindlin_spline)


def cycle_of(run, amplitude, cycles=3, quarter=900):
    """Torque (parts of rated) and angle over full cycles from the tip of the first loading on."""
    up = np.linspace(0.0, 1.0, quarter + 1)
    path = [up] + [np.concatenate([1.0 - up[1:], -up[1:], up[1:] - 1.0, up[1:]])] * cycles
    x = amplitude * np.concatenate(path)
    return x[quarter:], run(x)[quarter:]


def indicators(x, angle, rated, k, n):
    """Loop quantities of the settled cycle ``x`` (tip, zero, tip, zero, tip; ``n`` steps a quarter), torque in N m."""
    down_x, down = x[:2 * n + 1][::-1], angle[:2 * n + 1][::-1]
    up_x, up = x[2 * n:4 * n + 1], angle[2 * n:4 * n + 1]

    def up_at(q):
        return np.interp(q, up_x, up)

    def down_at(q):
        return np.interp(q, down_x, down)

    def middle(q):
        return 0.5 * (up_at(q) + down_at(q))

    area = float(np.trapezoid(down_at(up_x) - up, up_x))
    absorbed = float(np.trapezoid(up_x[n:], up[n:]) + np.trapezoid(down_x[:n + 1][::-1], down[:n + 1][::-1]))
    return {"lost_motion_rad": float(middle(k * rated) - middle(-k * rated)), "backlash_rad": float(down_at(0.0) - up_at(0.0)),
            "area_J": area, "absorbed_J": absorbed, "dissipation_ratio": area / absorbed,
            "peak_rad": float(0.5 * (angle[0] - angle[2 * n]))}


def new_reducer(rng, family):
    """Draw until the reducer settles and its loop is within the range of real ones; angle scaled to its wind-up."""
    windup = draw(rng, 3.0, 60.0) * ARCMIN
    for attempt in range(1, 400):
        raw = family(rng)
        x, y = cycle_of(raw, 1.0)
        n = (x.size - 1) // 12
        peak = 0.5 * (y[8 * n] - y[10 * n])
        one, two, three = y[:4 * n + 1] / peak, y[4 * n:8 * n + 1] / peak, y[8 * n:] / peak
        if not np.all(np.isfinite(y)) or np.abs(three - two).max() > 1e-4 or np.abs(two - one).max() > 3e-4:
            continue
        truth = indicators(x[8 * n:], y[8 * n:], 1.0, 0.03, n)
        lost, ratio = truth["lost_motion_rad"] / (2.0 * peak), truth["dissipation_ratio"]
        odd = np.abs(three[:2 * n + 1] + three[2 * n:]).max()
        if 0.001 <= lost <= 0.40 and 0.05 <= ratio <= 0.60 and odd < 1e-3:
            gain = windup / peak
            return (lambda q, gain=gain, raw=raw: gain * raw(q)), windup, attempt
    raise RuntimeError("no reducer of this family: " + family.__name__)


# ---- Records: the torque path on the time axis of the bench, with what happened before the record began.

def profile(rng, style, n=400):
    """One run from one tip to the next as time against progress, both from 0 to 1."""
    u = np.linspace(0.0, 1.0, n + 1)
    if style == "sine":
        return u, 0.5 - 0.5 * np.cos(math.pi * u)
    if style == "hand":
        knots = np.linspace(0.0, 1.0, 9)
        rate = np.exp(np.interp(u, knots, rng.normal(0.0, 0.45, 9)))
        rate *= 0.25 + np.minimum(1.0, np.minimum(u, 1.0 - u) / 0.06)
        way = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]))])
        return u, way / way[-1]
    return u, u


def torque_path(rng, style, amplitude, rate, start, cycles):
    """Time and torque at breakpoints; time is zero where the record begins and negative in what went before it."""
    tips = [0.0, amplitude] + [-amplitude if i % 2 == 0 else amplitude for i in range(2 * cycles + (start == "tip"))]
    if start == "rest":
        tips.append(0.0)
    if style == "hand":
        slack = 1.0 - np.abs(rng.normal(0.0, 0.004, len(tips)))
        tips = [q if i == 1 else q * s for i, (q, s) in enumerate(zip(tips, slack, strict=True))]
    t, x = [np.zeros(1)], [np.zeros(1)]
    begin = 0.0
    for i in range(1, len(tips)):
        u, way = profile(rng, style)
        if style == "sine" and tips[i - 1] == 0.0:
            u, way = u, np.sin(0.5 * math.pi * u)
        if style == "sine" and tips[i] == 0.0:
            u, way = u, 1.0 - np.cos(0.5 * math.pi * u)
        span = abs(tips[i] - tips[i - 1]) / rate * (math.exp(rng.normal(0.0, 0.06)) if style == "hand" else 1.0)
        t.append(t[-1][-1] + span * u[1:])
        x.append(tips[i - 1] + (tips[i] - tips[i - 1]) * way[1:])
        if i == 1 and start == "tip":
            begin = t[-1][-1]
    return np.concatenate(t) - begin, np.concatenate(x)


def new_records(rng, rated, style):
    """Two to four records of full loops at rates that differ; sometimes one of a smaller amplitude."""
    n = int(rng.integers(2, 5))
    base = 4.0 * rated / draw(rng, 25.0, 180.0)
    ratio = rng.uniform(2.0, 5.0)
    steps = ratio ** (np.arange(n) / (n - 1))
    small = int(rng.integers(0, n)) if n > 2 and rng.uniform() < 0.5 else -1
    kind = rng.uniform() < 0.3
    records = []
    for i, j in enumerate(rng.permutation(n)):
        amplitude = rated if i == 0 else rated * (1.0 if rng.uniform() < 0.6 else rng.uniform(0.85, 1.0))
        if j == small and i > 0:
            amplitude = rated * rng.uniform(0.4, 0.7)
        start, cycles = ("rest", "tip")[int(rng.uniform() < 0.4)], int(rng.choice([2, 2, 3]))
        rate = base * steps[j]
        knot_t, knot_x = torque_path(rng, style, amplitude / rated, rate / rated, start, cycles)
        samples = int(rng.integers(6000, 15001))
        t = np.linspace(0.0, knot_t[-1], samples)
        if kind:
            t[1:-1] += rng.uniform(-0.3, 0.3, samples - 2) * t[1]
        before = -np.linspace(-knot_t[0], t[1], 800) if start == "tip" else np.zeros(0)
        full_t = np.concatenate([before, t])
        records.append({"t": full_t, "x": np.interp(full_t, knot_t, knot_x), "keep": before.size, "amplitude": amplitude,
                        "rate": rate, "start": start, "cycles": cycles, "samples": samples,
                        "index": i})
    return records, "jitter" if kind else "uniform"


def loop_record(record, rated, cycles=5, quarter=600):
    """A triangle at the rate of a record, several cycles long, for the truth of its settled loop."""
    top = record["amplitude"] / rated
    up = np.linspace(0.0, 1.0, quarter + 1)
    x = top * np.concatenate([up] + [np.concatenate([1.0 - up[1:], -up[1:], up[1:] - 1.0, up[1:]])] * cycles)
    t = np.arange(x.size) * (top / quarter * rated / record["rate"])
    keep = 4 * quarter * (cycles - 1) + quarter
    return {"t": t, "x": x, "keep": keep, "index": record["index"]}, quarter


# ---- Effects: a variant with its own numbers is drawn once; ``s`` is then scaled. Torque in parts of rated, angle of wind-up.

def new_effect(rng, name, unit):
    """Draw a variant of an effect for a unit; ``s`` is still to be found."""
    n = len(unit["records"])
    period = min(4.0 * r["amplitude"] / r["rate"] for r in unit["records"])

    def pick(*names):
        return names[int(rng.integers(0, len(names)))]

    e = {"variant": "", "s": 0.0, "sign": pick(-1, 1)}
    if name == "torque_offset":
        e["variant"] = pick("constant", "tare_per_record", "zero_walk")
        e["share"] = [1.0] * n if e["variant"] == "constant" else rng.uniform(0.4, 1.6, n).tolist()
    elif name == "sensor_lag":
        e.update(variant=pick("delay", "first_order"), sign=1)
    elif name == "encoder_error":
        e.update(variant=pick("one_wave", "two_harmonics"), period=draw(rng, 0.06, 0.5), phase=rng.uniform(0.0, 6.28, 2).tolist())
    elif name == "thermal_drift":
        e.update(variant=pick("linear", "warm_up", "slow_wave"), share=rng.uniform(0.4, 1.6, n).tolist(),
                 part=rng.uniform(0.2, 0.6), phase=rng.uniform(0.0, 6.28))
    elif name == "viscoelastic_creep":
        e.update(variant=pick("single", "spread", "cubic"), seconds=draw(rng, 0.02, 0.5) * period, sign=1)
    elif name == "rate_dependent_friction":
        e.update(variant=pick("viscous", "power", "stribeck"), power=rng.uniform(0.25, 0.6), dip=rng.uniform(0.1, 0.3), sign=1)
    elif name == "asymmetric_stiffness":
        e["variant"] = pick("flank", "even_quadratic", "one_side_hardening")
    elif name == "stick_slip":
        e.update(variant=pick("regular", "random_static", "aging_static"), level=draw(rng, 0.02, 0.07), sign=1,
                 over=rng.uniform(-0.2, 0.8), hold=0.01 * period)
        e["age"] = rng.uniform(0.15, 0.4) if e["variant"] == "aging_static" else 0.0
        spread = 0.02 if e["variant"] == "regular" else 0.25
        e["draws"] = np.exp(rng.normal(0.0, spread, 83)).tolist()
    elif name == "second_backlash":
        e.update(variant=pick("drag", "preload"), sign=1, at=rng.uniform(0.2, 0.6), width=rng.uniform(0.02, 0.07),
                 friction=rng.uniform(0.01, 0.06))
    elif name == "interface_slip":
        e.update(variant=pick("kinematic", "power", "stays"), sign=1, at=rng.uniform(0.55, 0.85), power=rng.uniform(1.2, 2.0))
    elif name == "x_cycle_ratchet":
        e.update(variant="tip_advance", at=rng.uniform(0.6, 0.85))
    elif name == "x_running_in":
        e.update(variant="drag_wears_off", travel=rng.uniform(4.0, 12.0), sign=1)
    elif name == "x_mesh_wave_with_load":
        e.update(variant="tooth_pitch", period=draw(rng, 0.15, 0.6), phase=rng.uniform(0.0, 6.28))
    elif name == "x_one_sided_gap":
        e.update(variant="loose_key", at=rng.uniform(0.1, 0.5), width=rng.uniform(0.02, 0.07), friction=rng.uniform(0.02, 0.15),
                 side=pick(-1, 1))
    elif name == "x_gain_step":
        e.update(variant="torque_range", which=int(rng.integers(0, n)), part=rng.uniform(0.35, 0.65))
    elif name == "x_lost_counts":
        m = int(rng.integers(2, 5))
        e.update(variant="steps", which=rng.integers(0, n, m).tolist(), part=rng.uniform(0.1, 0.9, m).tolist())
    elif name == "x_debris_bump":
        e.update(variant=pick("stays", "crushed"), at=rng.uniform(-0.7, 0.7), width=rng.uniform(0.03, 0.08))
    elif name == "x_clock_skew":
        e.update(variant="two_clocks")
    return e


def front_nodes(unit, record, effects, q):
    """The torque that enters the reducer behind what acts in front of it."""
    t, i = record["t"], record["index"]
    part = np.maximum(t, 0.0) / t[-1]
    if "torque_offset" in effects:
        e = effects["torque_offset"]
        q = q - e["sign"] * e["s"] * e["share"][i] * (0.5 + part if e["variant"] == "zero_walk" else 1.0)
    if "x_gain_step" in effects and effects["x_gain_step"]["which"] == i:
        e = effects["x_gain_step"]
        q = q * (1.0 + e["sign"] * e["s"] * (part > e["part"]))
    if "rate_dependent_friction" in effects:
        e = effects["rate_dependent_friction"]
        v = np.abs(np.gradient(q, t)) * unit["rated"] / unit["fastest"]
        law = {"viscous": v, "power": v ** e["power"], "stribeck": 0.5 * np.exp(-v / e["dip"]) + 1.5 * v}[e["variant"]]
        out = np.zeros_like(q)
        load_play(q, e["s"] * law, 0.0, out, 1.0)
        q = out
    if "x_running_in" in effects:
        e = effects["x_running_in"]
        travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q)))]) + 8.0 * i
        out = np.zeros_like(q)
        load_play(q, e["s"] * np.exp(-travel / e["travel"]), 0.0, out, 1.0)
        q = out
    return q


def members(unit, record, effects, q, base):
    """Sum of the members in series that effects add, in parts of the wind-up (``base`` is the angle of the reducer)."""
    t, out = record["t"], np.zeros_like(q)

    def passed(drag):
        return soft_node(q, drag, 0.0, 0.3)

    for name, e in effects.items():
        s = e["s"] * e["sign"]
        if name == "viscoelastic_creep":
            load = q ** 3 if e["variant"] == "cubic" else q
            for factor in ((0.25, 1.0, 4.0) if e["variant"] == "spread" else (1.0,)):
                out += s * first_order(t, load, e["seconds"] * factor)
        elif name == "asymmetric_stiffness":
            out += s * {"flank": np.maximum(base, 0.0), "even_quadratic": q * q,
                        "one_side_hardening": np.maximum(q, 0.0) ** 2}[e["variant"]]
        elif name == "stick_slip":
            out += s * (sticking(q, e["level"], e["over"], np.array(e["draws"]), e["age"], t, e["hold"]) - q)
        elif name == "second_backlash" and e["variant"] == "drag":
            out += s * np.tanh(passed(e["at"]) / e["width"])
        elif name == "second_backlash":
            y = passed(e["friction"])
            out += 0.5 * s * (np.tanh((y - e["at"]) / e["width"]) + np.tanh((y + e["at"]) / e["width"]))
        elif name == "interface_slip" and e["variant"] == "stays":
            out += s * clamp_creepage(q, e["at"], e["power"])
        elif name == "interface_slip":
            y = soft_node(q, e["at"], 0.0, 0.06)
            out += s * (y if e["variant"] == "kinematic" else np.sign(y) * np.abs(y) ** e["power"])
        elif name == "x_cycle_ratchet":
            step = np.abs(np.diff(q, prepend=q[0]))
            out += s * np.cumsum(np.maximum(np.abs(q) - e["at"], 0.0) * step)
        elif name == "x_mesh_wave_with_load":
            out += s * q * np.cos(2.0 * math.pi * base / e["period"] + e["phase"])
        elif name == "x_one_sided_gap":
            y = passed(e["friction"]) * e["side"]
            out += s * 0.5 * (1.0 + np.tanh((y - e["at"]) / e["width"]))
        elif name == "x_debris_bump":
            left = np.exp(-4.0 * np.maximum(t, 0.0) / t[-1]) if e["variant"] == "crushed" else 1.0
            out += s * left * np.exp(-0.5 * ((base - e["at"]) / e["width"]) ** 2)
    return out


def simulate(unit, record, effects):
    """Noise-free angle (rad) of a record under the given effects."""
    t, i, w = record["t"], record["index"], unit["windup"]
    q = front_nodes(unit, record, effects, record["x"])
    if "base" not in record:
        record["base"] = unit["run"](record["x"]) / w
    base = record["base"] if q is record["x"] else unit["run"](q) / w
    out = base + members(unit, record, effects, q, base)
    part = np.maximum(t, 0.0) / t[-1]
    e = effects.get("sensor_lag")
    if e:
        out = np.interp(t - e["s"], t, out) if e["variant"] == "delay" else first_order(t, out, max(e["s"], 1e-9))
    e = effects.get("x_clock_skew")
    if e:
        out = np.interp(t - e["s"] * e["sign"] * np.maximum(t, 0.0), t, out)
    e = effects.get("encoder_error")
    if e:
        turn = 2.0 * math.pi * out / e["period"]
        wave = np.sin(turn + e["phase"][0])
        if e["variant"] == "two_harmonics":
            wave = wave + 0.5 * np.sin(2.0 * turn + e["phase"][1])
        out = out + e["s"] * e["sign"] * wave
    e = effects.get("thermal_drift")
    if e:
        shape = {"linear": part, "warm_up": 1.0 - np.exp(-part / e["part"]),
                 "slow_wave": np.sin(2.0 * math.pi * part * 1.3 + e["phase"]) - math.sin(e["phase"])}[e["variant"]]
        out = out + e["s"] * e["sign"] * e["share"][i] * shape
    e = effects.get("x_lost_counts")
    if e:
        out = out + sum(e["s"] * e["sign"] * (part > at) for k, at in zip(e["which"], e["part"], strict=True) if k == i)
    return out[record["keep"]:] * w


def change(unit, effects, refit):
    """Rms of the change by effects over all samples, in standard deviations of the angle noise."""
    total, count = 0.0, 0
    for record in unit["records"]:
        clean = simulate(unit, record, {})
        diff = simulate(unit, record, effects) - clean
        if refit:
            basis = clean - clean.mean()
            diff = diff - diff.mean()
            diff = diff - basis * (basis @ diff) / (basis @ basis)
        total += float(diff @ diff)
        count += diff.size
    return math.sqrt(total / count) / unit["noise"]


def scaled(unit, name, e, target, refit):
    """Find ``s`` of an effect so that its rms is ``target``: steps in proportion first, bisection if these do not end."""
    def rms(s):
        return change(unit, {name: dict(e, s=s)}, refit)
    s, low, high = 1e-3, 0.0, math.inf
    for _ in range(40):
        r = rms(s)
        if abs(r / target - 1.0) < 0.003:
            break
        low, high = (s, high) if r < target else (low, s)
        guess = s * min(max(target / max(r, 1e-12), 0.05), 20.0)
        if not low < guess < high or (high < math.inf and high - low < 0.3 * high):
            guess = 0.5 * (low + high) if high < math.inf else 2.0 * s
        s = guess
        if s > 50.0 and name not in ("sensor_lag",):
            break
    return dict(e, s=s), r


def truth(unit, record, effects):
    """Indicators of the settled loop of a reducer with effects, at the amplitude of a record."""
    loop, n = loop_record(record, unit["rated"])
    angle = simulate(unit, loop, effects)
    return indicators(loop["x"][loop["keep"]:] * unit["rated"], angle, unit["rated"], unit["k"], n)


def noise_of(rng, n, sd, share, length):
    """White noise with a share (of the variance) of first-order correlated noise."""
    out = rng.normal(0.0, sd * math.sqrt(1.0 - share), n)
    if share > 0.0:
        rho = math.exp(-1.0 / length)
        walk = rng.normal(0.0, 1.0, n)
        walk[1:] *= math.sqrt(1.0 - rho * rho)
        out += sd * math.sqrt(share) * autoregress(walk, rho)
    return out


@njit(cache=False)
def autoregress(steps, rho):
    """First-order autoregression."""
    out = steps.copy()
    for i in range(1, steps.size):
        out[i] += rho * out[i - 1]
    return out


# ---- The bench.

def plan_of(rng, units):
    """Kinds, effects and sizes of the cases in shuffled order, each with its family."""
    plan = [("clean", [], None)] * 24
    plan += [("single", [name], size) for name in LISTED for size in (1.0, 0.4, 0.2)]
    plan += [("unlisted", [name], size) for name in UNLISTED for size in (1.0, 0.4)]
    order = [LISTED[i] for i in rng.permutation(len(LISTED))]
    plan += [("pair", sorted([order[i], order[(i + 1) % len(order)]]), 1.0) for i in range(len(order))]
    turn = rng.permutation(len(FAMILIES))
    plan = [(case, FAMILIES[turn[i % len(FAMILIES)]]) for i, case in enumerate(plan)]
    plan = [plan[i] for i in rng.permutation(len(plan))]
    return [plan[i % len(plan)] for i in range(units)]


def new_unit(rng, kind, names, size, family, level, trace):
    """Draw a unit: reducer, records, noise, effects and traces."""
    run, windup, attempts = new_reducer(rng, family)
    rated = draw(rng, 0.05, 50.0)
    style = ("triangle", "triangle", "sine", "hand")[int(rng.integers(0, 4))]
    records, sampling = new_records(rng, rated, style)
    snr = draw(rng, 200.0, 2000.0)
    unit = {"kind": kind, "names": names, "size": size, "family": family.__name__, "attempts": attempts, "run": run,
            "windup": windup, "rated": rated, "records": records, "sampling": sampling, "style": style, "snr": snr,
            "noise": windup / snr, "k": 0.04 if family is strain_wave else 0.03, "fastest": max(r["rate"] for r in records)}
    unit["share"] = float(rng.uniform(0.1, 0.6)) if rng.uniform() < 0.6 else 0.0
    unit["length"] = draw(rng, 2.0, 30.0)
    unit["torque_noise"] = rated / snr * rng.uniform(0.05, 0.6)
    unit["quantum_angle"] = unit["noise"] * rng.uniform(0.5, 2.5) if rng.uniform() < 0.3 else 0.0
    unit["quantum_torque"] = rated / rng.uniform(1500.0, 6000.0) if rng.uniform() < 0.3 else 0.0
    unit["effects"], unit["rms"], unit["traces"], unit["trace_rms"] = {}, {}, {}, {}
    for name in names:
        unit["effects"][name], unit["rms"][name] = scaled(unit, name, new_effect(rng, name, unit), level * size, True)
    if len(names) > 1:
        unit["rms"]["together"] = change(unit, unit["effects"], True)
    others = [name for name in CHANNEL if name not in names]
    for i in rng.permutation(len(others))[:int(rng.integers(2, 4))]:
        target = trace * level * rng.uniform(0.05, 0.1)
        unit["traces"][others[i]], unit["trace_rms"][others[i]] = scaled(
            unit, others[i], new_effect(rng, others[i], unit), target, False)
    return unit


def write_unit(rng, unit, name, folder):
    """Write the files of a unit and return its entry of the key."""
    folder.mkdir(parents=True, exist_ok=True)
    toml = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f'rated_torque_Nm = {unit["rated"]:.6g}']
    entries = []
    acting = {**unit["effects"], **unit["traces"]}
    parts = {n: e for n, e in unit["effects"].items() if n in PARTS}
    for record in unit["records"]:
        file = f'rec-{record["index"] + 1}.csv'
        angle = simulate(unit, record, acting) + unit["windup"] * rng.uniform(-0.02, 0.02)
        angle = angle + noise_of(rng, angle.size, unit["noise"], unit["share"], unit["length"])
        torque = record["x"][record["keep"]:] * unit["rated"] + rng.normal(0.0, unit["torque_noise"], angle.size)
        if unit["quantum_angle"] > 0.0:
            angle = np.round(angle / unit["quantum_angle"]) * unit["quantum_angle"]
        if unit["quantum_torque"] > 0.0:
            torque = np.round(torque / unit["quantum_torque"]) * unit["quantum_torque"]
        table = np.column_stack([record["t"][record["keep"]:], torque, angle / ARCMIN])
        np.savetxt(folder / file, table, fmt=("%.12g", "%.9g", "%.9g"), delimiter=",", header="time_s,torque_Nm,angle_arcmin",
                   comments="", newline="\n")
        toml += ["", "[[record]]", f'file = "{file}"', f'loading_rate_Nm_per_s = {record["rate"]:.6g}',
                 f'amplitude_Nm = {record["amplitude"]:.6g}']
        own = truth(unit, record, parts)
        clean = truth(unit, record, {}) if parts else own
        entries.append({"file": file, "amplitude_Nm": record["amplitude"], "rate_Nm_per_s": record["rate"],
                        "style": unit["style"], "start": record["start"], "cycles": record["cycles"],
                        "samples": record["samples"], "full": record["amplitude"] >= 0.8 * unit["rated"],
                        "snr": clean["peak_rad"] / unit["noise"],
                        "indicators": own, "indicators_clean": clean})
    (folder / "unit.toml").write_text("\n".join(toml) + "\n", encoding="utf-8", newline="\n")
    sizes = {n: unit["size"] for n in unit["names"]}
    variant = {n: dict(e, size=unit["size"]) for n, e in unit["effects"].items()}
    return {"effects": unit["names"], "size": sizes if unit["kind"] == "pair" else unit["size"], "reducer": unit["family"],
            "style": unit["style"], "variant": variant, "rms": {**unit["rms"], "traces": unit["trace_rms"]},
            "rated_torque_Nm": unit["rated"], "k": unit["k"], "snr": unit["snr"], "noise_rad": unit["noise"],
            "noise_correlated_share": unit["share"], "torque_noise_Nm": unit["torque_noise"], "sampling": unit["sampling"],
            "quantum_angle_rad": unit["quantum_angle"], "quantum_torque_Nm": unit["quantum_torque"], "gaps": False,
            "records": entries, "kind": unit["kind"], "attempts": unit["attempts"]}


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description="virtual bench for gear reducers")
    parser.add_argument("out", type=Path)
    parser.add_argument("--units", type=int, default=80)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--level", type=float, default=LEVEL)
    parser.add_argument("--trace", type=float, default=1.0)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    key = {}
    for i, ((kind, names, size), family) in enumerate(plan_of(np.random.default_rng([args.seed, 0]), args.units), 1):
        rng = np.random.default_rng([args.seed, i])
        unit = new_unit(rng, kind, names, size, family, args.level, args.trace)
        name = f"case-{i:02d}"
        key[name] = write_unit(rng, unit, name, args.out / name)
    (args.out / "key.json").write_text(json.dumps(key, indent=1) + "\n", encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
