"""Thirteenth outside bench: written without sight of the package it tests, with reducer mechanics of its own.

"python thirteenth_outside_bench.py OUT --units 80 --seed 131" writes OUT/case-01 ... (unit.toml, a CSV a record) and
OUT/key.json; the same seed gives the same bytes.

Families (torque in units of the rated torque, quasi-static; every one is odd, rate-independent, and closes after first loading).
Those marked * are bodies with two freedoms, the twist and a side motion, held by contacts that stiffen as they seat; each contact
rubs along its own tangent with a Coulomb limit that follows its own normal load; Newton steps find the balance at each torque.
cycloid_disc*    8-12 lobes whose normals meet in the pitch point, the disc borne by a preloaded eccentric bearing that gives way;
                 output bushes with scattered play in their holes follow in series.
strain_wave*     tooth zones that come into contact from the major axis outwards and slide radially as the wedge of the flanks
                 presses the flexspline onto the wave generator; the cup winds up and stiffens.
rack_yoke*       a spring-loaded yoke keeps the rack in the pinion without play, lifts off at some torque, and meets a stop.
oldham_disc*     two pairs of tongues, one edge of a pair bearing first; the floating disc shifts sideways against friction.
hypoid_thrust*   thrust on preloaded taper bearings whose cones wedge (friction in proportion to the load); a sliding mesh.
cross_roller*    rollers of scattered preload drag beside a toothed stage; each lets go at a travel of its own.
bolted_flange*   bolts in holes of scattered clearance, their clamped faces slipping one after another; a mesh in series.
friction_ring    traction contacts with a slip annulus (Mindlin); a ball ramp, itself with friction, presses harder with load.
journal_roll     journals of a tilting shaft climb the wall of their plain bushes until the load leaves the friction cone.
adhesive_plastic sticky asperities attach on touch, and let go only under tension.
A torsion shaft and, on most, a seal (a compliant slider) are added to each.

Conventions: x_bedding_in varies about the clean reducer, its truth; the rest as in outside_units.py. Records start from rest, at
a tip, at zero torque of a settled loop, or anywhere in it. Coarsely sampled paths are solved in substeps of at most 1/1500 of the
rated torque. Noise is in part correlated, over a number of samples or over a time. Units that miss a severity are drawn anew.
Unlisted kinds: x_bedding_in (clearance or friction changes with the cycles run), x_mains_hum (mains or fan in the angle reading,
aliased by slow clocks), x_lost_counts (encoder steps that stay, or last shortly), x_gain_drift (compliance follows temperature),
x_clamp_walk (fixture creeps on at each visit to a tip, never back), x_one_sided_rub (shield or cable rubs on one side only),
x_debris (chip or fibre in the mesh at one place), x_clock_skew (clocks of torque and angle run apart).
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
    simulate,
    triangle,
    uniform,
)


# ---------------------------------------------------------------- kernels
@njit
def rub(q, fr, base, ratio):
    """Moment behind a rubbing seat whose friction is base + ratio times the moment that arrives."""
    m, res = 0.0, np.empty_like(q)
    for i in range(q.size):
        f = base * fr[i] + min(ratio * fr[i], 0.8) * abs(q[i])
        m = min(max(m, q[i] - f), q[i] + f)
        res[i] = m
    return res

def slider(q, radius):
    return rub(q, np.ones_like(q), radius, 0.0)

@njit
def _balance(x, y, torque, scale, net, e0, f0, e, f, r, jac):
    """Residual and tangent at twist x and side motion y; contacts (ax, ay, gap, k, soft), friction (tx, ty, grip, drag, mu)."""
    r[0], r[1], jac[:, :] = -torque, 0.0, 0.0
    for j in range(net.shape[0]):
        ax, ay, gap, k, soft, tx, ty, grip, drag, mu = net[j]
        a, n, slope, dx, dy = ax * x + ay * y - gap, 0.0, 0.0, 0.0, 0.0
        if soft < 0.0:
            n, slope = k * a, k
        elif a > 0.0:
            n, slope = k * a * a / (a + soft), k * a * (a + 2.0 * soft) / (a + soft) ** 2
        e[j], f[j] = tx * x + ty * y, 0.0
        if grip > 0.0:
            part, tried = min(mu * scale, 0.7), f0[j] + grip * (e[j] - e0[j])
            limit = drag * scale + part * abs(n)
            f[j] = min(max(tried, -limit), limit)
            grow = 0.0 if abs(tried) <= limit else np.sign(tried) * part * np.sign(n) * slope
            dx, dy = (grip * tx, grip * ty) if abs(tried) <= limit else (grow * ax, grow * ay)
        r[0] += ax * n + tx * f[j]
        r[1] += ay * n + ty * f[j]
        jac[0, 0] += ax * ax * slope + tx * dx
        jac[0, 1] += ax * ay * slope + tx * dy
        jac[1, 0] += ay * ax * slope + ty * dx
        jac[1, 1] += ay * ay * slope + ty * dy
    return abs(r[0]) + abs(r[1])

@njit
def seated(q, fr, net):
    """Twist of a body on its contacts along a torque path; damped Newton steps."""
    m, res = net.shape[0], np.empty_like(q)
    e0, f0, e, f, r, jac = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(2), np.zeros((2, 2))
    x, y = 0.0, 0.0
    for i in range(q.size):
        norm = _balance(x, y, q[i], fr[i], net, e0, f0, e, f, r, jac)
        for _ in range(100):
            if norm < 1e-12:
                break
            det = jac[0, 0] * jac[1, 1] - jac[0, 1] * jac[1, 0]
            dx, dy = (jac[0, 1] * r[1] - jac[1, 1] * r[0]) / det, (jac[1, 0] * r[0] - jac[0, 0] * r[1]) / det
            for share in (1.0, 0.5, 0.25, 0.12, 0.06, 0.03, 0.015):
                got = _balance(x + share * dx, y + share * dy, q[i], fr[i], net, e0, f0, e, f, r, jac)
                if got < (1.0 - 0.05 * share) * norm:
                    break
            x, y, norm = x + share * dx, y + share * dy, got
        e0[:], f0[:], res[i] = e, f, x if norm < 1e-9 else np.nan
    return res

@njit
def ramp_load(q, fr, gain, wedge, preload):
    """Normal load of a ball ramp: it follows |torque| between the two slopes that its friction allows, above a preload."""
    c, res = 0.0, np.empty_like(q)
    for i in range(q.size):
        w, now = min(wedge * fr[i], 0.9 - 1.0 / gain), abs(q[i])
        c = min(max(c, gain * (1.0 - w) * now), gain * (1.0 + w) * now)
        res[i] = max(preload, c)
    return res

@njit
def traction(q, load, levels, scale):
    """Tangential motion of Hertz contacts with slip annuli, normal load varying; annulus i lies inside the contact of level i."""
    m, x, res = levels.size - 1, 0.0, np.empty_like(q)
    k = 1.5 / scale * np.diff(levels ** (1.0 / 3.0))
    depth, p = (0.5 * (levels[1:] + levels[:-1])) ** (2.0 / 3.0), np.zeros(m)
    for i in range(q.size):
        top, lo, hi = load[i] ** (2.0 / 3.0), -1e9, 1e9
        for _ in range(200):
            force, slope = 0.01 * x - q[i], 0.01
            for j in range(m):
                s = scale * max(top - depth[j], 0.0)
                z = x - p[j]
                force += k[j] * min(max(z, -s), s)
                if abs(z) < s:
                    slope += k[j]
            if abs(force) < 1e-13:
                break
            lo, hi = (x, hi) if force < 0.0 else (lo, x)
            step = x - force / slope
            x = step if lo < step < hi else 0.5 * (lo + hi)
        for j in range(m):
            s = scale * max(top - depth[j], 0.0)
            p[j] = x - min(max(x - p[j], -s), s)
        res[i] = x
    return res

@njit
def climb(q, fr, pull, lean, cone):
    """Place of a journal on the wall of its bush: it stays while the load's direction keeps within the friction cone."""
    at, res = 0.0, np.empty_like(q)
    for i in range(q.size):
        way, half = np.arctan2(q[i], pull + lean * abs(q[i])), min(cone * fr[i], 0.5)
        at = min(max(at, way - half), way + half)
        res[i] = at
    return res

