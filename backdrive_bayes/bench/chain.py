"""The measurement chain of a unit: when samples are taken and how time, torque and angle are written down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.channel_noise import FRACTION, ChannelNoise, angle_noise
from backdrive_bayes.bench.draws import log_uniform

SAMPLING_HZ = (200.0, 2000.0)
CLOCKS, CLOCK_SHARES = ("even", "stamps", "uneven"), (0.6, 0.25, 0.15)
_OFFSET_SD = 5.0


@dataclass(frozen=True)
class Chain:
    """Sampling frequency [Hz], clock, and the steps of the channels [rad, N·m].

    ``uneven`` and ``stamp_jitter`` are shares of the sampling step: how far samples are taken from their even instants (stamps
    tell it), and the standard deviation of the stamps (which hides it). A rig resonates weakly with ``resonance_rad``.
    """

    sampling_hz: float
    uneven: float
    stamp_jitter: float
    angle_step_rad: float
    torque_step_nm: float
    resonance_rad: float
    resonance_hz: float


def draw_chain(rng, noise: ChannelNoise, sampling_hz: float | None, level: float) -> Chain:
    """A chain at random; ``sampling_hz`` None draws it too, ``level`` 0 leaves nothing but even samples of full resolution."""
    hertz = float(np.round(log_uniform(rng, *SAMPLING_HZ), -1))
    clock = str(rng.choice(CLOCKS, p=CLOCK_SHARES))
    uneven, jitter = rng.uniform(0.05, 0.3), log_uniform(rng, 0.005, 0.05)
    dirty = min(level, 1.0)
    return Chain(
        sampling_hz=hertz if sampling_hz is None else sampling_hz,
        uneven=dirty * uneven * (clock == "uneven"),
        stamp_jitter=dirty * jitter * (clock == "stamps"),
        angle_step_rad=level * noise.white_rad * log_uniform(rng, 0.05, 1.0),
        torque_step_nm=level * noise.torque_nm * log_uniform(rng, 0.05, 1.0),
        resonance_rad=level * FRACTION * noise.correlated_rad,
        resonance_hz=float(min(rng.uniform(15.0, 80.0), 0.4 * (sampling_hz or hertz))),
    )


def sample_times(rng, chain: Chain, end_s: float):
    """Instants [s] at which a record is sampled, shape (samples,), from 0 to its end."""
    step = 1.0 / chain.sampling_hz
    even = np.arange(int(round(end_s / step, 6)) + 1) * step
    moved = chain.uneven * step * rng.uniform(-1.0, 1.0, even.size) if chain.uneven else 0.0
    return np.clip(even + moved, 0.0, end_s)


def write_down(rng, chain: Chain, noise: ChannelNoise, time_s, torque_nm, angle_rad):
    """Time [s], torque [N·m] and angle [rad] as the record has them: noise, an encoder's offset, resonance, digits."""
    samples, step = time_s.size, 1.0 / chain.sampling_hz
    torque = torque_nm + noise.torque_nm * rng.standard_normal(samples)
    angle = angle_rad + angle_noise(rng, samples, step, noise) + noise.correlated_rad * rng.uniform(-_OFFSET_SD, _OFFSET_SD)
    angle = angle + _resonance(rng, time_s, chain)
    stamps = time_s + chain.stamp_jitter * step * rng.standard_normal(samples) if chain.stamp_jitter else time_s
    return stamps, _digits(torque, chain.torque_step_nm), _digits(angle, chain.angle_step_rad)


def _resonance(rng, time_s, chain):
    """A ring whose swell changes within a quarter of a second or so."""
    turn = 2 * np.pi * chain.resonance_hz * time_s
    knots = max(4, int(time_s[-1] / 0.25))
    swell = [np.interp(time_s, np.linspace(0, time_s[-1], knots), rng.standard_normal(knots)) for _ in range(2)]
    return chain.resonance_rad * (swell[0] * np.sin(turn) + swell[1] * np.cos(turn))


def _digits(values, step):
    return np.round(values / step) * step if step else values
