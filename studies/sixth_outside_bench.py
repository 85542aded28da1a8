"""A sixth virtual bench written without sight of the package: torque paths with friction joints before implicitly solved stages.

    python studies/sixth_outside_bench.py /tmp/sixth --units 80 --seed 61
    python studies/sixth_outside_bench.py /tmp/sixth --selfcheck

The input shaft is locked, the output is loaded; torque is commanded, angle answers.  A clean reducer is made of two elements,
both exact for any step as long as the input is monotone within the step:
* a torque path: friction joints one after another, each passing the torque T_i = clip(T_i, u - f(u), u + f(u)), f = c + mu |u|
  (Coulomb part and part that grows with the load; belts, threads, meshes, rods in a sleeve);
* a stage: an elastic contact G(x) (teeth or pins of scattered clearance, Hertz contact, preloaded pairs, ropes that go slack,
  rubber) beside a friction body (Jenkins elements, a Dahl bristle or Berg's rubber friction); x is found implicitly from
  G(x) + k0 x + friction(x, history) = T.
Eight kinds: helical_train, cycloid_pins, strain_wave, plastic_planetary, ball_screw, rope_drum, rubber_coupling, worm.
Torque and angle are normalised inside (rated torque 1) and scaled at the end.  Faults act on the torque path, in the reducer or
on the channels; the size of a fault is searched so that the rms of faulty minus clean angle at the same recorded torque, after
a least-squares refit of record offsets, compliance, cubic compliance, clearance and friction, is a multiple of the noise sd.
"""
# ruff: noqa: B007, B905, E401, E402, E701, E702, I001
import argparse
import json
import os

import numpy as np
from numba import njit
from scipy.signal import lfilter

LISTED = ["sensor_lag", "thermal_drift", "torque_offset", "encoder_error", "interface_slip", "viscoelastic_creep",
          "asymmetric_stiffness", "second_backlash", "stick_slip", "rate_dependent_friction"]
CHANNEL = LISTED[:4]
UNLISTED = ["x_torque_lag", "x_running_in", "x_torque_clipping", "x_local_pit", "x_ringing", "x_hum", "x_lost_counts",
            "x_warming_compliance", "x_ratchet"]
KINDS = ["helical_train", "cycloid_pins", "strain_wave", "plastic_planetary", "ball_screw", "rope_drum",
         "rubber_coupling", "worm"]
MULTIPLE = {1.0: 20.0, 0.4: 6.0, 0.2: 2.5}
STYLES = ["triangle", "sine", "dwell", "stairs", "hand"]

# ------------------------------------------------------------------ kernels
@njit
def joints(u, c, mu):
    """Torque behind each of n friction joints in a row, shape (n, len(u)); at rest at first."""
    n, m = c.size, u.size; out = np.empty((n, m))
    for j in range(n):
        t = 0.0
        for i in range(m):
            v = u[i] if j == 0 else out[j - 1, i]; f = c[j] + mu[j] * abs(v); t = min(max(t, v - f), v + f)
            out[j, i] = t
    return out

@njit
def joint_varying(u, c):
    """One friction joint whose limit c changes from sample to sample."""
    out = np.empty(u.size); t = 0.0
    for i in range(u.size):
        t = min(max(t, u[i] - c[i]), u[i] + c[i]); out[i] = t
    return out

@njit
def contact(x, G, dx):
    a = abs(x) / dx; i = int(a)
    if i > G.size - 2: i = G.size - 2
    g = G[i] + (a - i) * (G[i + 1] - G[i])
    return g if x >= 0 else -g

@njit
def friction(x, x0, g, s, kt, c, mu, mode, turn, keep=False):
    """Friction at x; s is its state at x0 (kept at x if asked).  mode 0 Jenkins, 1 Dahl, 2 Berg (turn = xs, Fs, direction)."""
    f, d = 0.0, x - x0
    for j in range(c.size):
        if mode == 0:
            lim = c[j] + mu[j] * abs(g); v = min(max(s[j] + kt[j] * d, -lim), lim)
        elif mode == 1:
            lim = c[j] if d > 0 else -c[j]; v = lim + (s[j] - lim) * np.exp(-kt[j] * abs(d) / c[j])
        elif d == 0.0: v = s[j]
        else:
            sg = 1.0 if d > 0 else -1.0; xs, fs = x0, s[j]
            if sg == turn[2]: xs, fs = turn[0], turn[1]
            v = fs + (x - xs) * (c[j] - sg * fs) / max(c[j] / kt[j] * (1.0 - sg * fs / c[j]) + abs(x - xs), 1e-300)
            if keep: turn[0], turn[1], turn[2] = xs, fs, sg
        if keep: s[j] = v
        f += v
    return f

@njit
def stage(u, G, dx, k0, kt, c, mu, mode):
    """Twist x of a stage under the torque u: G(x) + k0 x + friction = u."""
    m = u.size; out = np.empty(m); s = np.zeros(max(c.size, 1)); turn = np.zeros(3); x0, held, h0 = 0.0, 0.0, 5 * dx
    for i in range(m):
        g = contact(x0, G, dx); ra = g + k0 * x0 + friction(x0, x0, g, s, kt, c, mu, mode, turn) - u[i]
        if abs(ra) < 1e-13 or abs(u[i] - held) < 1e-10:         # a dwell turns nothing back
            out[i] = x0
            continue
        held = u[i]; sg = -1.0 if ra > 0 else 1.0; a, h = x0, h0; b, rb = a, ra
        for _ in range(80):
            b = a + sg * h; g = contact(b, G, dx); rb = g + k0 * b + friction(b, x0, g, s, kt, c, mu, mode, turn) - u[i]
            if rb * sg >= 0: break
            a, ra = b, rb; h *= 2
        side = 0; x = b
        for it in range(200):
            if abs(b - a) < 1e-12 + 1e-13 * abs(b) or rb == ra: break
            x = 0.5 * (a + b) if it % 6 == 5 else b - rb * (b - a) / (rb - ra); g = contact(x, G, dx)
            r = g + k0 * x + friction(x, x0, g, s, kt, c, mu, mode, turn) - u[i]
            if abs(r) < 1e-12: break
            if r * sg > 0:
                b, rb = x, r
                if side == 1 and it % 6 != 5: ra *= 0.5
                side = 1
            else:
                a, ra = x, r
                if side == -1 and it % 6 != 5: rb *= 0.5
                side = -1
        d = x - x0
        if d != 0.0:
            g = contact(x, G, dx); friction(x, x0, g, s, kt, c, mu, mode, turn, True); x0 = x
        out[i] = x0
    return out

@njit
def static_kinetic(u, fk, jump):
    """Torque behind a joint with static above kinetic friction: sticks to fk + jump_n, then falls to fk."""
    out = np.empty(u.size); t, n = 0.0, 0
    for i in range(u.size):
        while abs(u[i] - t) > fk + jump[n, i]:
            t += jump[n, i] if u[i] > t else -jump[n, i]; n = (n + 1) % jump.shape[0]
        out[i] = t
    return out

