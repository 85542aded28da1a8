"""Torque offset: zero error of the torque sensor, or a dead weight on the output."""

from __future__ import annotations

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Normal, Parameter


class TorqueOffset:
    """The reducer feels the torque that is read less a constant."""

    name = "torque_offset"
    stage = Stage.TORQUE_CHANNEL
    signature = "the whole loop is shifted along the torque axis"
    source = "zero error of strain-gauge torque sensors; weight of an unbalanced lever"
    parameters = (
        Parameter("torque_offset", "N·m", "torque", Normal(0.05), 0.0, "weakly informative: some per cent of full scale"),
    )

    def respond(self, values, drive):
        """Error of the reading [N·m], shape (…, 1)."""
        return values["torque_offset"]
