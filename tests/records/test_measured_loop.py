"""The cycle as measured: right on loops whose area, height and width are known, with errors that hold."""

import numpy as np
import pytest
from conftest import ramps

from backdrive_bayes.records.measured_loop import measured_loops
from backdrive_bayes.records.record import Record, Unit

NAMES = ("loop_area_j", "half_peak_to_peak_rad", "zero_torque_width_rad")


def play(torque, threshold=0.3, stiff=75.0, soft=1.0 / (0.02 - 0.7 / 75.0)):
    """Play in parallel with a spring: a parallelogram of area 4·r·(T−r)/K, height T/k + (T−r)/K, width 2·r/K."""
    position, out = 0.0, np.empty_like(torque)
    for k, level in enumerate(torque):
        position = min(max(position, level - threshold), level + threshold)
        out[k] = position
    return torque / soft + out / stiff


TRUTH = (4 * 0.3 * 0.7 / 75.0, 1.0 * (0.02 - 0.7 / 75.0) + 0.7 / 75.0, 2 * 0.3 / 75.0)


def loop(torque, angle, time):
    return measured_loops(Unit("u", 1.0, (Record("r", time, torque, angle),)))[0]


def noisy(seed, *, noise=1e-4, torque_noise=0.005, drift=0.0, knots=(0, 1, -1, 1), hertz=500):
    time, torque = ramps(knots, hertz=hertz)
    generator = np.random.default_rng(seed)
    angle = play(torque) + noise * generator.normal(size=len(time)) + drift * time / time[-1]
    return loop(torque + torque_noise * generator.normal(size=len(time)), angle, time)


def test_a_gap_over_the_steep_part_is_an_error_of_the_area():
    """Between the ends of a gap the path may take either corner."""
    time, torque = ramps((0, 1, -1, 1), hertz=500)
    angle = play(torque)
    kept = ~((torque > -0.6) & (torque < 0.2) & (time > 3.0))
    found, whole = loop(torque[kept], angle[kept], time[kept]), loop(torque, angle, time)
    assert abs(found.loop_area_j - TRUTH[0]) > 20 * whole.loop_area_j_sd
    assert abs(found.loop_area_j - TRUTH[0]) < 3 * found.loop_area_j_sd


def test_without_noise_the_truth_comes_out():
    found = noisy(0, noise=0.0, torque_noise=0.0, hertz=2000)
    assert (found.basis, found.cycles) == ("settled", 1)
    for name, true in zip(NAMES, TRUTH, strict=True):
        assert getattr(found, name) == pytest.approx(true, rel=3e-3), name
    assert found.amplitude_nm == pytest.approx(1.0, rel=1e-3)


@pytest.mark.parametrize("options", [{}, {"noise": 1e-3, "torque_noise": 0.03}, {"drift": 0.01}, {"knots": (0, 1, -1, 1, -1, 1)}])
def test_errors_cover_the_truth_and_noise_is_no_energy(options):
    found = [noisy(seed, **options) for seed in range(40)]
    for name, true in zip(NAMES, TRUTH, strict=True):
        off = np.array([(getattr(f, name) - true) / getattr(f, f"{name}_sd") for f in found])
        assert np.sqrt(np.mean(off**2)) < 1.6 and np.abs(off.mean()) < 0.8, (name, off.mean(), off.std())


@pytest.mark.parametrize("knots", [(1, -1, 1), (-1, 1, -1, 1), (1, -1, 1, -1, 1)])
def test_a_record_that_begins_at_a_tip_has_no_drift(knots):
    """Its first samples were averaged for the torque at its start, half a per cent too low, and a drift of 1e-4 rad was taken out
    for that: one and a half per cent of the width."""
    found = [noisy(seed, knots=knots, noise=1e-5, torque_noise=5e-4) for seed in range(10)]
    assert abs(np.mean([f.drift_rad for f in found])) < 3e-5
    for name, true in zip(NAMES, TRUTH, strict=True):
        assert np.mean([getattr(f, name) for f in found]) == pytest.approx(true, rel=4e-3), name


def test_a_coarse_encoder_errs_by_its_steps_however_many_samples_there_are():
    """Twelve steps over the loop, no noise: all samples at a tip are on the same side of the truth."""
    time, torque = ramps((0, 1, -1, 1), hertz=500)
    off = []
    for phase in np.linspace(0.0, 1.0, 12, endpoint=False):
        step = TRUTH[1] / 6.2
        found = loop(torque, step * np.round(play(torque) / step + phase), time)
        off.append((found.half_peak_to_peak_rad - TRUTH[1]) / found.half_peak_to_peak_rad_sd)
    assert np.abs(off).max() > 0.3 and np.sqrt(np.mean(np.square(off))) < 1.5


def test_drift_is_told_and_taken_out():
    found = noisy(1, drift=0.01)
    assert found.drift_rad == pytest.approx(0.01 * 4 / 5, rel=0.03)


