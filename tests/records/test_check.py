import json

import numpy as np
import pytest
from conftest import answer, ramps

from backdrive_bayes.records.check import check_unit
from backdrive_bayes.records.faults import SPOILING_SHARE, find_wild, longest_frozen, without_wild
from backdrive_bayes.records.record import Record, Unit

ARCMIN = np.pi / 10800


def judged(time, torque, angle=None, *, noise=0.1, rated=1.0, seed=5, **declared):
    angle = answer(torque) if angle is None else angle
    angle = angle + noise * ARCMIN * np.random.default_rng(seed).normal(size=len(angle))
    result = check_unit(Unit("u", rated, (Record("r.csv", time, torque, angle, **declared),)))
    json.dumps(result, allow_nan=False)
    return result, result["records"][0]


def texts(result, level):
    return " | ".join(message["text"] for message in result["messages"] if message["level"] == level)


def test_clean_record_is_described(tmp_path):
    time, torque = ramps(noise=0.002, rate=0.5)
    result, record = judged(time, torque, loading_rate_nm_per_s=0.5, amplitude_nm=1.0)
    assert result["schema"] == "backdrive-bayes/check/1"
    assert result["may_infer"] and not texts(result, "warning") and not texts(result, "error")
    assert record["samples"] == len(time) and record["duration_s"] == pytest.approx(10.0, abs=0.01)
    assert record["sampling"]["rate_hz"] == pytest.approx(200.0, rel=1e-6) and record["sampling"]["regular"]
    assert record["cycles"] == 1 and len(record["branches"]) == 5
    assert record["amplitude_Nm"]["estimated"] == pytest.approx(1.0, abs=0.01)
    assert record["loading_rate_Nm_per_s"]["estimated"] == pytest.approx(0.5, rel=0.01)
    assert record["noise"]["torque_Nm"] == pytest.approx(0.002, rel=0.3)
    assert abs(record["closure"]["difference_rad"]) < 4 * record["closure"]["sd_rad"] + 0.05 * ARCMIN


def test_few_samples_where_lost_motion_is_taken_are_said():
    """Six between ±k·T_r tell it, four do not."""
    for samples, told in ((6, False), (4, True)):
        time, torque = ramps(noise=0.0, rate=1.0)
        every = int(round(0.06 / samples * 200))
        result, _ = judged(time[::every], torque[::every], answer(torque)[::every])
        assert ("lost motion is hardly told" in texts(result, "warning")) == told


def test_contradiction_with_what_is_declared():
    result, _ = judged(*ramps(noise=0.002), loading_rate_nm_per_s=0.5, amplitude_nm=2.0)
    assert "declared amplitude 2" in texts(result, "warning")
    assert "declared loading rate 0.5" in texts(result, "warning")
    assert result["may_infer"] and "warnings" in result["reason"]


def test_drifting_loop_does_not_close():
    time, torque = ramps((0, 1, -1, 1, -1, 1), noise=0.002)
    result, record = judged(time, torque, answer(torque) + 20 * ARCMIN * time / time[-1])
    assert "does not close" in texts(result, "warning")
    assert record["closure"]["basis"] == "settled loop"
    assert record["closure"]["difference_rad"] == pytest.approx(20 * ARCMIN * 4 / time[-1], rel=0.1)


@pytest.mark.parametrize("cycles", [49, 50, 100])
def test_many_cycles_are_not_lost_in_noise(cycles):
    """Means over whole cycles are alike."""
    time, torque = ramps((0, *(1, -1) * cycles, 0), hertz=100.0, noise=0.002)
    result, record = judged(time, torque)
    assert result["may_infer"] and not texts(result, "warning")
    assert record["angle_signal_rad"] > 0.8 * (record["angle_range_rad"])


def test_an_encoder_that_slips_once_leaves_a_loop_open():
    """The last cycle closes; the one with the slip does not."""
    time, torque = ramps((0, 1, -1, 1, -1, 1, -1, 1), noise=0.002)
    angle = answer(torque) + 20 * ARCMIN * (time > 0.45 * time[-1])
    result, record = judged(time, torque, angle)
    assert "its encoder slips" in texts(result, "warning")
    assert record["closure"]["difference_rad"] == pytest.approx(20 * ARCMIN, rel=0.02)
    assert "not close" not in texts(judged(time, torque, answer(torque))[0], "warning")



