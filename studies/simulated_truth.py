"""Pairs of a simulator and a reality for studies/simulated_pairs.py, with what only the benches know of them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from backdrive_bayes.bench.benches import find_bench
from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, angle_noise, ramp, random_reducer
from backdrive_bayes.bench.loop_truth import own_loop
from backdrive_bayes.bench.plan import make_path, make_plan
from backdrive_bayes.bench.protocol import Circumstances
from backdrive_bayes.bench.truth import Truth
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.engine.parameters import Operator, parameters_of
from backdrive_bayes.records.record import Record, Unit

BENCHES = ("known", "sliders", "contact", "ode", "mujoco")
EFFECTS = ("none", "asymmetric_stiffness", "rate_dependent_friction", "none", "torque_offset", "viscoelastic_creep", "sensor_lag")
KNOWN_EFFECTS = {"rate_dependent_friction": "thermal_drift", "viscoelastic_creep": "asymmetric_stiffness"}
"""What is planted in units of the class in the place of effects that only mechanics have."""
SEVERITIES = (1.0, 0.4)
PLAN, OTHER_PATHS = make_plan((0.1, 0.5), sampling_hz=200.0), make_plan((0.25,), cycles=2, sampling_hz=200.0)
KNOWN_LOOPS, KNOWN_HERTZ, KNOWN_NOISE = ((0.1, 0.02), (0.1, 0.1)), 400.0, BenchNoise()
SHIFTS, MOST_STEPS = 3, 12.0
"""Parameters of a reducer that are shifted at once, and how many steps of about 2 % at most."""
SCALE = 0.25
"""Largest shift of the angle scale, in its logarithm."""


@dataclass(frozen=True, eq=False)
class Known:
    """A reality inside the class: angles are the known reducer's, effects are added to the reading."""

    reducer: KnownReducer
    effect: str
    size: float

    def records(self, rng, loops=KNOWN_LOOPS, noise: BenchNoise | None = KNOWN_NOISE) -> tuple[Record, ...]:
        """Records 0 → +T → −T → +T at each (amplitude [N·m], rate [N·m/s])."""
        found = []
        for number, (amplitude, rate) in enumerate(loops, 1):
            time, torque = ramp(amplitude, rate, KNOWN_HERTZ)
            angle = self.reducer.angle_rad(time, torque)
            late = {"sensor_lag": 0.03}.get(self.effect, 0.0) * self.size
            angle = np.interp(time - late, time, angle)
            angle = angle + self.size * {
                "thermal_drift": 1.5e-3 * (time / 20.0) ** 0.7, "asymmetric_stiffness": 0.02 * np.abs(torque),
            }.get(self.effect, 0.0)  # fmt: skip
            read = torque - {"torque_offset": 8e-4}.get(self.effect, 0.0) * self.size
            if noise:
                angle = angle + angle_noise(time.size, 1.0 / KNOWN_HERTZ, noise, rng)
                read = read + noise.torque_nm * rng.standard_normal(time.size)
            found.append(Record(f"{number:02d}.csv", time, read, angle, rate, amplitude))
        return tuple(found)

    def parameters(self) -> dict[str, float]:
        """Every parameter of the user, from the weights themselves."""
        known = self.reducer
        weights = {name: w[None] for name, w in known.weights.items()}
        operator = Operator(known.reducer, weights, known.torque_scale_nm, known.angle_scale_rad, 1.0)
        return {name: float(v[0]) for name, v in parameters_of(operator).items()}


@dataclass(frozen=True, eq=False)
class Reality:
    """A measured unit and its truth; ``effects`` is what acts in it."""

    bench: str
    unit: Unit
    effects: tuple[str, ...]
    truth: Truth | Known

    def parameters(self) -> dict[str, float]:
        """What is known of its parameters and indicators."""
        if isinstance(self.truth, Known):
            return self.truth.parameters()
        return _bench_truth(self.bench, self.truth.reducer, tuple(p.effect for p in self.truth.planted))