def test_a_single_valued_curve_has_no_area():
    time, torque = ramps(hertz=500)
    generator = np.random.default_rng(5)
    found = loop(torque, 0.02 * torque + 1e-3 * generator.normal(size=len(time)), time)
    assert abs(found.loop_area_j) < 4 * found.loop_area_j_sd
    assert abs(found.zero_torque_width_rad) < 4 * found.zero_torque_width_rad_sd


def test_a_loop_passed_the_wrong_way_has_a_negative_area():
    time, torque = ramps((1, -1, 1), hertz=500)
    assert loop(torque[::-1].copy(), play(torque)[::-1].copy(), time).loop_area_j < 0.0


def test_a_first_cycle_is_called_so():
    time, torque = ramps((0, 1, -1, 0), hertz=500)
    found = loop(torque, play(torque), time)
    assert found.basis == "first"
    assert found.half_peak_to_peak_rad == pytest.approx(TRUTH[1], rel=3e-3)
    assert found.loop_area_j == pytest.approx(np.trapezoid(torque, play(torque)), rel=1e-3)


@pytest.mark.parametrize("knots", [(0, 1, 0.2), (0, 1, -1, -0.5)])
def test_without_a_cycle_there_is_nothing(knots):
    time, torque = ramps(knots, hertz=500)
    assert loop(torque, play(torque), time) is None


def test_twins_have_the_areas_that_are_told_of_them(shared_data):
    from backdrive_bayes.records.unit_folder import read_unit

    unit = read_unit(shared_data / "twins" / "reducer-2")
    found = {m.record: m for m in measured_loops(unit)}["rate-0.05-amp-0.1.csv.gz"]
    assert found.loop_area_j == pytest.approx(1.941e-3, abs=4 * found.loop_area_j_sd)
    assert found.half_peak_to_peak_rad == pytest.approx(350.4 * np.pi / 10800, abs=4 * found.half_peak_to_peak_rad_sd)


@pytest.mark.parametrize("cut", [0.005, 0.015])
def test_a_cycle_that_ends_short_of_its_tip_keeps_its_area(cut):
    """A record is cut somewhere: the angle that the missing torque is worth is no drift."""
    time, torque = ramps((0, 1, -1, 1 - 2 * cut), hertz=2000)
    found = loop(torque, play(torque), time)
    assert found.loop_area_j == pytest.approx(TRUTH[0], rel=0.25 * cut / 0.005)
    assert abs(found.loop_area_j - TRUTH[0]) < found.loop_area_j_sd + 0.01 * TRUTH[0]


def test_a_ramp_cut_short_by_the_records_end_is_no_cycle():
    """Of two full ramps and most of a third the first two count, not the two that do not end where they began."""
    time, torque = ramps((0, 1, -1, 1, -0.85), hertz=500)
    found = loop(torque, play(torque), time)
    assert (found.basis, found.cycles) == ("settled", 1)
    assert found.loop_area_j == pytest.approx(TRUTH[0], rel=0.01)


def test_the_width_of_a_rest_at_zero_torque_is_that_at_zero():
    """Where the torque rests the samples of the width lie at zero, however many of the ramp's they are."""
    time, torque = ramps((0, 1, -1, 1), hertz=100)
    rested = np.interp(time, *_with_rests(time, torque))
    found, swept = loop(rested, play(rested), time), loop(torque, play(torque), time)
    assert found.zero_nm < 0.1 * swept.zero_nm
    assert found.zero_torque_width_rad == pytest.approx(TRUTH[2], rel=0.01)


@pytest.mark.parametrize(
    ("even", "bent"), [((-0.03, 0.12), (-0.09, 0.03)), ((-0.03, 0.12), (-0.2, 0.03)), ((-0.113, 0.13), (0.074, 0.13))]
)
def test_a_torque_turned_by_hand_errs_by_its_bends(even, bent):
    """Where one leg's torque bends next to zero, the straight line misses the instant of zero: by more than the noise, not by
    more than three of the width's errors."""
    time, torque = ramps((0, 1, -1, 1), hertz=2000)
    turned = np.where(np.gradient(torque) < 0, np.interp(torque, [-1.0, *even, 1.0], [-1.0, *bent, 1.0]), torque)
    found, straight = (loop(t, play(t, threshold=0.05), time) for t in (turned, torque))
    off = abs(found.zero_torque_width_rad - 2 * 0.05 / 75.0)
    assert 30 * straight.zero_torque_width_rad_sd < off < 3 * found.zero_torque_width_rad_sd


def _with_rests(time, torque):
    """Times and torques of a path that rests at zero torque for a fifth of a second on every ramp but the first."""
    rests = [time[i] for i in np.flatnonzero(np.diff(np.sign(torque)))[1:]]
    away = np.all([np.abs(time - t) > 0.12 for t in rests], axis=0)
    corners = [(t + s, 0.0) for t in rests for s in (-0.1, 0.1)] + list(zip(time[away], torque[away], strict=True))
    return tuple(np.array(sorted(corners)).T)
