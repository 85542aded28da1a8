"""Twelfth outside bench: written without sight of the package it tests, with reducer mechanics of its own.

"python twelfth_outside_bench.py OUT --units 80 --seed 121" writes OUT/case-01 ... (unit.toml, a CSV a record) and OUT/key.json;
the same seed gives the same bytes.

Families (torque in units of the rated torque, quasi-static; every one is odd, rate-independent, and closes after first loading).
Those marked * are small finite-element networks: nodes joined by elements, each a tabulated contact or spring law with a
Coulomb stick element beside it whose limit may follow the element's own normal load; solved by Newton steps at each torque.
tooth_ring*      6-9 tooth contacts with individual pitch errors on an elastic rim, the rim on a web, the web on the hub.
ball_nut*        turns of balls along an elastic screw loaded at its end; Hertz contacts with scattered clearance, or oversize
                 balls in four-point contact; spin friction with the 4/3 power of the load; a thrust collar in series.
bevel_tilt*      four places from toe to heel on either flank; the separating force tilts the gear on a bearing seat that
                 rubs and loses its preload, so that contact moves along the face.
nutating_plate*  five sectors, both flanks preloaded; the plate lifts and tilts in two directions on its rubbing ring.
roller_chain*    two strands that sag when slack (catenary), articulation friction with the tension, rollers seating.
press_fit*       slip front travels along a shaft in a hub; a key with clearance stops the far end; a mesh in series.
rough_plastic    1-3 meshes whose rough flanks meet asperity by asperity (Greenwood-Williamson), and tooth roots whose
                 internal damping grows with the amplitude (Davidenkov, a power law of play thresholds).
Every reducer has a torsion shaft and an output gland (a compliant slider) too. stick_slip is
that a share of this gland sticks and jumps; rate_dependent_friction and x_friction_cycle act on all friction of the reducer.

Conventions: x_friction_cycle and x_seat_lottery vary about the clean reducer, their truth; the rest as in outside_units.py.
Units that miss a severity are drawn anew.
Unlisted kinds: x_adc_step (reading jumps or hangs at codes), x_bus_jitter (angle early or late, packet by packet), x_squeeze_film
(oil film in the mesh thins under load and fills again), x_remounted_record (one record with another fixture),
x_reversal_crosstalk (transient of the reading at each reversal), x_friction_cycle (friction varies with the temperature of the
room), x_seat_lottery (a loose part seats elsewhere at each crossing), x_torque_wander (zero of the torque reading wanders).
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
def dry_play(q, fr, drag, mu):
    """Moment behind a slider whose friction is drag + mu times the moment it passes on."""
    m, res = 0.0, np.empty_like(q)
    for i in range(q.size):
        f, g = drag * fr[i], min(mu * fr[i], 0.9)
        up, down = q[i] - f, q[i] + f
        lo = up / (1.0 + g) if up > 0.0 else up / (1.0 - g)
        hi = down / (1.0 - g) if down > 0.0 else down / (1.0 + g)
        m = min(max(m, lo), hi)
        res[i] = m
    return res

def play(q, radius):
    return dry_play(q, np.ones_like(q), radius, 0.0)

@njit
def _assemble(u, torque, scale, net, e0, f0, e, f, r, jac):
    """Residual and tangent of the network at u, the stick elements coming from (e0, f0); gives the residual's norm."""
    arms, force, load, step, grip, drag, mu = net
    n, half = u.size, (force.shape[1] - 1) // 2
    r[:] = 0.0
    r[0] = -torque
    jac[:, :] = 1e-9 * np.eye(n)
    for k in range(e.size):
        x = 0.0
        for j in range(n):
            x += arms[k, j] * u[j]
        p = x / step + half
        c = min(max(int(np.floor(p)), 0), force.shape[1] - 2)
        slope = force[k, c + 1] - force[k, c]
        total = force[k, c] + (p - c) * slope
        slope /= step
        e[k] = x
        f[k] = 0.0
        if grip[k] > 0.0:
            rise = load[k, c + 1] - load[k, c]
            rub, tried = min(scale * mu[k], 0.6), f0[k] + grip[k] * (x - e0[k])
            limit = scale * drag[k] + rub * (load[k, c] + (p - c) * rise)
            f[k] = min(max(tried, -limit), limit)
            slope += grip[k] if abs(tried) <= limit else np.sign(tried) * rub * rise / step
            total += f[k]
        for i in range(n):
            if arms[k, i] != 0.0:
                r[i] += arms[k, i] * total
                for j in range(n):
                    jac[i, j] += slope * arms[k, i] * arms[k, j]
    return np.sqrt(np.sum(r * r))

@njit
def _solve(jac, r, d):
    """d = -jac^-1 r by Gauss elimination in place; jac is positive definite, so that no pivots are needed."""
    n = r.size
    d[:] = -r
    for j in range(n):
        for i in range(j + 1, n):
            share = jac[i, j] / jac[j, j]
            if share != 0.0:
                d[i] -= share * d[j]
                for k in range(j, n):
                    jac[i, k] -= share * jac[j, k]
    for j in range(n - 1, -1, -1):
        for k in range(j + 1, n):
            d[j] -= jac[j, k] * d[k]
        d[j] /= jac[j, j]

