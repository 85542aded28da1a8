"""A second clearance and slip are told from what looks like them: elasticity, friction, waves, a clearance's own teeth."""

import numpy as np
import pytest

from backdrive_bayes.gap.properties import Branches, properties_of, steps, unevenness

Z = np.linspace(0.0, 1.0, 1001)
NOISE = 1e-3


def angle(slope):
    """Angle at Z from a slope at Z."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(Z))])


def crossed(size, torque, width=0.06):
    """Angle of a step that is crossed within some width about a torque."""
    return size / (1.0 + np.exp(-(Z - torque) / (0.2 * width * torque)))


def loop(loading=0.0, unloading=0.0, hardening=0.5, threshold=0.1, first=0.03):
    """A settled loop: a clearance at ``first``, contacts that harden, friction that lets go on unloading at 1 - 2·threshold."""
    elastic = angle(1.0 - hardening * Z)
    sliding = angle(0.3 / (1.0 + np.exp((Z - 1.0 + 2.0 * threshold) / 0.03)))
    draws = NOISE * np.random.default_rng(0).standard_normal((2, 100, 12))
    wander = [np.array([np.interp(Z, np.linspace(0, 1, 12), d) for d in side]) for side in draws]
    up = elastic + crossed(0.6, first) + 0.3 * Z + loading
    return Branches(Z, up + wander[0], elastic + sliding + unloading + wander[1])


def found(branches):
    """Both properties of a loop by name."""
    return {p.name: p for p in properties_of(branches, 1.0, 1.0)}


def test_a_loop_of_clearance_hardening_and_friction_has_neither():
    assert max(p.probability for p in found(loop()).values()) < 0.1
    assert max(p.probability for p in found(loop(threshold=0.35)).values()) < 0.1


@pytest.mark.parametrize("torque", [0.15, 0.3, 0.5])
@pytest.mark.parametrize("size", [0.02, 0.1])
def test_a_second_clearance_is_found_with_its_size_and_torque(size, torque):
    here = found(loop(loading=crossed(size, torque)))["second_backlash"]
    assert here.probability > 0.9
    assert np.mean(here.size_rad) == pytest.approx(size, rel=0.25) and here.torque_nm == pytest.approx(torque, rel=0.12)


def test_a_second_clearance_is_found_beside_steep_friction_and_slip_beside_it():
    slip = angle(0.4 * np.clip(Z - 0.75, 0.0, None) / 0.25)
    both = found(loop(loading=crossed(0.04, 0.3) + slip, hardening=0.2))
    assert both["second_backlash"].probability > 0.9 and both["interface_slip"].probability > 0.5


def test_a_step_of_both_branches_is_elastic():
    step = crossed(0.05, 0.3)
    assert found(loop(loading=step, unloading=step))["second_backlash"].probability < 0.1


def test_a_wave_of_the_reading_is_neither():
    """Both branches are as uneven: the unloading one tells how much of a step is usual in this unit."""
    up, down = (0.01 * np.sin(2 * np.pi * 7 * Z + phase) for phase in (0.0, 2.0))
    waved = loop(loading=up, unloading=down)
    # Over the narrower widths: smooth friction that lets go is a step of the widest.
    assert np.sqrt(unevenness(waved)[1]) > 4e-3 and np.sqrt(unevenness(loop())[1]) < 1e-3
    assert found(waved)["second_backlash"].probability < 0.4
    still = found(loop(loading=up - down))["second_backlash"].probability
    assert found(waved)["second_backlash"].probability < still


def test_teeth_of_the_first_clearance_that_engage_late_are_no_second_one():
    assert found(loop(loading=crossed(0.6, 0.25)))["second_backlash"].probability < 0.1


@pytest.mark.parametrize("torque", [0.15, 0.25, 0.45])
def test_the_only_clearance_is_no_second_one_however_late_it_is_crossed(torque):
    """Against much drag a reducer crosses its clearance late; with one before it, the same step is a second."""
    small = crossed(0.1, torque)
    alone = Branches(Z, loop(first=0.03).loading - crossed(0.6, 0.03) + small, loop().unloading)
    assert found(alone)["second_backlash"].probability < 0.1
    assert found(loop(loading=small))["second_backlash"].probability > 0.9


def test_slip_is_compliance_that_grows_towards_the_tip():
    there = found(loop(loading=angle(0.5 * (Z > 0.8)), hardening=0.2))["interface_slip"]
    # Some reducers soften like that without a clamp: no slip is surer than those let it be.
    assert 0.5 < there.probability < 0.6 and there.torque_nm == pytest.approx(0.8, abs=0.11)
    # What grows as much while unloading is friction letting go, what falls is hardening.
    assert found(loop(unloading=angle(0.5 * (Z > 0.8)), hardening=0.2))["interface_slip"].probability < 0.1
    assert found(loop(loading=angle(-0.2 * (Z > 0.8)), hardening=0.2))["interface_slip"].probability < 0.1


@pytest.mark.parametrize("onset", [0.6, 0.65, 0.7])
@pytest.mark.parametrize("softer", [0.3, 0.5])
def test_a_body_that_softens_on_both_branches_does_not_slip(onset, softer):
    """A planted fault: the same on the loading branch alone is slip."""
    body = {"loading": angle(softer * (Z > 0.7)), "hardening": 0.0, "threshold": 0.02}
    assert found(loop(unloading=angle(softer * (Z > onset)), **body))["interface_slip"].probability < 0.1
    assert found(loop(**body))["interface_slip"].probability > 0.5


def test_steps_are_linear_and_none_on_a_straight_branch():
    straight = np.outer([1.0, 2.0], Z)
    assert np.abs(steps(Z, straight)).max() < 1e-12
    step = np.tile(crossed(0.1, 0.3), (2, 1))
    assert steps(Z, step + straight) == pytest.approx(steps(Z, step))
