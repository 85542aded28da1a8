"""Records and units refuse what they cannot be, wherever they are made."""

import numpy as np
import pytest

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.record import Record, Unit

RISING = [0.0, 0.1, 0.2]


def test_lists_become_arrays_of_floats_with_the_digest_of_arrays():
    made = Record("r", [0, 1, 2], [0, 1, 0], (0.0, 0.5, 0.1))
    assert made.torque_nm.dtype == float and made.angle_rad.shape == (3,)
    assert made.sha256 == Record("r", np.arange(3.0), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.5, 0.1])).sha256


@pytest.mark.parametrize(
    ("channels", "said"),
    [
        ((RISING, [0.0, 1.0], RISING), "torque_nm: expected 3 samples, found 2"),
        ((RISING, RISING, [0.0, np.nan, 1.0]), r"angle_rad\[1\]: expected a finite number, found nan"),
        (([0.0, 0.2, 0.1], RISING, RISING), r"time_s\[2\]: expected more than 0.2 s, found 0.1 s"),
        (([0.0, 0.1, 0.1], RISING, RISING), r"time_s\[2\]: expected more than 0.1 s"),
        ((np.zeros((3, 1)), RISING, RISING), r"expected an array of shape \(samples,\)"),
        ((RISING, ["a", "b", "c"], RISING), "torque_nm: expected numbers"),
    ],
)
def test_channels_that_are_none_are_refused(channels, said):
    with pytest.raises(BadInput, match=said):
        Record("r", *channels)


@pytest.mark.parametrize("rated", [0.0, -1.0, np.nan, np.inf, None, "3", True])
def test_a_rated_torque_is_a_number_above_zero(rated):
    record = Record("r", RISING, RISING, RISING)
    assert Unit("u", np.float64(2.0), (record,)).rated_torque_nm == 2.0
    with pytest.raises(BadInput, match="rated_torque_nm: expected a finite number above zero"):
        Unit("u", rated, (record,))


def test_a_unit_has_a_record():
    with pytest.raises(BadInput, match="one record or more"):
        Unit("u", 1.0, ())