@dataclass(frozen=True, eq=False)
class Shifted:
    """A simulator's records and what is known of it; ``gap_rad`` and ``remainder_rad`` are rms of the true gap along the measured
    paths and of what no parameter closes of it, None where it is not known."""

    unit: Unit
    effects: tuple[str, ...]
    parameters: dict[str, float]
    gap_rad: float | None
    remainder_rad: float | None


def draw_reality(rng, number: int) -> Reality:
    """The reality of this number: benches and effects in turn, all else at random."""
    bench, effect = BENCHES[number % len(BENCHES)], EFFECTS[number % len(EFFECTS)]
    severity = SEVERITIES[(number // len(EFFECTS)) % len(SEVERITIES)]
    if bench != "known":
        drawn = draw_unit(rng, {effect: severity}, bench=bench, plan=PLAN, name=f"reality-{number}")
        return Reality(bench, drawn.unit, drawn.truth.answer, drawn.truth)
    effect = KNOWN_EFFECTS.get(effect, effect)
    known = Known(random_reducer(rng), effect, severity)
    unit = Unit(f"reality-{number}", known.reducer.torque_scale_nm, known.records(rng))
    return Reality(bench, unit, () if effect == "none" else (effect,), known)


def draw_simulator(rng, reality: Reality, variant: int, number: int) -> Shifted:
    """A simulator of one of the three kinds (see studies/simulated_pairs.py)."""
    if variant == 1:
        return _other_mechanics(rng, reality, number)
    clean = not reality.effects
    if isinstance(reality.truth, Known):
        return _of_class(rng, reality.truth, variant, clean)
    return _of_bench(rng, reality, variant, clean)


def _of_class(rng, truth: Known, variant, clean):
    drawn = {n: np.exp(rng.uniform(-SCALE, SCALE)) for n in ("clearance", "elastic", "friction")}
    factors = {} if variant == 2 and clean else drawn
    reducer = replace(truth.reducer, weights={n: w * factors.get(n, 1.0) for n, w in truth.reducer.weights.items()})
    has = variant == 2 and not clean
    simulator = Known(reducer, truth.effect if has else "none", truth.size)
    noise = replace(KNOWN_NOISE, white_rad=0.5 * KNOWN_NOISE.white_rad, correlated_rad=0.5 * KNOWN_NOISE.correlated_rad)
    records = simulator.records(rng, noise=noise if has else None)
    unit = Unit("simulator", reducer.torque_scale_nm, records)
    exact = [Known(k, "none", 0.0).records(rng, noise=None) for k in (truth.reducer, reducer)]
    gap = _rms([a.angle_rad - b.angle_rad for a, b in zip(*exact, strict=True)])
    known = clean or has
    return Shifted(unit, (truth.effect,) if has else (), simulator.parameters(), gap if known else None, 0.0 if known else None)


def _of_bench(rng, reality, variant, clean):
    truth = reality.truth
    reducer = truth.reducer if variant == 2 and clean else _moved(rng, truth.reducer)
    has = variant == 2 and not clean
    effects = tuple(p.effect for p in truth.planted) if has else ()
    unit = _simulated(rng, reality.bench, reducer, effects, PLAN, truth.noise if has else None)
    gap, rest = _true_gap(reality, reality.bench, reducer, effects)
    return Shifted(unit, reality.effects if has else (), _bench_truth(reality.bench, reducer, effects), gap, 0.0 if has else rest)


def _other_mechanics(rng, reality, number):
    others = [b for b in BENCHES[1:] if b != reality.bench]
    bench = others[number % len(others)]
    drawn = find_bench(bench).draw_reducer(rng)
    scale = reality.truth.reducer.angle_scale_rad if isinstance(reality.truth, Known) else reality.truth.reducer.angle_rad
    reducer = replace(drawn, rated_torque_nm=reality.unit.rated_torque_nm, angle_rad=scale)
    unit = _simulated(rng, bench, reducer, (), PLAN if number % 2 else OTHER_PATHS, None)
    known = isinstance(reality.truth, Known)
    gap, rest = (None, None) if known else _true_gap(reality, bench, reducer, ())
    return Shifted(unit, (), _bench_truth(bench, reducer, ()), gap, rest)


def _moved(rng, reducer) -> Any:
    """The reducer with some of its parameters shifted."""
    turned = [t for t in reducer.turned() if len(_changed(reducer, t)) == 1]
    values = {"angle_rad": reducer.angle_rad * float(np.exp(rng.uniform(-SCALE, SCALE)))}
    for other in rng.choice(np.array(turned, object), SHIFTS, replace=False):
        (name,) = _changed(reducer, other)
        old, step = getattr(reducer, name), getattr(other, name) - getattr(reducer, name)
        values[name] = float(max(old + step * rng.uniform(-MOST_STEPS, MOST_STEPS), 0.3 * old))
    return replace(reducer, **values)


def _changed(reducer, other):
    values = ((f.name, getattr(reducer, f.name), getattr(other, f.name)) for f in fields(reducer))
    return [name for name, a, b in values if isinstance(a, float) and a != b]


def _where(plan, reducer) -> list[Circumstances]:
    return [Circumstances(make_path(loop, reducer.rated_torque_nm, ()), 0.0, i) for i, loop in enumerate(plan.loops)]


def _simulated(rng, bench, reducer, effects, plan, noise) -> Unit:
    """Records of a bench's mechanics without anything of a measuring chain, with half of a bench's noise where there is any."""
    records = []
    for where in _where(plan, reducer):
        time = np.arange(0.0, where.path.end_s, 1.0 / plan.sampling_hz)
        torque, angle = where.path.torque_at(time), find_bench(bench).angle(reducer, effects, where, time)
        if noise:
            own = BenchNoise(0.5 * noise.white_rad, 0.5 * noise.correlated_rad, noise.correlation_time_s, 0.5 * noise.torque_nm)
            angle = angle + angle_noise(time.size, 1.0 / plan.sampling_hz, own, rng)
            torque = torque + own.torque_nm * rng.standard_normal(time.size)
        amplitude = float(np.abs(where.path.torque_nm).max())
        records.append(Record(f"{where.index + 1:02d}.csv", time, torque, angle, where.path.rate_nm_per_s, amplitude))
    return Unit("simulator", reducer.rated_torque_nm, tuple(records))


def _true_gap(reality, bench, reducer, effects) -> tuple[float, float]:
    """Rms [rad] of the true angle less the simulator's along the measured paths after the first reversal, and of what no
    parameter of the reality's mechanics closes."""
    gaps, rests = [], []
    for where, own in zip(_where(PLAN, reducer), reality.truth.records, strict=True):
        later = own.time_s > where.path.time_s[np.argmax(where.path.torque_nm)]
        simulated = find_bench(bench).angle(reducer, effects, where, own.time_s)
        gaps.append((own.angle_rad - simulated)[later])
        rests.append(own.remainder_rad[later])
    return _rms(gaps), _rms(rests)


def _rms(pieces) -> float:
    return float(np.sqrt(np.mean(np.concatenate([p - p.mean() for p in pieces]) ** 2)))


def _bench_truth(bench, reducer, effects) -> dict[str, float]:
    """Compliance of the clean reducer near T_r, and the indicators of the settled loop at the first rate."""
    mechanics, where = find_bench(bench), _where(PLAN, reducer)[0]
    own = tuple(e for e in effects if e.of_reducer)
    found = own_loop(mechanics, reducer, own, where, reducer.rated_torque_nm)
    path = where.path
    rise = path.end_s - np.array([0.15, 0.0]) * reducer.rated_torque_nm / path.rate_nm_per_s
    low, high = mechanics.angle(reducer, (), where, rise)
    kept = {name: found[name] for name in ("lost_motion_rad", "loop_area_J", "dissipation_ratio")}
    return kept | {"compliance_rated_rad_per_Nm": float((high - low) / (0.15 * reducer.rated_torque_nm))}