@njit
def equilibrium(q, fr, net):
    """Displacement of node 0, which carries the torque; damped Newton steps on the convex problem of each sample."""
    (m, n), res = net[0].shape, np.empty_like(q)
    u, d, r, jac, trial = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros((n, n)), np.zeros(n)
    e0, f0, e, f = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    for i in range(q.size):
        norm = _assemble(u, q[i], fr[i], net, e0, f0, e, f, r, jac)
        for _ in range(80):
            if norm < 1e-11:
                break
            _solve(jac, r, d)
            for share in (1.0, 0.5, 0.25, 0.12, 0.06, 0.03, 0.015):
                trial[:] = u + share * d
                got = _assemble(trial, q[i], fr[i], net, e0, f0, e, f, r, jac)
                if got < (1.0 - 0.05 * share) * norm:
                    break
            u[:], norm = trial, got
        e0[:], f0[:], res[i] = e, f, u[0]
    return res

@njit
def breakaway(q, t, fr, kinetic, static, ageing, tau):
    """Slider that holds until |q - m| exceeds a static level, which may grow with the time of rest, then jumps to kinetic."""
    m, event, since, res = 0.0, 0, t[0], np.empty_like(q)
    for i in range(q.size):
        level = kinetic + (static[event % static.size] - kinetic) * (1.0 - ageing * np.exp((since - t[i]) / tau))
        if abs(q[i] - m) > level * fr[i]:
            m = q[i] - np.sign(q[i] - m) * kinetic * fr[i]
            event, since = event + 1, t[i]
        res[i] = m
    return res

@njit
def film(t, q, thin, fill, still):
    """Share of an oil film left in the mesh: it thins at a rate with the load, and fills while the load is below still."""
    h, res = 1.0, np.ones_like(q)
    for i in range(1, q.size):
        dt, m = t[i] - t[i - 1], abs(q[i])
        h = 1.0 + (h - 1.0) * np.exp(-dt / fill) if m < still else h * np.exp(-dt * m / thin)
        res[i] = h
    return res

@njit
def since_reversal(t, q):
    """Time since the loading last turned, and the direction since then."""
    way, turned, age, side = 1.0, t[0], np.zeros_like(q), np.ones_like(q)
    for i in range(1, q.size):
        if (q[i] - q[i - 1]) * way < -1e-12:
            way, turned = -way, t[i - 1]
        age[i], side[i] = t[i] - turned, way
    return age, side

# ---------------------------------------------------------------- reducers
@dataclass
class Reducer:
    family: str
    parts: list
    shaft: float
    gland: float
    drag: float
    friction: float
    scale: float = 1.0
    half: float = 1.0

    def angle(self, run):
        q, rub = run.q, self.friction * run.fr
        return self.scale * (sum(p(q, rub) for p in self.parts) + self.shaft * q + self.gland * dry_play(q, rub, self.drag, 0.0))

def whole(rng, lo, hi):
    return int(rng.integers(lo, hi + 1))

GRID = np.linspace(-5.0, 5.0, 8001)

def network(nodes, rows):
    """A part from rows (arms {node: lever}, law, load, drag, mu, reach); law and load are functions, no load means |law|."""
    arms, (drag, mu, reach) = np.zeros((len(rows), nodes)), np.array([row[3:] for row in rows]).T
    force, load = np.zeros((2, len(rows), GRID.size))
    for k, (levers, law, carried, *_) in enumerate(rows):
        arms[k, list(levers)] = list(levers.values())
        force[k] = law(GRID)
        load[k] = carried(GRID) if carried else np.abs(force[k])
    grip = np.where(reach > 0.0, (drag + mu * load[:, np.searchsorted(GRID, 0.5)]) / np.maximum(reach, 1e-9), 0.0)
    net = (arms, force, load, GRID[1] - GRID[0], grip, drag, mu)
    return lambda q, fr: equilibrium(q, fr, net)

def spring(k):
    return lambda x: k * x

def touch(gap, power, cross, share):
    """Odd contact law: a weak centring through the clearance, a power law beyond."""
    return lambda x: share * np.sign(x) * (cross * np.abs(x) / gap + np.maximum(np.abs(x) - gap, 0.0) ** power)

def one_sided(gap, power, share):
    return lambda x: share * np.maximum(x - gap, 0.0) ** power

def inverse_law(torque_of):
    """Deflection as an odd function of the moment, from a rising torque law on x >= 0."""
    x = 8.0 * np.linspace(0.0, 1.0, 8001) ** 1.5
    m = torque_of(x)
    return lambda v: np.sign(v) * np.interp(np.abs(v), m, x)