@njit
def clamp_slip(u, ts, power, top):
    """Clamp that slips only above |u| = ts while the load grows, and stays where it is till the other side slips it back."""
    out = np.empty(u.size); z = 0.0
    for i in range(u.size):
        if u[i] > ts: z = max(z, -1.0 + 2.0 * ((u[i] - ts) / (top - ts)) ** power)
        elif u[i] < -ts: z = min(z, 1.0 - 2.0 * ((-u[i] - ts) / (top - ts)) ** power)
        out[i] = z
    return out

@njit
def relays(u, th):
    """Share of a clearance crossed: relays that switch at +th and -th, starting in mid-clearance."""
    out = np.zeros(u.size); st = np.zeros(th.size)
    for i in range(u.size):
        a = 0.0
        for j in range(th.size):
            if u[i] >= th[j]: st[j] = 1.0
            elif u[i] <= -th[j]: st[j] = -1.0
            a += st[j]
        out[i] = a / th.size
    return out

@njit
def relax(t, f, tc):
    """First-order lag of f(t) with time constant tc, exact for f linear between samples, at rest at first."""
    out = np.empty(t.size); z = f[0]; out[0] = z
    for i in range(1, t.size):
        h = t[i] - t[i - 1]
        if h > 0:
            q = (f[i] - f[i - 1]) / h; e = np.exp(-h / tc); z = f[i] - q * tc + (z - f[i - 1] + q * tc) * e
        out[i] = z
    return out

# ------------------------------------------------------------------ the eight kinds of reducer (rated torque 1)
NTAB = 6000

def teeth(b, lever, share, p, e):
    """Table of sum_j share_j l_j <l_j x - b_j>^p scaled to 1 at mean clearance + e."""
    x1 = np.mean(b) + e; xs = np.linspace(0, np.max(b) + 3 * e, NTAB)
    def raw(x):
        return (share[:, None] * lever[:, None] * np.maximum(lever[:, None] * x[None] - b[:, None], 0) ** p).sum(0)
    return raw(xs) / raw(np.array([x1 / np.mean(lever)]))[0], xs[1]

def hertz(T, t0, p):
    """Approach of a rolling contact that starts with a little load t0."""
    return np.sign(T) * ((np.abs(T) + t0) ** p - t0 ** p)

def table(fun, xm):
    xs = np.linspace(0, xm, NTAB)
    return fun(xs), xs[1]