@njit
def sticky(q, fr, place, hold, k, centre):
    """Twist on asperities of two flanks at +-place that attach on touch and let go at a stretch of hold; event by event."""
    n, stiff, pull, res = place.size, centre, 0.0, np.empty_like(q)
    on = np.zeros((2, n), dtype=np.bool_)
    for i in range(q.size):
        x = (q[i] + pull) / stiff
        for _ in range(20 * n):
            worst, side, who = 1e-13, 0, -1
            for s in range(2):
                for j in range(n):
                    p = (1.0 - 2.0 * s) * x - place[j]
                    over = -p - hold[j] * fr[i] if on[s, j] else p
                    if over > worst:
                        worst, side, who = over, s, j
            if who < 0:
                break
            on[side, who] = not on[side, who]
            way = 1.0 if on[side, who] else -1.0
            stiff += way * k[who]
            pull += way * (1.0 - 2.0 * side) * k[who] * place[who]
            x = (q[i] + pull) / stiff
        res[i] = x
    return res

@njit
def jerky(q, fr, kinetic, excess, beat):
    """Slider that holds until |q - m| exceeds its static level, which varies by event and place, then jumps to kinetic."""
    m, event, res = 0.0, 0, np.empty_like(q)
    for i in range(q.size):
        level = kinetic + excess[event % excess.size] * (1.0 + beat * np.sin(40.0 * m))
        if abs(q[i] - m) > level * fr[i]:
            m = q[i] - np.sign(q[i] - m) * kinetic * fr[i]
            event += 1
        res[i] = m
    return res

@njit
def walked(q, edge, side):
    """Way that a clamp has crept: it adds up while |q| grows beyond edge (on one side only unless side is zero)."""
    w, res = 0.0, np.zeros_like(q)
    for i in range(1, q.size):
        rise = max(abs(q[i]) - edge, 0.0) - max(abs(q[i - 1]) - edge, 0.0)
        if rise > 0.0 and side * q[i] >= 0.0:
            w += rise
        res[i] = w
    return res

@njit
def correlated(z, memory):
    """Unit-variance noise from white z, memory[i] being its correlation with the sample before."""
    res = z.copy()
    for i in range(1, z.size):
        res[i] = memory[i] * res[i - 1] + np.sqrt(1.0 - memory[i] ** 2) * z[i]
    return res

# ---------------------------------------------------------------- reducers
@dataclass
class Reducer:
    family: str
    parts: list
    shaft: float
    seal: float
    drag: float
    friction: float
    scale: float = 1.0
    half: float = 1.0

    def angle(self, run):
        parts = max(1, int(np.ceil(1500.0 * np.abs(np.diff(run.q)).max() - 1e-9)))
        fine, at = np.arange((run.q.size - 1) * parts + 1) / parts, np.arange(run.q.size)
        q, fr = (run.q, run.fr) if parts == 1 else (np.interp(fine, at, run.q), np.interp(fine, at, run.fr))
        rubs = self.friction * fr
        theta = sum(p(q, rubs) for p in self.parts) + self.shaft * q + self.seal * rub(q, rubs, self.drag, 0.0)
        return self.scale * theta[::parts]