def tooth_ring(rng):
    n, gap, power, cross = whole(rng, 6, 9), uniform(rng, 0.05, 0.5), uniform(rng, 1.05, 1.5), uniform(rng, 0.01, 0.05)
    gaps = gap * (1.0 + uniform(rng, 0.2, 0.9) * rng.random(n))
    web, rim, reach = uniform(rng, 2.0, 7.0) / n, uniform(rng, 0.2, 2.0), log_uniform(rng, 0.01, 0.08)
    drags, mu = log_uniform(rng, 0.01, 0.07) * rng.dirichlet(np.full(n, 3.0)), uniform(rng, 0.02, 0.15)
    rows = []
    for j in range(n):
        rows += [({0: 1.0, j + 1: -1.0}, spring(web), None, 0.0, 0.0, 0.0),
                 ({j + 1: 1.0, 1 + (j + 1) % n: -1.0}, spring(rim), None, 0.0, 0.0, 0.0),
                 ({j + 1: 1.0}, touch(gaps[j], power, cross, 1.0 / n), None, drags[j], mu, reach)]
    return [network(n + 1, rows)]

def ball_nut(rng):
    n, screw, oversize = whole(rng, 4, 7), uniform(rng, 2.0, 8.0), rng.random() < 0.35
    gap, drag, mu = uniform(rng, 0.05, 0.4), log_uniform(rng, 0.01, 0.06), uniform(rng, 0.03, 0.14)
    seat, reach, cross = uniform(rng, 0.05, 0.25), log_uniform(rng, 0.01, 0.1), uniform(rng, 0.01, 0.04)
    def side(x, balls):
        return 1.6 / n * np.mean(np.maximum(x[:, None] + balls, 0.0) ** 1.5, axis=1)
    rows = []
    for j in range(n):
        balls = (seat if oversize else -gap) * (1.0 + 0.4 * rng.random(8))
        def law(x, b=balls):
            return side(x, b) - side(-x, b) + cross / n * x / gap
        def load(x, b=balls):
            return (n * (side(x, b) + side(-x, b))) ** (4.0 / 3.0) / n
        rows.append(({j: 1.0}, law, load, drag / n, mu, reach))
    rows += [({j: 1.0, j + 1: -1.0}, spring(screw), None, 0.0, 0.0, 0.0) for j in range(n - 1)]
    collar, hub, rub = uniform(rng, 0.1, 0.4), uniform(rng, 0.1, 0.4), uniform(rng, 0.02, 0.12)
    hertz = inverse_law(lambda x: (hub + x) ** 1.5 - np.maximum(hub - x, 0.0) ** 1.5)
    return [network(n, rows), lambda q, fr: collar * hertz(dry_play(q, fr, 0.3 * drag, rub))]

def bevel_tilt(rng):
    gap, power, cross = uniform(rng, 0.05, 0.4), uniform(rng, 1.05, 1.5), uniform(rng, 0.01, 0.05)
    lift, face, mu = uniform(rng, 0.25, 0.6), uniform(rng, 0.1, 0.4), uniform(rng, 0.02, 0.12)
    stiff, soft, kept = uniform(rng, 1.5, 5.0), uniform(rng, 0.3, 0.8), uniform(rng, 0.05, 0.25)
    reach, crown = log_uniform(rng, 0.005, 0.05), gap * uniform(rng, 0.1, 0.6)
    rows = [({0: 1.0}, spring(cross / gap), None, log_uniform(rng, 0.01, 0.06), 0.0, reach),
            ({1: 1.0}, lambda y: stiff * (soft * y + (1.0 - soft) * np.clip(y, -kept / stiff, kept / stiff)), None,
             log_uniform(rng, 0.01, 0.08), 0.0, 0.3 * reach)]
    for y in (-1.0, -0.4, 0.3, 1.0):
        flank = one_sided(gap + crown * y * y, power, 0.3)
        rows += [({0: way, 1: -(lift + face * y)}, flank, None, 0.0, mu, reach) for way in (1.0, -1.0)]
    return [network(2, rows), lambda q, fr: 0.1 * lift * np.arcsinh(dry_play(q, fr, 0.02, 0.3 * mu) / 0.3)]

def nutating_plate(rng):
    power, start, cone = uniform(rng, 1.1, 1.6), uniform(rng, 0.05, 0.25), uniform(rng, 0.3, 0.7)
    preload, mu, reach = uniform(rng, 0.06, 0.25), uniform(rng, 0.02, 0.12), log_uniform(rng, 0.004, 0.04)
    azimuth, spread = uniform(rng, 0.3, 0.7), uniform(rng, 0.2, 0.7)
    betas = azimuth * np.arange(-2.0, 3.0)
    shares = preload * np.exp(-spread * np.abs(betas)) / np.sum(np.exp(-spread * np.abs(betas)))
    rows, thrust = [], np.zeros(2)
    for beta, share in zip(betas, shares, strict=True):
        flank = one_sided(-start, power, share / start**power)
        levers = {1: -cone, 2: -cone * np.cos(beta), 3: -cone * np.sin(beta)}
        rows += [({0: way, **levers}, flank, None, 0.0, mu, reach) for way in (1.0, -1.0)]
        thrust += 2.0 * share * cone * np.array([1.0, np.cos(beta)])
    stiff = uniform(rng, 1.0, 4.0) * np.array([1.0, uniform(rng, 0.5, 2.0), uniform(rng, 0.5, 2.0)])
    for node, (k, held) in enumerate(zip(stiff, (*thrust, 0.0), strict=True)):
        rows.append(({node + 1: 1.0}, lambda z, k=k, held=held: held + k * z, None, log_uniform(rng, 0.004, 0.04), 0.0, reach))
    rows.append(({0: 1.0}, spring(uniform(rng, 0.01, 0.05)), None, log_uniform(rng, 0.01, 0.06), 0.0, reach))
    return [network(4, rows)]

