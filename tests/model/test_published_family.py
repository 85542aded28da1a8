"""Eq. (20), reconstructed: its closed forms, and when the model with memory reduces to it.

The branches of a settled loop ±T are those of eq. (20) exactly where every play operator slides: at torques
further than 2·max(drag torque, largest friction threshold) from the reversal, for a linear elastic unit
(hardening_ratio = 1), without release (release_share = 0) and with constant thresholds (friction_ratio → 0).
Then a1 = compliance, A = clearance / 2, B = 1 / engagement_torque, D = drag_torque / engagement_torque and
d0 = compliance · (1 − free_share) · friction_torque because
the weights preserve the mean threshold.
"""

import numpy as np
import pytest
from scipy.integrate import quad
from support.known import RATED, reducer, settled_loops

from backdrive_bayes.indicators.indicators import loop_area_j
from backdrive_bayes.indicators.loop import torque_grid
from backdrive_bayes.model.friction import CONSTANT_SHARES
from backdrive_bayes.model.hat_weights import hat_weights
from backdrive_bayes.mechanics.published import PublishedLoop

LOOP = PublishedLoop(0.004, 0.21, 3.0, 40.0, 0.006, 130.0, 0.9, 5e-4)
SATURATING = {
    "clearance": 0.012, "drag_torque": 0.006, "engagement_torque": 0.004, "release_share": 0.0,
    "release_torque": 0.003, "release_width_ratio": 1.0, "late_share": 0.0, "late_drag_ratio": 1.5, "late_width_ratio": 1.0,
    "initial_gap_position": 0.4, "initial_gap_spread": 0.0, "compliance": 0.15, "hardening_ratio": 1.0, "hardening_torque": 0.04,
    "friction_torque": 0.003, "friction_ratio": 1e-300, "friction_spread": 0.05, "load_spread": 0.05, "free_share": 0.25,
    "initial_friction_state": -0.5,
}  # fmt: skip


def values_with(**changes):
    return {k: np.array([[v]]) for k, v in (SATURATING | changes).items()}


def predicted(v):
    """Eq. (20) with the parameters that the model's own imply."""
    v = {k: float(x[0, 0]) for k, x in v.items()}
    s = v["engagement_torque"]
    d0 = v["compliance"] * (1 - v["free_share"]) * v["friction_torque"]
    return PublishedLoop(
        0.0, v["compliance"], 0.0, 0.0, 0.5 * v["clearance"], 1 / s, v["drag_torque"] / s, d0
    )


def reach(v):
    """How far from a reversal some operator may still hold [N·m]."""
    weights = hat_weights(CONSTANT_SHARES, v["friction_torque"] / RATED, v["friction_spread"])[0]
    largest = CONSTANT_SHARES[weights > 1e-12].max() * RATED
    return 2 * max(float(v["drag_torque"][0, 0]), largest)


def misfit(v, margin=1.0):
    """Largest distance from eq. (20) on the saturated part of both branches, relative to the peak angle."""
    grid = torque_grid(RATED)
    loops, published = settled_loops(reducer(), v, grid), predicted(v)
    slides = grid >= -RATED + margin * reach(v)
    up = loops.rising[0] - published.angle_rad(grid, 1)
    down = loops.falling[0] - published.angle_rad(grid, -1)
    return max(np.abs(up[slides]).max(), np.abs(down[slides[::-1]]).max()) / np.ptp(loops.rising)


@pytest.mark.parametrize(
    "changes", [{}, {"friction_spread": 0.2}, {"friction_torque": 0.011}, {"free_share": 0.0}]
)
def test_saturated_branches_are_eq_20(changes):
    assert misfit(values_with(**changes)) < 1e-9


@pytest.mark.parametrize(
    "changes",
    [{"release_share": 0.1}, {"hardening_ratio": 1.2}, {"friction_ratio": 0.05}],
)
def test_each_condition_is_needed(changes):
    assert misfit(values_with(**changes)) > 1e-3


def test_nearer_the_reversal_the_branches_differ_because_the_model_closes():
    assert misfit(values_with(), margin=0.0) > 1e-2


def test_load_dependent_friction_widens_the_loop_with_the_load():
    v = values_with(friction_ratio=0.03)
    grid = torque_grid(RATED)
    width = settled_loops(reducer(), v, grid).width[0]
    plain = predicted(v)
    constant = plain.angle_rad(grid, -1) - plain.angle_rad(grid, 1)
    growth = 2 * float(v["compliance"][0, 0]) * (1 - 0.25) * 0.03 * np.abs(grid)
    # Thresholds are r + m|τ|: everything slides in the middle of the loop.
    middle = np.abs(grid) < 0.4 * RATED
    np.testing.assert_allclose(width[middle], (constant + growth)[middle], rtol=0, atol=2e-4 * width.max())
    assert np.abs(width - constant)[middle].max() > 0.02 * width.max()


def test_area_is_the_closed_form_less_the_corners():
    v = values_with()
    published, corner = predicted(v).area_j(RATED), reach(v)
    area = float(loop_area_j(settled_loops(reducer(), v, torque_grid(RATED)))[0])
    grid = np.linspace(RATED - corner, RATED, 2001)
    width = predicted(v).angle_rad(grid, -1) - predicted(v).angle_rad(grid, 1)
    assert 0 < published - area < 2 * np.trapezoid(width, grid)
    assert published / area - 1 > 0.01, "eq. (20) does not close at the tips: its area must be visibly larger"


@pytest.mark.parametrize("amplitude", [0.004, 0.03, 0.1])
def test_area_against_quadrature(amplitude):
    expected = quad(
        lambda t: LOOP.angle_rad(t, -1) - LOOP.angle_rad(t, 1),
        -amplitude,
        amplitude,
        points=[0.0],
        epsabs=1e-14,
    )[0]
    assert LOOP.area_j(amplitude) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("amplitude", [0.004, 0.03, 0.1])
def test_absorbed_work_against_quadrature(amplitude):
    def slope(t, direction, h=1e-6):
        return (LOOP.angle_rad(t + h, direction) - LOOP.angle_rad(t - h, direction)) / (2 * h)

    up = quad(lambda t: t * slope(t, 1), 0, amplitude, epsabs=1e-14)[0]
    down = quad(lambda t: t * slope(t, -1), -amplitude, 0, epsabs=1e-14)[0]
    # On the way from 0 to -T torque and angle both fall: the work is positive.
    assert LOOP.absorbed_j(amplitude) == pytest.approx(up - down, rel=1e-6)


def test_stiffness_never_enters_the_area():
    other = PublishedLoop(0.0, 7.0, -2.0, 1.0, 0.006, 130.0, 0.9, 5e-4)
    assert other.area_j(0.1) == LOOP.area_j(0.1)


def test_large_arguments_do_not_overflow():
    steep = PublishedLoop(0.0, 0.1, 0.0, 0.0, 0.01, 1e6, 5e3)
    assert steep.area_j(0.1) == pytest.approx(4 * 0.01 * 5e-3, rel=1e-9)