def whole(rng, lo, hi):
    return int(rng.integers(lo, hi + 1))

def element(ax=0.0, ay=0.0, gap=0.0, k=0.0, soft=-1.0, tx=0.0, ty=0.0, reach=1.0, drag=0.0, mu=0.0, load=0.2):
    """A contact (two-sided and linear if soft is negative) and its friction, which lets go at about reach under a usual load."""
    return [ax, ay, gap, k, soft, tx, ty, (drag + mu * load) / reach, drag, mu]

def both(rows, side):
    """The rows and their mirror images for the other sense of torque; the side motion turns its sign with it if side is -1."""
    flip = np.array([-1.0, side, 1.0, 1.0, 1.0, -1.0, side, 1.0, 1.0, 1.0])
    return [*rows, *(np.array(rows) * flip).tolist()]

def body(rows):
    net = np.array([*rows, element(ay=1.0, k=1e-6)])
    return lambda q, fr: seated(q, fr, net)

def mesh(rng, gap, drag, mu, stiff):
    """A toothed stage: 2-4 pairs of scattered clearance, friction with the load, a weak centring through the gap."""
    n, reach, soft = whole(rng, 2, 4), log_uniform(rng, 0.003, 0.06), log_uniform(rng, 0.01, 0.3)
    rows = both([element(1.0, 0.0, gap * uniform(rng, 1.0, 1.5), stiff / n, soft, 1.0, 0.0, reach, 0.0, mu)
                 for _ in range(n)], 1.0)
    return body([*rows, element(1.0, k=uniform(rng, 0.02, 0.1)), element(tx=1.0, reach=reach, drag=drag)])

def some_gap(rng, most):
    """Clearance: none on a third of the stages, otherwise anything up to most."""
    return -uniform(rng, 0.0, 0.05) if rng.random() < 0.33 else most * uniform(rng, 0.01, 1.0) ** 1.5

def cycloid_disc(rng):
    m, lam, soft = whole(rng, 8, 12), uniform(rng, 0.55, 0.85), log_uniform(rng, 0.02, 0.2)
    beta, reach, mu = (np.arange(m) + 0.5) * np.pi / m, log_uniform(rng, 0.004, 0.05), log_uniform(rng, 0.02, 0.15)
    long = np.sqrt(1.0 + lam**2 - 2.0 * lam * np.cos(beta))
    lever, along = np.sin(beta) / long, (np.cos(beta) - lam) / long
    gaps = some_gap(rng, 0.3) + uniform(rng, 0.02, 0.3) * (1.0 - lever) + uniform(rng, 0.0, 0.06) * rng.random(m)
    stiff, bearing, push = uniform(rng, 1.5, 4.0), uniform(rng, 1.0, 8.0), uniform(rng, 0.0, 0.3)
    rows = both([element(c, s, g, 2.0 * stiff / m, soft, s, -c, reach, 0.0, mu)
                 for c, s, g in zip(lever, along, gaps, strict=True)], 1.0)
    rows += [element(0.0, 1.0, push / bearing, bearing, -1.0, 0.0, 1.0, reach, log_uniform(rng, 0.003, 0.03), 0.3 * mu),
             element(1.0, k=0.03, tx=1.0, reach=reach, drag=log_uniform(rng, 0.005, 0.06))]
    k, bush, play = whole(rng, 6, 10), uniform(rng, 1.0, 5.0), some_gap(rng, 0.25)
    angles, width = np.arange(k) * 2.0 * np.pi / k + 0.1, uniform(rng, 0.0, 0.8)
    holes = [element(np.sin(b), 0.0, max(play, 0.0) * (1.0 + width * rng.random()), bush / k, 0.05, 1.0, 0.0, reach, mu=0.5 * mu)
             for b in angles if np.sin(b) > 0.05]
    return [body(rows), body([*both(holes, 1.0), element(1.0, k=0.05, tx=1.0, reach=reach, drag=0.02)])]

def strain_wave(rng):
    m, wedge, first = whole(rng, 7, 11), uniform(rng, 0.25, 0.7), uniform(rng, -0.12, 0.06)
    spread, stiff, ring = uniform(rng, 0.1, 0.6), uniform(rng, 2.0, 5.0), uniform(rng, 1.0, 6.0)
    reach, mu, cup, bend = log_uniform(rng, 0.003, 0.04), uniform(rng, 0.03, 0.2), uniform(rng, 0.2, 0.8), uniform(rng, 0.1, 1.0)
    rows = both([element(1.0, -wedge, first + spread * z * z, stiff / m, 0.03, wedge, 1.0, reach, 0.0, mu, 0.1)
                 for z in (np.arange(m) + 0.5) / m], 1.0)
    rows += [element(0.0, 1.0, 0.0, ring, -1.0, 0.0, 1.0, reach, log_uniform(rng, 0.002, 0.03), 0.02),
             element(1.0, k=0.05, tx=1.0, reach=reach, drag=log_uniform(rng, 0.005, 0.05))]
    return [body(rows), lambda q, fr: cup * q * (1.0 + bend) / (1.0 + bend * np.abs(rub(q, fr, 0.01, 0.3 * mu)))]