def roller_chain(rng):
    slack, sag, stiff = uniform(rng, 0.02, 0.12), uniform(rng, 0.05, 0.4), uniform(rng, 0.8, 2.5)
    pull = np.exp(np.linspace(np.log(1e-5), np.log(20.0), 6000))
    length = (pull - slack) / stiff + sag * (1.0 - (slack / pull) ** 2)
    def strand(x):
        return np.interp(x, length, pull)
    mu, reach = uniform(rng, 0.03, 0.12), log_uniform(rng, 0.01, 0.1)
    seats = touch(uniform(rng, 0.05, 0.3), uniform(rng, 1.05, 1.4), uniform(rng, 0.01, 0.05), uniform(rng, 2.0, 5.0))
    rows = [({1: way}, strand, None, 0.0, 0.7 * mu, reach) for way in (1.0, -1.0)]
    rows += [({1: way}, spring(0.0), strand, 0.0, 0.3 * mu, 0.2 * reach) for way in (1.0, -1.0)]
    rows += [({0: 1.0, 1: -1.0}, seats, None, log_uniform(rng, 0.008, 0.04), 0.3 * mu, 0.5 * reach),
             ({0: 1.0}, spring(0.01), None, log_uniform(rng, 0.005, 0.04), 0.0, reach)]
    return [network(2, rows)]

def press_fit(rng):
    n, fit, shaft = whole(rng, 5, 8), uniform(rng, 0.04, 0.2), uniform(rng, 3.0, 12.0)
    pressure = 1.0 + uniform(rng, 0.5, 2.0) * np.linspace(-1.0, 1.0, n) ** 2
    limits, reach = fit * pressure / pressure.sum(), log_uniform(rng, 0.003, 0.03)
    key = touch(uniform(rng, 0.04, 0.3), uniform(rng, 1.05, 1.4), uniform(rng, 0.01, 0.05), uniform(rng, 1.0, 3.0))
    rows = [({n - 1: 1.0}, key, None, 0.0, uniform(rng, 0.01, 0.08), reach)]
    rows += [({j: 1.0}, spring(0.0), None, limits[j], 0.0, reach) for j in range(n)]
    rows += [({j: 1.0, j + 1: -1.0}, spring(shaft), None, 0.0, 0.0, 0.0) for j in range(n - 1)]
    gap, drag, mu = uniform(rng, 0.03, 0.3), log_uniform(rng, 0.01, 0.06), uniform(rng, 0.02, 0.1)
    mesh = inverse_law(touch(gap, uniform(rng, 1.1, 1.5), 0.03, uniform(rng, 1.0, 2.0)))
    return [network(n, rows), lambda q, fr: mesh(dry_play(q, fr, drag, mu))]

def rough_plastic(rng):
    heights = np.linspace(-4.0, 4.0, 161)
    density = np.exp(-0.5 * heights**2) / np.sum(np.exp(-0.5 * heights**2))
    def mesh(weight):
        sigma, gap, hard = uniform(rng, 0.02, 0.1), uniform(rng, 0.1, 0.5), uniform(rng, 1.0, 4.0)
        law = inverse_law(lambda x: 0.03 * x + hard * np.maximum(x[:, None] - gap + sigma * heights, 0.0) ** 1.5 @ density)
        drag, mu = log_uniform(rng, 0.008, 0.06), uniform(rng, 0.02, 0.12)
        return lambda q, fr: weight * law(dry_play(q, fr, drag, mu))
    radii, kappa = np.linspace(0.0, uniform(rng, 0.3, 0.8), 25)[1:], uniform(rng, 0.5, 1.6)
    weights = uniform(rng, 0.1, 0.5) * radii ** (kappa - 1.0) / np.sum(radii ** (kappa - 1.0))
    root, bend = uniform(rng, 0.2, 0.8), uniform(rng, 0.3, 1.0)
    def roots(q, fr):
        lossy = sum(w * dry_play(q, fr, r, 0.0) for r, w in zip(radii, weights, strict=True))
        return root * bend * np.arctan(q / bend) + lossy
    return [mesh(w) for w in rng.dirichlet(np.full(whole(rng, 1, 3), 3.0))] + [roots]

