"""Unlisted effects of the angle's reading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class MainsHum(Effect):
    """Vibration in time at ``frequency_hz`` and twice that, swelling slowly; strength is angle share."""

    frequency_hz: float
    phase: float
    swell_hz: float

    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with vibration [rad]."""
        turn = 2 * np.pi * self.frequency_hz * run.bench_time_s + self.phase
        swell = 1.0 + 0.4 * np.sin(2 * np.pi * self.swell_hz * run.bench_time_s)
        return angle_rad + self.strength * run.reducer.angle_rad * swell * (np.sin(turn) + 0.3 * np.sin(2 * turn))


@dataclass(frozen=True)
class SensorJump(Effect):
    """A loose mount jumps once in each of ``records``, at a share ``when`` of the record; strength is angle share."""

    when: tuple[float, ...]
    records: tuple[bool, ...]
    direction: float

    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with a jump [rad]."""
        k = run.index % len(self.when)
        jumped = run.time_s > self.when[k] * run.path.end_s if self.records[k] else 0.0
        return angle_rad + self.direction * self.strength * run.reducer.angle_rad * jumped


@dataclass(frozen=True)
class BistableMount(Effect):
    """A mount that flips between two places at random ``flips`` of the bench's time [s]; strength is angle share."""

    flips: tuple[float, ...]

    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with flips [rad]."""
        # A longer session flips as it did before.
        side = np.searchsorted(self.flips, np.asarray(run.bench_time_s) % self.flips[-1]) % 2 - 0.5
        return angle_rad + self.strength * run.reducer.angle_rad * side


@dataclass(frozen=True)
class AngleScale(Effect):
    """The angle's gain differs between records, by ``gains`` times strength."""

    gains: tuple[float, ...]

    of_reducer = False

    def read(self, run, angle_rad):
        """Scaled angle [rad]."""
        return angle_rad * (1.0 + self.strength * self.gains[run.index % len(self.gains)])


@dataclass(frozen=True)
class DriveCrosstalk(Effect):
    """The drive's current leaks into the angle: a constant with the rate's sign, filtered; strength is angle share."""

    filter_share: float
    direction: float

    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with cross-talk [rad]."""
        path, window = run.path, self.filter_share * run.path.end_s
        going = np.sign(np.diff(path.torque_nm))
        begin, rise = path.time_s[0], np.r_[0.0, np.cumsum(going * np.diff(path.time_s))]
        before = np.interp(run.time_s - window, path.time_s, rise) + going[0] * np.minimum(run.time_s - window - begin, 0.0)
        leaked = (np.interp(run.time_s, path.time_s, rise) - before) / window
        return angle_rad + self.direction * self.strength * run.reducer.angle_rad * leaked


@dataclass(frozen=True)
class BufferSlip(Effect):
    """Samples are lost once in each record: from a share ``when`` of it on the angle is late by strength, in seconds."""

    when: tuple[float, ...]

    guess = 0.02
    of_reducer = False
    most = 2.0

    def read(self, run, angle_rad):
        """Angle, late after the loss [rad]."""
        late = run.time_s > self.when[run.index % len(self.when)] * run.path.end_s
        return np.interp(run.time_s - self.strength * late, run.time_s, angle_rad)


def draw_hum(rng, reducer):
    """Mains of 50 or 60 Hz, or a machine nearby at 8-30 Hz."""
    frequency = float(rng.choice([50.0, 60.0, rng.uniform(8.0, 30.0)]))
    return MainsHum(0.0, frequency, rng.uniform(0, 2 * np.pi), rng.uniform(0.02, 0.2))


def draw_jump(rng, reducer):
    """In one record or in several."""
    several = rng.random(8) < 0.4
    several[0] = True
    return SensorJump(0.0, tuple(rng.uniform(0.25, 0.9, 8).tolist()), tuple(bool(v) for v in several), sign(rng))


def draw_bistable(rng, reducer):
    """Flips every few seconds."""
    return BistableMount(0.0, tuple(np.cumsum(rng.exponential(log_uniform(rng, 1.0, 6.0), 3000)).tolist()))


def draw_scale(rng, reducer):
    """A gain error for each record."""
    return AngleScale(0.0, tuple(rng.uniform(-1, 1, 8).tolist()))


def draw_crosstalk(rng, reducer):
    """Either sign, filtered over a hundredth of the record or so."""
    return DriveCrosstalk(0.0, rng.uniform(0.002, 0.02), sign(rng))


def draw_buffer(rng, reducer):
    """At any time of each record."""
    return BufferSlip(0.0, tuple(rng.uniform(0.2, 0.7, 8).tolist()))