def rack_yoke(rng):
    wedge, stiff, reach = uniform(rng, 0.25, 0.5), uniform(rng, 2.0, 5.0), log_uniform(rng, 0.003, 0.04)
    push, spring, stop = uniform(rng, 0.05, 0.3), uniform(rng, 0.2, 1.5), uniform(rng, 0.02, 0.3)
    mu, tilt = uniform(rng, 0.03, 0.2), uniform(rng, 0.0, 0.08)
    rows = both([element(1.0, -wedge, -g, 0.5 * stiff, 0.02, wedge, 1.0, reach, 0.0, mu) for g in (0.0, -tilt)], 1.0)
    rows += [element(0.0, 1.0, -push / spring, spring, -1.0, 1.0, 0.0, reach, 0.0, mu),
             element(0.0, 1.0, stop, 15.0, 0.01), element(ty=1.0, reach=reach, drag=log_uniform(rng, 0.003, 0.04)),
             element(1.0, k=0.05, tx=1.0, reach=reach, drag=log_uniform(rng, 0.005, 0.05))]
    return [body(rows)]

def oldham_disc(rng):
    parts = []
    for _ in range(2):
        near, far = some_gap(rng, 0.3), log_uniform(rng, 0.01, 0.25)
        stiff, soft, reach = uniform(rng, 1.0, 3.0), log_uniform(rng, 0.02, 0.4), log_uniform(rng, 0.004, 0.06)
        mu, lead = uniform(rng, 0.03, 0.25), uniform(rng, 0.3, 1.0)
        edges = [element(1.0, way * lead, g, stiff, soft, 0.0, 1.0, reach, 0.0, mu)
                 for way, g in ((1.0, near), (-1.0, max(near, 0.0) + far))]
        parts.append(body([*both(edges, -1.0), element(0.0, 1.0, k=uniform(rng, 0.1, 0.6)),
                           element(ty=1.0, reach=reach, drag=log_uniform(rng, 0.005, 0.06)),
                           element(1.0, k=0.05, tx=1.0, reach=reach, drag=log_uniform(rng, 0.005, 0.04))]))
    return parts

def hypoid_thrust(rng):
    held, stiff, reach = uniform(rng, 0.03, 0.4), uniform(rng, 0.7, 3.0), log_uniform(rng, 0.005, 0.08)
    cone = element(1.0, 0.0, -held, stiff, log_uniform(rng, 0.01, 0.2), 1.0, 0.0, reach, 0.0, uniform(rng, 0.05, 0.45))
    return [body([*both([cone], 1.0), element(1.0, k=uniform(rng, 0.02, 0.2))]),
            mesh(rng, some_gap(rng, 0.5), log_uniform(rng, 0.005, 0.06), uniform(rng, 0.05, 0.25), uniform(rng, 1.0, 4.0))]

def cross_roller(rng):
    m, total, gap = whole(rng, 16, 30), log_uniform(rng, 0.02, 0.2), some_gap(rng, 0.4)
    drags, travels = total * rng.dirichlet(np.full(m, 1.5)), log_uniform(rng, 0.01, 0.15) * np.exp(0.8 * rng.standard_normal(m))
    teeth, mu, soft = whole(rng, 3, 5), uniform(rng, 0.0, 0.1), log_uniform(rng, 0.02, 0.4)
    rows = both([element(1.0, 0.0, gap + uniform(rng, 0.0, 0.1), uniform(rng, 1.0, 3.0) / teeth, soft, 1.0, 0.0, 0.03, 0.0, mu)
                 for _ in range(teeth)], 1.0)
    rows += [element(tx=1.0, reach=r, drag=d) for r, d in zip(travels, drags, strict=True)]
    return [body([*rows, element(1.0, k=uniform(rng, 0.02, 0.15))])]

def bolted_flange(rng):
    n, faces, reach = whole(rng, 4, 8), log_uniform(rng, 0.05, 0.6), log_uniform(rng, 0.01, 0.1)
    hole, bolts, mu = uniform(rng, 0.05, 0.4), uniform(rng, 2.0, 6.0), uniform(rng, 0.02, 0.15)
    slips = [element(tx=1.0, reach=reach * uniform(rng, 0.5, 2.0), drag=d) for d in faces * rng.dirichlet(np.full(n, 3.0))]
    holes = hole * rng.uniform(0.6, 1.6, n)
    shanks = both([element(1.0, 0.0, h, bolts / n, 0.02, 1.0, 0.0, reach, 0.0, mu) for h in holes], 1.0)
    return [body([*slips, *shanks, element(1.0, k=uniform(rng, 0.2, 1.0))]),
            mesh(rng, some_gap(rng, 0.4), log_uniform(rng, 0.005, 0.06), uniform(rng, 0.02, 0.12), uniform(rng, 1.0, 4.0))]

def friction_ring(rng):
    gain, wedge, preload = uniform(rng, 1.4, 2.5), uniform(rng, 0.03, 0.3), uniform(rng, 0.06, 0.7)
    scale, turn, levels = uniform(rng, 0.3, 1.2), uniform(rng, 0.05, 0.5), np.linspace(0.0, 1.0, 61) ** 1.5 * 7.0
    base, ratio = log_uniform(rng, 0.003, 0.04), uniform(rng, 0.0, 0.06)
    def ring(q, fr):
        m = rub(q, fr, base, ratio)
        load = ramp_load(m, fr, gain, wedge, preload)
        return traction(m, load, levels, scale) + turn * np.sign(m) * (load ** (2.0 / 3.0) - preload ** (2.0 / 3.0))
    return [ring]

def journal_roll(rng):
    lever = uniform(rng, 0.2, 0.8)
    def bush(share):
        pull, lean, cone = log_uniform(rng, 0.01, 0.3), uniform(rng, 0.2, 0.5), log_uniform(rng, 0.03, 0.3)
        clear, dent, firm = some_gap(rng, 0.8), uniform(rng, 0.1, 1.0), uniform(rng, 0.2, 1.0)
        def side(q, fr):
            force = np.hypot(q, pull + lean * np.abs(q))
            depth = max(clear, 0.0) + dent * force / (firm + force) + 0.1 * force
            return share * depth * np.sin(climb(q, fr, pull, lean, cone))
        return side
    return [bush(lever), bush(1.0 - lever),
            mesh(rng, some_gap(rng, 0.3), log_uniform(rng, 0.004, 0.05), uniform(rng, 0.02, 0.12), uniform(rng, 1.0, 4.0))]

