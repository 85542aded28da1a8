"""What a path from block to block leaves of the samples."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.reduced import Reduced


def residuals(reduced: Reduced, angles) -> list[np.ndarray]:
    """Every sample's angle [rad] beside the path from block to block of ``angles`` (records, blocks) in angle scales, (samples,)
    by record, less what the torque does beside its own path."""
    slopes, found = reduced.slopes(angles), []
    for r, (record, blocks, noise) in enumerate(zip(reduced.unit.records, reduced.blocks, reduced.noise, strict=True)):
        angle = np.interp(record.time_s, blocks.mid_s, angles[r]) * reduced.angle_scale_rad
        beside = slopes[r][block_of(record, blocks)] * between_blocks(record, blocks, noise.torque_nm)
        found.append(record.angle_rad - angle - beside)
    return found


def block_of(record, blocks) -> np.ndarray:
    """Number of the block of every sample, (samples,)."""
    return np.clip(np.searchsorted(blocks.begin_s, record.time_s, side="right") - 1, 0, blocks.count.size - 1)


def between_blocks(record, blocks, noise_nm: float) -> np.ndarray:
    """What the torque does beside the straight path from block to block [N·m], (samples,): a torque that rises in stairs moves
    the angle in stairs. Of what is mostly the sensor's noise the Wiener share is kept.
    """
    beside = record.torque_nm - np.interp(record.time_s, blocks.mid_s, blocks.torque_nm)
    return beside * max(0.0, 1.0 - noise_nm**2 / max(float(np.mean(beside**2)), 1e-300))
