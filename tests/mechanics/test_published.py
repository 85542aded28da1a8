"""Closed forms of eq. (20), reconstructed, against quadrature."""

import pytest
from scipy.integrate import quad

from backdrive_bayes.mechanics.published import PublishedLoop

LOOP = PublishedLoop(0.3, 0.05, 1.0, 30.0, 0.02, 60.0, 2.5, 1e-4)


@pytest.mark.parametrize("top", [0.03, 0.1])
def test_area_and_absorbed_work_are_the_integrals(top):
    area = quad(lambda t: LOOP.angle_rad(t, -1) - LOOP.angle_rad(t, 1), -top, top, epsabs=1e-14, limit=200)[0]
    assert LOOP.area_j(top) == pytest.approx(area, rel=1e-9)
    slope = 1e-6
    work = quad(lambda t: t * (LOOP.angle_rad(t + slope, 1) - LOOP.angle_rad(t - slope, 1)) / (2 * slope), 0, top, limit=200)[0]
    assert LOOP.absorbed_j(top) == pytest.approx(2 * work, rel=1e-5)


def test_the_closed_area_knows_no_elasticity():
    stiff = PublishedLoop(0.0, 0.0, 0.0, 0.0, 0.02, 60.0, 2.5, 1e-4)
    assert LOOP.area_j(0.1) == stiff.area_j(0.1) and LOOP.absorbed_j(0.1) > stiff.absorbed_j(0.1)


def test_large_arguments_do_not_overflow():
    steep = PublishedLoop(0.0, 0.0, 0.0, 0.0, 0.02, 1e6, 100.0)
    assert steep.area_j(0.1) == pytest.approx(2 * 0.02 / 1e6 * 2 * 100.0, rel=1e-6)