def adhesive_plastic(rng):
    n, gap, rough = whole(rng, 60, 120), some_gap(rng, 0.4), log_uniform(rng, 0.02, 0.25)
    place = gap + rough * rng.exponential(1.0, n)
    hold = log_uniform(rng, 0.003, 0.06) * rng.gamma(2.0, 0.5, n)
    k, centre = uniform(rng, 1.5, 5.0) / n * rng.gamma(4.0, 0.25, n), uniform(rng, 0.05, 0.3)
    base, ratio, give = log_uniform(rng, 0.003, 0.04), uniform(rng, 0.0, 0.1), uniform(rng, 0.0, 0.6)
    return [lambda q, fr: sticky(rub(q, fr, base, ratio), fr, place, hold, k, centre), lambda q, fr: give * np.arcsinh(q)]

FAMILIES = (cycloid_disc, strain_wave, rack_yoke, oldham_disc, hypoid_thrust, cross_roller, bolted_flange, friction_ring,
            journal_roll, adhesive_plastic)

def closes(theta):
    """Whether the cycles of a settled path repeat after the first loading, and the branches rise."""
    return max(np.abs(theta[-8000:] - theta[-12000:-4000]).max(), -np.diff(theta[-2001:]).min()) < 2e-7 * np.ptp(theta)

def make_reducer(family, rng):
    """Draws until the loop takes 0.5-35 % of its box and loops of three amplitudes close; half the range is 1' to 3 degrees."""
    while True:
        red = Reducer(family.__name__, family(rng), log_uniform(rng, 0.01, 0.5), uniform(rng, 0.0, 0.3) * (rng.random() < 0.7),
                      log_uniform(rng, 0.02, 0.15), log_uniform(rng, 0.3, 4.0))
        paths = [settled_path(a, 1.0) for a in (1.0, 0.45, 1.2)]
        loops = [red.angle(Run(p, 0, p.q, np.ones_like(p.q))) for p in paths]
        shape = loop_indicators(paths[0].q, loops[0])
        if all(map(closes, loops)) and 0.02 < shape["area_J"] / shape["peak_rad"] < 1.4 and shape["absorbed_J"] > shape["area_J"]:
            break
    red.scale = log_uniform(rng, 1.0, 180.0) * ARCMIN / shape["peak_rad"]
    red.half = shape["peak_rad"] * red.scale
    return red

# ---------------------------------------------------------------- paths and records
def wave(look, u):
    if look["style"] == "sine":
        return np.sin(2.0 * np.pi * u)
    if look["style"] == "trapezoid":
        return np.clip(triangle(u) / (1.0 - look["dwell"]), -1.0, 1.0)
    if look["style"] == "stairs":
        stair = 4 * look["steps"] * u
        return triangle((np.floor(stair) + np.minimum(stair % 1.0 / (1.0 - look["dwell"]), 1.0)) / (4 * look["steps"]))
    return triangle(u)

def make_path(rng, look, amplitude, rate, n):
    """Local rate: that at which sliding goes on, held through dwells, never below 0.2 of the mean."""
    first, step = look["first"], look["cycles"] / (n - 1)
    keep = int(round(first / step))
    u = first + step * np.arange(-keep, n)
    if look["unequal"] == "jitter":
        u[1:-1] += 0.35 * step * rng.uniform(-1.0, 1.0, u.size - 2)
    elif look["unequal"] == "gaps":
        stay = rng.random(u.size) > look["gaps"]
        stay[[0, keep, -1]] = True
        u, keep = u[stay], int(stay[:keep].sum())
    u[0] = 0.0
    t = (u - first) * 4.0 * amplitude / rate
    local = np.full_like(t, rate / (1.0 - look["dwell"]) if look["style"] in ("stairs", "trapezoid") else rate)
    if look["style"] == "sine":
        local = np.maximum(0.5 * np.pi * rate * np.abs(np.cos(2.0 * np.pi * u)), 0.2 * rate)
    return Trace(t, amplitude * wave(look, u), u, local, keep, amplitude, rate)

def draw_look(rng):
    start, over = pick(rng, "rest", "rest", "rest", "tip", "tip", "zero", "anywhere"), pick(rng, "samples", "seconds")
    cycles = {"rest": (1.25, 2.25, 3.0), "tip": (1.0, 1.5, 2.0, 3.0)}.get(start, (1.25, 2.0, 3.0))
    first = {"rest": 0.0, "tip": 1.25, "zero": 2.0}.get(start, uniform(rng, 1.25, 2.25))
    style = str(rng.choice(["triangle", "sine", "trapezoid", "stairs"], p=[0.34, 0.22, 0.2, 0.24]))
    return {"style": style, "start": start, "first": first, "cycles": float(rng.choice(cycles)), "steps": whole(rng, 5, 12),
            "dwell": uniform(rng, 0.15, 0.6), "pace": str(rng.choice(["fast", "normal", "slow"], p=[0.3, 0.4, 0.3])),
            "sampling": pick(rng, "clock", "count"), "unequal": str(rng.choice(["no", "jitter", "gaps"], p=[0.7, 0.18, 0.12])),
            "gaps": uniform(rng, 0.02, 0.2), "correlated": max(uniform(rng, -0.5, 0.7), 0.0), "over": over,
            "length": log_uniform(rng, 1.5, 25.0), "torque_noise": uniform(rng, 0.02, 0.3),
            "lsb": max(uniform(rng, -4.0, 2.5), 0.0), "torque_lsb": max(uniform(rng, -0.6, 0.3), 0.0)}

