"""A whole unit of the virtual bench: drawn, computed, made noisy, with its truth kept apart."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench import registry
from backdrive_bayes.bench.channel_noise import ChannelNoise, angle_noise, draw_noise
from backdrive_bayes.bench.dirt import Dirt, draw_dirt, quantise, resonance
from backdrive_bayes.bench.effect import Effect
from backdrive_bayes.bench.loop_truth import own_loop
from backdrive_bayes.bench.mechanics import Resolution, Setting, record_angle, sample_times
from backdrive_bayes.bench.plan import DEFAULT_PLAN, Plan, draw_past, make_path
from backdrive_bayes.bench.reducer import BenchReducer, draw_reducer
from backdrive_bayes.bench.severity import FULL, make_yardstick, scale_to
from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.record import Record, Unit

STEPS_PER_LEG = 500
_MEMBERS = ("load_dependent_friction", "hardening_stiffness")


@dataclass(frozen=True, eq=False)
class PlantedEffect:
    """An effect in a unit: its name on the bench, what a diagnosis should answer, and how far it stands out.

    ``height`` is what severity.py defines, in noise standard deviations; it falls short of ``severity`` where ``limited``.
    """

    name: str
    answer: str
    severity: float
    effect: Effect
    height: float
    limited: bool


@dataclass(frozen=True, eq=False)
class RecordTruth:
    """Noise-free truth of one record: arrays of shape (samples,).

    ``torque_nm`` is as commanded, ``angle_rad`` as read. ``effect_rad`` is what the effects make of it: the angle with them less
    that of the same reducer without, and less the record's mean, which an encoder's offset hides.
    ``remainder_rad`` is the part of it that the reducer's parameters cannot absorb (severity.py), computed on coarse samples.
    ``noise_rad`` is the noise's total standard deviation. ``indicators`` are of the reducer's own settled loop, in SI units.
    """

    torque_nm: np.ndarray
    angle_rad: np.ndarray
    effect_rad: np.ndarray
    remainder_rad: np.ndarray
    noise_rad: np.ndarray
    indicators: dict[str, float]


@dataclass(frozen=True, eq=False)
class Truth:
    """What only the bench knows of a unit; ``answer`` is what a diagnosis should say, () for none."""

    answer: tuple[str, ...]
    planted: tuple[PlantedEffect, ...]
    reducer: BenchReducer
    noise: ChannelNoise
    dirt: Dirt
    records: tuple[RecordTruth, ...]


@dataclass(frozen=True, eq=False)
class BenchUnit:
    """A unit as a reader would give it, and the truth about it."""

    unit: Unit
    truth: Truth


def draw_unit(rng, effects=None, *, plan: Plan = DEFAULT_PLAN, kind=None, dirt=1.0, reserved=False, name="bench") -> BenchUnit:
    """A unit at random with ``effects``, a mapping of names to severities.

    Names are those of registry.py; 'unknown' takes an unlisted effect at random (a ``reserved`` one if so asked), 'none' adds
    nothing. ``kind`` is one of reducer.KINDS or None; ``dirt`` 0 gives a perfectly clean bench. Raises BadInput.
    """
    effects = _checked(effects or {}, rng, reserved)
    reducer = draw_reducer(rng, kind, tuple(name for name in effects if name in _MEMBERS))
    noise, settings = draw_noise(rng, reducer), _settings(rng, reducer, plan)
    grime = draw_dirt(rng, reducer, noise, max(s.path.end_s for s in settings), dirt)
    planted, remainders = _plant(rng, reducer, settings, noise, effects)
    acting, step_s = tuple(p.effect for p in planted), 1.0 / plan.sampling_hz
    truths = [_true_record(reducer, acting, grime, noise, s, step_s) for s in settings]
    truths = [replace(t, remainder_rad=_stretch(z, t)) for t, z in zip(truths, remainders, strict=True)]
    records = tuple(_measure(rng, t, noise, s, step_s, dirt) for t, s in zip(truths, settings, strict=True))
    answer = tuple(dict.fromkeys(p.answer for p in planted))
    unit = Unit(name, reducer.rated_torque_nm, records, reducer.reduction_ratio)
    return BenchUnit(unit, Truth(answer, planted, reducer, noise, grime, tuple(truths)))


def _checked(effects, rng, reserved):
    chosen = {}
    for name, severity in effects.items():
        if not (isinstance(severity, int | float) and math.isfinite(severity) and 0.0 <= severity <= 10.0):
            raise BadInput(f"severity of {name}", "a number from 0 to 10", severity)
        if name not in registry.known_names():
            registry.find_draw(name)
        if name != registry.NONE and severity > 0:
            chosen[registry.pick_unlisted(rng, reserved) if name == registry.UNKNOWN else name] = float(severity)
    if registry.NONE in effects and len(effects) > 1:
        raise BadInput("effects", "'none' alone", ", ".join(effects))
    return chosen


def _settings(rng, reducer, plan):
    settings, start = [], rng.uniform(0.0, 120.0)
    for index, loop in enumerate(plan.loops):
        path = make_path(loop, reducer.rated_torque_nm, draw_past(rng, loop.amplitude))
        settings.append(Setting(path, float(start), index, float(rng.uniform(-1.0, 1.0))))
        start += path.end_s + rng.uniform(10.0, 120.0)
    return tuple(settings)


def _plant(rng, reducer, settings, noise, effects):
    """Planted effects, and for each record what cannot be absorbed of them together [noise sd], on coarse samples."""
    if not effects:
        return (), np.zeros((len(settings), 2))
    yardstick, planted = make_yardstick(reducer, settings, noise, effects), []
    for name, severity in effects.items():
        wanted = severity * rng.uniform(*FULL)
        effect = scale_to(registry.find_draw(name)(rng, reducer), yardstick, wanted)
        height = yardstick.height(effect)
        planted.append(PlantedEffect(name, registry.answer(name), severity, effect, height, height < 0.8 * wanted))
    return tuple(planted), yardstick.remainder(tuple(p.effect for p in planted))


def _true_record(reducer, effects, dirt, noise, setting, step_s):
    resolution, rate = Resolution(STEPS_PER_LEG, step_s), setting.path.rate_nm_per_s
    torque = setting.path.torque_at(sample_times(setting.path, step_s))
    angle = record_angle(reducer, (dirt, *effects), setting, resolution)
    without = record_angle(reducer, (dirt,), setting, resolution) if effects else angle
    effect, sd = angle - without, noise.total_rad(np.gradient(without, step_s) / rate)
    indicators = own_loop(reducer, effects, setting, float(np.abs(torque).max()))
    return RecordTruth(torque, angle, effect - effect.mean(), np.zeros(torque.size), sd, indicators)


def _stretch(remainder, truth: RecordTruth):
    """Remainder in rad on the record's samples."""
    at = np.linspace(0.0, 1.0, truth.noise_rad.size)
    return np.interp(at, np.linspace(0.0, 1.0, remainder.size), remainder) * truth.noise_rad


def _measure(rng, truth: RecordTruth, noise, setting, step_s, dirt):
    """The record as the bench writes it: noise, an encoder's offset, digits."""
    samples, rate = truth.torque_nm.size, setting.path.rate_nm_per_s
    torque = truth.torque_nm + noise.torque_nm * rng.standard_normal(samples)
    angle = truth.angle_rad + angle_noise(rng, samples, step_s, noise) + noise.correlated_rad * rng.uniform(-5.0, 5.0)
    angle = quantise(angle + resonance(rng, samples, step_s, noise, dirt), noise, dirt)
    amplitude = float(np.abs(setting.path.torque_nm[setting.path.time_s >= 0]).max())
    name = f"{setting.index + 1:02d}-rate-{rate:.3g}-amp-{amplitude:.3g}.csv.gz"
    return Record(name, np.arange(samples) * step_s, torque, angle, rate, amplitude)
