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
LONG, HALF = 0.6, 0.4
"""Share of a record's torque range that a leg spans at least to be compared, and where no two of them do."""
NEAR, LEAST = 0.3, 0.4
"""How near to its ends, in shares of its largest torque, a leg still knows where it began, and the least share to compare."""
USUAL = np.array([0.2, 1.0])
"""Standard deviations by which the least squares are held: lag [torque scale a unit rate], exponent."""


def possible_starts(reduced: Reduced) -> list[Distortion]:
    """Distortions worth starting from: with the offset alone, with a lag, with a drag exponent, with both."""
    crossings, context, offset = _crossings(reduced), reduced.context, _oddest_offset(reduced)
    if len(crossings) < 3:
        return [Distortion(offset)]
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
    """Offset about which rising legs and mirrored falling ones of a record agree best, up to an offset of the angle."""
    pairs = []
    for blocks, angle in zip(reduced.blocks, reduced.angles, strict=True):
        # A record of one cycle that begins at rest has half of one leg.
        found = (_branches(blocks, angle, reduced.torque_scale_nm, share) for share in (LONG, HALF))
        pairs += [legs for legs in found if len(legs) == 2][:1]
    if not pairs:
        return 0.0

    def unevenness(shift):
        whole, points = 0.0, 0
        for up, down in pairs:
            low, high = max(up[0] + shift, down[0] - shift), min(up[1] + shift, down[1] - shift)
            near = NEAR * 0.5 * (up[1] - up[0])
            inside = (TORQUES > low + near) & (TORQUES < high - near)
            if high - low < 2.0 * near + LEAST * (up[1] - up[0]):
                continue
            read = TORQUES[inside] - shift
            slope = np.interp(read, TORQUES, np.gradient(up[2], TORQUES))
            weight = 1.0 / (reduced.context.angle_noise**2 + (reduced.context.torque_noise * slope) ** 2)
            apart = np.interp(read, TORQUES, up[2]) - np.interp(TORQUES[inside] + shift, TORQUES, down[2])
            whole += float(np.sum(weight * (apart - np.average(apart, weights=weight)) ** 2))
            points += int(inside.sum())
        return whole / points if points else np.inf

    coarse = min(SHIFTS, key=unevenness)
    return float(min(coarse + FINE, key=unevenness))


def _branches(blocks, angle, scale: float, share: float) -> list[tuple[float, float, np.ndarray]]:
    """The mean rising leg of a record and the mean mirrored falling one, of legs that span at least a share of it: where they
    begin and end, and the angle at TORQUES."""
    long = share * np.ptp(blocks.turning_nm)
    found = []
    for sign in (1.0, -1.0):
        legs = []
        for k in range(1 if blocks.direction.size > 1 else 0, blocks.direction.size):
            if blocks.direction[k] == sign and abs(blocks.turning_nm[k + 1] - blocks.turning_nm[k]) > long:
                own = blocks.leg == k
                z = np.maximum.accumulate(blocks.torque_nm[own] * sign) / scale
                legs.append((z[0], z[-1], np.interp(TORQUES, z, angle[own] * sign)))
        if legs:
            first, last, angles = zip(*legs, strict=True)
            found.append((max(first), min(last), np.mean(angles, axis=0)))
    return found


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
