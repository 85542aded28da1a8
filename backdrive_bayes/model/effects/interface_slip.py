"""Interface slip: micro-slip of the output-shaft clamp near full load."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, Parameter, Uniform

CLAMP = "weakly informative: a clamp that holds well below the rated torque"


class InterfaceSlip:
    """Slip that grows by a ((|τ|-τ_s)/(T_r-τ_s))^p while the load grows above τ_s, and stays until slipped back the other way."""

    name = "interface_slip"
    stage = Stage.COMPLIANCE
    signature = "only above a threshold torque, only while loading, and it stays until the load is reversed"
    source = "the suspicion of doi:10.1177/00202940261442382 on its 3 N·m unit; micro-slip of clamped joints"
    parameters = (
        Parameter("slip_angle", "rad", "angle", LogNormal(0.03, 1.2), 0.0, CLAMP),
        Parameter("slip_threshold", "N·m", "torque", Uniform(0.35, 0.97), None, CLAMP),
        Parameter("slip_exponent", "1", "none", Uniform(0.7, 3.0), None, "from a constant rate to a run-away"),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        threshold, power = values["slip_threshold"], values["slip_exponent"]
        room = np.maximum(drive.rated_torque_nm - threshold, 0.01 * drive.rated_torque_nm)

        def excess(torque):
            return (np.maximum(torque - threshold, 0.0) / room) ** power

        path, pieces = drive.path, []
        signs = np.array([leg.direction for leg in path.legs], float)
        turning = np.array([path.start_torque_nm, *(leg.end_torque_nm for leg in path.legs)]) - drive.shift_nm
        begin, end = excess(signs * turning[..., :-1]), excess(signs * turning[..., 1:])
        before = np.cumsum(signs * (end - begin), axis=-1) - signs * end
        along = path.direction * excess(path.direction * drive.torque_nm)
        for k, leg in enumerate(path.legs):
            pieces.append(along[..., leg.start : leg.stop] + before[..., k : k + 1])
        return values["slip_angle"] * np.concatenate(pieces, axis=-1)
