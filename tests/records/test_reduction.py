"""Block means of a record."""

import numpy as np
import pytest
from conftest import answer, ramps
from scipy.ndimage import uniform_filter1d
from support.planted import planted

from backdrive_bayes.engine.infer import _amplitude
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.mechanics.history import of_blocks
from backdrive_bayes.records import reduction, torque_path
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.white_noise import white_noise


def outer_counts(monkeypatch, hertz, halvings):
    """Samples of the first and last block of every leg, and how far from the peak the last block before each turn lies [N·m]."""
    monkeypatch.setattr("support.planted.HERTZ", hertz)
    monkeypatch.setattr(reduction, "HALVINGS", halvings)
    (blocks,) = reduce_unit(planted(loops=((0.1, 0.02),))).blocks
    legs = [blocks.count[blocks.leg == k] for k in range(blocks.direction.size)]
    away = 0.1 - np.abs(blocks.torque_nm[np.flatnonzero(np.diff(blocks.leg))])
    return np.array([[c[0], c[-1]] for c in legs]), away


def test_blocks_next_to_a_turning_point_are_halved(monkeypatch):
    whole, far = outer_counts(monkeypatch, 4000.0, 0)
    halved, near = outer_counts(monkeypatch, 4000.0, 3)
    assert halved == pytest.approx(whole / 8, abs=2)
    assert np.all(near < 0.2 * far)


def test_no_block_is_halved_to_less_than_few_samples(monkeypatch):
    whole, _ = outer_counts(monkeypatch, 200.0, 0)
    halved, _ = outer_counts(monkeypatch, 200.0, 3)
    assert whole.max() > 2 * reduction.FEW
    assert np.all(halved >= np.minimum(whole, reduction.FEW))


def turned(torque, time, *, acting=None, noise=2e-3, seed=0, kept=slice(None)):
    """A unit with one record of this torque [N·m], read with noise; ``acting`` is what turns the angle, by default the same."""
    rng = np.random.default_rng(seed)
    angle = answer(torque if acting is None else acting) + 2e-5 * rng.standard_normal(time.size)
    read = torque + noise * rng.standard_normal(time.size)
    return Unit("u", 1.0, (Record("r.csv", time[kept], read[kept], angle[kept], 0.1),))


def ramped(dwell=0.0, rounding=1):
    """Time and torque of a loop of ±1 N·m, the torque at rest at its tips or rounded over so many samples."""
    time, torque = ramps((0, 1, -1, 1, 0), rate=0.1, hertz=500.0, dwell=dwell)
    return time, uniform_filter1d(torque, rounding, mode="nearest")


@pytest.mark.parametrize("tips", [{}, {"dwell": 0.8}, {"dwell": 0.15}, {"rounding": 201}], ids=str)
def test_the_amplitude_is_that_of_the_torque_whatever_its_tips(tips):
    """Straight flanks meet beyond a tip at which the torque rests or turns gradually."""
    time, torque = ramped(**tips)
    true = np.abs(torque).max()
    found = [reduce_unit(turned(torque, time, seed=seed)).blocks[0].amplitude_nm / true - 1.0 for seed in range(4)]
    assert np.abs(found).max() < 1.5e-3, found


def test_a_torque_that_sways_is_followed_and_its_amplitude_stays():
    time, torque = ramped()
    swaying = torque + 0.004 * np.sin(2 * np.pi * time / 10.0)
    (blocks,) = reduce_unit(turned(swaying, time)).blocks
    mid = np.interp(blocks.mid_s, time, uniform_filter1d(swaying, 5))
    inner = np.abs(np.abs(mid) - 1.0) > 0.05
    assert np.sqrt(np.mean((blocks.torque_nm - mid)[inner] ** 2)) < 4e-4
    assert blocks.amplitude_nm == pytest.approx(1.0, abs=2e-3)


def test_where_a_record_begins_and_ends_is_no_tip():
    time, torque = ramps((0.96, -1, 1, -0.96), rate=0.1, hertz=500.0)
    assert reduce_unit(turned(torque, time)).blocks[0].amplitude_nm == pytest.approx(1.0, abs=1.5e-3)


def test_a_record_in_packets_has_no_more_blocks_than_a_whole_one():
    time, torque = ramped()
    packets = np.arange(time.size) % 16 < 10
    whole, cut = (reduce_unit(turned(torque, time, kept=kept)).blocks[0].count.size for kept in (slice(None), packets))
    assert cut < 1.2 * whole


def left_of(path_s, path_nm, time, torque, noise=2e-3):
    """What a path leaves of a torque that has no noise, rms in the noise of a sample."""
    return float(np.sqrt(np.mean((np.interp(time, path_s, path_nm) - torque) ** 2)) / noise)