def draw_records(rng, look):
    """Records in order on the bench clock: 1-3 s (fast), half a minute, or up to an hour (slow); clocks of 1 Hz to 20 kHz."""
    n, clock, done = int(rng.choice([2, 3, 4, 5], p=[0.25, 0.4, 0.2, 0.15])), 0.0, 0.0
    amplitudes = rng.uniform(0.4, 1.2, n) if rng.random() < 0.4 else np.ones(n)
    amplitudes[int(rng.integers(n))] = 1.0
    spread = 1.0 if rng.random() < 0.2 else log_uniform(rng, 2.0, 20.0)
    ranges = {"fast": (0.7, 3.0), "normal": (5.0, 90.0), "slow": (900.0 / spread, 3600.0 / spread)}
    places = np.r_[0.0, 1.0, np.arange(1, n - 1) / (n - 1) + rng.uniform(-0.1, 0.1, n - 2)]
    rates = rng.permutation(4.0 * look["cycles"] / log_uniform(rng, *ranges[look["pace"]]) * spread**-places)
    lasts, most = 4.0 * amplitudes * look["cycles"] / rates, log_uniform(rng, 300.0, 10000.0)
    counts = most * lasts / lasts.max() if look["sampling"] == "clock" else np.full(n, most)
    counts = np.clip(counts, np.maximum(np.minimum(lasts, 9000.0), 300.0), np.minimum(10000.0, 20000.0 * lasts)).astype(int)
    look["clock_Hz"] = (counts / lasts).tolist()
    paths = [make_path(rng, look, float(a), float(r), int(c)) for a, r, c in zip(amplitudes, rates, counts, strict=True)]
    for p in paths:
        p.clock, p.done = clock - p.t[0], done
        clock, done = p.clock + p.t[-1] + uniform(rng, 5.0, 60.0), done + p.u[-1]
    return paths

def measure(rng, unit, index, effects):
    """Time, torque and angle as the bench records them, SI; correlation over samples, or over seconds of the quickest clock."""
    path, look = unit.paths[index], unit.look
    theta = simulate(unit, path, index, effects)[path.keep:] + unit.zero
    t, share = path.t[path.keep:] - path.t[path.keep], look["correlated"]
    apart = np.r_[0.0, np.diff(t)] * max(look["clock_Hz"]) if look["over"] == "seconds" else np.ones_like(t)
    slow = correlated(rng.standard_normal(t.size), np.exp(-apart / look["length"]))
    theta = theta + unit.sd * (np.sqrt(1.0 - share) * rng.standard_normal(t.size) + np.sqrt(share) * slow)
    q = path.q[path.keep:] + look["torque_noise"] / unit.snr * rng.standard_normal(t.size)
    if look["lsb"] > 0.0:
        theta = look["lsb"] * unit.sd * np.round(theta / (look["lsb"] * unit.sd))
    if look["torque_lsb"] > 0.0:
        q = look["torque_lsb"] / unit.snr * np.round(q * unit.snr / look["torque_lsb"])
    return t, unit.rated * q, theta

def draw_unit(rng, family, turn):
    look, reducer = draw_look(rng), make_reducer(family, rng)
    return Unit(reducer, draw_records(rng, look), look, log_uniform(rng, 0.05, 1000.0), log_uniform(rng, 150.0, 5000.0),
                reducer.half * uniform(rng, -2.0, 2.0), turn)

# ---------------------------------------------------------------- effects
def longest_record(unit):
    return max(float(p.t[-1] - p.t[p.keep]) for p in unit.paths)

def through(path):
    """Share of the record that is over; negative before its start."""
    return (path.t - path.t[path.keep]) / (path.t[-1] - path.t[path.keep])

def interface_slip(rng, unit):
    kind, edge, power = unit.kind("sharp", "gradual", "two_clamps"), uniform(rng, 0.65, 0.88), uniform(rng, 1.3, 2.2)
    def slip(run):
        if kind == "two_clamps":
            return clamp_slip(run.q, edge, 1.0) + 0.7 * clamp_slip(run.q, 0.5 * (1.0 + edge), 1.0)
        return clamp_slip(run.q, edge, 1.0 if kind == "sharp" else power)
    return Effect({"kind": kind, "threshold": edge, "power": power}, BODY, adding(unit, slip), 1.2)

def viscoelastic_creep(rng, unit):
    kind, edge, n = unit.kind("single_time", "decades", "above_threshold"), uniform(rng, 0.15, 0.4), whole(rng, 3, 5)
    tau = unit.mean_period * log_uniform(rng, 0.03, 0.5)
    times = np.clip(tau * (np.logspace(-1.0, 1.0, n) if kind == "decades" else np.ones(1)), 0.1, 300.0)
    def delayed(run):
        pull = np.sign(run.q) * np.maximum(np.abs(run.q) - edge, 0.0) if kind == "above_threshold" else run.q
        return np.mean([lagged(run.path.t / v, pull, 0.0) for v in times], axis=0)
    return Effect({"kind": kind, "tau_s": times.tolist(), "edge": edge}, BODY, adding(unit, delayed), 0.8)

