"""What the eleventh and the twelfth outside bench share: paths and their truth, the chain of effects, severities, files, key.

A bench brings its reducers (``angle(run)`` on a path, ``half`` its range, ``family``), how they are measured, and its effects;
its own docstring says which. Torque is in units of the rated torque.

Conventions. Each record starts from a virgin reducer: "rest" records show the first loading, "tip" records are cut after 1.25
cycles. The path is that of the reading: torque_offset makes the reducer see reading + offset. A record's rate is its mean |d
torque/dt|, dwells included. snr: half the range of the clean rated loop over the sd of the angle noise. Severity: rms over all
samples of a unit of the change of the noise-free angle, after in each record an offset and a scale of the clean angle are
refitted, over that sd; size s means 3 s, for each member of a pair on its own. Traces of torque_offset, sensor_lag,
thermal_drift and encoder_error, of severity 0.02-0.03 each, are on every unit; a planted effect gets no trace of its own kind.
Truth: third cycle of a triangle of the record's amplitude, rate and place on the bench clock, with what is part of the reducer
("inside" in the key), without channel and bench faults. Variants of an effect are dealt in turn; strengths of angles are shares
of half the range.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.signal import lfilter

ARCMIN = np.pi / 10800.0
LOAD, BODY, LAG, CODE, TIME = range(5)
SIZES = (1.0, 0.4, 0.2)
K_LOST = 0.03

# ---------------------------------------------------------------- kernels
@njit
def lagged(z, x, y):
    """First-order lag of x over a rising coordinate z in units of its constant, exact for linear pieces."""
    res = np.empty_like(x)
    res[0] = y
    for i in range(1, x.size):
        a = z[i] - z[i - 1]
        if a > 0.0:
            y = x[i] + (y - x[i - 1]) * np.exp(-a) + (x[i] - x[i - 1]) * np.expm1(-a) / a
        res[i] = y
    return res

@njit
def clamp_slip(q, threshold, power):
    """Slip that grows only while |q| grows above the threshold, and stays until the other side slips."""
    s, res = 0.0, np.zeros_like(q)
    for i in range(1, q.size):
        now, old = abs(q[i]), abs(q[i - 1])
        if now > threshold and now > old:
            s += np.sign(q[i]) * ((now - threshold) ** power - max(old - threshold, 0.0) ** power)
        res[i] = s
    return res

# ---------------------------------------------------------------- draws
def uniform(rng, lo, hi):
    return float(rng.uniform(lo, hi))

def log_uniform(rng, lo, hi):
    return float(np.exp(rng.uniform(np.log(lo), np.log(hi))))

def pick(rng, *names):
    return names[int(rng.integers(len(names)))]

# ---------------------------------------------------------------- paths and their truth
@dataclass
class Trace:
    """A torque path: time, reading, cycles done, local rate; samples before keep are lived through and not recorded."""
    t: np.ndarray
    q: np.ndarray
    u: np.ndarray
    local: np.ndarray
    keep: int
    amplitude: float
    rate: float
    clock: float = 0.0
    done: float = 0.0
    base: np.ndarray | None = None

    @property
    def period(self):
        return 4.0 * self.amplitude / self.rate

def triangle(u):
    return 1.0 - 4.0 * np.abs((u + 0.25) % 1.0 - 0.5)

def settled_path(amplitude, rate):
    """Triangle from rest through the third settled cycle, tip to tip, of 4000 samples a cycle."""
    u = np.arange(13001) / 4000.0
    return Trace(u * 4.0 * amplitude / rate, amplitude * triangle(u), u, np.full_like(u, rate), 0, amplitude, rate)

def loop_indicators(q, theta):
    """Definitions of the method on the last cycle (+T to -T to +T) of a settled path, energies in units of the rated torque."""
    down, up, grid = theta[-4001:-2000][::-1], theta[-2001:], q[-2001:]
    width, mean = down - up, 0.5 * (down + up)
    absorbed = np.trapezoid(grid[1000:], up[1000:]) + np.trapezoid(grid[1000::-1], down[1000::-1])
    area = np.trapezoid(width, grid)
    return {"lost_motion_rad": np.interp(K_LOST, grid, mean) - np.interp(-K_LOST, grid, mean), "backlash_rad": width[1000],
            "area_J": area, "absorbed_J": absorbed, "dissipation_ratio": area / absorbed, "peak_rad": 0.5 * np.ptp(theta[-4001:])}

@dataclass
class Unit:
    """What is drawn once a unit: reducer, records, noise; fractions of the rated torque inside, SI in the files."""
    reducer: Any
    paths: list
    look: dict
    rated: float
    snr: float
    zero: float
    turn: int

    def kind(self, *variants):
        return variants[self.turn % len(variants)]

    @property
    def sd(self):
        return self.reducer.half / self.snr

    @property
    def mean_period(self):
        return float(np.exp(np.mean([np.log(p.period) for p in self.paths])))

# ---------------------------------------------------------------- effects
@dataclass
class Run:
    """A path on its way through the chain: torque, friction and that of the two flanks as many times, angle."""
    path: Trace
    index: int
    q: np.ndarray
    fr: np.ndarray
    pos: float = 1.0
    neg: float = 1.0
    theta: np.ndarray | None = None

@dataclass
class Effect:
    """A mechanism with drawn parameters; act(run, strength) gives the run as changed at its stage of the chain."""
    variant: dict
    stage: int
    act: Callable
    limit: float

def adding(unit, shape):
    """An action that adds strength x half range x shape(run) to the angle."""
    return lambda run, s: replace(run, theta=run.theta + s * unit.reducer.half * shape(run))

def simulate(unit, path, index, effects):
    """Noise-free angle on a path with [(effect, strength)]; the reducer is solved anew only if its load or friction changes."""
    run = Run(path, index, path.q, np.ones_like(path.q))
    if path.base is None:
        path.base = unit.reducer.angle(run)
    loads = [(e, s) for e, s in effects if e.stage == LOAD]
    for effect, strength in loads:
        run = effect.act(run, strength)
    run.theta = unit.reducer.angle(run) if loads else path.base
    for effect, strength in sorted((p for p in effects if p[0].stage != LOAD), key=lambda p: p[0].stage):
        run = effect.act(run, strength)
    return run.theta

# ---------------------------------------------------------------- severity
class OutOfReach(Exception):
    """The severity lies beyond what this mechanism can physically do on this unit."""

def severity(unit, effects):
    """rms of the change left after refitting offset and scale of the clean angle in each record, over the noise sd."""
    left = []
    for i, path in enumerate(unit.paths):
        clean = simulate(unit, path, i, [])[path.keep:]
        change = simulate(unit, path, i, effects)[path.keep:] - clean
        basis = np.column_stack([np.ones_like(clean), (clean - clean.mean()) / unit.reducer.half])
        left.append(change - basis @ np.linalg.lstsq(basis, change, rcond=None)[0])
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2))) / unit.sd

def find_strength(unit, effect, target):
    """Proportional steps inside a bracket that shrinks; gives (strength, severity reached)."""
    lo, hi, s = 0.0, np.inf, 0.05 * effect.limit
    for _ in range(40):
        got = severity(unit, [(effect, s)])
        if abs(got / target - 1.0) < 2e-3:
            return s, got
        if got < target and s >= effect.limit:
            break
        lo, hi = (s, hi) if got < target else (lo, s)
        step = s * min(max(target / max(got, 1e-12), 0.02), 8.0)
        if not lo < step < hi:
            step = 0.5 * (lo + hi) if np.isfinite(hi) else 2.0 * s
        s = min(step, effect.limit)
    raise OutOfReach(effect.variant)

# ---------------------------------------------------------------- files and key
def measure(rng, unit, index, effects):
    """Time, torque and angle as the bench records them, SI."""
    path, look = unit.paths[index], unit.look
    theta = simulate(unit, path, index, effects)[path.keep:] + unit.zero
    memory, share = np.exp(-1.0 / look["length"]), look["correlated"]
    slow = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], rng.standard_normal(theta.size + 200))[200:]
    theta = theta + unit.sd * (np.sqrt(1.0 - share) * rng.standard_normal(theta.size) + np.sqrt(share) * slow)
    if look["lsb"] > 0.0:
        theta = look["lsb"] * unit.sd * np.round(theta / (look["lsb"] * unit.sd))
    q = path.q[path.keep:] + look["torque_noise"] / unit.snr * rng.standard_normal(theta.size)
    return path.t[path.keep:] - path.t[path.keep], unit.rated * q, theta

def write_unit(folder, unit, rng, effects, measure):
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{folder.name}"', f"rated_torque_Nm = {unit.rated!r}"]
    for i, path in enumerate(unit.paths):
        t, torque, theta = measure(rng, unit, i, effects)
        np.savetxt(folder / f"record-{i + 1}.csv", np.column_stack([t, torque, theta / ARCMIN]), delimiter=",",
                   fmt=["%.10g", "%.8g", "%.10g"], header="time_s,torque_Nm,angle_arcmin", comments="")
        lines += ["", "[[record]]", f'file = "record-{i + 1}.csv"', f"loading_rate_Nm_per_s = {path.rate * unit.rated!r}",
                  f"amplitude_Nm = {path.amplitude * unit.rated!r}"]
    (folder / "unit.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")

def truth(unit, index, effects):
    """Indicators of the reducer at a record's amplitude, rate and place on the bench clock, SI."""
    record = unit.paths[index]
    path = settled_path(record.amplitude, record.rate)
    path.clock, path.done = record.clock + record.t[0], record.done
    found = loop_indicators(path.q, simulate(unit, path, index, effects))
    return {k: float(v * (unit.rated if k in ("area_J", "absorbed_J") else 1.0)) for k, v in found.items()}