class Reducer:
    """A clean reducer; `angle(u, gap, fric)` is its angle under the normalised torque u, gap and fric scale its modules."""
    def __init__(self, kind, g):
        self.kind, self.g = kind, g; self.par = getattr(self, "_" + kind)(g); self.scale = 1.0
        self.has_gap = any("b" in s for s in self.par["stages"])
    def angle(self, u, gap=1.0, fric=1.0):
        p = self.par; u = np.ascontiguousarray(u, float); T = joints(u, p["c"] * fric, np.minimum(p["mu"] * fric, 0.9))
        th = np.zeros(u.size)
        for i, f in p.get("springs", []): th += f(T[i] if i >= 0 else u)
        for s in p["stages"]:
            v = np.ascontiguousarray(T[s["at"]] if s["at"] >= 0 else u)
            if "b" in s:
                G, dx = teeth(s["b"] * gap, s["lever"], s["share"], s["p"], s["e"])
                if "bend" in s:
                    xs = np.arange(NTAB) * dx; G = G * s["bend"](np.maximum(xs - np.mean(s["b"]) * gap, 0) / s["e"])
            else: G, dx = s["tab"]
            th += s["w"] * stage(v, G, dx, s["k0"], s["kt"], s["c"] * fric, s["mu"] * fric, s["mode"])
        return th * self.scale
    @staticmethod
    def _stops(n, total, x, grade, mu):
        """n Jenkins elements: limits sum to total, yield points graded over a decade about x, load parts sum to mu."""
        q = np.linspace(-grade, grade, n) if n > 1 else np.zeros(1); c = np.full(n, total / n)
        return x * 10 ** q, c, np.full(n, mu / n)
    def _toothed(self, at, w, b, lever, share, p, e, drag, n, mu, mode, g, bend=None):
        xb = 0.08 * np.mean(b) + 0.03 * e; xq, c, m = self._stops(n, drag, xb, 0.4, mu); kt = c / xq
        if mode == 0 and mu > 0:                                # never softer than the growth of its own limit
            kt = np.maximum(kt, 2.5 * m * p / e)
        s = dict(at=at, w=w, b=b, lever=lever, share=share, p=p, e=e, c=c, kt=kt, mu=m, mode=mode)
        s["k0"] = (g.uniform(0.3, 1.0) * drag + 0.01) / max(np.mean(b), 0.05 * e) * 0.5
        if bend is not None: s["bend"] = bend
        return s
    def _helical_train(self, g):
        n = int(g.integers(2, 5)); r = g.uniform(3.5, 6) ** np.arange(n)
        c, mu = g.uniform(0.003, 0.02, n), g.uniform(0.01, 0.05, n); gapf = g.choice([0.1, 0.4, 1.0]) * g.uniform(0.6, 1.4)
        st = []
        for i in range(n):
            e = g.uniform(0.5, 1.2) / r[i]
            b = gapf * g.uniform(0.5, 1.0) * (1 + 0.25 * np.sort(g.uniform(0, 1, 4))) * (1.0 if i == 0 else r[i] ** -0.7)
            st.append(self._toothed(i, 1.0, b, np.ones(4), np.ones(4), 10 / 9, e,
                                    g.uniform(0.006, 0.03), 4, g.uniform(0, 0.06), 0, g))
        a, h = g.uniform(0.1, 0.4), g.uniform(0.05, 0.4)
        return dict(c=c, mu=mu, stages=st, springs=[(0, lambda T: a * T + h * hertz(T, 0.05, 2 / 3))])
    def _cycloid_pins(self, g):
        n = int(g.integers(24, 46)); phi = np.pi * (np.arange(n) + 0.5) / n; lever = 0.15 + 0.85 * np.sin(phi)
        e = 1.0
        b = np.abs(g.uniform(0.05, 0.5) * (1 + g.uniform(0.15, 0.6) * g.standard_normal(n)))
        st = [self._toothed(0, 1.0, b, lever, np.ones(n), 1.1, e, g.uniform(0.01, 0.06), 6, g.uniform(0.05, 0.22), 0, g)]
        a, h = g.uniform(0.1, 0.5), g.uniform(0.1, 0.4)        # crank bearings (line contact) and the disc
        return dict(c=g.uniform(0.002, 0.02, 1), mu=g.uniform(0.01, 0.06, 1), stages=st,
                    springs=[(0, lambda T: a * T + h * hertz(T, 0.02, 0.9))])
    def _strain_wave(self, g):
        n = 16                                                  # flexspline in its teeth: a bar in a sleeve of friction
        c = g.uniform(0.03, 0.16) * g.dirichlet(np.full(n, 3.0)); mu = g.uniform(0.02, 0.12) * np.linspace(2, 0, n) / n
        w, h = g.dirichlet(np.full(n, 2.0)) * g.uniform(0.6, 1.2), g.uniform(-0.12, 0.35)
        springs = [(i, lambda T, q=w[i]: q * (T - h * T ** 3 / (1 + T * T))) for i in range(n)]
        soft, x0 = g.uniform(0.3, 0.7), g.uniform(0.1, 0.4)     # wave generator: ever more balls and teeth carry
        q = 1 / (soft + (1 - soft) / (1 + x0 ** 2))
        tab = table(lambda x: q * x * (soft + (1 - soft) * x ** 2 / (x ** 2 + x0 ** 2)), 3.0)
        xq, cs, ms = self._stops(8, g.uniform(0.02, 0.1), g.uniform(0.02, 0.12), 0.6, 0.0)
        st = [dict(at=0, w=g.uniform(0.3, 0.8), tab=tab, k0=0.0, kt=cs / xq, c=cs, mu=ms, mode=0)]
        return dict(c=c, mu=mu, stages=st, springs=springs)
    def _plastic_planetary(self, g):
        n = int(g.integers(3, 6)); gapf = g.choice([0.15, 0.5, 1.2]) * g.uniform(0.6, 1.3)
        b = gapf * (1 + g.uniform(0.2, 0.8) * np.sort(g.uniform(0, 1, n)))
        so = g.uniform(0.05, 0.35)                              # softening of warm plastic, a power of the load
        st = [self._toothed(1, 1.0, b, np.ones(n), np.ones(n), 1.15, 1.0, g.uniform(0.015, 0.08), 2, 0.0, 1, g,
                            bend=lambda y: (1 + y) ** -so)]
        b2 = 0.3 * gapf * (1 + 0.5 * np.sort(g.uniform(0, 1, n)))
        st.append(self._toothed(2, 1.0, b2, np.ones(n), np.ones(n), 1.15, 0.3, g.uniform(0.01, 0.04), 2, 0.0, 1, g))
        return dict(c=g.uniform(0.004, 0.03, 3), mu=g.uniform(0.02, 0.10, 3), stages=st)
    def _ball_screw(self, g):
        d0 = g.uniform(0.2, 0.9)                                # preload of the double nut in units of rated deflection
        k = 1 / ((d0 + 1) ** 1.5 - max(d0 - 1, 0) ** 1.5)
        tab = table(lambda x: k * ((d0 + x) ** 1.5 - np.maximum(d0 - x, 0) ** 1.5), 3.0)
        n = 12
        xq, cs, ms = self._stops(n, g.uniform(0.05, 0.2), g.uniform(0.03, 0.15), 0.7, g.uniform(0.0, 0.12))
        kt = np.maximum(cs / xq, 3 * ms * 3); st = [dict(at=-1, w=1.0, tab=tab, k0=0.0, kt=kt, c=cs, mu=ms, mode=0)]
        a = g.uniform(0.1, 0.5)
        return dict(c=g.uniform(0.005, 0.03, 1), mu=g.uniform(0.01, 0.08, 1), stages=st,
                    springs=[(0, lambda T: a * hertz(T, 0.03, 2 / 3))])
    def _rope_drum(self, g):
        n = 10                                                  # strands creep over the drum, tension falls turn by turn
        ph, pre = g.uniform(0.1, 0.5), g.uniform(0.25, 0.9); mu = np.full(n, 1 - np.exp(-ph / n))
        c = mu * pre * g.uniform(0.3, 0.8)
        toe, ts = g.uniform(0.0, 0.4), g.uniform(0.1, 0.3)      # wires seat first: extension of a strand under tension S
        S = np.linspace(0, 6, 4000); ext = S + toe * (1 - np.exp(-S / ts)); e0 = np.interp(pre, S, ext)
        def pull(x):
            return np.interp(e0 + x, ext, S) - np.interp(e0 - x, ext, S, left=0.0)
        tab = table(pull, 4.0); q = g.dirichlet(np.full(n, 4.0))
        xq, cs, ms = self._stops(3, g.uniform(0.004, 0.03), 0.05, 0.4, 0.0)
        st = [dict(at=int(i), w=1.0 * q[i], tab=tab, k0=0.0, kt=cs / xq, c=cs, mu=ms, mode=0) for i in range(0, n, 3)]
        return dict(c=c, mu=mu, stages=st, springs=[(i, lambda T, w=0.6 * q[i]: w * T) for i in range(n)])
    def _rubber_coupling(self, g):
        n = 6; be = g.uniform(0.1, 0.9)
        b = g.choice([0.02, 0.1, 0.35]) * g.uniform(0.7, 1.3) * (1 + 0.5 * np.sort(g.uniform(0, 1, n)))
        st = [self._toothed(0, 1.0, b, np.ones(n), np.ones(n), 1.0, 1.0, g.uniform(0.05, 0.16), 1, 0.0, 2, g,
                            bend=lambda y: (1 + be * y * y) / (1 + be))]
        st[0]["kt"] = st[0]["c"] / g.uniform(0.05, 0.25)
        return dict(c=g.uniform(0.003, 0.02, 1), mu=g.uniform(0.0, 0.04, 1), stages=st, springs=[(0, lambda T: 0.1 * T)])
    def _worm(self, g):
        f = g.uniform(0.12, 0.4)                                # thread and thrust washer: friction in the ratio of the load
        c, mu = g.uniform(0.005, 0.03, 2), np.array([f * 0.7, f * 0.3])
        b = g.choice([0.08, 0.3, 0.8]) * g.uniform(0.7, 1.3) * np.array([1.0, 1.12, 1.3, 1.35])
        st = [self._toothed(1, 1.0, b, np.ones(4), np.ones(4), 1.5, 0.8, g.uniform(0.01, 0.05), 3, 0.0, 0, g)]
        a = g.uniform(0.3, 0.8)                                 # the wheel's shaft stands before the thread
        return dict(c=c, mu=mu, stages=st, springs=[(-1, lambda T: a * T), (0, lambda T: 0.4 * T - 0.05 * T ** 3)])
    def settled(self, amp, n=4000):
        """Settled loop of normalised amplitude: torque grid (rising), ascending and descending branch."""
        up = np.linspace(-amp, amp, 2 * n + 1); u = np.concatenate([np.linspace(0, amp, n + 1)] + [up[::-1][1:], up[1:]] * 4)
        th = self.angle(u); m = 2 * n; asc = np.concatenate([[th[-m - 1]], th[-m:]]); des = th[-2 * m - 1:-m]
        return up, asc, des[::-1]

