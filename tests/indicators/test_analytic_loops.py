"""Every indicator on loops whose indicators are known in closed form."""

import numpy as np
import pytest

from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.draws import core_indicators
from backdrive_bayes.indicators.intervals import interval
from backdrive_bayes.indicators.loop import Loops, torque_grid
from backdrive_bayes.mechanics.published import PublishedLoop

T, SLOPE = 0.1, np.array([[0.2], [0.35]])
FINE = np.linspace(-T, T, 20001)


def parallelogram(half_width, torque=FINE):
    """Two parallel branches, ``half_width`` (draws, 1) off the elastic line, with an encoder offset."""
    return Loops(torque, 0.01 + SLOPE * torque - half_width, 0.01 + SLOPE * torque + half_width)


def ellipse(height, torque=FINE):
    bow = height * np.sqrt(np.maximum(1 - (torque / T) ** 2, 0))
    return Loops(torque, SLOPE * torque - bow, SLOPE * torque + bow)


HALF, HEIGHT = np.array([[0.001], [0.002]]), np.array([[0.003], [0.004]])
A, H, B = SLOPE[:, 0], HALF[:, 0], HEIGHT[:, 0]
KNOWN = {
    "parallelogram": (parallelogram(HALF), {
        "lost_motion_rad": 2 * A * 0.003, "zero_torque_width_rad": 2 * H, "peak_angle_rad": A * T,
        "loop_area_J": 4 * H * T, "absorbed_J": A * T**2, "dissipation_ratio": 4 * H / (A * T),
    }),
    "ellipse": (ellipse(HEIGHT), {
        "lost_motion_rad": 2 * A * 0.003, "zero_torque_width_rad": 2 * B, "peak_angle_rad": A * T,
        "loop_area_J": np.pi * B * T, "absorbed_J": A * T**2 + np.pi * B * T / 2,
        "dissipation_ratio": np.pi * B / (A * T + np.pi * B / 2),
    }),
}  # fmt: skip


@pytest.mark.parametrize("shape", KNOWN)
def test_core_indicators(shape):
    loops, expected = KNOWN[shape]
    found = core_indicators(loops, 0.003)
    assert set(found) == set(expected)
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=2e-4, err_msg=name)


@pytest.mark.parametrize("shape", KNOWN)
def test_an_encoder_offset_changes_nothing(shape):
    loops = KNOWN[shape][0]
    moved = Loops(loops.torque_nm, loops.rising + 3.0, loops.falling + 3.0)
    before, after = core_indicators(loops, 0.003), core_indicators(moved, 0.003)
    for name in before:
        np.testing.assert_allclose(after[name], before[name], rtol=1e-9, err_msg=name)


def test_noise_adds_no_energy_to_speak_of():
    rng = np.random.default_rng(0)
    clean = KNOWN["ellipse"][0]
    noisy = Loops(FINE, *(x + 6e-5 * rng.standard_normal(x.shape) for x in (clean.rising, clean.falling)))
    np.testing.assert_allclose(ind.absorbed_j(noisy), ind.absorbed_j(clean), rtol=0.02)
    rectified = np.abs(np.diff(noisy.rising, axis=1)) @ np.abs(0.5 * (FINE[1:] + FINE[:-1]))
    assert (rectified > 5 * ind.absorbed_j(clean)).all(), (
        "rectified increments would have turned noise into energy"
    )


def test_lost_motion_beyond_the_loop_is_undefined():
    loops = KNOWN["ellipse"][0]
    assert np.isnan(ind.lost_motion_rad(loops, 1.01 * T)).all()
    assert interval(ind.lost_motion_rad(loops, 1.01 * T)) is None
    assert np.isfinite(ind.lost_motion_rad(loops, T)).all()


def test_torque_energy_curve():
    torque, flat = ind.torque_energy(KNOWN["parallelogram"][0])
    assert (torque[0], torque[-1]) == (0.0, T) and flat.shape == (2, torque.size)
    np.testing.assert_allclose(flat, 2 * HALF + 0 * torque, rtol=1e-9)
    torque, bowed = ind.torque_energy(KNOWN["ellipse"][0])
    np.testing.assert_allclose(bowed, 2 * HEIGHT * np.sqrt(1 - (torque / T) ** 2), atol=2e-2 * HEIGHT.max())
    # Twice its integral over |τ| is the loop area.
    np.testing.assert_allclose(2 * np.trapezoid(bowed, torque, axis=1), np.pi * B * T, rtol=2e-3)


def test_torque_energy_averages_both_signs():
    lopsided = Loops(FINE, np.zeros((1, FINE.size)), (1 + FINE / T)[None])
    np.testing.assert_allclose(ind.torque_energy(lopsided)[1], 1.0, rtol=1e-9)


def humped(foot, rise, hump, fall, torque):
    """A valley up to ``foot``, a linear rise to ``hump``, a linear fall until ``fall``, then flat."""
    return np.interp(torque, [0, foot, hump, fall, torque[-1]], [1.0, 1.0, 1.0 + rise, 0.4, 0.4])


@pytest.mark.parametrize(
    ("foot", "hump", "fall"), [(0.01, 0.03, 0.08), (0.0, 0.05, 0.1), (0.02, 0.024, 0.03)]
)
def test_hump_torques_are_the_half_heights(foot, hump, fall):
    torque = np.linspace(0, T, 101)
    tau1, tau2 = ind.hump_torques_nm(torque, humped(foot, 2.0, hump, fall, torque)[None])
    assert tau1[0] == pytest.approx(0.5 * (foot + hump), abs=1.01e-3)
    # Half-way down from 3.0 to the lowest value beyond the hump, 0.4.
    assert tau2[0] == pytest.approx(0.5 * (hump + fall), abs=1.01e-3)
    assert tau1[0] <= hump <= tau2[0]


