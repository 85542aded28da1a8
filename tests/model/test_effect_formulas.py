"""Formulas of single effects against slow, plain computations and against what their signatures promise."""

import numpy as np
import pytest

from backdrive_bayes.model.effects.interface_slip import InterfaceSlip
from backdrive_bayes.model.effects.viscoelastic_creep import SLOWER, ViscoelasticCreep
from backdrive_bayes.model.member import Drive
from backdrive_bayes.model.path import TorquePath


def column(**values):
    return {k: np.array([[v]], float) for k, v in values.items()}


def stepped_creep(time, load, constant, threshold, substeps=40):
    """A Kelvin-Voigt element with a threshold, stepped forward in small steps."""
    place, out = load[0] - np.clip(load[0], -threshold, threshold), [0.0]
    for k in range(1, load.size):
        for share in (np.arange(substeps) + 0.5) / substeps:
            over = load[k - 1] + share * (load[k] - load[k - 1]) - place
            place += (over - np.clip(over, -threshold, threshold)) * (time[k] - time[k - 1]) / substeps / constant
        out.append(place)
    return np.array(out)


@pytest.mark.parametrize("threshold", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("constant", [0.5, 5.0])
def test_creep_is_that_of_an_element_stepped_in_time(threshold, constant):
    path = TorquePath.from_turning_points([0, 1, -1, 0.5, -0.8, 1], 150, 0.3)
    drive = Drive(path, 1.0, transmitted_nm=path.torque_nm[None])
    values = column(creep_compliance=1.0, creep_time=constant, creep_slow_share=0.3, initial_creep=0.0, creep_threshold=threshold)
    parts = [stepped_creep(path.time_s, path.torque_nm, c, threshold) for c in (constant, SLOWER * constant)]
    wanted = 0.7 * parts[0] + 0.3 * parts[1]
    np.testing.assert_allclose(ViscoelasticCreep().respond(values, drive)[0], wanted, atol=2e-3 * np.ptp(wanted))


@pytest.mark.parametrize(("share", "onset"), [(0.0, -0.8), (1.0, -0.6)])
def test_slip_back_begins_at_the_threshold_or_when_the_load_has_fallen_by_twice_it(share, onset):
    path = TorquePath.from_turning_points([0, 1, -1], 2000)
    values = column(slip_angle=1.0, slip_threshold=0.8, slip_exponent=1.0, slip_spring_share=share, initial_slip=0.0)
    angle = InterfaceSlip().respond(values, Drive(path, 1.0))[0]
    falling = path.direction < 0
    assert angle.max() == pytest.approx(1.0)
    assert path.torque_nm[falling][angle[falling] < 1 - 1e-6].max() == pytest.approx(onset, abs=2e-3)