FAMILIES = (tooth_ring, ball_nut, bevel_tilt, nutating_plate, roller_chain, press_fit, rough_plastic)

def make_reducer(family, rng):
    """Draws until the loop takes 2-30 % of its box; scaled to a lost motion of 0.2-60', half the range at most 4 degrees."""
    path = settled_path(1.0, 1.0)
    while True:
        red = Reducer(family.__name__, family(rng), uniform(rng, 0.02, 0.25), uniform(rng, 0.08, 0.5),
                      log_uniform(rng, 0.03, 0.15), log_uniform(rng, 0.6, 3.0))
        shape = loop_indicators(path.q, red.angle(Run(path, 0, path.q, np.ones_like(path.q))))
        if 0.02 < shape["area_J"] / (4.0 * shape["peak_rad"]) < 0.3 and shape["absorbed_J"] > shape["area_J"]:
            break
    most = min(60.0, 240.0 * shape["lost_motion_rad"] / shape["peak_rad"])
    red.scale = log_uniform(rng, 0.2, most) * ARCMIN / shape["lost_motion_rad"]
    red.half = shape["peak_rad"] * red.scale
    return red

# ---------------------------------------------------------------- paths and records
def wave(look, u):
    if look["style"] == "sine":
        return np.sin(2.0 * np.pi * u)
    if look["style"] == "trapezoid":
        return np.clip(triangle(u) / (1.0 - look["dwell"]), -1.0, 1.0)
    stair, most = 4 * look["steps"] * u, 1.0 - (look["dwell"] if look["style"] == "stairs" else 0.0)
    return triangle((np.floor(stair) + np.minimum(stair % 1.0 / most, 1.0)) / (4 * look["steps"]))

def by_hand(rng, u):
    """Cycles done from u[0] to u[-1] when turned unevenly, and the reach of each half cycle (the largest turned is one)."""
    z, k, phases = np.linspace(0.0, 1.0, 4000), np.arange(1, 9)[:, None], rng.uniform(0.0, 2 * np.pi, (8, 1))
    pace = np.cumsum(np.exp(0.32 * np.sum(rng.standard_normal((8, 1)) / np.sqrt(k) * np.sin(10.7 * k * z + phases), axis=0)))
    reach, span = rng.uniform(0.94, 1.0, int(2 * u[-1]) + 2), u[-1] - u[0]
    turned = u[0] + span * np.interp((u - u[0]) / span, (pace - pace[0]) / (pace[-1] - pace[0]), z)
    return turned, np.minimum(reach / reach[int(2 * u[0]):int(np.ceil(2 * u[-1]))].max(), 1.0)

def make_path(rng, look, amplitude, rate, n):
    """Local rate: that at which sliding goes on, held through dwells, never below 0.3 of the mean."""
    first, step = 1.25 if look["start"] == "tip" else 0.0, look["cycles"] / (n - 1)
    keep = int(round(first / step))
    u = first + step * np.arange(-keep, n)
    u[1:-1] += (0.3 if look["unequal"] else 0.0) * step * rng.uniform(-1.0, 1.0, u.size - 2)
    u[0] = 0.0
    t = (u - first) * 4.0 * amplitude / rate
    local = np.full_like(t, rate / (1.0 - look["dwell"]) if look["style"] in ("stairs", "trapezoid") else rate)
    if look["style"] == "hand":
        u[keep:], reach = by_hand(rng, u[keep:])
        q = amplitude * triangle(u) * reach[(2.0 * u).astype(int)]
        rate = float(np.abs(np.diff(q[keep:])).sum() / (t[-1] - t[keep]))
    else:
        q = amplitude * wave(look, u)
    if look["style"] in ("sine", "hand"):
        local = np.maximum(np.abs(np.gradient(q, t)), 0.3 * rate)
    return Trace(t, q, u, local, keep, amplitude, rate)

def draw_look(rng):
    start = str(rng.choice(["rest", "tip"], p=[0.6, 0.4]))
    style = str(rng.choice(["triangle", "sine", "trapezoid", "stairs", "hand"], p=[0.34, 0.16, 0.16, 0.16, 0.18]))
    cycles = [1.0, 1.5, 2.0, 3.0] if start == "tip" else [1.25, 2.0, 2.25, 3.0]
    return {"style": style, "start": start, "cycles": float(rng.choice(cycles)), "unequal": bool(rng.random() < 0.2),
            "steps": whole(rng, 6, 14), "dwell": uniform(rng, 0.2, 0.6), "correlated": max(uniform(rng, -0.6, 0.6), 0.0),
            "length": uniform(rng, 2.0, 10.0), "torque_noise": uniform(rng, 0.05, 0.25), "lsb": max(uniform(rng, -4.0, 2.0), 0.0)}

