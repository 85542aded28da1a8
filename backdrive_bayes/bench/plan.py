"""Test plans of the virtual bench: which torque paths are run, at which rates, and on which grids they are computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign


@dataclass(frozen=True)
class Loop:
    """One record: amplitude as a share of the rated torque, rate in rated torques per second, cycles."""

    amplitude: float = 1.0
    rate: float = 0.5
    cycles: int = 1


@dataclass(frozen=True)
class Plan:
    """The records of one unit and their sampling frequency [Hz], None for one that the bench draws."""

    loops: tuple[Loop, ...]
    sampling_hz: float | None = None


def make_plan(rates=(0.1, 0.5, 1.0), amplitudes=(1.0,), cycles=1, sampling_hz: float | None = 1000.0) -> Plan:
    """One record for each rate at each amplitude; units as in :class:`Loop`."""
    return Plan(tuple(Loop(a, r, cycles) for a in amplitudes for r in rates), sampling_hz)


DEFAULT_PLAN = make_plan(sampling_hz=None)


def random_plan(rng) -> Plan:
    """A plan such as benches run: mostly three rates, else sweeps, several cycles, unequal rates, one record."""
    kind = rng.choice(["rates", "sweep", "cycles", "unequal", "single"], p=[0.5, 0.15, 0.15, 0.1, 0.1])
    base = log_uniform(rng, 0.08, 0.4)
    if kind == "rates":
        return make_plan((base, 5 * base, 10 * base), sampling_hz=None)
    if kind == "sweep":
        return make_plan((5 * base,), (0.4, 0.7, 1.0), sampling_hz=None)
    if kind == "cycles":
        return make_plan((2 * base, 10 * base), cycles=int(rng.integers(2, 4)), sampling_hz=None)
    if kind == "unequal":
        return make_plan(tuple(base * np.cumprod(np.r_[1.0, rng.uniform(1.5, 5.0, 2)])), sampling_hz=None)
    return make_plan((base,), sampling_hz=None)


@dataclass(frozen=True)
class Path:
    """Turning torques [N·m] and their times [s]; the record begins at time 0, what lies before is its past."""

    time_s: np.ndarray
    torque_nm: np.ndarray
    rate_nm_per_s: float

    @property
    def end_s(self) -> float:
        """Time of the record's last turning point [s]."""
        return float(self.time_s[-1])

    def torque_at(self, time_s):
        """Torque [N·m] at times [s] of any shape."""
        return np.interp(time_s, self.time_s, self.torque_nm)


def make_path(loop: Loop, rated_torque_nm: float, past) -> Path:
    """Path of one record; ``past`` holds the turning torques before it as shares of the rated torque, 0 comes after them."""
    record = loop.amplitude * np.array([0.0, *([1.0, -1.0] * loop.cycles), 1.0])
    levels = np.r_[0.0, past, record] * rated_torque_nm
    rate = loop.rate * rated_torque_nm
    time = np.r_[0.0, np.cumsum(np.abs(np.diff(levels)))] / rate
    keep = np.r_[True, np.diff(time) > 0]
    time = time - time[len(past) + 1]
    return Path(time[keep], levels[keep], rate)


def draw_past(rng, amplitude: float) -> tuple[float, ...]:
    """Turning torques of the reducer's past as shares of the rated torque: none, one side, both, or loops within the loop."""
    turns = int(rng.choice([0, 1, 2, 3, 4]))
    sizes = rng.uniform(0.5, 1.0, turns) if turns < 3 else np.sort(rng.uniform(0.1, 1.0, turns))[::-1]
    levels = amplitude * sign(rng) * sizes * (-1.0) ** np.arange(turns)
    return tuple(float(level) for level in levels)


def event_grid(path: Path, rated_torque_nm: float, steps_per_leg: int) -> np.ndarray:
    """Times [s] at which the mechanics are computed: even in torque, twice as many again near zero torque."""
    times = [path.time_s[:1]]
    for t0, t1, q0, q1 in zip(path.time_s[:-1], path.time_s[1:], path.torque_nm[:-1], path.torque_nm[1:], strict=True):
        low, high = sorted((q0, q1))
        first, last = np.clip([-0.12 * rated_torque_nm, 0.12 * rated_torque_nm], low, high)
        near = np.linspace(first, last, steps_per_leg)
        torque = np.unique(np.r_[np.linspace(low, high, steps_per_leg), near])
        share = np.sort((torque - q0) / (q1 - q0))
        times.append(t0 + (t1 - t0) * share[1:])
    return np.concatenate(times)
