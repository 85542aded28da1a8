import gzip

import numpy as np
import pytest
from conftest import FULL_CYCLE, ramps
from hypothesis import given, settings
from hypothesis import strategies as st

from backdrive_bayes.records import turning
from backdrive_bayes.records.branches import find_branches, find_segments
from backdrive_bayes.records.clock import strictly_rising

SETTLED = ["load+0", "unload+1", "load-1", "unload-1", "load+1"]


def labels(time, torque):
    branches = find_branches(time, torque, find_segments(time, torque))
    return [f"{branch.label}{branch.cycle}" for branch in branches]


def starts(time, torque):
    return [segment.start for segment in find_segments(time, torque)]


def table(path, *columns):
    with gzip.open(path, "rt") as file:
        names = file.readline().strip().split(",")
        values = np.loadtxt(file, delimiter=",", usecols=[names.index(name) for name in columns])
    return values.T


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.03])
@pytest.mark.parametrize(
    "knots, turns, expected",
    [
        (FULL_CYCLE, [200, 600], SETTLED),
        ((1, -1, 1), [400], ["unload+1", "load-1", "unload-1", "load+1"]),
        ((-1, 1, -1, 1), [400, 800], ["unload-1", "load+1", "unload+1", "load-1", "unload-2", "load+2"]),
        ((0, -1, 1, -1), [200, 600], ["load-0", "unload-1", "load+1", "unload+1", "load-1"]),
        ((0.3, 1, -1, 1, -1), [140, 540, 940], SETTLED + ["unload+2", "load-2"]),
        (
            (-0.5, -1, 1, -1, 0),
            [100, 500, 900],
            ["load-0", "unload-1", "load+1", "unload+1", "load-1", "unload-2"],
        ),
    ],
)
def test_turning_points_and_labels(knots, turns, expected, noise):
    time, torque = ramps(knots, noise=noise)
    assert starts(time, torque) == pytest.approx([0, *turns], abs=0.5 if noise < 0.01 else 4)
    assert labels(time, torque) == expected


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_dwell_and_plateau_are_cut_in_the_middle(noise):
    assert starts(*ramps(dwell=0.2, noise=noise)) == pytest.approx([0, 220, 660], abs=3)
    assert starts(*ramps((0, 2, -2, 2), limit=1.2, noise=noise)) == pytest.approx([0, 400, 1200], abs=8)


def by_hand(seed=0):
    """A torque whose speed wavers by a factor of two, with its tips: flanks are bent, tips are sharp."""
    rng = np.random.default_rng(seed)
    speed = np.exp(0.5 * np.interp(np.arange(4000), np.linspace(0, 4000, 40), rng.standard_normal(40)))
    run = 5.0 * np.r_[0.0, np.cumsum(speed[:-1])] / speed[:-1].sum()
    torque = np.interp(run, [0, 1, 3, 5], [0, 1, -1, 1])
    return np.arange(4000) * 0.01, torque + 1e-4 * rng.standard_normal(4000), np.searchsorted(run, [1, 3])


def test_tips_of_a_torque_by_hand_are_where_it_turns(monkeypatch):
    for seed in range(5):
        time, torque, tips = by_hand(seed)
        assert starts(time, torque)[1:] == pytest.approx(tips.tolist(), abs=20)
        found = torque[starts(time, torque)[1:]]
        np.testing.assert_allclose(found, [1, -1], atol=0.006)
    monkeypatch.setattr(turning, "_TOP_SHARE", 1.0)
    far = [np.abs(np.abs(by_hand(s)[1][starts(*by_hand(s)[:2])[1:]]) - 1).max() for s in range(5)]
    assert max(far) > 0.02, "lines through bent flanks alone meet elsewhere (planted fault)"


def test_minor_loops_are_segments_but_no_cycles():
    time, torque = ramps((0, 1, 0.7, 1, -1, -0.8, -1, 1), noise=0.002)
    assert starts(time, torque) == pytest.approx([0, 200, 260, 320, 720, 760, 800], abs=2)
    assert {label[-1] for label in labels(time, torque)} == {"0", "1"}


def test_many_cycles():
    time, torque = ramps([0.0] + 50 * [1.0, -1.0], noise=0.01)
    found = starts(time, torque)
    assert len(found) == 100
    assert np.abs(np.diff(found)[1:] - 400).max() <= 4
    assert labels(time, torque)[-1] == "load-50"


