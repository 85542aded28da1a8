"""Slopes of fine blocks, through which the torque's noise enters."""

from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.gap import fine
from backdrive_bayes.inference import fit


@pytest.mark.parametrize("slope", [fine._slope, lambda blocks: fit._slope(blocks, blocks.angle_rad)])
def test_slopes_stay_of_their_size_where_the_torque_stands_still_in_most_blocks(slope):
    still = np.repeat(np.arange(10.0), 30)
    rough = SimpleNamespace(torque_nm=still, angle_rad=np.linspace(0.0, 2e-2, still.size))
    assert np.median(np.gradient(still)) == 0.0
    smooth = SimpleNamespace(torque_nm=np.linspace(0.0, 9.0, still.size), angle_rad=rough.angle_rad)
    assert np.max(slope(rough)) < 1e3 * np.max(slope(smooth))