def test_ripples_at_low_torque_do_not_move_the_first_range():
    torque = np.linspace(0, T, 101)
    curve = humped(0.02, 2.0, 0.05, 0.09, torque)
    curve[3] += 1.2
    assert ind.hump_torques_nm(torque, curve[None])[0][0] == pytest.approx(0.035, abs=1.01e-3)


def test_a_curve_without_a_hump_has_no_first_range():
    torque = np.linspace(0, T, 101)
    tau1, tau2 = ind.hump_torques_nm(torque, np.exp(-torque / 0.02)[None])
    assert tau1[0] == 0.0 and tau2[0] == pytest.approx(0.02 * np.log(2), abs=2e-3)


@pytest.mark.parametrize("load", [0.03, T])
def test_back_drive_on_a_parallelogram(load):
    torque = torque_grid(T, (load,))
    angle, energy = ind.back_drive(parallelogram(HALF, torque), load)
    np.testing.assert_allclose(angle, A * load, rtol=1e-9)
    np.testing.assert_allclose(energy, A * load**2 / 2, rtol=1e-9)


def test_back_drive_on_an_ellipse():
    angle, energy = ind.back_drive(KNOWN["ellipse"][0], 0.06)
    np.testing.assert_allclose(angle, A * 0.06 + B * (1 - 0.8), rtol=1e-3)
    x = 0.6
    bow = 0.5 * (np.arcsin(x) - x * np.sqrt(1 - x**2))
    np.testing.assert_allclose(energy, A * 0.06**2 / 2 + B * T * bow, rtol=1e-3)


def test_back_drive_energy_of_any_load():
    angle, energy = ind.back_drive(parallelogram(HALF, torque_grid(T)), 0.093)
    np.testing.assert_allclose(angle, A * 0.093, rtol=1e-9)
    np.testing.assert_allclose(energy, A * 0.093**2 / 2, rtol=1e-3)


def test_back_drive_by_a_negative_load_runs_down_the_falling_branch():
    torque = torque_grid(T, (0.06,))
    bow = HEIGHT * np.sqrt(1 - (torque / T) ** 2)
    lopsided = Loops(torque, SLOPE * torque - 2 * bow, SLOPE * torque + bow)
    angle, energy = ind.back_drive(lopsided, -0.06)
    np.testing.assert_allclose(angle, -(A * 0.06 + B * (1 - 0.8)), rtol=1e-3)
    other = ind.back_drive(Loops(torque, SLOPE * torque - bow, SLOPE * torque + bow), 0.06)[1]
    np.testing.assert_allclose(energy, other, rtol=1e-12)
    assert (energy < ind.back_drive(lopsided, 0.06)[1]).all(), "the branches differ"


@pytest.mark.parametrize("share", [0.013, 0.4, 1.0])
def test_a_window_cuts_area_and_absorbed_energy_out_of_the_loop(share):
    t, x = share * T, share
    area = ind.loop_area_j(KNOWN["ellipse"][0].within(t))
    np.testing.assert_allclose(area, 2 * B * T * (x * np.sqrt(1 - x**2) + np.arcsin(x)), rtol=1e-3)
    window = KNOWN["parallelogram"][0].within(t)
    np.testing.assert_allclose(ind.loop_area_j(window), 4 * H * t, rtol=1e-9)
    np.testing.assert_allclose(ind.absorbed_j(window), A * t**2, rtol=1e-9)
    np.testing.assert_allclose(ind.dissipation_ratio(window), 4 * H / (A * t), rtol=1e-9)


def test_the_largest_window_is_the_loop_and_windows_are_sums_of_strips():
    coarse = ellipse(HEIGHT, torque_grid(T))
    for f in (ind.loop_area_j, ind.absorbed_j):
        np.testing.assert_allclose(f(coarse.within(T)), f(coarse), rtol=1e-12)
    torque, strips = ind.torque_energy(coarse)
    inner, outer = torque[20], torque[50]
    between = ind.loop_area_j(coarse.within(outer)) - ind.loop_area_j(coarse.within(inner))
    np.testing.assert_allclose(between, 2 * np.trapezoid(strips[:, 20:51], torque[20:51], axis=1), rtol=1e-9)


def test_indicators_of_eq_20_are_its_closed_forms():
    p = PublishedLoop(0.004, 0.21, 3.0, 40.0, 0.006, 130.0, 0.9, 5e-4)
    loops = Loops(FINE, p.angle_rad(FINE, 1)[None], p.angle_rad(FINE, -1)[None])
    assert ind.loop_area_j(loops)[0] == pytest.approx(p.area_j(T), rel=1e-6)
    assert ind.absorbed_j(loops)[0] == pytest.approx(p.absorbed_j(T), rel=1e-6)
    assert ind.dissipation_ratio(loops)[0] == pytest.approx(p.area_j(T) / p.absorbed_j(T), rel=1e-6)
    assert ind.zero_torque_width_rad(loops)[0] == pytest.approx(2 * (0.006 * np.tanh(0.9) + 5e-4), rel=1e-9)


def test_intervals_are_central():
    draws = np.random.default_rng(0).normal(3.0, 2.0, 200_000)
    found = interval(draws, 0.8)
    assert found["median"] == pytest.approx(3.0, abs=0.03)
    assert (found["lo"], found["hi"]) == (
        pytest.approx(3 - 1.2816 * 2, abs=0.03),
        pytest.approx(3 + 1.2816 * 2, abs=0.03),
    )
