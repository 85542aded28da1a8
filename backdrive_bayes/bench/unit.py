"""A whole unit of a virtual bench: drawn, computed, made noisy, with its truth kept apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from backdrive_bayes.bench import registry
from backdrive_bayes.bench.benches import DEFAULT_BENCH, find_bench
from backdrive_bayes.bench.chain import Chain, draw_chain, sample_times, write_down
from backdrive_bayes.bench.channel_noise import ChannelNoise, draw_noise
from backdrive_bayes.bench.loop_truth import held_record, own_effects, own_loop
from backdrive_bayes.bench.plan import DEFAULT_PLAN, Plan, draw_past, make_path
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances, Mechanics
from backdrive_bayes.bench.rig import Rig, draw_rig, rig_angle
from backdrive_bayes.bench.severity import FULL, Yardstick, make_yardstick, scale_to
from backdrive_bayes.bench.soil import HEIGHT, draw_soil
from backdrive_bayes.bench.truth import BenchUnit, PlantedEffect, RecordTruth, Truth
from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.record import Record, Unit


@dataclass(frozen=True, eq=False)
class _Test:
    """What all records of a unit share; ``acting`` are the traces and then the planted effects."""

    mechanics: Mechanics
    reducer: Any
    noise: ChannelNoise
    chain: Chain
    rig: Rig
    traces: tuple[BenchEffect, ...]
    acting: tuple[BenchEffect, ...]

    def angle(self, effects, where, time_s):
        """Noise-free angle [rad]."""
        return self.mechanics.angle(self.reducer, effects, where, time_s)


@threadpool_limits.wrap(limits=1)  # sums in another order would change last bits
def draw_unit(
    rng, effects=None, *, bench=DEFAULT_BENCH, plan: Plan = DEFAULT_PLAN, kind=None, soil=1.0, reserved=False, name="bench"
) -> BenchUnit:
    """A unit at random with ``effects``, a mapping of names to severities.

    Names are those of the bench (registry.py); 'unknown' takes an unlisted effect at random (a ``reserved`` one if so asked),
    'none' adds nothing; one that stands out no further than a trace is planted and not answered. ``kind`` is one of the bench's
    kinds or None; ``soil`` 0 gives a perfectly clean bench. Raises BadInput.
    """
    mechanics = find_bench(bench)
    chosen = registry.choose_effects(rng, mechanics, effects or {}, reserved)
    kind = _checked_kind(rng, mechanics, kind)
    reducer = mechanics.draw_reducer(rng, kind, tuple(name for name in chosen if name in registry.MEMBERS))
    noise, records = draw_noise(rng, reducer), _draw_records(rng, reducer, plan)
    yardstick = make_yardstick(mechanics, reducer, records, noise, tuple(chosen))
    planted = _plant(rng, yardstick, chosen)
    traces = draw_soil(rng, yardstick, soil, chosen)
    chain, rig = draw_chain(rng, noise, plan.sampling_hz, soil), draw_rig(rng, reducer, noise, soil)
    weak, strong = tuple(t.effect for t in traces), tuple(p.effect for p in planted)
    test = _Test(mechanics, reducer, noise, chain, rig, weak, (*weak, *strong))
    remainder = yardstick.remainder(strong) if strong else np.zeros((len(records), 2))
    truths = tuple(_true_record(rng, test, where, z) for where, z in zip(records, remainder, strict=True))
    measured = tuple(_measure(rng, test, truth, where) for truth, where in zip(truths, records, strict=True))
    held = held_record(mechanics, reducer, test.acting, strong, _fourth_rate(records), records[-1].start_s)
    # What a plan does not show (another gain in each of one record) is not there.
    answer = tuple(dict.fromkeys(p.answer for p in planted if p.height > HEIGHT[1]))
    truth = Truth(bench, kind, answer, planted, reducer, noise, chain, rig, traces, truths, remainder, held)
    return BenchUnit(Unit(name, reducer.rated_torque_nm, measured, reducer.reduction_ratio), truth)


def _checked_kind(rng, mechanics, kind):
    if kind is not None and kind not in mechanics.kinds:
        raise BadInput("kind", f"one of {', '.join(mechanics.kinds)}", f"'{kind}'")
    drawn = str(rng.choice(mechanics.kinds))
    return kind or drawn


def _draw_records(rng, reducer, plan) -> tuple[Circumstances, ...]:
    records, start = [], rng.uniform(0.0, 120.0)
    for index, loop in enumerate(plan.loops):
        path = make_path(loop, reducer.rated_torque_nm, draw_past(rng, loop.amplitude))
        records.append(Circumstances(path, float(start), index, float(rng.uniform(-1.0, 1.0))))
        start += path.end_s + rng.uniform(10.0, 120.0)
    return tuple(records)


def _plant(rng, yardstick: Yardstick, chosen) -> tuple[PlantedEffect, ...]:
    planted = []
    for name, severity in chosen.items():
        wanted = severity * rng.uniform(*FULL)
        drawn = registry.find_draw(yardstick.mechanics, name)(rng, yardstick.reducer)
        effect = scale_to(drawn, yardstick, wanted)
        height = yardstick.height(effect)
        planted.append(PlantedEffect(name, registry.answer(name), severity, effect, height, height < 0.8 * wanted))
    return tuple(planted)


def _true_record(rng, test: _Test, where: Circumstances, remainder) -> RecordTruth:
    time, rate = sample_times(rng, test.chain, where.path.end_s), where.path.rate_nm_per_s
    angle = test.angle(test.acting, where, time)
    without = angle if test.acting == test.traces else test.angle(test.traces, where, time)
    effect, sd = angle - without, test.noise.total_rad(np.gradient(without, time) / rate)
    coarse = np.linspace(0.0, where.path.end_s, remainder.size)
    beyond, largest = np.interp(time, coarse, remainder) * sd, float(np.abs(where.path.torque_nm).max())
    own = own_loop(test.mechanics, test.reducer, test.acting, where, largest)
    clean = own if angle is without else own_loop(test.mechanics, test.reducer, test.traces, where, largest)
    return RecordTruth(time, where.path.torque_at(time), angle, effect - effect.mean(), beyond, sd, own, clean)


def _measure(rng, test: _Test, truth: RecordTruth, where: Circumstances) -> Record:
    """The record as the bench writes it."""
    own = test.angle(own_effects(test.acting), where, truth.time_s)
    angle = truth.angle_rad + rig_angle(rng, test.rig, test.reducer, where, truth.time_s, own)
    time, torque, angle = write_down(rng, test.chain, test.noise, truth.time_s, truth.torque_nm, angle)
    rate, amplitude = where.path.rate_nm_per_s, float(np.abs(where.path.torque_nm[where.path.time_s >= 0]).max())
    name = f"{where.index + 1:02d}-rate-{rate:.3g}-amp-{amplitude:.3g}.csv.gz"
    return Record(name, time, torque, angle, rate, amplitude)


def _fourth_rate(records) -> float:
    """A rate [N·m/s] between the two slowest of the records' rates, or three times the only one."""
    rates = sorted({where.path.rate_nm_per_s for where in records})
    return float(np.sqrt(rates[0] * rates[1])) if len(rates) > 1 else 3.0 * rates[0]