def stairs(time, steps=8):
    """A torque that rises in stairs to 1 N·m and on to -1 N·m, with short ramps between, and again."""
    ramp = np.interp(time, np.array([0.0, 10.0, 30.0, 50.0]), [0.0, 1.0, -1.0, 1.0])
    return uniform_filter1d(np.round(steps * ramp) / steps, 25)


@pytest.mark.parametrize("shape", ["ramp", "dwell", "rounded", "sine", "stairs"])
def test_the_path_is_what_the_torque_was(shape, monkeypatch):
    """The planted fault is a path of one piece."""
    if shape in ("ramp", "dwell", "rounded"):
        time, torque = ramped(dwell=2.0 if shape == "dwell" else 0.0, rounding=80 if shape == "rounded" else 1)
    else:
        time = np.arange(0.0, 50.0, 2e-3)
        torque = np.sin(2 * np.pi * time / 40.0) if shape == "sine" else stairs(time)
    blocks = reduce_unit(turned(torque, time)).blocks[0]
    assert left_of(blocks.path_s, blocks.path_nm, time, torque) < (1.0 if shape == "stairs" else 0.5)
    monkeypatch.setattr(torque_path, "MOST_PIECES", 1)
    straight = reduce_unit(turned(torque, time)).blocks[0]
    assert left_of(straight.path_s, straight.path_nm, time, torque) > 2.0


def test_samples_that_share_a_stamp_make_no_spikes():
    time, torque = ramped()
    coarse = np.floor(time / 0.004) * 0.004 + 1e-9 * np.arange(time.size)
    blocks = reduce_unit(turned(torque, coarse)).blocks[0]
    assert np.abs(blocks.path_nm).max() < 1.02 and np.all(np.diff(blocks.path_s) > 0)
    assert left_of(blocks.path_s, blocks.path_nm, time, torque) < 1.0


def test_a_dwell_is_one_piece():
    """The planted fault: cuts that are not taken back."""
    time, torque = ramped(dwell=4.0)
    blocks = reduce_unit(turned(torque, time)).blocks[0]
    assert blocks.path_s.size == 2 * blocks.direction.size + 1
    assert np.abs(blocks.turning_nm[1:-1]) == pytest.approx(1.0, abs=5e-4)


def test_pieces_meet_at_the_tip_and_not_at_a_sample():
    time = np.arange(0.0, 50.0, 0.1373)
    torque = np.interp(time, [0.0, 10.0, 30.0, 50.0], [0.0, 1.0, -1.0, 1.0])
    blocks = reduce_unit(turned(torque, time, noise=1e-5)).blocks[0]
    assert np.abs(blocks.turning_nm[1:-1]) == pytest.approx(1.0, abs=1e-4)
    assert np.abs(torque[time < 40.0]).max() < 0.998


@pytest.mark.parametrize("reached", [(0, 1, -1, 1, 0.93), (0.93, 1, -1, 1, -1, -0.93), (0.05, 0, 1, -1, 0.1)], ids=str)
def test_a_bit_of_a_leg_at_an_end_bends_no_other(reached):
    """It is too short for a leg of its own, and the path of its neighbour is not to make up for it."""
    time, torque = ramps(reached, rate=0.1, hertz=50.0)
    blocks = reduce_unit(turned(torque, time)).blocks[0]
    assert np.abs(np.interp(time, blocks.path_s, blocks.path_nm) - torque).max() < 6e-3
    assert np.abs(blocks.turning_nm[1:-1]) == pytest.approx(1.0, abs=4e-3)


@pytest.mark.parametrize("turns_back", [True, False])
def test_a_torque_that_goes_back_within_a_leg_is_followed_where_the_angle_turns_back(turns_back, monkeypatch):
    """By hand a torque goes back by a twentieth of its range, and so does the angle; where a drive surges, the angle goes on.
    The planted fault takes the one for the other."""
    time, torque = ramps((0, 1, 0.5, 0.6, -1, -0.3, -0.4, 1, 0), rate=0.1, hertz=500.0)
    tips = [0.0, *(float(time[f(torque)]) for f in (np.argmax, np.argmin)), float(time[torque > 0.999][-1]), float(time[-1])]
    acting = torque if turns_back else np.interp(time, tips, [0.0, 1.0, -1.0, 1.0, 0.0])

    def turns():
        blocks = reduce_unit(turned(torque, time, acting=acting)).blocks[0]
        assert blocks.direction.size == 4
        steps = np.diff(blocks.path_nm)
        return int(np.count_nonzero(np.diff(np.sign(steps[steps != 0.0]))))

    assert turns() == (7 if turns_back else 3)
    turned_of = torque_path._turned
    monkeypatch.setattr(torque_path, "_turned", lambda *where: -turned_of(*where))
    assert turns() == (3 if turns_back else 7)


