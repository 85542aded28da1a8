"""Columns of what something unlisted may look like."""

import numpy as np
import pytest
from support.planted import prepared

from backdrive_bayes.engine import unlisted


def test_a_set_grows_with_the_way_wherever_the_torque_goes():
    """Of the records' whole ways each column holds its part; a set never goes back."""
    linear = prepared("none")[0]
    group = unlisted.ratchet_group(linear)
    ways = [np.abs(np.diff(b.torque_nm)).sum() for b in linear.reduced.blocks]
    for columns, way in zip(group.columns, ways, strict=True):
        assert np.all(np.diff(columns, axis=0) >= 0.0)
        assert columns[-1].mean() == pytest.approx(way / max(ways), rel=1e-6)


def test_bumps_stand_where_the_reducer_is_and_smooth_ones_draw_no_encoders_wave():
    linear = prepared("none")[0]
    smooth, alone = unlisted.bump_groups(linear)
    at = unlisted.PLACES.size // 2
    for columns, predicted in zip(alone.columns, linear.predicted, strict=True):
        high = np.argmax(columns[:, at])
        middle = 0.5 * (min(p.min() for p in linear.predicted) + max(p.max() for p in linear.predicted))
        assert abs(predicted[high] - middle) < 0.03 * np.ptp(predicted)
    share = np.linspace(-1.0, 1.0, smooth.width)
    assert np.corrcoef(smooth.columns[0] @ np.cos(np.pi * 0.5 * share), np.cos(np.pi * 0.5 * linear.predicted[0]))[0, 1] > 0.9
    fast = smooth.columns[0] @ np.cos(np.pi * 4.0 * share)
    assert np.ptp(fast) < 0.2 * np.ptp(smooth.columns[0] @ np.cos(np.pi * 0.5 * share))
