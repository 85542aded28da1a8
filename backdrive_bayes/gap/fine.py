"""A record in fine blocks: what is left of it beside a slow model, whitened leg by leg against noise and smooth error.

Jumps, vibration and encoder error vanish in blocks that are wide enough for everything else; here the blocks are about ten
times finer, and a smooth process along each leg takes up whatever the slow model does not explain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from backdrive_bayes.gap.hypotheses import Fitted
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.inference.covariance import block_covariance, local_slope
from backdrive_bayes.inference.problem import path_of
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.reduction import reduce_record

BLOCKS_PER_SEGMENT = 700
SMOOTH_LENGTH = 0.04
"""Length scale of the smooth error along a leg, in legs of evenly counted blocks."""


@dataclass(frozen=True, eq=False)
class FineLeg:
    """One leg: torque run through since its start [N·m], angle read [rad], time [s], all (blocks,); whitened residual."""

    record: int
    way_nm: np.ndarray
    angle_rad: np.ndarray
    time_s: np.ndarray
    direction: int
    lower: np.ndarray
    residual: np.ndarray

    def white(self, columns):
        """Whitened columns (blocks, columns)."""
        return solve_triangular(self.lower, columns, lower=True, check_finite=False)


def fine_legs(setting: Setting, fitted: Fitted) -> list[FineLeg]:
    """All legs of all records beside a fitted hypothesis."""
    legs = []
    for r, record in enumerate(setting.unit.records):
        noise = setting.problem.records[r].noise
        blocks = reduce_record(record, find_segments(record.time_s, record.torque_nm), noise, BLOCKS_PER_SEGMENT)
        modelled = fitted.problem.model.angle(fitted.problem.values(fitted.z, r), path_of(blocks))
        residual = blocks.angle_rad - modelled
        # The measured angle's own jumps are what is looked for: they are no slope.
        covariance = block_covariance(blocks, noise, local_slope(blocks, modelled))
        for k, direction in enumerate(blocks.direction):
            own = np.flatnonzero(blocks.leg == k)
            if own.size < 20:
                continue
            own_covariance = covariance[np.ix_(own, own)] + _smooth(residual[own], np.sqrt(np.diag(covariance)[own]))
            lower = cholesky(own_covariance, lower=True, check_finite=False)
            left = solve_triangular(lower, residual[own] - residual[own].mean(), lower=True, check_finite=False)
            # Sharp places that no model has right would pass for structure if they counted as noise of the usual size.
            left /= max(1.0, float(np.std(left)))
            way = np.abs(blocks.torque_nm[own] - blocks.turning_nm[k])
            legs.append(FineLeg(r, way, blocks.angle_rad[own], blocks.mid_s[own], int(direction), lower, left))
    return legs


def _smooth(residual, noise_sd):
    place = np.arange(residual.size) / residual.size
    apart = np.sqrt(3) * np.abs(place[:, None] - place) / SMOOTH_LENGTH
    size = np.std(residual) + 3 * np.median(noise_sd)
    return size**2 * (1 + apart) * np.exp(-apart) + size**2