def test_what_is_declared_of_a_sine_is_its_mean_rate():
    time = np.arange(0.0, 20.0, 0.005)
    torque = np.sin(np.pi * time / 5.0) + 0.002 * np.random.default_rng(0).normal(size=time.size)
    for declared, told in ((0.4, False), (0.2 * np.pi, True)):
        result, _ = judged(time, torque, loading_rate_nm_per_s=declared)
        assert ("declared loading rate" in texts(result, "warning")) == told


def test_the_largest_cycles_are_those_of_the_amplitude():
    """Smaller ones before, to run the reducer in, are none of it."""
    time, torque = ramps((0, 0.85, -0.85, 0.85, -0.85, 1, -1, 1), noise=0.002)
    result, record = judged(time, torque, amplitude_nm=1.0)
    assert record["amplitude_Nm"]["estimated"] == pytest.approx(1.0, abs=0.01) and not texts(result, "warning")


@pytest.mark.parametrize("hertz", [4.0, 5.0, 7.3])
def test_the_tips_of_a_coarse_record_are_no_spikes(hertz):
    time, torque = ramps((0, 1, -1, 1, -1, 1), hertz=hertz, rate=0.2)
    torque = torque + 3e-4 * np.random.default_rng(0).normal(size=time.size)
    assert "isolated" not in texts(judged(time, torque)[0], "error") + texts(judged(time, torque)[0], "warning")
    torque[40] += 1.5
    assert "1 isolated torque sample" in " ".join(texts(judged(time, torque)[0], level) for level in ("error", "warning"))