def draw_records(rng, look):
    """Records in order on the bench clock; the fastest a cycle of 8-60 s (at rated torque), rates spanning 3 to 30."""
    n, clock = whole(rng, 2, 4), 0.0
    amplitudes = np.where(rng.random(n) < pick(rng, 0.0, 0.0, 0.6), rng.uniform(0.5, 0.95, n), 1.0)
    amplitudes[int(rng.integers(n))] = 1.0
    spread = np.r_[0.0, 1.0, np.arange(1, n - 1) / (n - 1) + rng.uniform(-0.1, 0.1, n - 2)]
    rates = rng.permutation(4.0 / uniform(rng, 8.0, 60.0) * log_uniform(rng, 3.0, 30.0) ** -spread)
    paths = [make_path(rng, look, float(a), float(r), int(log_uniform(rng, 800, 6000)))
             for a, r in zip(amplitudes, rates, strict=True)]
    for p in paths:
        p.clock = clock - p.t[0]
        clock = p.clock + p.t[-1] + uniform(rng, 5.0, 60.0)
    return paths

def draw_unit(rng, family, turn):
    look, reducer = draw_look(rng), make_reducer(family, rng)
    return Unit(reducer, draw_records(rng, look), look, log_uniform(rng, 0.05, 1000.0), log_uniform(rng, 60.0, 3000.0),
                reducer.half * uniform(rng, -2.0, 2.0), turn)

# ---------------------------------------------------------------- effects
def interface_slip(rng, unit):
    kind, edge, power = unit.kind("one_way", "slip_front"), uniform(rng, 0.7, 0.88), uniform(rng, 1.0, 1.5)
    radii = np.linspace(0.5 + 0.5 * edge, 1.0, 9)[:-1]
    def slip(run):
        return clamp_slip(run.q, edge, power) if kind == "one_way" else np.mean([play(run.q, r) for r in radii], axis=0)
    return Effect({"kind": kind, "threshold": edge, "power": power}, BODY, adding(unit, slip), 1.2)

def viscoelastic_creep(rng, unit):
    kind, hold = unit.kind("kelvin", "spectrum", "stress_power"), uniform(rng, 1.4, 2.2)
    tau = float(np.clip(unit.mean_period * log_uniform(rng, 0.03, 0.4), 1.0, 100.0))
    times = np.clip(tau * np.array([0.2, 1.0, 5.0]), 1.0, 100.0) if kind == "spectrum" else [tau]
    def delayed(run):
        pull = run.q * np.abs(run.q) ** (hold - 1.0) if kind == "stress_power" else run.q
        return np.mean([lagged(run.path.t / v, pull, 0.0) for v in times], axis=0)
    return Effect({"kind": kind, "tau_s": [float(v) for v in times], "power": hold}, BODY, adding(unit, delayed), 0.8)

def asymmetric_stiffness(rng, unit):
    kind, way = unit.kind("softer_flank", "worn_flank", "late_support"), pick(rng, -1.0, 1.0)
    n, edge, drag, mu = uniform(rng, 1.0, 1.6), uniform(rng, 0.15, 0.45), uniform(rng, 0.01, 0.04), uniform(rng, 0.02, 0.08)
    def flank(run):
        if kind == "softer_flank":
            return way * np.maximum(way * run.theta, 0.0) / unit.reducer.half
        m = np.maximum(way * dry_play(run.q, run.fr, drag, mu), 0.0)
        return way * (m**n if kind == "worn_flank" else np.maximum(m - edge, 0.0))
    return Effect({"kind": kind, "side": way, "power": n, "edge": edge}, BODY, adding(unit, flank), 0.8)

def second_backlash(rng, unit):
    kind, drag = unit.kind("free_step", "shared_teeth", "load_dragged"), uniform(rng, 0.25, 0.55)
    width, mu = uniform(rng, 0.03, 0.12) / (6.0 if kind == "free_step" else 1.0), 0.15 if kind == "load_dragged" else 0.0
    meet = np.tanh if kind == "shared_teeth" else lambda m: np.clip(m, -1.0, 1.0)
    return Effect({"kind": kind, "drag": drag, "width": width, "mu": mu}, BODY,
                  adding(unit, lambda run: meet(dry_play(run.q, run.fr, drag, mu) / width)), 0.5)

def sensor_lag(rng, unit):
    kind, unit_s = unit.kind("first_order", "delay"), min(p.period for p in unit.paths)
    late = {"delay": lambda t, x, tau: np.interp(t - tau, t, x), "first_order": lambda t, x, tau: lagged(t / tau, x, x[0])}
    return Effect({"kind": kind, "unit_s": unit_s}, LAG,
                  lambda run, s: replace(run, theta=late[kind](run.path.t, run.theta, s * unit_s)), 0.08)