# ---------------------------------------------------------------- the bench
@dataclass(frozen=True)
class Bench:
    """Families and effects (functions of a generator and a unit); ``unlisted`` are (effect, size) as they are dealt, ``outside``
    names what is no part of the reducer, ``draw_unit`` draws a unit of a family, ``measure`` reads a record of it."""
    seed: int
    families: tuple
    listed: tuple
    unlisted: tuple
    traces: tuple
    outside: set
    draw_unit: Callable
    measure: Callable = measure

    def plan(self, n, rng):
        """[(kind, {effect: size}, family)]: blocks of 80, each shuffled, families dealt in turn within each kind."""
        names, full = [f.__name__ for f in self.listed], []
        while len(full) < n:
            twos = [rng.choice(names, 2, replace=False) for _ in range(9)]
            block = [("clean", {})] * 24 + [("single", {f: s}) for f in names for s in SIZES]
            block += [("single", {str(f): s}) for f, s in zip(twos[8], SIZES[:2], strict=True)]
            block += [("pair", {str(f): float(rng.choice(SIZES[:2])) for f in two}) for two in twos[:8]]
            block += [("unlisted", {f.__name__: s}) for f, s in self.unlisted]
            full += [(*block[i], self.families[i % len(self.families)]) for i in rng.permutation(len(block))]
        return full[:n]

    def build_unit(self, seed, index, family, sizes, turn):
        """Draws until every effect, traces too, reaches its severity: generator, unit, {name: (effect, strength, severity)}."""
        by_name = {f.__name__: f for f in (*self.listed, *(f for f, _ in self.unlisted))}
        for attempt in range(80):
            rng = np.random.default_rng([seed, index, attempt])
            unit = self.draw_unit(rng, family if attempt < 16 else pick(rng, *self.families), turn)
            goals = {name: 3.0 * size for name, size in sizes.items()}
            goals |= {f.__name__: uniform(rng, 0.02, 0.03) for f in self.traces if f.__name__ not in sizes}
            effects = {name: by_name[name](rng, unit) for name in goals}
            try:
                return rng, unit, {name: (e, *find_strength(unit, e, goals[name])) for name, e in effects.items()}
            except OutOfReach:
                continue
        raise RuntimeError(f"unit {index}: no draw reached {sizes}")

    def key_entry(self, unit, kind, sizes, found):
        inside = [found[name][:2] for name in sizes if name not in self.outside]
        records = [{"file": f"record-{i + 1}.csv", "amplitude_Nm": p.amplitude * unit.rated, "rate_Nm_per_s": p.rate * unit.rated,
                    "full": p.amplitude >= 0.999, "indicators": truth(unit, i, inside), "indicators_clean": truth(unit, i, [])}
                   for i, p in enumerate(unit.paths)]
        told = {name: {**e.variant, "strength": float(s), "severity": g, "inside": name not in self.outside}
                for name, (e, s, g) in found.items()}
        return {"effects": list(sizes), "size": sizes if kind == "pair" else next(iter(sizes.values()), None),
                "reducer": unit.reducer.family, "style": unit.look["style"], "kind": kind, "rated_torque_Nm": unit.rated,
                "snr": unit.snr, "variant": {name: told[name] for name in sizes},
                "traces": {name: v for name, v in told.items() if name not in sizes}, "bench": unit.look, "records": records}

    def main(self):
        parser = argparse.ArgumentParser(description="virtual test bench for gear reducers")
        parser.add_argument("out", type=Path)
        parser.add_argument("--units", type=int, default=80)
        parser.add_argument("--seed", type=int, default=self.seed)
        args, key, seen = parser.parse_args(), {}, Counter()
        for i, (kind, sizes, family) in enumerate(self.plan(args.units, np.random.default_rng(args.seed))):
            name = f"case-{i + 1:02d}"
            rng, unit, found = self.build_unit(args.seed, i, family, sizes, sum(seen[e] for e in sizes) if sizes else i)
            seen.update(list(sizes))
            write_unit(args.out / name, unit, rng, [(e, s) for e, s, _ in found.values()], self.measure)
            key[name] = self.key_entry(unit, kind, sizes, found)
        (args.out / "key.json").write_text(json.dumps(key, indent=1) + "\n", encoding="utf-8")