def asymmetric_stiffness(rng, unit):
    kind, way, n = unit.kind("bowed", "soft_side", "early_support"), pick(rng, -1.0, 1.0), uniform(rng, 1.3, 2.4)
    base, ratio, edge = uniform(rng, 0.005, 0.04), uniform(rng, 0.0, 0.08), uniform(rng, 0.2, 0.6)
    def flank(run):
        m = way * rub(run.q, run.fr, base, ratio)
        return way * {"bowed": np.abs(m) ** n, "soft_side": np.maximum(m, 0.0), "early_support": -np.maximum(m - edge, 0.0)}[kind]
    return Effect({"kind": kind, "side": way, "power": n, "edge": edge}, BODY, adding(unit, flank), 0.8)

def second_backlash(rng, unit):
    kind, drag = unit.kind("sharp", "rounded", "rubbing"), uniform(rng, 0.2, 0.6)
    width, mu = uniform(rng, 0.01, 0.03) if kind == "sharp" else uniform(rng, 0.04, 0.15), 0.2 if kind == "rubbing" else 0.0
    def step(run):
        z = rub(run.q, run.fr, drag, mu) / width
        return z / np.sqrt(1.0 + z * z) if kind == "rounded" else np.clip(z, -1.0, 1.0)
    return Effect({"kind": kind, "drag": drag, "width": width, "mu": mu}, BODY, adding(unit, step), 0.5)

def sensor_lag(rng, unit):
    kind, unit_s = unit.kind("low_pass", "transport", "moving_mean"), min(p.period for p in unit.paths)
    def late(t, x, tau):
        if kind == "low_pass":
            return lagged(t / tau, x, x[0])
        shares = (np.arange(20) + 0.5) / 10.0 if kind == "moving_mean" else (1.0,)
        return np.mean([np.interp(t - tau * z, t, x) for z in shares], axis=0)
    return Effect({"kind": kind, "unit_s": unit_s}, LAG,
                  lambda run, s: replace(run, theta=late(run.path.t, run.theta, s * unit_s)), min(0.08, 5.0 / unit_s))

def thermal_drift(rng, unit):
    kind, sign, longest = unit.kind("settling", "steady", "swaying"), pick(rng, -1.0, 1.0), longest_record(unit)
    phase, total = uniform(rng, 0.0, 2 * np.pi), unit.paths[-1].clock + unit.paths[-1].t[-1]
    tau = {"settling": total * uniform(rng, 0.1, 0.6), "steady": total, "swaying": longest * uniform(rng, 0.6, 3.0)}[kind]
    shape = {"settling": lambda z: -np.expm1(-z), "steady": lambda z: z, "swaying": lambda z: np.sin(2 * np.pi * z + phase)}[kind]
    return Effect({"kind": kind, "tau_s": float(tau), "sign": sign}, TIME,
                  adding(unit, lambda run: sign * shape((run.path.clock + run.path.t) / tau)), 2.0)

def torque_offset(rng, unit):
    kind, sign, n = unit.kind("hanging_arm", "each_record_anew"), pick(rng, -1.0, 1.0), len(unit.paths)
    share = sign * (np.ones(n) if kind == "hanging_arm" else rng.uniform(0.3, 1.0, n))
    return Effect({"kind": kind, "share": share.tolist()}, LOAD, lambda run, s: replace(run, q=run.q + s * share[run.index]), 0.2)

def encoder_error(rng, unit):
    kind, waves = unit.kind("sine", "two_tones", "sawtooth"), uniform(rng, 2.5, 20.0)
    phase, period = uniform(rng, 0.0, 1.0), 2.0 * unit.reducer.half / waves
    def ripple(run):
        z = (run.theta + unit.zero) / period + phase
        tones = {"sine": (1.0,), "two_tones": (0.7, 0.0, 0.0, 0.7), "sawtooth": (1.0, 0.5, 0.33, 0.25)}[kind]
        return sum(a * np.sin(2 * np.pi * (k + 1) * z) for k, a in enumerate(tones))
    return Effect({"kind": kind, "period_rad": period}, CODE, adding(unit, ripple), 0.2)

def stick_slip(rng, unit):
    kind, drag, depth = unit.kind("even", "scattered", "by_place"), uniform(rng, 0.05, 0.15), uniform(rng, 0.3, 0.9)
    excess = 2.0 * depth * drag * np.exp((0.3 if kind == "scattered" else 0.0) * rng.standard_normal(199))
    beat = 0.7 if kind == "by_place" else 0.0
    return Effect({"kind": kind, "mean_drag": drag, "depth": depth}, BODY, adding(unit, lambda run: jerky(
        run.q, run.fr, drag * (1.0 - depth), excess, beat) - rub(run.q, run.fr, drag, 0.0)), 0.5)

def rate_dependent_friction(rng, unit):
    kind, sign, rates = unit.kind("logarithmic", "weakening", "power_law"), pick(rng, -1.0, 1.0), [p.rate for p in unit.paths]
    middle, n = float(np.exp(np.mean(np.log(rates)))), uniform(rng, 0.15, 0.5)
    change = {"logarithmic": np.log, "weakening": lambda z: 1.0 / (1.0 + z) - 0.5, "power_law": lambda z: z**n - 1.0}[kind]
    limit = 0.9 / max(float(np.max(np.abs(change(np.array(rates) / middle)))), 0.3)
    return Effect({"kind": kind, "sign": sign, "middle_rate_per_s": middle, "power": n}, LOAD, lambda run, s: replace(
        run, fr=run.fr * np.clip(1.0 + sign * s * change(run.path.local / middle), 0.1, 4.0)), limit)