def indicators(red, amp, tr, k):
    """Indicators of the clean settled loop of amplitude amp (share of the rated torque tr), SI units."""
    u, asc, des = red.settled(amp); t = u * tr; off = 0.25 * (asc[0] + asc[-1] + des[0] + des[-1])
    asc, des = asc - off, des - off; mean = 0.5 * (asc + des); lost = np.interp(k * tr, t, mean) - np.interp(-k * tr, t, mean)
    w = des - asc; area = np.trapezoid(w, t); i0 = u.size // 2; tm = 0.5 * (t[1:] + t[:-1])
    absorbed = np.sum((tm * np.diff(asc))[i0:]) + np.sum((tm * np.diff(des))[:i0]) * -1.0
    return dict(lost_motion_rad=float(lost), backlash_rad=float(w[i0]), area_J=float(area), absorbed_J=float(absorbed),
                dissipation_ratio=float(area / absorbed), peak_rad=float(0.5 * np.ptp(np.concatenate([asc, des]))))

# ------------------------------------------------------------------ torque paths
class Path:
    """A record's torque against time; history before t = 0 is lived through but not recorded."""
    def __init__(self, g, style, amp, cycles, period, start, preamble, n):
        self.style, self.amp = style, amp; tips = [0.0]
        if preamble == "small":
            q = g.uniform(0.25, 0.6) * amp; tips += [q, -q]
        if start == "virgin": body = [0.0, amp]
        else: body = [0.0, amp, -amp, amp]
        for _ in range(cycles): body += [-amp, amp]
        if start == "other": body = [-b for b in body]
        tips = tips + body[1:] + ([0.0] if start != "tip" else [])
        if style == "hand":
            tips = np.array(tips) * g.uniform(0.96, 1.0, len(tips)); tips = tips * amp / np.max(np.abs(tips))
        rate = 4 * amp / period; t, seg = [0.0], [tips[0]]; clock, moving, travel = 0.0, 0.0, 0.0
        marks = [0.0]
        if preamble == "rest":
            clock += g.uniform(0.05, 0.15) * period; t.append(clock), seg.append(tips[0])
        for a, b in zip(tips[:-1], tips[1:]):
            dur = max(abs(b - a) / rate, 1e-9); m = 400; f = np.linspace(0, 1, m + 1)[1:]
            if style == "sine":
                z0, z1 = np.arcsin(np.clip([a / amp, b / amp], -1, 1)); val = amp * np.sin(z0 + (z1 - z0) * f)
                tt = clock + dur * f
            elif style == "stairs":
                k = max(int(round(abs(b - a) / amp * int(g.integers(8, 16)))), 2)
                x = np.array([(i + q) / k for i in range(k) for q in (0.0, 1.0)])
                f = np.array([(i + q) / k for i in range(k) for q in (0.65, 1.0)]); val, tt = a + (b - a) * x, clock + dur * f
            elif style == "hand":
                rough = np.exp(0.55 * lfilter([1], [1, -0.985], g.standard_normal(m) * 0.18))
                if g.random() < 0.4: rough[g.integers(20, m - 40):][:25] *= 8.0
                val, tt = a + (b - a) * f, clock + dur * np.cumsum(rough) / rough.sum()
            else: val, tt = np.array([b]), np.array([clock + dur])
            t, seg = t + list(tt), seg + list(val); clock += dur; moving += dur; travel += abs(b - a)
            if style == "dwell":
                hold = g.uniform(0.04, 0.2) * period; clock += hold; t.append(clock), seg.append(b)
            marks.append(clock)
        t, seg = np.array(t), np.array(seg); self.rate = travel / moving; t0 = 0.0
        if start in ("history", "tip"):
            j = 2 + (2 if preamble == "small" else 0)
            t0 = marks[j]                                       # recording begins at the second tip of the history
            if start == "history": t0 += g.uniform(0.15, 0.8) * (marks[j + 1] - marks[j])
        self.t, self.tau, self.t0, self.t1 = t, seg, t0, t[-1]; self.corners = np.array(marks) - t0
        ts = np.linspace(t0, self.t1, n); dt = ts[1] - ts[0]; how = g.choice(["even", "even", "jitter", "dropped", "blocks"])
        if how == "jitter": ts[1:-1] += g.uniform(-0.3, 0.3, n - 2) * dt
        elif how == "dropped": ts = ts[g.random(n) > g.uniform(0.03, 0.12)]
        elif how == "blocks":
            ts = np.delete(ts, np.concatenate([int(g.integers(1, n - 40)) + np.arange(int(g.integers(5, 20))) for _ in range(3)]))
        lead = t[0] - 1.5 * period; pre = np.linspace(t[0], t0, 1500)[:-1] if t0 > 0 else np.empty(0)
        tip_pre = t[(t < t0)]; grid = np.unique(np.concatenate([[lead], pre, tip_pre, t[t >= t0], ts]))
        self.grid = grid - t0                                   # all simulated times; recorded ones are `pick`
        self.pick = np.searchsorted(grid, ts); self.period = period; self.u = self.torque(self.grid)
        self.cols = None
    def torque(self, t):
        return np.interp(t + self.t0, self.t, self.tau)