def test_unequal_sampling_and_sine():
    generator = np.random.default_rng(3)
    time, torque = ramps(hertz=2000)
    keep = np.sort(generator.choice(len(time), 900, replace=False))
    found = time[keep][starts(time[keep], torque[keep])[1:]]
    assert found == pytest.approx([1.0, 3.0], abs=0.01)
    time = np.arange(0, 20, 0.005)
    assert time[starts(time, np.sin(time))[1:]] == pytest.approx(np.pi * (np.arange(6) + 0.5), abs=0.01)


def test_surge_of_the_drive_is_no_reversal():
    time, torque = ramps(noise=0.03)
    torque[90:104] += 0.8 * np.sin(np.linspace(0, 4 * np.pi, 14))
    assert starts(time, torque) == pytest.approx([0, 200, 600], abs=5)


@pytest.mark.parametrize("torque", [np.ones(100), np.zeros(1), np.arange(2.0), np.arange(50.0)])
def test_torque_without_reversal_is_one_segment(torque):
    time = np.arange(len(torque), dtype=float)
    (segment,) = find_segments(time, torque)
    assert (segment.start, segment.stop) == (0, len(torque))
    assert len(find_branches(time, torque, (segment,))) == 1


wave = st.lists(st.floats(0.5, 1.0), min_size=3, max_size=6)


@given(
    peaks=wave, start=st.floats(-0.2, 0.2), noise=st.sampled_from([0.0, 0.003, 0.02]), seed=st.integers(0, 99)
)
@settings(max_examples=25, deadline=None)
def test_segments_cover_the_record_and_sit_at_the_reversals(peaks, start, noise, seed):
    knots = [start, *(peak * (-1) ** k for k, peak in enumerate(peaks))]
    time, torque = ramps(knots, noise=noise, seed=seed)
    segments = find_segments(time, torque)
    assert segments[0].start == 0 and segments[-1].stop == len(time)
    assert all(
        a.stop == b.start and a.direction == -b.direction
        for a, b in zip(segments, segments[1:], strict=False)
    )
    turns = np.cumsum(np.abs(np.diff(knots)))[:-1]
    assert [time[segment.start] for segment in segments[1:]] == pytest.approx(turns, abs=0.03)
    branches = find_branches(time, torque, segments)
    assert branches[0].start == 0 and branches[-1].stop == len(time)
    assert all(a.stop == b.start for a, b in zip(branches, branches[1:], strict=False))


@given(start=st.integers(0, 380), noise=st.sampled_from([0.0, 0.01]))
@settings(max_examples=20, deadline=None)
def test_start_in_the_cycle_does_not_move_the_later_turns(start, noise):
    time, torque = ramps((0, 1, -1, 1, -1, 0), noise=noise)
    whole = [turn for turn in starts(time, torque) if turn > start + 60]
    cut = [turn + start for turn in starts(time[start:], torque[start:]) if turn > 60]
    assert cut == pytest.approx(whole, abs=3)


@given(scale=st.sampled_from([1e-3, 40.0]), noise=st.sampled_from([0.0, 0.01]), seed=st.integers(0, 9))
@settings(max_examples=15, deadline=None)
def test_sign_and_unit_of_torque_do_not_matter(scale, noise, seed):
    time, torque = ramps(noise=noise, seed=seed)
    mirrored = [label.translate(str.maketrans("+-", "-+")) for label in labels(time, -scale * torque)]
    assert starts(time, -scale * torque) == starts(time, torque)
    assert mirrored == labels(time, torque)


def test_twins_are_cut_to_the_sample(shared_data):
    for path in sorted((shared_data / "twins").glob("*/*.csv.gz")):
        time, torque = table(path, "time_s", "torque_Nm")
        fifth = (len(time) - 1) // 5
        assert starts(time, torque) == pytest.approx([0, fifth, 3 * fifth], abs=1), path
        assert labels(time, torque) == SETTLED, path


@pytest.mark.parametrize("kind, tolerance", [("small", 0.08), ("large", 0.3)])
def test_real_motors_give_three_segments(shared_data, kind, tolerance):
    for path in sorted((shared_data / "cycloidal").glob(f"*/{kind}-*.csv.gz")):
        stamps, torque, command = table(path, "TIME", "TORQUE", "CONTROL_TORQUE")
        time, _ = strictly_rising(stamps, 2, str(path))
        turns = [time[np.flatnonzero(command == level)].mean() for level in (command.max(), command.min())]
        assert time[starts(time, torque)[1:]] == pytest.approx(turns, abs=tolerance), path
        assert labels(time, torque) == SETTLED[:4], path
