"""Area, height and width of a record's own cycle, read off the samples without a model, with standard errors from the noise.

Each quantity is a weighted sum of the recorded angles, so that noise averages out instead of becoming energy: the area is the
signed closed integral of torque over angle; tips and zero crossings are read from straight lines in time through many samples.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.faults import gaps_after, quantum
from backdrive_bayes.records.loop_weights import RAMP_SHARE, area_weights, cycles_of, first_cycle, settled_cycle, zero_torque_nm
from backdrive_bayes.records.noise import ChannelRecord, NoiseEstimate, estimate_common_noise
from backdrive_bayes.records.record import Record, Unit

_DITHER = 0.4
"""White noise, in steps of the encoder, from which a mean of many angles errs by a seventieth of a step at most."""


@dataclass(frozen=True)
class MeasuredLoop:
    """A record's mean cycle as measured: area ∮τ dθ [J], half the angle between the tips [rad], width at zero torque [rad].

    ``_sd`` are standard errors from the channels' noise, from gaps and tips between samples, and for the width from how much it
    depends on what is taken as straight (noise counts there once more: rather too large than too small). ``basis`` is 'settled'
    (tip to same tip, the mean of ``cycles`` of them, a linear drift of ``drift_rad`` per cycle taken out) or 'first' (0 to +T
    to -T to 0, the first loading in it). The width is None where the cycle does not reach zero torque on both branches; it is
    the mean over torques up to ``zero_nm``.
    """

    record: str
    basis: str
    cycles: int
    amplitude_nm: float
    drift_rad: float
    loop_area_j: float
    loop_area_j_sd: float
    half_peak_to_peak_rad: float
    half_peak_to_peak_rad_sd: float
    zero_torque_width_rad: float | None
    zero_torque_width_rad_sd: float | None
    zero_nm: float


def measured_loops(unit: Unit) -> tuple[MeasuredLoop | None, ...]:
    """The measured cycle of every record of a unit, None for a record that holds none."""
    cut = [find_segments(r.time_s, r.torque_nm) for r in unit.records]
    channels = [ChannelRecord(r.time_s, r.torque_nm, r.angle_rad, s) for r, s in zip(unit.records, cut, strict=True)]
    noises = estimate_common_noise(channels)
    return tuple(measure_loop(r, s, n) for r, s, n in zip(unit.records, cut, noises, strict=True))


def measure_loop(record: Record, segments, noise: NoiseEstimate) -> MeasuredLoop | None:
    """The mean settled cycle of a record, else its first cycle, else None; ``segments`` as from ``find_segments``."""
    found = cycles_of(record, segments)
    if found is None:
        return None
    weights = settled_cycle if found.settled else first_cycle
    # One cycle at a time: their weights are as long as the record.
    mean = _mean(weights(record, segments, k, left) for k, left in zip(found.starts, found.unclosed, strict=True))
    area, height, drift = mean["area"], mean["height"], mean["drift"]
    # The chord stands for the slope at the tip, which may be half as much again, or half of it.
    closing = 0.5 * float(mean["closing"] @ record.angle_rad)
    errors = [_angle_error(record, area, noise), _torque_error(record, found, noise), _gap_error(record, found), closing]
    step = _step_error(record, noise)
    width, width_sd = _width(record, found, mean.get("widths"), noise, step)
    return MeasuredLoop(
        record=record.name,
        basis="settled" if found.settled else "first",
        cycles=len(found.starts),
        amplitude_nm=found.amplitude_nm,
        drift_rad=float(drift @ record.angle_rad),
        loop_area_j=float(area @ record.angle_rad),
        loop_area_j_sd=float(np.linalg.norm(errors)),
        half_peak_to_peak_rad=float(height @ record.angle_rad),
        half_peak_to_peak_rad_sd=float(np.linalg.norm([_angle_error(record, height, noise), _corner_error(found), step])),
        zero_torque_width_rad=width,
        zero_torque_width_rad_sd=width_sd,
        zero_nm=0.0 if width is None else float(np.mean([zero_torque_nm(record, segments[k + 1]) for k in found.starts])),
    )


def _mean(parts) -> dict[str, np.ndarray]:
    """Mean of each named array over the parts that have it."""
    total: dict[str, np.ndarray] = {}
    count: dict[str, int] = {}
    for part in parts:
        for name, values in part.items():
            if values is not None:
                total[name] = total.get(name, 0.0) + values
                count[name] = count.get(name, 0) + 1
    return {name: values / count[name] for name, values in total.items()}


def _width(record: Record, found, weights, noise, step) -> tuple[float | None, float | None]:
    """Mean width at zero torque and its standard error; what a window twice as long changes is an error of its own, and so is
    what a straight torque over half the time changes."""
    if weights is None:
        return None, None
    short, long, closely = weights @ record.angle_rad
    ramp = RAMP_SHARE * (found.bounds[0][1] - found.bounds[0][0])
    torque = noise.torque_nm * found.slope_rad_per_nm * np.sqrt(2.0 / (ramp * len(found.starts)))
    errors = [_angle_error(record, weights[0], noise), torque, long - short, closely - short, np.sqrt(2.0) * step]
    return float(short), float(np.linalg.norm(errors))


def _angle_error(record: Record, weights: np.ndarray, noise: NoiseEstimate) -> float:
    """Standard error of a weighted sum of angles from their white and their correlated noise."""
    white = noise.white_rad**2 * float(weights @ weights)
    step = float(np.median(np.diff(record.time_s)))
    decay = float(np.exp(-step / noise.correlation_time_s))
    # Weights' covariance in a first-order process, in one pass: each sum keeps the share ``decay`` of the one before.
    steps = np.array([np.ones(weights.size), np.full(weights.size, -decay)])
    correlated = float(weights @ (2.0 * solve_banded((1, 0), steps, weights) - weights))
    return float(np.sqrt(max(white + noise.correlated_rad**2 * correlated, 0.0)))


def _step_error(record: Record, noise: NoiseEstimate) -> float:
    """Standard deviation of an angle that is read in steps [rad]; noise of a good part of a step makes means finer than steps."""
    step = quantum(record.angle_rad) or 0.0
    return step / np.sqrt(12.0) if noise.white_rad < _DITHER * step else 0.0


def _corner_error(found) -> float:
    """What half a sample at the turning points is worth: noise moves them, and either way the tip is read too low."""
    samples = np.mean([stop - start for start, stop in found.bounds])
    return found.slope_rad_per_nm * 2.0 * found.amplitude_nm / float(samples)


def _gap_error(record: Record, found) -> float:
    """Standard error of the mean area from gaps: between their ends the path may take either corner, or any way between."""
    at = gaps_after(record.time_s)
    corners = np.abs(np.diff(record.torque_nm)[at] * np.diff(record.angle_rad)[at])
    inside = [(at >= start) & (at < stop) for start, stop in found.bounds]
    return float(np.sqrt(sum(np.sum(corners[own] ** 2) for own in inside) / 12.0)) / len(found.bounds)


def _torque_error(record: Record, found, noise: NoiseEstimate) -> float:
    """Standard error of the mean area from the torque's noise, which multiplies the steps of the angle."""
    square = sum(float(np.sum(area_weights(record.angle_rad[a:b]) ** 2)) for a, b in found.bounds)
    return noise.torque_nm * float(np.sqrt(square)) / len(found.bounds)