# ------------------------------------------------------------------ faults
class Fault:
    """One fault of a unit: variant and shape are drawn here, its size s is searched later."""
    def __init__(self, name, g, red, paths, session):
        self.name, self.sign = name, float(g.choice([-1.0, 1.0])); self.v = int(g.integers(0, 3))
        self.z = g.uniform(0, 1, 8); self.session = session; self.pp = np.ptp(red.settled(1.0, 200)[1])
        self.rref = np.exp(np.mean([np.log(p.rate) for p in paths])); self.seed = int(g.integers(1 << 30))
        rate, dur = np.array([p.rate for p in paths]), np.array([p.t1 - p.t0 for p in paths])
        self.fast, self.slow = 4 / rate.max(), dur.max(); self.total = dur.sum()
        self.smax = {"sensor_lag": 0.12 * self.fast, "torque_offset": 0.3, "x_torque_lag": 0.12 * self.fast, "stick_slip": 0.3,
                     "rate_dependent_friction": 0.9 / np.log(rate.max() / rate.min()), "x_torque_clipping": 0.35,
                     "x_running_in": 3.0, "encoder_error": 0.1 * self.wave(), "x_local_pit": 0.01}.get(name, 0.6)
        self.s0 = {"sensor_lag": 0.01 * self.fast, "torque_offset": 0.02, "x_torque_lag": 0.01 * self.fast,
                   "rate_dependent_friction": 0.1, "x_torque_clipping": 0.08, "x_running_in": 0.4}.get(name, 0.03)
    def wave(self):
        return 0.06 * 7 ** self.z[0]                            # period of the encoder's error in peak-to-peak angles
    # torque side: (recorded, true) torque on the path's grid
    def torque(self, s, p, k, rec, true):
        if self.name == "torque_offset":
            q = 1.0 if self.v < 2 else 0.8 + 0.4 * self.z[k % 8]          # variant 2: the zero wanders from record to record
            return rec, true - self.sign * s * q
        if self.name == "x_torque_lag": return rec, p.torque(p.grid + s)
        if self.name == "x_torque_clipping": return np.clip(rec, s - 1.0 if self.v else -9.0, 1.0 - s), true
        return rec, true
    def friction_scale(self, s, p):
        if self.name == "rate_dependent_friction" and self.v < 2:
            q = self.sign * s * np.log(p.rate / self.rref)
            return max(1 + q, 0.05) if self.v == 0 else float(np.exp(q))
        return 1.0
    # inside the reducer: added angle under the true torque u
    def inside(self, s, p, k, u):
        n, z, t = self.name, self.z, p.grid
        if n == "interface_slip":
            ts = 0.72 + 0.2 * z[0] if self.v else 0.84 + 0.1 * z[0]
            if self.v == 0: sl = joints(u, np.array([ts]), np.zeros(1))[0] / (1 - ts)
            else: sl = clamp_slip(u, ts, (1.0 if self.v == 1 else 1.7), 1.0)
            return s * self.pp * sl
        if n == "viscoelastic_creep":
            tcs = [np.exp(np.log(0.8) + z[0] * np.log(15))] if self.v != 1 else [0.7 * 3.2 ** j for j in range(4)]
            drive = u if self.v < 2 else np.sign(u) * np.maximum(np.abs(u) - 0.15 - 0.25 * z[1], 0) * 1.5
            if z[2] < 0.3: drive = drive + 0.6 * drive ** 3
            return s * self.pp * np.mean([relax(t, drive, c) for c in tcs], 0)
        if n == "asymmetric_stiffness":
            T = joints(u, np.array([0.01 + 0.03 * z[0]]), np.array([0.06 * z[1]]))[0] if self.v == 1 else u
            a = np.abs(T)
            return self.sign * s * self.pp * [np.sqrt(a * a + 1e-3) - 1e-3 ** 0.5, a ** (10 / 9), a ** 1.6][int(3 * z[2]) % 3]
        if n == "second_backlash":
            d = 0.14 + 0.36 * z[0]; th = d * (1 + (0.06 + 0.2 * z[1]) * np.linspace(-1, 1, 41))
            if self.v < 2: return 0.5 * s * self.pp * relays(u, th)
            b = 1 + 0.2 * np.linspace(-1, 1, 5); G, dx = teeth(b, np.ones(5), np.ones(5), 1.1, 0.15)
            return 0.5 * s * self.pp * stage(u, G, dx, 0.1 * d, np.array([d / 0.1]), np.array([d]), np.zeros(1), 0)
        if n == "stick_slip":
            fk = 0.01 + 0.05 * z[0]; g = np.random.default_rng(self.seed + k); scat = np.exp(0.25 * g.standard_normal(997))
            size = s; load = 0.35 + np.abs(u) if self.v == 1 else np.ones(u.size)
            if self.v == 2: size /= 1 + 0.7 * p.rate / self.rref        # Stribeck: less of a fall when it moves faster
            jump = np.maximum(size * scat[:, None] * load[None], 2e-4)
            return (0.3 + 0.5 * z[1]) * 0.5 * self.pp * (static_kinetic(u, fk, jump) - joints(u, np.array([fk]), np.zeros(1))[0])
        if n == "rate_dependent_friction" and self.v == 2:
            r = np.minimum(np.abs(np.gradient(u, t)), 10 * p.rate)
            r = np.interp(t, t[r > 0.02 * p.rate], r[r > 0.02 * p.rate]) if np.any(r > 0.02 * p.rate) else np.full(t.size, p.rate)
            w = max(0.02 * p.period, 1e-9); r = np.exp(relax(t, np.log(np.maximum(r, 0.02 * p.rate)), w))
            q = np.arcsinh(3 * r / self.rref) - np.arcsinh(3.0); c0 = 0.04 + 0.08 * z[0]
            c = c0 * np.maximum(1 + self.sign * 2.2 * s * q, 0.03)
            return 0.5 * self.pp * (0.4 + 0.4 * z[1]) * (joint_varying(u, c) - joint_varying(u, np.full(u.size, c0)))
        if n == "x_running_in":
            way = np.concatenate([[0], np.cumsum(np.abs(np.diff(u)))]) / (4 * p.amp); way = way - way[p.pick[0]]
            c0 = 0.03 + 0.06 * z[0]; c = c0 * (1 + s * 1.5 * np.exp(-np.maximum(way, 0) / (0.4 + 0.6 * z[1])))
            return 0.5 * self.pp * 0.7 * (joint_varying(u, c) - joint_varying(u, np.full(u.size, c0)))
        if n == "x_ratchet":
            du = np.diff(u, prepend=u[0])
            z0 = np.cumsum(np.where((self.sign * du > 0) & (self.sign * u > 0.6), (np.abs(u) - 0.6) * np.abs(du), 0))
            return self.sign * s * self.pp * 4.0 * z0
        return 0.0
    # channel: the angle as read
    def channel(self, s, p, k, th):
        n, z, t = self.name, self.z, p.grid
        if n == "sensor_lag":
            d, c = [(s, 0.0), (0.0, s), (0.5 * s, 0.5 * s)][self.v]
            if d > 0: th = np.interp(t - d, t, th)
            return relax(t, th, c) if c > 0 else th
        if n == "thermal_drift":
            if self.v == 0: f = t / self.slow
            elif self.v == 1:
                tc = (0.3 + z[0]) * self.slow; f = 2 * (1 - np.exp(-(np.maximum(t, 0) + self.session[k]) / tc))
            else: f = 0.7 * np.sin(2 * np.pi * ((t + self.session[k]) / ((1.2 + 1.5 * z[0]) * self.slow) + z[1]))
            return th + self.sign * s * self.pp * f
        if n == "encoder_error":
            per = self.pp * self.wave(); ph = 2 * np.pi * (th / per + z[1]); e = np.sin(ph)
            if self.v == 1: e = e + 0.5 * np.sin(2 * ph + 6.28 * z[2])
            if self.v == 2: e = np.arctan2(np.sin(ph), 0.6 + np.cos(ph) * 0.6 + 0.5) * 1.5
            return th + s * self.pp * e
        if n == "x_local_pit":
            c, w = (0.7 * (z[0] - 0.5)) * self.pp, (0.03 + 0.05 * z[1]) * self.pp
            return th + self.sign * s * self.pp * 3 * np.exp(-((th - c) / w) ** 2)
        if n == "x_ringing":
            f, td = 0.7 + 1.5 * z[0], (1.0 + 2.5 * z[1]); e = np.zeros(t.size)
            for c in p.corners:
                q = t - c
                e += np.where(q > 0, np.exp(-np.maximum(q, 0) / td) * np.sin(2 * np.pi * f * q), 0)
            return th + s * self.pp * e * min(p.rate / self.rref, 4.0)
        if n == "x_hum": return th + s * self.pp * np.sin(2 * np.pi * ((0.25 + 0.9 * z[0]) * t + z[1] + 0.37 * k))
        if n == "x_lost_counts":
            g = np.random.default_rng(self.seed + k); e = np.zeros(t.size)
            for _ in range(int(g.integers(1, 4))): e += self.sign * (t > g.uniform(0.08, 0.92) * t[-1])
            return th + s * self.pp * e
        if n == "x_warming_compliance":
            return th * (1 + s * (1 - np.exp(-(t + self.session[k]) / ((0.3 + 0.5 * z[0]) * self.total))))
        return th

