"""Where to begin: torque offset, lag, the drag's dependence on the rate and a drag at the shaft that follows it, from where legs
cross levels of the angle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.mechanics.effect import Distortion
from backdrive_bayes.mechanics.history import LEAST_RANGE

LEVELS = np.linspace(-0.9, 0.9, 73)
TORQUES = np.linspace(-0.97, 0.97, 1941)
SHIFTS = np.linspace(-0.4, 0.4, 401)
FINE = np.linspace(-0.002, 0.002, 41)
"""Torques at which legs are compared, and offsets that are tried, roughly and finely, in shares of the torque scale."""
LONG, HALF = 0.6, 0.4
"""Share of a record's torque range that a leg spans at least to be compared, and where no two of them do."""
NEAR, LEAST = 0.3, 0.4
"""How near to its ends, in shares of half its range, a leg still knows where it began, and the least share of it to compare."""
USUAL = np.array([0.2, 1.0, 0.2])
"""Standard deviations by which the least squares are held: lag [torque scale a unit rate], exponent, drag [torque scale]."""
MOST = (0.5, 0.2)
"""Most of an exponent and of a drag, in shares of the torque scale, that a search begins at. What the legs
tell beyond is mostly noise of few crossings; a search that begins too low may go on, one that begins too high ends elsewhere."""


def possible_starts(reduced: Reduced) -> list[Distortion]:
    """Distortions worth starting from: with the offset alone, with a lag, with a drag exponent, with both, with a drag at the
    shaft."""
    context, crossings, offset = reduced.context, _crossings(reduced), _oddest_offset(reduced)
    if len(crossings) < 3:
        return [Distortion(offset)]
    record = np.array([r for _, _, r in crossings])
    torque = np.array([t + sign * offset for t, sign, _ in crossings])
    base = np.median(torque, axis=0)
    weight = 1.0 / (np.abs(np.gradient(base)) + 2e-4) ** 2
    late = ((torque - base) * weight).sum(axis=1) / weight.sum()
    at = max(float((np.abs(base) * weight).sum() / weight.sum()), 1e-3)
    fastest = context.rate.max()
    share = context.rate[record] / fastest
    design = np.column_stack([np.ones(late.size), share, at * context.log_rate[record], np.sqrt(share)])
    held = np.diag(np.r_[0.0, 1e-2 / USUAL])
    starts = []
    several = int(np.ptp(np.sqrt(share)) > LEAST_RANGE)
    for used in ([1, 0, 0, 0], [1, 1, 0, 0], [1, 0, 1, 0], [1, 1, 1, 0], [1, 0, 0, several]):
        found = np.linalg.lstsq(np.vstack([design * used, held]), np.r_[late, np.zeros(4)], rcond=None)[0] * used
        if found[1] < 0.0:
            continue
        exponent, drag = (float(np.clip(value, -most, most)) for value, most in zip(found[2:], MOST, strict=True))
        starts.append(Distortion(offset, float(found[1] / fastest), drag_exponent=exponent, shaft_drag=drag))
    return starts


def _oddest_offset(reduced) -> float:
    """Offset about which rising legs and mirrored falling ones of a record agree best, up to an offset of the angle; none where
    no two of them overlap enough."""
    # A record of one cycle that begins at rest has half of one leg; legs of one direction each are those of several records.
    records = [_legs(*each, reduced.torque_scale_nm) for each in zip(reduced.blocks, reduced.angles, strict=True)]
    pairs = [pair for legs in records for pair in _pairs(legs)] or _pairs([leg for legs in records for leg in legs])
    widest = max((_overlap(pair, 0.0) for pair in pairs), default=0.0)
    pairs = [pair for pair in pairs if _overlap(pair, 0.0) > LONG * widest]

    def unevenness(shift):
        # Whatever is tried, the same legs are compared.
        if min(_overlap(pair, shift) for pair in pairs) == 0.0:
            return np.inf
        whole, points = 0.0, 0
        for up, down in pairs:
            low, high = _compared(up, down, shift)
            inside = (TORQUES > low) & (TORQUES < high)
            read = TORQUES[inside] - shift
            slope = np.interp(read, TORQUES, up.slope)
            weight = 1.0 / (reduced.context.angle_noise**2 + (reduced.context.torque_noise * slope) ** 2)
            apart = np.interp(read, TORQUES, up.angle) - np.interp(TORQUES[inside] + shift, TORQUES, down.angle)
            whole += float(np.sum(weight * (apart - np.average(apart, weights=weight)) ** 2))
            points += int(inside.sum())
        return whole / points

    if not pairs:
        return 0.0
    coarse = min(SHIFTS, key=unevenness)
    return float(min(coarse + FINE, key=unevenness))


