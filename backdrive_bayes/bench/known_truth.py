"""Bench records of the inference model itself: the truth is inside the model, the noise is a real bench's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.records.record import Record, Unit


@dataclass(frozen=True)
class BenchNoise:
    """Noise of a virtual bench: standard deviations [rad, N·m] and the correlation time [s] of the angle's slow part."""

    white_rad: float = 3e-5
    correlated_rad: float = 7e-5
    correlation_time_s: float = 0.03
    torque_nm: float = 1e-4


def ramp(amplitude_nm: float, rate_nm_per_s: float, sampling_hz: float = 1000.0, legs=(1, -1, 1)):
    """Time [s] and torque [N·m] of shape (samples,) of 0 → +T → −T → +T (or other signs of turning points)."""
    turning = amplitude_nm * np.concatenate([[0.0], legs])
    corner = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turning)))]) / rate_nm_per_s
    time = np.arange(int(round(corner[-1] * sampling_hz)) + 1) / sampling_hz
    return time, np.interp(time, corner, turning)


def angle_noise(n: int, step_s: float, noise: BenchNoise, rng) -> np.ndarray:
    """Stationary Ornstein-Uhlenbeck plus white noise [rad], shape (n,)."""
    phi = np.exp(-step_s / noise.correlation_time_s)
    drive = rng.standard_normal(n) * np.sqrt(1 - phi**2)
    drive[0] = rng.standard_normal()
    return noise.correlated_rad * lfilter([1], [1, -phi], drive) + noise.white_rad * rng.standard_normal(n)


def simulate_record(name, model: ReducerModel, values, amplitude_nm, rate_nm_per_s, noise: BenchNoise, rng) -> Record:
    """One record of a reducer with parameters ``values`` (scalars by name, SI units)."""
    time, torque = ramp(amplitude_nm, rate_nm_per_s)
    path = TorquePath.from_samples(torque, time)
    angle = model.angle({k: np.array([v]) for k, v in values.items()}, path)
    angle = angle + angle_noise(time.size, time[1] - time[0], noise, rng)
    measured = torque + noise.torque_nm * rng.standard_normal(time.size)
    return Record(name, time, measured, angle, rate_nm_per_s, amplitude_nm)


def simulate_unit(model: ReducerModel, values, loops, noise: BenchNoise, rng) -> Unit:
    """A unit with one record for each (amplitude [N·m], rate [N·m/s]) of ``loops``; ``values`` is one mapping a record."""
    records = tuple(
        simulate_record(f"amplitude-{a:g}-rate-{r:g}.csv", model, v, a, r, noise, rng)
        for (a, r), v in zip(loops, values, strict=True)
    )
    return Unit("known-truth", model.scale.torque_nm, records)
