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
        # A sensor's zero may be set anew for every record.
        Parameter("torque_offset", "N·m", "torque", Normal(0.03), 0.0, "weakly informative: some per cent of full scale", True),
    )

    def respond(self, values, drive):
        """Error of the reading [N·m], shape (…, 1)."""
        return values["torque_offset"]