@dataclass(frozen=True, eq=False)
class _Leg:
    """A leg, mirrored where it falls: torques [shares] at which it begins and ends, the angle at TORQUES, its share of its
    record's range."""

    sign: float
    first: float
    last: float
    angle: np.ndarray
    share: float

    @cached_property
    def slope(self) -> np.ndarray:
        """Change of the angle with the torque, at TORQUES."""
        return np.gradient(self.angle, TORQUES)


def _legs(blocks, angle, scale: float) -> list[_Leg]:
    """The settled legs of a record that span at least HALF of its range."""
    found, span = [], np.abs(np.diff(blocks.turning_nm)) / np.ptp(blocks.turning_nm)
    for k, sign, own in _settled_legs(blocks):
        if span[k] > HALF:
            z = np.maximum.accumulate(blocks.torque_nm[own] * sign) / scale
            found.append(_Leg(sign, z[0], z[-1], np.interp(TORQUES, z, angle[own] * sign), span[k]))
    return found


def _pairs(legs: list[_Leg]) -> list[tuple[_Leg, _Leg]]:
    """The mean rising leg and the mean mirrored falling one, of LONG legs if there are both, that overlap enough; or nothing."""
    for share in (LONG, HALF):
        both = [[leg for leg in legs if leg.sign == sign and leg.share > share] for sign in (1.0, -1.0)]
        if all(both):
            up, down = (
                _Leg(of[0].sign, max(g.first for g in of), min(g.last for g in of), np.mean([g.angle for g in of], axis=0), share)
                for of in both
            )
            return [(up, down)] if _overlap((up, down), 0.0) > 0.0 else []
    return []


def _compared(up: _Leg, down: _Leg, shift: float) -> tuple[float, float]:
    """Torques between which two legs are compared at an offset: not near where they begin and end."""
    near = NEAR * 0.5 * max(up.last - up.first, down.last - down.first)
    return max(up.first + shift, down.first - shift) + near, min(up.last + shift, down.last - shift) - near


def _overlap(pair, shift: float) -> float:
    """Range of torque that two legs share at an offset, 0 where it is too little to compare them."""
    up, down = pair
    low, high = _compared(up, down, shift)
    return high - low if high - low > LEAST * max(up.last - up.first, down.last - down.first) else 0.0


def _settled_legs(blocks):
    """Number, direction and blocks of every leg but the first, which the past decides, or of the only one."""
    for k in range(1 if blocks.direction.size > 1 else 0, blocks.direction.size):
        yield k, float(blocks.direction[k]), blocks.leg == k


def _crossings(reduced):
    """Torque at LEVELS on every settled leg that spans most of the range, mirrored where it falls, with sign and record."""
    found = []
    for r, (blocks, angle) in enumerate(zip(reduced.blocks, reduced.angles, strict=True)):
        settled = blocks.leg > 0 if blocks.direction.size > 1 else blocks.leg >= 0
        middle = angle - 0.5 * (angle[settled].max() + angle[settled].min())
        for k, sign, own in _settled_legs(blocks):
            if abs(blocks.turning_nm[k + 1] - blocks.turning_nm[k]) > 1.2 * reduced.torque_scale_nm:
                rising = np.maximum.accumulate(middle[own] * sign)
                found.append((np.interp(LEVELS, rising, blocks.torque_nm[own] * sign / reduced.torque_scale_nm), sign, r))
    return found
