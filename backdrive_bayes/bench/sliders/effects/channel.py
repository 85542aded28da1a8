"""Effects of the measuring channel: lag, drift, torque offset, and the encoder's interpolation error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect

SESSION_S = 6000.0


@dataclass(frozen=True)
class SensorLag(Effect):
    """Pure delay, first-order filter, or both; strength is the lag in seconds, ``delay_share`` of it pure delay."""

    delay_share: float

    guess = 0.02
    most = 0.5
    of_reducer = False

    def read(self, run, angle_rad):
        """Late angle [rad]."""
        late = np.interp(run.time_s - self.strength * self.delay_share, run.time_s, angle_rad)
        return elements.relaxed(run.time_s, late, self.strength * (1.0 - self.delay_share))


def draw_sensor_lag(rng, reducer):
    """A delay, a filter, or half of each."""
    return SensorLag(0.0, float(rng.choice([0.0, 0.5, 1.0])))


@dataclass(frozen=True)
class ThermalDrift(Effect):
    """Drift as a function of the bench's time; strength is the angle share that it moves in ``scale_s``."""

    variant: str
    direction: float
    scale_s: float
    walk: tuple[float, ...] = ()

    most = 10.0
    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with drift [rad]."""
        return angle_rad + self.strength * self.direction * run.reducer.angle_rad * self._course(run.bench_time_s)

    def _course(self, time_s):
        if self.variant == "warm_up":
            return -np.expm1(-np.maximum(time_s, 0.0) / self.scale_s)
        if self.variant == "walk":
            span = SESSION_S + 10.0
            # A longer session walks the same way back, and on.
            back = SESSION_S - np.abs((time_s + 10.0) % (2.0 * span) - span)
            folded = np.where(time_s > SESSION_S, back, np.maximum(time_s, -10.0))
            return PchipInterpolator(np.linspace(-10.0, SESSION_S, len(self.walk)), self.walk)(folded)
        if self.variant == "air_conditioning":
            return np.sin(2 * np.pi * time_s / self.scale_s)
        return time_s / self.scale_s


def draw_thermal_drift(rng, reducer):
    """Linear, warm-up over 0.3-5 minutes, a walk with steps of seconds, or a swing of 0.5-5 minutes."""
    variant = str(rng.choice(["linear", "warm_up", "walk", "air_conditioning"]))
    scale = log_uniform(rng, 30.0, 300.0) if variant == "air_conditioning" else log_uniform(rng, 20.0, 300.0)
    if variant != "walk":
        return ThermalDrift(0.0, variant, sign(rng), scale)
    step = log_uniform(rng, 4.0, 15.0)
    steps = rng.standard_normal(int(SESSION_S / step)) * np.sqrt(step / 30.0)
    return ThermalDrift(0.0, variant, sign(rng), 30.0, tuple(np.cumsum(steps).tolist()))


@dataclass(frozen=True)
class TorqueOffset(Effect):
    """The torque that acts is the measured one less an offset; strength is its share of rated torque.

    ``factors`` make it differ between records (a sensor zeroed anew); all 1 is a dead weight.
    """

    direction: float
    factors: tuple[float, ...]

    most = 0.25
    of_reducer = False

    def torque(self, run, torque_nm):
        """Acting torque [N·m]."""
        factor = self.factors[run.index % len(self.factors)]
        return torque_nm - self.strength * self.direction * factor * run.reducer.rated_torque_nm


def draw_torque_offset(rng, reducer):
    """The same in all records, or nearly."""
    spread = float(rng.choice([0.0, 0.0, 0.25]))
    return TorqueOffset(0.0, sign(rng), tuple((1.0 + spread * rng.uniform(-1, 1, 8)).tolist()))


@dataclass(frozen=True)
class EncoderError(Effect):
    """Sine with a second harmonic, or a sawtooth rounded; ``period`` is an angle share, strength the sine's steepest slope."""

    period: float
    phase: float
    harmonic: float
    sharpness: float

    guess = 0.3
    most = 0.85
    of_reducer = False

    def read(self, run, angle_rad):
        """Angle with interpolation error [rad]."""
        turn = 2 * np.pi * angle_rad / (self.period * run.reducer.angle_rad) + self.phase
        wave = np.sin(turn) + self.harmonic * np.sin(2 * turn + 1.0)
        if self.sharpness:
            wave = np.arctan2(self.sharpness * np.sin(turn), 1.0 - self.sharpness * np.cos(turn))
        return angle_rad + self.strength * self.period * run.reducer.angle_rad * wave / (2 * np.pi)


def draw_encoder_error(rng, reducer):
    """Five to sixty-odd periods in the measured range."""
    variant = rng.integers(3)
    harmonic, sharpness = (rng.uniform(0.2, 0.5) if variant == 1 else 0.0), (rng.uniform(0.5, 0.8) if variant == 2 else 0.0)
    return EncoderError(0.0, log_uniform(rng, 0.03, 0.4), rng.uniform(0, 2 * np.pi), harmonic, sharpness)