def x_bedding_in(rng, unit):
    kind, last, sign = unit.kind("clearance", "friction"), unit.paths[-1], pick(rng, -1.0, 1.0)
    total, drag, width = last.done + last.u[-1], uniform(rng, 0.03, 0.12), uniform(rng, 0.03, 0.12)
    pace = total * uniform(rng, 0.1, 0.6)
    def worn(run):
        return sign * (np.exp(-(run.path.done + run.path.u) / pace) + pace / total * np.expm1(-total / pace))
    wider = adding(unit, lambda run: worn(run) * np.clip(slider(run.q, drag) / width, -1.0, 1.0))
    def freer(run, s):
        return replace(run, fr=run.fr * (1.0 + s * worn(run)))
    return Effect({"kind": kind, "cycles": pace}, *((BODY, wider) if kind == "clearance" else (LOAD, freer)), 0.9)

def x_mains_hum(rng, unit):
    kind, phase = unit.kind("mains", "fan"), uniform(rng, 0.0, 2 * np.pi)
    f = pick(rng, 50.0, 60.0) * uniform(rng, 0.998, 1.002) if kind == "mains" else log_uniform(rng, 5.0, 40.0)
    sway, depth = 2 * np.pi / (unit.mean_period * uniform(rng, 0.2, 2.0)), 0.0 if kind == "mains" else uniform(rng, 0.5, 3.0)
    def hum(run):
        t = run.path.clock + run.path.t
        return np.sin(2 * np.pi * f * t + phase + depth * np.sin(sway * t))
    return Effect({"kind": kind, "frequency_Hz": f, "phase_sway": depth}, TIME, adding(unit, hum), 0.3)

def x_lost_counts(rng, unit):
    kind, n = unit.kind("stays", "returns"), whole(rng, 2, 6)
    places, heights = np.sort(rng.random((len(unit.paths), n)), axis=1), rng.choice([-1.0, 1.0], (len(unit.paths), n))
    width = uniform(rng, 0.01, 0.08)
    def steps(run):
        z = through(run.path)[:, None] - places[run.index]
        return ((z > 0.0) & ((z < width) | (kind == "stays"))) @ heights[run.index]
    return Effect({"kind": kind, "steps": n, "width": width}, TIME, adding(unit, steps), 0.6)

def x_gain_drift(rng, unit):
    kind, sign, phase = unit.kind("warming", "swaying"), pick(rng, -1.0, 1.0), uniform(rng, 0.0, 2 * np.pi)
    tau = longest_record(unit) * (uniform(rng, 0.2, 0.8) if kind == "warming" else uniform(rng, 0.4, 2.0))
    shape = {"warming": lambda z: -np.expm1(-z), "swaying": lambda z: np.sin(2 * np.pi * z + phase)}[kind]
    return Effect({"kind": kind, "tau_s": float(tau), "sign": sign}, BODY, lambda run, s: replace(
        run, theta=run.theta * (1.0 + sign * s * shape((run.path.clock + run.path.t) / tau))), 0.5)

def x_clamp_walk(rng, unit):
    kind, way, edge = unit.kind("both_tips", "one_tip"), pick(rng, -1.0, 1.0), uniform(rng, 0.5, 0.85)
    side = 0.0 if kind == "both_tips" else pick(rng, -1.0, 1.0)
    return Effect({"kind": kind, "direction": way, "side": side, "edge": edge}, BODY,
                  adding(unit, lambda run: way * walked(run.q, edge, side)), 1.0)

def x_one_sided_rub(rng, unit):
    kind, way = unit.kind("shield", "cable"), pick(rng, -1.0, 1.0)
    (lo, hi), r = ((0.1, 0.4), uniform(rng, 0.04, 0.15)) if kind == "shield" else ((-0.5, -0.2), uniform(rng, 0.15, 0.4))
    edge = uniform(rng, lo, hi)
    def rubbing(run):
        z = np.maximum(way * run.q - edge, 0.0)
        return way * (slider(z, r) - slider(z, 0.1 * r))
    return Effect({"kind": kind, "side": way, "edge": edge, "drag": r}, BODY, adding(unit, rubbing), 1.5)

def x_debris(rng, unit):
    kind, sign, place = unit.kind("chip", "fibre"), pick(rng, -1.0, 1.0), pick(rng, -1.0, 1.0) * uniform(rng, 0.1, 0.7)
    width, r = uniform(rng, 0.04, 0.15), uniform(rng, 0.005, 0.03) if kind == "chip" else uniform(rng, 0.1, 0.25)
    return Effect({"kind": kind, "place": place, "width": width, "drag": r}, BODY, adding(
        unit, lambda run: sign * np.exp(-(((slider(run.q, r) - place) / width) ** 2))), 0.6)

def x_clock_skew(rng, unit):
    kind, n, sign = unit.kind("runs_apart", "set_right"), uniform(rng, 2.5, 7.0), pick(rng, -1.0, 1.0)
    def act(run, s):
        p, z = run.path, through(run.path)
        late = z - 0.5 if kind == "runs_apart" else (n * z) % 1.0 - 0.5
        return replace(run, theta=np.interp(p.t - sign * s * p.period * late, p.t, run.theta))
    return Effect({"kind": kind, "corrections": n}, LAG, act, 0.15)

LISTED = (interface_slip, viscoelastic_creep, asymmetric_stiffness, second_backlash, sensor_lag, thermal_drift,
          torque_offset, encoder_error, stick_slip, rate_dependent_friction)
UNLISTED = (x_bedding_in, x_mains_hum, x_lost_counts, x_gain_drift, x_clamp_walk, x_one_sided_rub, x_debris, x_clock_skew)
TRACES = (torque_offset, sensor_lag, thermal_drift, encoder_error)
OUTSIDE = {f.__name__ for f in TRACES + UNLISTED} - {"x_debris"}

BENCH = Bench(131, FAMILIES, LISTED, tuple((f, s) for s in SIZES[:2] for f in UNLISTED), TRACES, OUTSIDE, draw_unit, measure)

if __name__ == "__main__":
    BENCH.main()