class Unit:
    def __init__(self, red, paths, shift):
        self.red, self.paths, self.shift = red, paths, shift; self.memo = {}
    def reducer(self, u, fric=1.0, gap=1.0):
        key = (u.tobytes()[::97], float(u.sum()), u.size, fric, gap)
        if key not in self.memo:
            if len(self.memo) > 60: self.memo.clear()
            self.memo[key] = self.red.angle(u, gap, fric)
        return self.memo[key]
    def run(self, faults):
        """Recorded torque and read angle of every record, normalised torque, no noise; faults is a list of (fault, size)."""
        out = []
        for k, p in enumerate(self.paths):
            rec, true = p.u, p.u; fr = 1.0
            for f, s in faults:
                rec, true = f.torque(s, p, k, rec, true); fr *= f.friction_scale(s, p)
            th = self.reducer(true, fr) + self.shift[k]
            for f, s in faults: th = th + f.inside(s, p, k, true)
            for name in ("encoder_error", "x_", "sensor_lag", "thermal_drift"):
                for f, s in faults:
                    if f.name.startswith(name): th = f.channel(s, p, k, th)
            out.append((rec, th))
        return out
    def columns(self, k, rec):
        p = self.paths[k]
        if rec is p.u and p.cols is not None: return p.cols
        base = self.reducer(rec); df = (self.reducer(rec, 1.03) - base) / 0.03
        if self.red.has_gap: dg = (self.reducer(rec, 1.0, 1.03) - base) / 0.03
        else: dg = np.tanh(joints(rec, np.array([0.02]), np.zeros(1))[0] / 0.03)
        cols = np.stack([base, df, dg, rec ** 3], 1)[p.pick]; cols = cols / np.maximum(np.sqrt((cols ** 2).mean(0)), 1e-30)
        if rec is p.u: p.cols = cols
        return cols
    def rms(self, faults):
        """RMS over records at equal weight of faulty minus clean angle after the refit."""
        R = len(self.paths); A, y = [], []
        for k, (rec, th) in enumerate(self.run(faults)):
            p = self.paths[k]; d = (th - self.reducer(rec) - self.shift[k])[p.pick]; c = self.columns(k, rec)
            w = 1 / np.sqrt(d.size * R); o = np.zeros((d.size, R)); o[:, k] = 1; A.append(w * np.concatenate([o, c], 1))
            y.append(w * d)
        A, y = np.concatenate(A), np.concatenate(y); q = np.linalg.lstsq(A, y, rcond=1e-10)[0]
        return float(np.sqrt(np.sum((y - A @ q) ** 2)))
    def size_for(self, fault, target, tol=0.01):
        """Size of the fault whose rms is the target: (size, rms reached); the largest size where it cannot be reached."""
        lo, hi, s, best = 0.0, None, fault.s0, None
        for it in range(40):
            r = self.rms([(fault, s)])
            if best is None or abs(np.log(max(r, 1e-30) / target)) < abs(np.log(max(best[1], 1e-30) / target)): best = (s, r)
            if abs(r / target - 1) < tol: break
            if r < target:
                lo = s
                if s >= fault.smax: break
            else: hi = s
            g = s * np.clip(target / max(r, 1e-30), 1e-3, 20.0)
            if hi is not None and (it > 8 and it % 2 or not lo < g < hi): g = np.sqrt(max(lo, 1e-3 * hi) * hi)
            s = min(g, fault.smax)
            if hi is not None and hi - lo < 1e-7 * hi: break
        return best

