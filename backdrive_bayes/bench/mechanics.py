"""One record computed: torque, friction, clearance, springs and effects on the event grid, then the channels on the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.effect import Run
from backdrive_bayes.bench.plan import PREROLL_S, Path, event_grid
from backdrive_bayes.bench.reducer import BenchReducer


@dataclass(frozen=True)
class Setting:
    """One record's circumstances: its path, its start since switch-on [s], its number, where the clearance floats at first."""

    path: Path
    start_s: float
    index: int
    floating: float = 0.0


@dataclass(frozen=True)
class Resolution:
    """Steps of the event grid on each leg, and the sampling step of the channels [s]."""

    steps_per_leg: int
    sampling_s: float


def sample_times(path: Path, sampling_s: float):
    """Times [s] of the record's samples, shape (samples,)."""
    return np.arange(int(round(path.end_s / sampling_s, 6)) + 1) * sampling_s


def record_angle(reducer: BenchReducer, effects, setting: Setting, resolution: Resolution):
    """Noise-free angle [rad] at ``sample_times``, shape (samples,)."""
    grid = event_grid(setting.path, reducer.rated_torque_nm, resolution.steps_per_leg)
    angle = reducer_angle(effects, _run(reducer, setting, grid))
    kept = sample_times(setting.path, resolution.sampling_s)
    before = int(PREROLL_S / resolution.sampling_s)
    times = np.r_[np.arange(-before, 0) * resolution.sampling_s, kept]
    reading, run = np.interp(times, grid, angle), _run(reducer, setting, times)
    for effect in effects:
        reading = effect.read(run, reading)
    return reading[before:]


def reducer_angle(effects, run: Run):
    """Angle of the reducer and of what is in series with it [rad], at the run's times."""
    reducer, torque = run.reducer, run.torque_nm
    for effect in effects:
        torque = effect.torque(run, torque)
    half_width = reducer.half_widths_nm(torque)
    for effect in effects:
        half_width = effect.friction(run, torque, half_width)
    drag = reducer.drags_nm(torque.size)
    for effect in effects:
        drag = effect.floating_drag(run, drag)
    passed = reducer.transmitted_nm(torque, half_width)
    for effect in effects:
        passed = effect.transmit(run, passed)
    angle = reducer.gap_angle_rad(torque, drag, run.floating) + reducer.spring_angle_rad(passed)
    return angle + sum((effect.deflect(run, torque, passed, angle) for effect in effects), 0.0)


def _run(reducer, setting, times):
    path = setting.path
    torque, rate = path.torque_at(times), path.rate_nm_per_s
    return Run(reducer, times, torque, rate, setting.start_s, setting.index, setting.floating)