def thermal_drift(rng, unit):
    kind, total = unit.kind("warm_up", "room_cycle", "linear"), unit.paths[-1].clock + unit.paths[-1].t[-1]
    sign, phase, share = pick(rng, -1.0, 1.0), uniform(rng, 0.0, 2 * np.pi), uniform(rng, 0.15, 0.6)
    longest = max(p.t[-1] for p in unit.paths)
    tau = {"linear": total, "warm_up": total * share, "room_cycle": longest * (0.4 + 2.5 * share)}[kind]
    shape = {"linear": lambda z: z, "warm_up": lambda z: -np.expm1(-z), "room_cycle": lambda z: np.sin(2 * np.pi * z + phase)}
    return Effect({"kind": kind, "tau_s": float(tau), "sign": sign}, TIME,
                  adding(unit, lambda run: sign * shape[kind]((run.path.clock + run.path.t) / tau)), 2.0)

def torque_offset(rng, unit):
    kind, sign = unit.kind("dead_weight", "zero_shift"), pick(rng, -1.0, 1.0)
    share = sign * (np.ones(len(unit.paths)) if kind == "dead_weight" else rng.uniform(0.4, 1.0, len(unit.paths)))
    return Effect({"kind": kind, "share": share.tolist()}, LOAD,
                  lambda run, s: replace(run, q=run.q + s * share[run.index]), 0.2)

def encoder_error(rng, unit):
    kind, waves = unit.kind("single", "with_harmonic", "subdivision"), uniform(rng, 3.0, 16.0)
    parts = {"single": (1.0, 0.0), "with_harmonic": (1.0, 0.5), "subdivision": (0.25, 1.0)}[kind]
    phases, period = rng.uniform(0.0, 2 * np.pi, 2), 2.0 * unit.reducer.half / waves
    def ripple(run):
        turn = 2 * np.pi * (run.theta + unit.zero) / period
        return parts[0] * np.sin(turn + phases[0]) + parts[1] * np.sin(2 * turn + phases[1])
    return Effect({"kind": kind, "period_rad": period, "parts": parts}, CODE, adding(unit, ripple), 0.2)

def stick_slip(rng, unit):
    kind, red, depth = unit.kind("regular", "irregular", "ageing"), unit.reducer, uniform(rng, 0.3, 0.9)
    spread = np.exp((0.25 if kind == "irregular" else 0.0) * rng.standard_normal(211))
    tau, ageing = uniform(rng, 0.005, 0.03) * unit.mean_period, 0.6 if kind == "ageing" else 0.0
    def act(run, s):
        rub, low = red.friction * run.fr, red.drag * (1.0 - depth)
        held = breakaway(run.q, run.path.t, rub, low, low + 2.0 * depth * red.drag * spread, ageing, tau)
        return replace(run, theta=run.theta + s * red.scale * red.gland * (held - dry_play(run.q, rub, red.drag, 0.0)))
    return Effect({"kind": kind, "mean_drag": red.drag * red.friction, "depth": depth, "tau_s": tau}, BODY, act, 1.0)

def rate_dependent_friction(rng, unit):
    kind, sign, rates = unit.kind("logarithmic", "stribeck", "power_law"), pick(rng, -1.0, 1.0), [p.rate for p in unit.paths]
    middle, power = float(np.exp(np.mean(np.log(rates)))), uniform(rng, 0.2, 0.5)
    change = {"logarithmic": np.log, "stribeck": lambda z: np.exp(-z) - 0.4, "power_law": lambda z: z**power - 1.0}[kind]
    limit = 0.9 / float(np.max(np.abs(change(np.array(rates) / middle))))
    return Effect({"kind": kind, "sign": sign, "middle_rate_per_s": middle, "power": power}, LOAD, lambda run, s: replace(
        run, fr=run.fr * np.clip(1.0 + sign * s * change(run.path.local / middle), 0.1, 4.0)), limit)

def x_adc_step(rng, unit):
    kind, half = unit.kind("major_carry", "dead_code"), unit.reducer.half
    place, heights = half * uniform(rng, -0.6, 0.6), pick(rng, -1.0, 1.0) * np.array([-0.5, 1.0, -0.5])
    codes = place + half * uniform(rng, 0.4, 0.8) * np.array([-1.0, 0.0, 1.0])
    def dead(run, s):
        over, hang = run.theta - place, s * half
        return replace(run, theta=run.theta - np.clip(np.minimum(over, 2.0 * hang - over), 0.0, None))
    carry = adding(unit, lambda run: (run.theta[:, None] > codes) @ heights)
    return Effect({"kind": kind, "place_rad": place}, CODE, carry if kind == "major_carry" else dead, 0.6)

def x_bus_jitter(rng, unit):
    kind, block = unit.kind("packets", "bursts"), unit.mean_period / uniform(rng, 20.0, 80.0)
    late = rng.uniform(-1.0, 1.0, (len(unit.paths), 4096))
    if kind == "bursts":
        late *= np.repeat(rng.random((len(unit.paths), 512)) < 0.25, 8, axis=1)
    def act(run, s):
        now = late[run.index][((run.path.t - run.path.t[0]) / block).astype(int) % 4096]
        return replace(run, theta=np.interp(run.path.t - s * run.path.period * now, run.path.t, run.theta))
    return Effect({"kind": kind, "block_s": block}, LAG, act, 0.12)

