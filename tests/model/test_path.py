"""Torque paths: samples and turning points say the same thing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backdrive_bayes.model.path import TorquePath

TURNS = st.lists(st.integers(-50, 50), min_size=2, max_size=12)


def true_turns(levels):
    """Start, strict local extremes and end of a zigzag."""
    kept = [levels[0]]
    for before, here, after in zip(levels[:-2], levels[1:-1], levels[2:], strict=True):
        if (here - before) * (after - here) < 0:
            kept.append(here)
    return [*kept, levels[-1]]


@given(TURNS)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_samples_give_back_the_turning_points(raw):
    levels = [float(a) for k, a in enumerate(raw) if k == 0 or a != raw[k - 1]]
    if len(levels) < 2:
        return
    path = TorquePath.from_turning_points(levels, points_per_leg=7)
    turns = true_turns(levels)
    assert [path.start_torque_nm, *[leg.end_torque_nm for leg in path.legs]] == pytest.approx(
        turns, abs=1e-12
    )
    assert [leg.direction for leg in path.legs] == list(np.sign(np.diff(turns)))
    assert path.legs[0].start == 0 and path.legs[-1].stop == path.torque_nm.size
    for a, b in zip(path.legs[:-1], path.legs[1:], strict=True):
        assert a.stop == b.start and a.direction == -b.direction
    for leg in path.legs:
        assert (leg.direction * np.diff(path.torque_nm[leg.start : leg.stop]) >= 0).all()


def test_direction_belongs_to_the_sample_that_arrives():
    path = TorquePath.from_samples([0.0, 1.0, 2.0, 2.0, 1.0, 1.0, 3.0])
    assert path.direction.tolist() == [1, 1, 1, 1, -1, -1, 1]
    assert [leg.end_torque_nm for leg in path.legs] == [2.0, 1.0, 3.0]


def test_time_follows_the_loading_rate():
    path = TorquePath.from_turning_points([0.0, 1.0, -1.0], 10, rate_nm_per_s=0.5)
    assert path.time_s[-1] == pytest.approx(6.0)
    np.testing.assert_allclose(np.abs(np.diff(path.torque_nm)) / np.diff(path.time_s), 0.5)


@pytest.mark.parametrize("torque", [[0.4], [0.4, 0.4, 0.4]])
def test_constant_torque_is_one_leg(torque):
    path = TorquePath.from_samples(torque)
    assert len(path.legs) == 1 and path.direction.size == len(torque)
