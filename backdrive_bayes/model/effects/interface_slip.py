"""Interface slip: micro-slip of the output-shaft clamp near full load."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, Parameter, Uniform
from backdrive_bayes.model.play import play

CLAMP = "weakly informative: a clamp that holds well below the rated torque"


class InterfaceSlip:
    """Slip of the clamp, a ((|τ|-τ_s)/(T_r-τ_s))^p on first loading above τ_s, in two kinds.

    A clamp that forgets slips anew whenever the load grows above τ_s, and keeps the slip until it slips back the other way. One
    that springs back (a slider against a spring, kinematic hardening) slips back as soon as the load has fallen by 2 τ_s. The
    share ``slip_spring_share`` is of the second kind; it begins displaced by ``initial_slip`` times a.
    """

    name = "interface_slip"
    stage = Stage.COMPLIANCE
    signature = "only above a threshold torque, only while loading, and it stays until the load is reversed"
    source = "the suspicion of doi:10.1177/00202940261442382 on its 3 N·m unit; sliders, doi:10.1115/1.3625046"
    parameters = (
        Parameter("slip_angle", "rad", "angle", LogNormal(0.03, 1.2), 0.0, CLAMP),
        Parameter("slip_threshold", "N·m", "torque", Uniform(0.35, 0.97), None, CLAMP),
        Parameter("slip_exponent", "1", "none", Uniform(0.7, 3.0), None, "from a constant rate to a run-away"),
        Parameter("slip_spring_share", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
        Parameter("initial_slip", "1", "none", Uniform(-1.0, 1.0), None, "the unit's past is unknown", True),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        threshold, power = values["slip_threshold"], values["slip_exponent"]
        room = np.maximum(drive.rated_torque_nm - threshold, 0.01 * drive.rated_torque_nm)

        def beyond(torque):
            return (np.maximum(torque - threshold, 0.0) / room) ** power

        def sprung(torque):
            over = (torque - threshold) / room
            return np.sign(over) * np.abs(over) ** power

        slip = _forgetting(drive, beyond)
        kept = play(drive.path, sprung, values["initial_slip"], drive.shift_nm)
        return values["slip_angle"] * (slip + values["slip_spring_share"] * (kept - slip))


def _forgetting(drive, beyond):
    """Slip that grows by ``beyond`` of the torque on every leg away from zero, shape (…, samples)."""
    path, pieces = drive.path, []
    signs = np.array([leg.direction for leg in path.legs], float)
    turning = np.array([path.start_torque_nm, *(leg.end_torque_nm for leg in path.legs)]) - drive.shift_nm
    begin, end = beyond(signs * turning[..., :-1]), beyond(signs * turning[..., 1:])
    before = np.cumsum(signs * (end - begin), axis=-1) - signs * end
    along = path.direction * beyond(path.direction * drive.torque_nm)
    for k, leg in enumerate(path.legs):
        pieces.append(along[..., leg.start : leg.stop] + before[..., k : k + 1])
    return np.concatenate(pieces, axis=-1)