def x_squeeze_film(rng, unit):
    kind, still = unit.kind("thins_under_load", "fills_near_zero"), uniform(rng, 0.05, 0.2)
    long, short = unit.mean_period * log_uniform(rng, 0.05, 0.3), unit.mean_period * uniform(rng, 0.002, 0.01)
    thin, fill = (long, short) if kind == "thins_under_load" else (short, long)
    return Effect({"kind": kind, "thin_s": thin, "fill_s": fill, "still": still}, BODY, adding(
        unit, lambda run: -film(run.path.t, run.q, thin, fill, still) * np.tanh(play(run.q, 0.03) / 0.08)), 0.6)

def x_remounted_record(rng, unit):
    kind, which = unit.kind("loose_fixture", "skewed_axis"), int(rng.integers(len(unit.paths)))
    drag, width, n, sign = uniform(rng, 0.03, 0.12), uniform(rng, 0.02, 0.08), uniform(rng, 1.2, 2.0), pick(rng, -1.0, 1.0)
    shape = {"loose_fixture": lambda q: np.tanh(play(q, drag) / width), "skewed_axis": lambda q: sign * np.abs(q) ** n}[kind]
    return Effect({"kind": kind, "record": which + 1, "drag": drag, "power": n}, BODY,
                  adding(unit, lambda run: shape(run.q) * (run.index == which)), 0.8)

def x_reversal_crosstalk(rng, unit):
    kind, tau = unit.kind("exponential", "ringing"), min(p.period for p in unit.paths) * uniform(rng, 0.02, 0.1)
    sign, beat = pick(rng, -1.0, 1.0), tau * uniform(rng, 0.4, 1.0)
    def transient(run):
        age, way = since_reversal(run.path.t, run.path.q)
        return sign * way * np.exp(-age / tau) * (np.cos(2 * np.pi * age / beat) if kind == "ringing" else 1.0)
    return Effect({"kind": kind, "tau_s": tau, "beat_s": beat}, TIME, adding(unit, transient), 1.0)

def x_friction_cycle(rng, unit):
    kind, phase, tau = unit.kind("room", "heater"), uniform(rng, 0.0, 1.0), unit.mean_period * uniform(rng, 0.3, 1.8)
    def warm(t):
        z = (t / tau + phase) % 1.0
        return np.sin(2 * np.pi * z) if kind == "room" else np.where(z < 0.3, 1.0 - 2.0 * z / 0.3, 2.0 * (z - 0.3) / 0.7 - 1.0)
    return Effect({"kind": kind, "tau_s": tau}, LOAD, lambda run, s: replace(
        run, fr=run.fr * (1.0 + s * warm(run.path.clock + run.path.t))), 0.9)

def x_seat_lottery(rng, unit):
    kind, width = unit.kind("random", "alternate"), uniform(rng, 0.05, 0.2)
    seats = rng.uniform(-1.0, 1.0, (len(unit.paths), 64))
    if kind == "alternate":
        seats = np.tile([1.0, 0.0, -1.0, 0.0], 16) * np.sign(seats[:, :1])
    def seated(run):
        half_cycle = np.floor(2.0 * run.path.u + 1e-9).astype(int)
        return seats[run.index][half_cycle % 64] * np.tanh(np.abs(run.path.q) / width)
    return Effect({"kind": kind, "width": width}, BODY, adding(unit, seated), 0.6)

def x_torque_wander(rng, unit):
    kind, waves = unit.kind("slow_wave", "walk"), uniform(rng, 0.7, 2.5)
    high = rng.standard_normal(6) / np.arange(1.0, 7.0) if kind == "walk" else np.ones(1)
    phases = rng.uniform(0.0, 2 * np.pi, (len(unit.paths), high.size, 1))
    def wander(run):
        z = waves * (run.path.t - run.path.t[0]) / (run.path.t[-1] - run.path.t[run.path.keep])
        return high / np.linalg.norm(high) @ np.sin(2 * np.pi * np.arange(1, high.size + 1)[:, None] * z + phases[run.index])
    return Effect({"kind": kind, "waves": waves}, LOAD, lambda run, s: replace(run, q=run.q + s * wander(run)), 0.2)

LISTED = (interface_slip, viscoelastic_creep, asymmetric_stiffness, second_backlash, sensor_lag, thermal_drift,
          torque_offset, encoder_error, stick_slip, rate_dependent_friction)
UNLISTED = (x_adc_step, x_bus_jitter, x_squeeze_film, x_remounted_record, x_reversal_crosstalk, x_friction_cycle,
            x_seat_lottery, x_torque_wander)
TRACES = (torque_offset, sensor_lag, thermal_drift, encoder_error)
OUTSIDE = {f.__name__ for f in TRACES + UNLISTED} - {"x_squeeze_film"}

BENCH = Bench(121, FAMILIES, LISTED, tuple((f, s) for s in SIZES[:2] for f in UNLISTED), TRACES, OUTSIDE, draw_unit)

if __name__ == "__main__":
    BENCH.main()
