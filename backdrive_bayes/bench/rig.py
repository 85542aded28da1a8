"""What acts on the reducer and no sensor reads: ripple, cables, torques at which clearances cross; and the fixture's bend.

For a rate-independent reducer a small unread torque δ on a leg of loading rate τ' is a shift of time by δ/τ', so that one clean
angle per record serves for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.channel_noise import FRACTION, ChannelNoise
from backdrive_bayes.bench.draws import log_uniform, ornstein_uhlenbeck
from backdrive_bayes.bench.plan import Path

_CABLE_STEPS = 2000


@dataclass(frozen=True)
class Rig:
    """Amplitudes [N·m, rad] that stay below what can be told.

    The cable pulls back with ``cable_nm`` at half the angle range and rubs with ``cable_friction_nm``, which turns over within
    ``cable_slack`` of the half range. The torque at which clearances cross scatters by ``crossing_nm`` (sd) and is correlated
    over ``crossing_distance_nm`` of torque travelled. The fixture bends by ``wave_rad`` sin(``wave_load`` · load).
    """

    ripple_nm: float
    ripple_hz: float
    cable_nm: float
    cable_friction_nm: float
    cable_slack: float
    crossing_nm: float
    crossing_distance_nm: float
    wave_rad: float
    wave_load: float


def draw_rig(rng, reducer, noise: ChannelNoise, level: float) -> Rig:
    """Each part a fraction of the noise of its channel, times ``level``."""
    return Rig(
        ripple_nm=level * FRACTION * noise.torque_nm * rng.uniform(0.3, 1.0),
        ripple_hz=log_uniform(rng, 1.0, 12.0),
        cable_nm=level * noise.torque_nm * rng.uniform(0.02, 0.3),
        cable_friction_nm=level * noise.torque_nm * rng.uniform(0.02, 0.1),
        cable_slack=rng.uniform(0.05, 0.3),
        crossing_nm=level * noise.torque_nm * rng.uniform(0.0, 0.3),
        crossing_distance_nm=reducer.rated_torque_nm * log_uniform(rng, 1e-3, 5e-3),
        wave_rad=level * FRACTION * noise.correlated_rad * rng.uniform(-1.0, 1.0),
        wave_load=rng.uniform(4.0, 12.0),
    )


def rig_angle(rng, rig: Rig, reducer, where, time_s, own_rad):
    """Angle [rad] that the rig adds to the reducer's own one at ``time_s``, shape (samples,)."""
    path = where.path
    torque = path.torque_at(time_s)
    unread = rig.ripple_nm * np.sin(2 * np.pi * rig.ripple_hz * (where.start_s + time_s))
    unread = unread - _cable(rig, time_s, own_rad / reducer.angle_rad) + _crossing(rng, rig, time_s, path)
    shifted = np.interp(_shifted_times(path, time_s, unread), time_s, own_rad) - own_rad
    return shifted + rig.wave_rad * np.sin(rig.wave_load * torque / reducer.rated_torque_nm)


def _shifted_times(path: Path, time_s, unread_nm):
    """Times [s] at which the commanded torque is what acts now, on the same leg."""
    leg = np.clip(np.searchsorted(path.time_s, time_s, side="right") - 1, 0, path.time_s.size - 2)
    rate = (np.diff(path.torque_nm) / np.diff(path.time_s))[leg]
    return np.clip(time_s + unread_nm / rate, path.time_s[leg], path.time_s[leg + 1])


def _cable(rig, time_s, turned):
    """Torque of the cable [N·m]: a spring, and friction that follows the direction of motion within the slack."""
    times = np.linspace(time_s[0], time_s[-1], _CABLE_STEPS)
    step = np.diff(np.interp(times, time_s, turned))
    rub, rubbed = 0.0, [0.0]
    for toward, kept in zip(np.sign(step).tolist(), np.exp(-np.abs(step) / rig.cable_slack).tolist(), strict=True):
        rub = toward + (rub - toward) * kept
        rubbed.append(rub)
    return rig.cable_nm * turned + rig.cable_friction_nm * np.interp(time_s, times, rubbed)


def _crossing(rng, rig, time_s, path: Path):
    """Stationary Ornstein-Uhlenbeck process over the torque travelled [N·m], shape (samples,)."""
    per_distance = 4.0
    step = rig.crossing_distance_nm / per_distance
    nodes = int(np.ceil(path.rate_nm_per_s * path.end_s / step)) + 2
    course = ornstein_uhlenbeck(rng, nodes, np.exp(-1.0 / per_distance))
    return rig.crossing_nm * np.interp(path.rate_nm_per_s * time_s, step * np.arange(nodes), course)
