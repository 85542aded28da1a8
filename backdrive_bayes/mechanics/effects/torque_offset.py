"""Zero error of the torque sensor, or a dead weight."""

from backdrive_bayes.mechanics.effect import TangentEffect


class TorqueOffset(TangentEffect):
    """The loop is shifted along the torque."""

    def present(self, context):
        """Some thousandths of the largest torque."""
        return 6e-3


TORQUE_OFFSET = TorqueOffset(
    "torque_offset", "oddness", "loop shifted along the torque", "JCGM 200:2012, 4.28 (zero error)", "N·m", False, False, "offset"
)