def test_the_ringing_of_a_drive_is_no_tip(monkeypatch):
    """Across a clearance the torque of a drive rings beyond the tip, as on the measured cycloidal units, for a fiftieth of a leg.
    The planted fault takes the farthest torque for the tip."""
    time, torque = ramps((0, 1, -1, 1, 0), rate=0.5, hertz=500.0)
    rung = torque.copy()
    for begin in (1.4, 5.2, 9.3):
        own = slice(*np.searchsorted(time, [begin, begin + 0.08]))
        rung[own] += 1.2 * np.sin(2.0 * np.pi * (time[own] - begin) / 0.02)
    assert np.abs(rung).max() > 1.7

    def reached():
        blocks = reduce_unit(turned(rung, time, acting=torque)).blocks[0]
        assert blocks.direction.size == 4
        return np.abs(blocks.turning_nm - [0.0, 1.0, -1.0, 1.0, 0.0]).max()

    assert reached() < 0.02
    monkeypatch.setattr(torque_path, "_mode", lambda height, weight: int(np.argmax(height)))
    assert reached() > 0.3


def test_a_tip_before_a_long_hold_is_found(monkeypatch):
    """A servo lets go a little when it stops, and holds for longer than it has ramped. The planted fault looks for a tip from the
    middle of a leg's samples on, which lies in the hold."""
    levels, spans = [0.0], []
    for sign in (1, -1, 1):
        levels += [sign, 0.96 * sign, 0.96 * sign]
        spans += [abs(sign - levels[-4]) / 0.5, 0.2, 20.0]
    ends = np.cumsum([0.0, *spans, 1.8])
    time = np.arange(0.0, ends[-1], 1 / 200.0)
    torque = np.interp(time, ends, [*levels, 0.0])

    def missed():
        blocks = reduce_unit(turned(torque, time)).blocks[0]
        return np.abs(blocks.turning_nm - [0.0, 1.0, -1.0, 1.0, 0.0]).max()

    assert missed() < 0.01
    monkeypatch.setattr(torque_path, "_middle", lambda record, s: (s.start + s.stop - 1) // 2)
    assert missed() > 0.02


def test_short_rests_between_fast_rises_are_followed(monkeypatch):
    """Dead weights put on by hand: lines that rest are joined by what was read between, not where they would meet. The planted
    fault joins them wherever that is."""
    rng = np.random.default_rng(5)
    level = np.r_[np.arange(0, 8), np.arange(6, -8, -1), np.arange(-6, 8)] / 7.0
    torque = uniform_filter1d(np.repeat(level, rng.integers(6, 14, level.size)), 2, mode="nearest")
    time = 0.07 * np.arange(torque.size)

    def most(seed):
        blocks = reduce_unit(turned(torque, time, noise=1.5e-3, seed=seed)).blocks[0]
        return float(np.abs(np.interp(time, blocks.path_s, blocks.path_nm) - torque).max())

    assert max(map(most, range(4))) < 0.035
    monkeypatch.setattr(torque_path, "APART", np.inf)
    assert max(map(most, range(4))) > 0.042


def test_noise_is_told_from_uneven_samples_and_from_rounding():
    """The planted fault: samples taken to be even make noise of a ramp."""
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.2e-3, 1.8e-3, 20_000))
    read = time + 1e-4 * rng.standard_normal(time.size)
    assert white_noise(read, time) == pytest.approx(1e-4, rel=0.05)
    assert white_noise(read) > 2.5e-4
    assert 0.0 < white_noise(np.round(time, 1), time) < 0.1 / np.sqrt(12.0)


def test_more_cycles_have_fewer_blocks_a_leg():
    time, torque = ramps((0, *(1, -1) * 15), rate=0.5, hertz=500.0)
    many, few = (reduce_unit(turned(torque[:n], time[:n])).blocks[0] for n in (None, 6000))
    assert many.count.size < 1.6 * 1200 and few.count.size / few.direction.size > 2 * many.count.size / many.direction.size


def test_no_block_reaches_over_a_gap():
    time, torque = ramped()
    (blocks,) = reduce_unit(turned(torque, time, kept=(time < 21.0) | (time > 23.0))).blocks
    assert not np.any((blocks.begin_s < 22.0) & (blocks.end_s > 22.0))
    # What passes in the gap counts in the mean of neither neighbour: the path's means are those of the samples.
    history = of_blocks(blocks, 1.0)
    means = history.mean(history.z0[:, None], history.z1[:, None])[:, 0]
    for k in np.flatnonzero(np.abs(blocks.mid_s - 22.0) < 1.3):
        inside = (time >= blocks.begin_s[k]) & (time <= blocks.end_s[k])
        assert means[k] == pytest.approx(torque[inside].mean(), abs=2e-3)


def test_the_declared_amplitude_is_that_of_the_loop_where_the_torque_reached_it():
    assert _amplitude(1.01, 1.0) == 1.0 and _amplitude(0.99, 1.0) == 1.0
    assert _amplitude(1.2, 1.0) == 1.2 and _amplitude(1.01, None) == 1.01