# ------------------------------------------------------------------ plan and writing
def plan(n, g):
    """Truths of n units in the proportions 24 : 34 : 10 : 12, shuffled, with reducers dealt evenly."""
    nc, ns, npair = round(0.3 * n), round(0.425 * n), round(0.125 * n); rows = [("clean", [], []) for _ in range(nc)]
    deck = [(e, s) for s in (1.0, 0.4, 0.2) for e in LISTED]
    extra = [(str(e), float(s)) for e, s in zip(g.permutation(LISTED), [1.0, 0.4, 0.2, 0.4] * 3)]
    deck = (deck + extra)[:ns] if ns >= 30 else [deck[i] for i in g.permutation(30)[:ns]]
    rows += [("single", [e], [s]) for e, s in deck]
    while True:
        q = [str(e) for e in np.concatenate([g.permutation(LISTED) for _ in range(max(1, -(-2 * npair // 10)))])][:2 * npair]
        pairs = [tuple(q[2 * i:2 * i + 2]) for i in range(npair)]
        if all(a != b for a, b in pairs) and len({frozenset(a) for a in pairs}) == len(pairs): break
    rows += [("pair", list(a), [float(g.choice([1.0, 0.4])) for _ in a]) for a in pairs]
    nu = n - len(rows); un = UNLISTED + [str(e) for e in g.permutation(UNLISTED)]
    rows += [("unlisted", [un[i % len(un)]], [1.0 if i % 3 else 0.4]) for i in range(nu)]
    deal = list(zip(rows, [str(e) for e in np.resize(g.permutation(KINDS), n)]))
    return [deal[i] for i in g.permutation(n)]

PEAK = dict(helical_train=(1, 40), cycloid_pins=(0.4, 5), strain_wave=(0.3, 5), plastic_planetary=(8, 60), ball_screw=(0.5, 8),
            rope_drum=(2, 40), rubber_coupling=(15, 60), worm=(2, 30))
TORQUE = dict(helical_train=(0.5, 200), cycloid_pins=(5, 1000), strain_wave=(3, 300), plastic_planetary=(0.05, 5),
              ball_screw=(1, 100), rope_drum=(0.3, 40), rubber_coupling=(0.3, 150), worm=(0.5, 200))
WORDS = dict(helical_train="planetary gear train, metal", cycloid_pins="cycloid reducer", strain_wave="strain-wave gear",
             plastic_planetary="planetary gear train, plastic", ball_screw="screw drive, preloaded nut", rope_drum="rope drive",
             rubber_coupling="gear stage with elastomer coupling", worm="worm gear")
MATERIAL = dict(helical_train="steel", cycloid_pins="steel", strain_wave="steel", plastic_planetary="POM", ball_screw="steel",
                rope_drum="steel rope", rubber_coupling="steel and elastomer", worm="bronze on steel")

def loguni(g, a, b):
    return float(np.exp(g.uniform(np.log(a), np.log(b))))

def draw_paths(g, styles):
    n = int(g.integers(3, 6)); fast, spread = loguni(g, 4, 10), loguni(g, 10, 30)
    periods = fast * spread ** (np.linspace(0, 1, n) + np.r_[0, g.uniform(-0.1, 0.1, n - 2), 0])
    periods = periods[g.permutation(n)]; main = str(g.choice(styles)); mixed = g.random() < 0.35
    amps = np.ones(n)
    if g.random() < 0.45:
        m = int(g.integers(1, n - 1)); amps[g.permutation(n)[:m]] = g.choice([0.4, 0.5, 0.6, 0.75, 0.8], m)
    cyc = int(g.integers(2, 4)); start = str(g.choice(["virgin", "virgin", "other", "history", "tip"]))
    pre = str(g.choice(["none", "none", "small", "rest"])); ps = []
    for k in range(n):
        st = str(g.choice(styles)) if mixed else main; slowness = np.log(periods[k] / periods.min()) / np.log(spread)
        m = int(np.clip(loguni(g, 600, 2200) * (1 + 2.6 * slowness), 520, 8000))
        ps.append(Path(g, st, amps[k], cyc, float(periods[k] * amps[k]), start, pre, m))
    used = sorted({p.style for p in ps})
    return ps, "+".join(used)

def draw_unit(g, kind, names):
    for attempt in range(40):
        red = Reducer(kind, g); _, asc, des = red.settled(1.0, 800); q = indicators(red, 1.0, 1.0, 0.03)
        closed = max(abs(asc[-1] - des[-1]), abs(asc[0] - des[0])) < 2e-3 * q["peak_rad"]
        if closed and 0.03 < q["dissipation_ratio"] < 0.9: break
    else: raise RuntimeError("no plausible reducer of kind " + kind)
    pk = loguni(g, *PEAK[kind]) / 60 * np.pi / 180; red.scale = pk / q["peak_rad"]
    paths, style = draw_paths(g, ["triangle", "dwell", "stairs"] if "x_ringing" in names else STYLES)
    order = np.cumsum([0] + [p.t1 - p.t0 + g.uniform(10, 60) for p in paths[:-1]])
    shift = g.uniform(-0.4, 0.4) * pk + g.uniform(-0.03, 0.03, len(paths)) * pk
    return Unit(red, paths, shift), style, pk, order

def sig(x, n=4):
    return float(f"{x:.{n}g}")

def write_unit(folder, name, unit, rows, tr, g, noise, kind):
    """CSV files and unit.toml; returns rate labels."""
    os.makedirs(folder, exist_ok=True); corr, tnf = g.uniform(0, 0.6), g.uniform(0.05, 0.4)
    tsd = 2 * tnf * noise / max(np.ptp(th[p.pick]) for p, (_, th) in zip(unit.paths, rows))     # through the mean slope
    qa = noise * g.choice([0.01, 0.1, 0.5, 1.0]); dialect = int(g.integers(0, 6))
    say_rate, say_amp, say_words = g.random() < 0.7, g.random() < 0.5, g.random() < 0.6
    cols, ta, tm, aa = [("time_s", "torque_Nm", "angle_arcmin")] * 3 + [("t [ms]", "M [Nm]", "phi [deg]"),
                        ("time_s", "torque_mNm", "angle_mrad"), ("t [s]", "torque [Nm]", "-angle [arcsec]")], 1.0, 1.0, 1.0
    c = cols[dialect]; ta = 1000.0 if "ms" in c[0] else 1.0; tm = 1000.0 if "mNm" in c[1] else 1.0
    per = dict(arcmin=10800 / np.pi, deg=180 / np.pi, mrad=1000.0, arcsec=648000 / np.pi)
    aa = per[c[2].replace("]", "").replace("[", "").split("_")[-1].split(" ")[-1]] * (-1 if c[2].startswith("-") else 1)
    head = ",".join(c).replace("-angle", "angle")
    toml = ['schema = "backdrive-bayes/unit/1"', f'name = "{name}"', f"rated_torque_Nm = {tr:g}"]
    if say_words or kind == "strain_wave": toml += [f'description = "{WORDS[kind]}"', f'material = "{MATERIAL[kind]}"']
    labels = []
    for k, (p, (rec, th)) in enumerate(zip(unit.paths, rows)):
        m = p.pick.size; dt = np.median(np.diff(p.grid[p.pick])); ph = np.exp(-dt / g.uniform(0.03, 0.3)) if corr > 0 else 0.0
        ar = lfilter([np.sqrt(1 - ph ** 2)], [1, -ph], g.standard_normal(m + 300))[300:]
        eps = noise * (np.sqrt(1 - corr) * g.standard_normal(m) + np.sqrt(corr) * ar)
        a = np.round((th[p.pick] + eps) / qa) * qa; t = rec[p.pick] + tsd * g.standard_normal(m)
        qt = tsd * g.choice([0.1, 1.0]); t = np.round(t / qt) * qt * tr * tm; ti = (p.grid[p.pick] - p.grid[p.pick[0]]) * ta
        da = max(int(np.ceil(-np.log10(qa * abs(aa)))) + 2, 2); dtq = max(int(np.ceil(-np.log10(qt * tr * tm))) + 2, 2)
        f = f"r{k + 1}.csv"
        with open(os.path.join(folder, f), "w", newline="\n") as h:
            h.write(head + "\n")
            h.writelines(f"{x:.5f},{y:.{dtq}f},{v:.{da}f}\n" for x, y, v in zip(ti, t, a * aa))
        rate = sig(p.rate * tr); labels.append(f"{rate:g}"); toml += ["", "[[record]]", f'file = "{f}"']
        toml += [f"loading_rate_Nm_per_s = {rate:g}"] if say_rate else []
        toml += [f"amplitude_Nm = {sig(p.amp * tr, 6):g}"] if say_amp else []
        if dialect > 2: toml += ["[record.columns]", f'time = "{c[0]}"', f'torque = "{c[1]}"', f'angle = "{c[2]}"']
    with open(os.path.join(folder, "unit.toml"), "w", newline="\n") as h:
        h.write("\n".join(toml) + "\n")
    return labels

def make(out, n, seed, only=None):
    root = os.path.join(out, "u"); os.makedirs(root, exist_ok=True); key = {}
    for i, ((what, names, sizes), kind) in enumerate(plan(n, np.random.default_rng([seed, 0]))):
        name = f"case-{i + 1:02d}"
        if only and name not in only: continue
        for attempt in range(30):
            g = np.random.default_rng([seed, i + 1, attempt]); unit, style, pk, session = draw_unit(g, kind, names)
            share = loguni(g, 0.0002, 0.003)
            if {"stick_slip", "x_running_in", "rate_dependent_friction"} & set(names): share = loguni(g, 0.0002, 0.0006)
            noise = share * 2 * pk; faults, reached = [], []
            for e, s in zip(names, sizes):
                f = Fault(e, g, unit.red, unit.paths, session); z, r = unit.size_for(f, MULTIPLE[s] * noise)
                faults.append((f, z)); reached.append((r, MULTIPLE[s]))
            worst = min([r / (m * noise) for r, m in reached] + [1.0])
            if worst < 0.98:                                    # too feeble a reducer for this fault: a quieter bench, or another
                noise = 0.97 * worst * noise
                if noise < 0.00018 * 2 * pk: continue
                sized = [unit.size_for(f, MULTIPLE[s] * noise) for (f, _), s in zip(faults, sizes)]
                faults = [(f, z) for (f, _), (z, _) in zip(faults, sized)]
                reached = [(r, m) for (_, r), (_, m) in zip(sized, reached)]
            if all(abs(r / (m * noise) - 1) < 0.03 for r, m in reached): break
        else: raise RuntimeError(f"{name}: {names} cannot be given its size")
        traces, tr_rms = [], {}
        for e in CHANNEL:
            if e in names: continue
            f = Fault(e, g, unit.red, unit.paths, session); f.s0 *= 0.02
            z, r = unit.size_for(f, loguni(g, 0.02, 0.1) * noise, 0.05); traces.append((f, z))
            tr_rms[e] = r / noise
        total = unit.rms(faults) / noise if faults else 0.0; tr = sig(loguni(g, *TORQUE[kind]), 2)
        k = 0.04 if kind == "strain_wave" else 0.03
        labels = write_unit(os.path.join(root, name), name, unit, unit.run(faults + traces), tr, g, noise, kind)
        full = indicators(unit.red, 1.0, tr, k); own = {p.amp: indicators(unit.red, p.amp, tr, k) for p in unit.paths}
        key[name] = dict(effects=names, kind=what, size=min(sizes) if sizes else None, sizes=sizes, reducer=kind, style=style,
                         noise_sd_rad=noise, rms_over_noise=total, rms_over_noise_each=[r / noise for r, _ in reached],
                         variants=[f.v for f, _ in faults], traces_over_noise=tr_rms, rated_torque_Nm=tr, k=k,
                         indicators={q: full for q in labels},
                         records=[dict(file=f"r{j + 1}.csv", amplitude_Nm=sig(p.amp * tr, 6), indicators=own[p.amp])
                                  for j, p in enumerate(unit.paths)])
        print(name, "written", flush=True)
    with open(os.path.join(root, "key.json"), "w") as h:
        json.dump(key, h, indent=1)
    return key

# ------------------------------------------------------------------ checks of the bench itself
def selfcheck(seed):
    ok, tips = True, np.array([0, 1, -1, 0.7, -0.2, 0.5, -1, 1, -0.6, 0.1, 0])
    def path(n):
        legs = [np.linspace(a, b, int(round(n * abs(b - a))) + 1)[1:] for a, b in zip(tips[:-1], tips[1:])]
        return np.concatenate([[0.0]] + legs)
    for i, kind in enumerate(KINDS * 3):
        g = np.random.default_rng([seed, 900 + i]); unit, style, pk, session = draw_unit(g, kind, [])
        red = unit.red; coarse, fine = red.angle(path(100)), red.angle(np.repeat(path(1000), 3))
        step = np.max(np.abs(fine[::30] - coarse)) / pk; odd = np.max(np.abs(red.angle(-path(100)) + coarse)) / pk
        args = (STYLES[i % 5], 1.0, 2, 5.0, ["virgin", "tip"][i % 2], "small", 900)
        p, q = [Path(np.random.default_rng(i), *args[:3], t, *args[4:]) for t in (5.0, 150.0)]     # 30 times slower
        rate = np.max(np.abs(red.angle(p.u)[p.pick] - red.angle(q.u)[q.pick])) / pk; a = indicators(red, 1.0, 2.0, 0.03)
        u, asc, des = red.settled(1.0, 9000); th, t = np.concatenate([asc, des[::-1]]), 2.0 * np.concatenate([u, u[::-1]])
        tm, d = 0.5 * (t[1:] + t[:-1]), np.diff(th)             # direct integrals of torque over angle round the cycle
        S, W = np.sum(tm * d), np.sum((tm * d)[tm * np.diff(t) > 0])
        gap = max(abs(asc[-1] - des[-1]), abs(asc[0] - des[0])) / pk; mono = min(np.diff(asc).min(), np.diff(des).min()) / pk
        err = max(abs(S / a["area_J"] - 1), abs(W / a["absorbed_J"] - 1), abs(np.ptp(th) / 2 / a["peak_rad"] - 1))
        good = step < 1e-3 and odd < 1e-9 and rate < 1e-9 and err < 2e-3 and gap < 2e-3 and 0 <= a["dissipation_ratio"] <= 1
        ok &= bool(good)
        print(f"{kind:18s} step {step:.0e} odd {odd:.0e} rate {rate:.0e} integrals {err:.0e} tips {gap:.0e}",
              f"u {a['dissipation_ratio']:.2f} lost {a['lost_motion_rad'] / pk:.3f} w0 {a['backlash_rad'] / pk:.3f}",
              f"least slope {mono:+.0e} peak {pk * 10800 / np.pi:.1f}'", "ok" if good else "BAD")
    for i, e in enumerate(LISTED + UNLISTED):
        g = np.random.default_rng([seed, 990 + i]); unit, style, pk, session = draw_unit(g, KINDS[i % 8], [e])
        f = Fault(e, g, unit.red, unit.paths, session)
        r = [unit.size_for(f, m * 3e-4 * 2 * pk)[1] / (m * 3e-4 * 2 * pk) for m in MULTIPLE.values()]
        print(f"{e:24s} variant {f.v} {KINDS[i % 8]:18s} reached/wanted", " ".join(f"{x:.3f}" for x in r))
    print("self-check", "passed" if ok else "FAILED")
    return ok

def main():
    a = argparse.ArgumentParser(description=__doc__.split("\n")[0]); a.add_argument("out")
    a.add_argument("--units", type=int, default=80); a.add_argument("--seed", type=int, default=61)
    a.add_argument("--selfcheck", action="store_true", help="check the bench itself, write nothing")
    a.add_argument("--only", nargs="*"); q = a.parse_args()
    if q.selfcheck: raise SystemExit(0 if selfcheck(q.seed) else 1)
    make(q.out, q.units, q.seed, q.only)

if __name__ == "__main__": main()
