"""Where to begin: torque offset, lag and the drag's dependence on rate, from where the legs cross levels of the angle."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.mechanics.effect import Distortion

LEVELS = np.linspace(-0.9, 0.9, 73)
TORQUES = np.linspace(-0.97, 0.97, 1941)
SHIFTS = np.linspace(-0.4, 0.4, 401)
FINE = np.linspace(-0.002, 0.002, 41)
"""Torques at which legs are compared, and offsets that are tried, roughly and finely, in shares of the torque scale."""
USUAL = np.array([0.2, 1.0])
"""Standard deviations by which the least squares are held: lag [torque scale a unit rate], exponent."""


def possible_starts(reduced: Reduced) -> list[Distortion]:
    """Distortions worth starting from: with the offset alone, with a lag, with a drag exponent, with both."""
    crossings = _crossings(reduced)
    if len(crossings) < 3:
        return [Distortion()]
    context, offset = reduced.context, _oddest_offset(reduced)
    record = np.array([r for _, _, r in crossings])
    torque = np.array([t + sign * offset for t, sign, _ in crossings])
    base = np.median(torque, axis=0)
    weight = 1.0 / (np.abs(np.gradient(base)) + 2e-4) ** 2
    late = ((torque - base) * weight).sum(axis=1) / weight.sum()
    at = max(float((np.abs(base) * weight).sum() / weight.sum()), 1e-3)
    fastest = context.rate.max()
    design = np.column_stack([np.ones(late.size), context.rate[record] / fastest, at * context.log_rate[record]])
    held = np.diag(np.r_[0.0, 1e-2 / USUAL])
    starts = []
    for used in ([1, 0, 0], [1, 1, 0], [1, 0, 1], [1, 1, 1]):
        found = np.linalg.lstsq(np.vstack([design * used, held]), np.r_[late, np.zeros(3)], rcond=None)[0] * used
        if found[1] < 0.0:
            continue
        starts.append(Distortion(offset, float(found[1] / fastest), 0.0, float(np.clip(found[2], -0.5, 0.5))))
    return starts


def _oddest_offset(reduced) -> float:
    """Offset about which rising legs and mirrored falling ones agree best, up to an offset of the angle."""
    legs: dict[float, list[np.ndarray]] = {1.0: [], -1.0: []}
    for blocks, angle in zip(reduced.blocks, reduced.angles, strict=True):
        for k in range(1 if blocks.direction.size > 1 else 0, blocks.direction.size):
            own, sign = blocks.leg == k, float(blocks.direction[k])
            if abs(blocks.turning_nm[k + 1] - blocks.turning_nm[k]) > 1.2 * reduced.torque_scale_nm:
                z = np.maximum.accumulate(blocks.torque_nm[own] * sign) / reduced.torque_scale_nm
                legs[sign].append(np.interp(TORQUES, z, angle[own] * sign))
    if not legs[1.0] or not legs[-1.0]:
        return 0.0
    up, down = np.mean(legs[1.0], axis=0), np.mean(legs[-1.0], axis=0)
    variance = reduced.context.angle_noise**2 + (reduced.context.torque_noise * np.gradient(up, TORQUES)) ** 2

    def unevenness(shift):
        inside = np.abs(TORQUES) < TORQUES[-1] - abs(shift)
        read = TORQUES[inside] - shift
        weight = 1.0 / np.interp(read, TORQUES, variance)
        apart = np.interp(read, TORQUES, up) - np.interp(TORQUES[inside] + shift, TORQUES, down)
        middle = np.sum(weight * apart) / weight.sum()
        return float(np.mean(weight * (apart - middle) ** 2))

    coarse = min(SHIFTS, key=unevenness)
    return float(min(coarse + FINE, key=unevenness))


def _crossings(reduced):
    """Torque at LEVELS on every settled leg that spans most of the range, mirrored where it falls, with sign and record."""
    found = []
    for r, (blocks, angle) in enumerate(zip(reduced.blocks, reduced.angles, strict=True)):
        legs = blocks.direction.size
        settled = blocks.leg > 0 if legs > 1 else blocks.leg >= 0
        middle = angle - 0.5 * (angle[settled].max() + angle[settled].min())
        for k in range(1 if legs > 1 else 0, legs):
            if abs(blocks.turning_nm[k + 1] - blocks.turning_nm[k]) > 1.2 * reduced.torque_scale_nm:
                own, sign = blocks.leg == k, blocks.direction[k]
                rising = np.maximum.accumulate(middle[own] * sign)
                found.append((np.interp(LEVELS, rising, blocks.torque_nm[own] * sign / reduced.torque_scale_nm), sign, r))
    return found
