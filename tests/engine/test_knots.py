"""Knots are where clearances feel the torque, not where it is read."""

import numpy as np
from support.planted import MORE, planted, smooth_reducer

from backdrive_bayes.engine.knots import first_knots
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.mechanics.effect import Distortion


def test_knots_are_dense_where_the_clearance_is_behind_a_drag_at_the_shaft():
    """It is crossed at 0.05 of the torque, and read at up to 0.03 more; without the drag (planted fault) knots follow the
    reading."""
    unit = reduce_unit(planted(known=smooth_reducer(), drag_nm=3e-3, loops=MORE))
    behind, read = (first_knots(unit, Distortion(shaft_drag=drag)) for drag in (0.03, 0.0))

    def near(knots, at):
        return np.mean(np.abs(knots - at) < 0.008)

    assert near(behind, 0.05) > 1.5 * near(behind, 0.075)
    assert near(read, 0.05) < near(read, 0.075)
