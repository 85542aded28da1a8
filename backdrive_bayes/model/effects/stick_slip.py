"""Stick-slip: static above kinetic friction, the output advances in small jumps."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Parameter, Uniform

CONTACT = "weakly informative: jumps of some thousandths of the peak angle"


class StickSlip:
    """Sawtooth along the torque: the angle stays behind by up to a jump and catches up every ``stick_torque`` of loading."""

    name = "stick_slip"
    stage = Stage.COMPLIANCE
    signature = "a sawtooth along the torque, small jumps in the direction of loading"
    source = "spring-slider with static above kinetic friction"
    parameters = (
        Parameter("slip_jump", "rad", "angle", LogNormal(0.01, 1.2), 0.0, CONTACT),
        Parameter("stick_torque", "N·m", "torque", LogUniform(0.01, 0.3), None, CONTACT),
        Parameter("stick_phase", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        path = drive.path
        turning = [path.start_torque_nm, *(leg.end_torque_nm for leg in path.legs[:-1])]
        begin = np.repeat(turning, [leg.stop - leg.start for leg in path.legs])
        way = np.abs(path.torque_nm - begin) / values["stick_torque"] + values["stick_phase"]
        return values["slip_jump"] * path.direction * (0.5 - way % 1.0)
