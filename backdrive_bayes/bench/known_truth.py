"""Bench records of the class itself: the truth is inside the class, the noise is a real bench's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import first_order
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.part import TOP
from backdrive_bayes.mechanics.reducer import ReducerClass
from backdrive_bayes.records.record import Record, Unit

KNOTS = np.r_[0.0, np.geomspace(0.004, TOP, 80)]


@dataclass(frozen=True)
class BenchNoise:
    """Noise of a virtual bench: standard deviations [rad, N·m] and the correlation time [s] of the angle's slow part."""

    white_rad: float = 3e-5
    correlated_rad: float = 7e-5
    correlation_time_s: float = 0.03
    torque_nm: float = 1e-4


@dataclass(frozen=True, eq=False)
class KnownReducer:
    """A reducer of the class: ``weights`` (cells,) by part, in shares of the angle scale."""

    weights: dict[str, np.ndarray]
    torque_scale_nm: float = 0.1
    angle_scale_rad: float = 0.02
    reducer: ReducerClass = ReducerClass(KNOTS)

    def angle_rad(self, time_s, torque_nm) -> np.ndarray:
        """Angle [rad] along a torque history of shape (samples,), from the neutral state at its first sample."""
        history = through(np.r_[time_s[:1], time_s], np.r_[torque_nm[:1], torque_nm], self.torque_scale_nm)
        total = sum((part.cells.ends(history) @ self.weights[part.name] for part in self.reducer.parts), np.zeros(()))
        return total * self.angle_scale_rad


def physical_reducer(
    rng, *, clearance=0.9, drag=0.05, engagement=0.15, compliance=0.5, friction=0.3, threshold=0.05, spread=0.6, scatter=0.1
) -> KnownReducer:
    """A reducer near the physical family, every weight with a log-normal ``scatter`` of its own.

    ``clearance``, ``compliance`` and ``friction`` are what is turned under full load, in angle scales; the clearance is crossed
    about ``drag`` (a share of the torque scale) with a relative standard deviation ``engagement``; thresholds are log-normal.
    """
    reducer = ReducerClass(KNOTS)
    elastic, friction_cells, steps = (reducer.part(name).cells for name in ("elastic", "friction", "clearance"))
    middle = steps.up + 0.5 * steps.width
    crossed = steps.width * np.exp(-0.5 * ((middle / drag - 1) / engagement) ** 2)
    plays = np.exp(-0.5 * (np.log(friction_cells.threshold / threshold) / spread) ** 2) * (friction_cells.centre < 0.3)
    weights = {
        "elastic": np.full(elastic.count, 2 * compliance),
        "friction": 2 * friction * plays / (plays @ friction_cells.width),
        "clearance": clearance * crossed / crossed.sum(),
        "free_play": np.zeros(steps.count),
        "compliance": np.zeros(1),
    }
    scattered = {n: w * np.exp(scatter * rng.standard_normal(w.size)) for n, w in weights.items()}
    return KnownReducer(scattered | {"masing": np.zeros(reducer.part("masing").cells.count)})


def random_reducer(rng, log_sd: float = 0.4) -> KnownReducer:
    """A physical reducer whose numbers vary log-normally about the usual ones."""
    usual = {"clearance": 0.9, "drag": 0.05, "engagement": 0.2, "compliance": 0.5, "friction": 0.3, "threshold": 0.05}
    return physical_reducer(rng, **{n: v * np.exp(log_sd * rng.standard_normal()) for n, v in usual.items()})


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
    return noise.correlated_rad * first_order(drive, phi) + noise.white_rad * rng.standard_normal(n)


def simulate_record(name, known: KnownReducer, amplitude_nm, rate_nm_per_s, noise: BenchNoise, rng, sampling_hz=1000.0) -> Record:
    """One record 0 → +T → −T → +T of a known reducer."""
    time, torque = ramp(amplitude_nm, rate_nm_per_s, sampling_hz)
    angle = known.angle_rad(time, torque) + angle_noise(time.size, time[1] - time[0], noise, rng)
    measured = torque + noise.torque_nm * rng.standard_normal(time.size)
    return Record(name, time, measured, angle, rate_nm_per_s, amplitude_nm)


def simulate_unit(known: KnownReducer, loops, noise: BenchNoise, rng, sampling_hz: float = 1000.0) -> Unit:
    """A unit with one record for each (amplitude [N·m], rate [N·m/s]) of ``loops``."""
    records = tuple(
        simulate_record(f"amplitude-{a:g}-rate-{r:g}.csv", known, a, r, noise, rng, sampling_hz) for a, r in loops
    )
    return Unit("known-truth", known.torque_scale_nm, records)
