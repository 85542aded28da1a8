"""Noise is taken out of a measured torque history, a commanded one keeps every turn."""

import numpy as np
import pytest

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.history import noise_free_torque, read_history

RNG = np.random.default_rng(0)


def path(turns, samples):
    """Straight legs of so many samples each."""
    legs = [np.linspace(a, b, samples, endpoint=False) for a, b in zip(turns, turns[1:], strict=False)]
    return np.concatenate([*legs, turns[-1:]])


MINOR = [0.0, 0.1, *np.ravel([(0.1 - d, 0.1) for d in RNG.uniform(0.02, 0.04, 15)]), -0.1, 0.1]


@pytest.mark.parametrize("turns", [MINOR, [0.0, *[0.1, -0.1] * 15]])
@pytest.mark.parametrize("samples", [1, 4, 10, 45])
def test_a_commanded_history_of_many_turns_keeps_them(turns, samples):
    """Made monotone between the turns of a record, the planted fault, minor loops are lost."""
    torque = path(turns, samples)
    found, noisy = noise_free_torque(np.arange(torque.size), torque)
    assert not noisy
    np.testing.assert_array_equal(found, torque)


@pytest.mark.parametrize(("turns", "noise"), [(MINOR, 1e-4), (MINOR, 2e-3), ([0.0, 0.1, -0.1, 0.1], 2e-3)])
def test_noise_goes_and_minor_loops_stay(turns, noise):
    torque = path(turns, 1000)
    time = np.arange(torque.size) * 1e-3
    found, noisy = noise_free_torque(time, torque + noise * np.random.default_rng(1).standard_normal(torque.size))
    assert noisy and np.sqrt(np.mean((found - torque) ** 2)) < 0.35 * noise


def test_a_step_is_no_coarse_clock(tmp_path):
    (tmp_path / "h.csv").write_text("time_s,torque_Nm\n0,0\n2,0\n2,0.1\n10,0.1\n14,0\n")
    with pytest.raises(BadInput, match="row 4, time: expected rising time stamps .*, found 2 s twice"):
        read_history(tmp_path / "h.csv")
    stamps = np.floor(np.arange(400) / 4) * 0.1
    np.savetxt(tmp_path / "c.csv", np.c_[stamps, np.arange(400) * 1e-4], delimiter=",", header="time_s,torque_Nm", comments="")
    time, _, notes = read_history(tmp_path / "c.csv")
    assert (np.diff(time) > 0).all() and "coarse clock" in notes[0]