def test_a_torque_that_is_noise_while_the_angle_goes_on_is_not_read():
    """A cable that came off: the channel's noise goes on, so that nothing stands still."""
    time, torque = ramps((0, 1, -1, 1, -1, 1))
    angle, noise = answer(torque), 0.002 * np.random.default_rng(0).normal(size=time.size)
    assert judged(time, torque + noise, angle)[0]["may_infer"]
    torque[time.size // 2 :] = 0.0
    result, _ = judged(time, torque + noise, angle)
    assert "it is not read, though its noise may go on" in texts(result, "error") and not result["may_infer"]


@pytest.mark.parametrize("stairs", [False, True])
def test_a_torque_that_drops_out_for_a_while_is_a_loose_cable(stairs):
    """Too long for a spike and too short to change the loop's ramps; the steps of stairs go with their ramp."""
    time, torque = ramps((0, 1, -1, 1, -1, 1), hertz=2000.0)
    torque = np.round(8 * torque) / 8 if stairs else torque
    angle, noise = answer(torque), 0.002 * np.random.default_rng(0).normal(size=time.size)
    assert "loose cable" not in texts(judged(time, torque + noise, angle)[0], "warning")
    for begin in (3000, 9500):
        torque[begin : begin + 50] = 0.0
    assert "jumps against its ramp 2 times" in texts(judged(time, torque + noise, angle)[0], "warning")


def test_plateau_is_seen():
    result, record = judged(*ramps((0, 2, -2, 2), limit=1.0, noise=0.002))
    assert len(record["plateaus"]) == 2
    assert "clipped, saturated or dwells" in texts(result, "warning")


def test_a_sine_has_no_plateau():
    time = np.arange(0.0, 25.0, 0.01)
    assert "dwells" not in texts(judged(time, np.sin(0.5 * time))[0], "warning")


def test_gap_is_an_error_when_it_skips_much_torque():
    time, torque = ramps(noise=0.002)
    for skipped, level in ((slice(300, 310), "warning"), (slice(300, 400), "error")):
        keep = np.delete(np.arange(len(time)), skipped)
        result, record = judged(time[keep], torque[keep])
        assert len(record["gaps"]) == 1
        assert "gap in time" in texts(result, level)
        assert result["may_infer"] == (level == "warning")


def test_of_many_gaps_the_widest_is_judged_and_all_are_counted():
    """The planted fault is to look at the first twenty."""
    time, torque = ramps(noise=0.002, hertz=2000)
    starts = np.arange(200, 7800, 250)
    keep = np.delete(np.arange(len(time)), np.r_[np.add.outer(starts, np.arange(12)).ravel(), 8500:9300])
    result, record = judged(time[keep], torque[keep])
    assert record["gap_count"] == len(starts) + 1 and len(record["gaps"]) == 20
    assert f"{len(starts) + 1} gaps in time; the worst, 0.4" in texts(result, "error")
    assert np.all(np.diff([gap["at_s"] for gap in record["gaps"]]) > 0)


def test_drop_outs_are_counted():
    time, torque = ramps(noise=0.002)
    torque[[150, 333, 700]] = 0.0
    result, record = judged(time, torque)
    assert record["drop_outs"]["torque"] == 3
    assert "3 isolated torque samples" in texts(result, "warning")


@pytest.mark.parametrize("at", [0, 1, -2, -1])
def test_a_zero_in_the_first_or_last_row_is_a_wild_sample(at):
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.3
    for steep in (angle, torque, torque[:190], torque[:190] ** 3, np.sqrt(np.arange(60.0))):
        assert not find_wild(steep).any(), "a record may begin or end on a ramp"
    angle[at] = 0.0
    assert np.flatnonzero(find_wild(angle)).tolist() == [at % len(angle)]
    (left,) = without_wild(Unit("u", 1.0, (Record("r.csv", time, torque, angle),))).records
    assert left.angle_rad.min() > 0.2


def test_one_wild_sample_changes_neither_signs_nor_jumps_nor_the_measured_loop():
    time, torque = ramps(noise=0.002)
    clean = judged(time, torque)[1]
    for size in (5e3, 1e6):
        spiky = answer(torque)
        spiky[700] += size * ARCMIN
        result, record = judged(time, torque, spiky)
        assert result["may_infer"] and "1 isolated angle sample" in texts(result, "warning")
        for name in ("loop_area_J", "zero_torque_width_rad"):
            assert record["measured_loop"][name] == pytest.approx(clean["measured_loop"][name], rel=1e-3)


def test_frozen_channel_speaks_against_inference():
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.1 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    angle[250:450] = angle[250]
    result, _ = judged(time, torque, angle, noise=0.0)
    assert "angle stands still for 200 samples from sample 251" in texts(result, "error")
    assert not result["may_infer"] and "stands still" in result["reason"]


@pytest.mark.parametrize("channel", ["torque_nm", "angle_rad"])
def test_a_channel_held_over_a_tip_for_a_fifth_of_the_record_is_an_error(channel):
    """It passed for an encoder at rest: there and back the other channel comes to the same value."""
    time, torque = ramps(noise=0.002)
    noisy = answer(torque) + 0.3 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    channels = {"torque_nm": torque, "angle_rad": noisy}
    assert judged(time, torque, noisy, noise=0.0)[0]["may_infer"]
    tip = int(np.argmax(torque))
    about = slice(tip - len(time) // 10, tip + len(time) // 10)
    channels[channel] = channels[channel].copy()
    channels[channel][about] = channels[channel][about.start]
    result, _ = judged(time, channels["torque_nm"], channels["angle_rad"], noise=0.0)
    assert "stands still" in texts(result, "error") and not result["may_infer"]


def test_a_frozen_channel_that_catches_up_is_not_taken_for_a_wrapping_encoder():
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.1 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    angle[400:810] = angle[400]
    result, record = judged(time, torque, angle, noise=0.0)
    assert record["angle_jumps"]["against_motion"] == 1
    assert "stands still" in texts(result, "error") and not texts(result, "warning")


def test_a_run_that_noise_makes_impossible_is_a_warning_and_a_coarse_encoder_is_none():
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.1 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    for quantum in (0.0, 0.1, 2.0):
        coarse = np.round(angle / (quantum * ARCMIN)) * quantum * ARCMIN if quantum else angle.copy()
        assert "stands still" not in texts(judged(time, torque, coarse, noise=0.0)[0], "warning")
        if quantum < 1.0:
            coarse[450:510] = coarse[450]
            result, _ = judged(time, torque, coarse, noise=0.0)
            assert "r.csv: angle stands still for 60 samples from sample 451 while torque passes" in texts(result, "warning")
            assert result["may_infer"]


def test_a_step_as_large_as_standing_still_is_called_coarse_and_not_frozen():
    time, torque = ramps(noise=0.002)
    result, _ = judged(time, torque, np.round(answer(torque) / (100.0 * ARCMIN)) * 100.0 * ARCMIN, noise=0.0)
    said = texts(result, "error")
    assert "angle comes in 2 steps of 100′ only" in said and "stands still" not in said


def test_a_dwell_of_torque_and_angle_alike_is_no_fault_of_the_encoder():
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.1 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    torque[450:550], angle[450:550] = torque[450], angle[450]
    assert "stands still" not in texts(judged(time, torque, angle, noise=0.0)[0], "warning")


def by_position(noise=0.1, clearance=0.5):
    """A bench that turns the output steadily through a clearance, with its torque printed to 1 mN·m of 100."""
    time, turned = ramps((0, 1, -1, 1, 0), rate=0.1)
    free = np.sign(turned) * np.maximum(np.abs(turned) - clearance, 0.0) / (1.0 - clearance)
    drag = 4.0 * np.sign(np.gradient(turned))
    steps = 100.0 * free + drag + noise * np.random.default_rng(0).normal(size=len(time))
    return time, 1e-3 * np.round(steps), np.radians(turned)


@pytest.mark.parametrize("noise", [0.0, 0.1])
@pytest.mark.parametrize("clearance", [0.4, 0.5])
def test_a_coarse_torque_that_stands_still_across_a_clearance_is_sound(noise, clearance):
    time, torque, angle = by_position(noise, clearance)
    result, record = judged(time, torque, angle, noise=0.004, rated=0.1)
    assert longest_frozen(torque, angle)["other_share"] > 0.3, "the clearance is long enough to look like a frozen channel"
    assert result["may_infer"] and "stands still" not in texts(result, "warning")


@pytest.mark.parametrize("frozen", [slice(2450, 4500), slice(2600, 4200), slice(4000, 5400), slice(3900, 6600)])
def test_a_coarse_torque_that_freezes_on_a_ramp_stays_an_error(frozen):
    """Frozen on the ramp before the clearance, within it and on beyond it, or over a tip: it has missed torque."""
    time, torque, angle = by_position()
    torque[frozen] = torque[frozen.start]
    result, _ = judged(time, torque, angle, noise=0.004, rated=0.1)
    assert "torque stands still for" in texts(result, "error") and not result["may_infer"]


def test_a_fine_torque_that_stands_still_at_the_drag_is_frozen():
    time, torque, angle = by_position()
    torque += 1e-4 * np.random.default_rng(2).normal(size=len(time))
    torque[4000:5800] = torque[4000]
    assert "torque stands still" in texts(judged(time, torque, angle, noise=0.004, rated=0.1)[0], "error")


def test_angle_lost_in_noise_speaks_against_inference():
    result, _ = judged(*ramps(noise=0.002), noise=500.0)
    assert not result["may_infer"] and "not clear of its noise" in result["reason"]


def test_overload_offset_and_uneven_sampling_are_said():
    time, torque = ramps(hertz=1000, noise=0.002)
    keep = np.sort(np.random.default_rng(2).choice(len(time), 1500, replace=False))
    result, _ = judged(time[keep], torque[keep] + 0.1, rated=0.5)
    assert "above the rated" in texts(result, "warning")
    assert "off centre" in texts(result, "warning")
    assert "sampling is uneven" in texts(result, "info")


def test_angle_clipped_over_a_tip_speaks_against_inference():
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 0.1 * ARCMIN * np.random.default_rng(0).normal(size=len(torque))
    result, _ = judged(time, torque, np.minimum(angle, 0.5 * angle.max()), noise=0.0)
    assert not result["may_infer"] and "angle stands still" in result["reason"]


def test_spikes_are_left_out_with_a_note_and_nothing_else_is():
    time, torque = ramps(noise=0.002)
    clean = Record("r.csv", time, torque, answer(torque))
    torque = torque.copy()
    torque[[150, 700]] = 1e9, 3.0
    spiky = Record("r.csv", time, torque, answer(clean.torque_nm), notes=("said before",))
    first, second = without_wild(Unit("u", 1.0, (spiky, clean))).records
    assert second is clean
    np.testing.assert_array_equal(first.torque_nm, np.delete(torque, [150, 700]))
    np.testing.assert_array_equal(first.time_s, np.delete(time, [150, 700]))
    assert first.notes == ("said before", "2 isolated samples far from the neighbours left out")


def test_what_was_rid_of_spikes_has_none_left():
    """A ring of a few samples hides some of its own. The planted fault is to look once."""
    time, torque = ramps(noise=0.002)
    torque[300:305] += 0.9, 0.9, -0.9, 0.9, 0.9
    unit = Unit("u", 1.0, (Record("r.csv", time, torque, answer(ramps()[1])),))
    done = without_wild(unit)
    assert without_wild(done).records[0] is done.records[0]
    assert find_wild(torque[~find_wild(torque, SPOILING_SHARE)], SPOILING_SHARE).any()
