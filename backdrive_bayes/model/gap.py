"""A clearance between two flanks as a generalised play operator in closed form; its loops are compiled (``kernels``)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.model.kernels import gap_positions


@dataclass(frozen=True)
class Steps:
    """The rising boundary Σ share·tanh((τ - torque)/width) of a gap; the falling one is its mirror image.

    Three ``shares`` that sum to one, their ``torques`` and ``widths`` [N·m], each a number or (…, 1).
    """

    shares: tuple
    torques: tuple
    widths: tuple


def positions_in_gap(drive, steps: Steps, place, spread=0.0) -> np.ndarray:
    """Position from -1 to 1 along the path, shape (…, samples).

    ``place`` from 0 to 1 (…, 1) is where the path begins between the boundaries; teeth that share the gap may have been left at
    different places: the share ``spread`` (…, 1) of them lies at the one flank or the other so as to give the same mean position.
    """
    # The columns that gap_positions takes: three of each, the shift between; then place and spread.
    fine = [1 / width for width in steps.widths]
    columns = np.broadcast_arrays(*steps.shares, *steps.torques, drive.shift_nm, *fine, place, spread)
    shape, path = columns[0].shape[:-1], drive.path
    table = np.stack([c.reshape(-1) for c in columns], axis=-1)
    out = np.empty((table.shape[0], path.torque_nm.size))
    stop, direction, end = path.leg_table
    begin = np.array([path.start_torque_nm])
    gap_positions(path.torque_nm, stop, direction, end, begin, table[:, :10], table[:, 10], table[:, 11], out)
    return out.reshape(*shape, -1)
