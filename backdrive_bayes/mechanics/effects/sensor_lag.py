"""The angle channel is late against the torque channel."""

from backdrive_bayes.mechanics.effect import SpreadEffect, TangentEffect


class SensorLag(TangentEffect):
    """The loop's width grows with rate times slope: late is one way, an angle ahead of the torque is no lag."""

    one_way = True

    def present(self, context):
        """The torque moves by some thousandths of the largest at the fastest rate."""
        return 6e-3 / context.rate.max()


SENSOR_LAG = SensorLag(
    "sensor_lag",
    "rate independence",
    "width grows with rate times slope",
    "delay and first-order lag alike, to first order in the lag",
    "s",
    False,
    False,
    "lag_s",
)


class LagSpread(SpreadEffect):
    """How much of the lag is a first-order one: 0 for a pure delay, 1 where all of it smooths."""

    known = True

    def present(self, context):
        """Root mean square of shares from none to all, each as likely."""
        return 3.0**-0.5


LAG_SPREAD = LagSpread(
    "lag_spread", "rate independence", "steps are rounded", "step response of a first-order lag", "1", False, False
)
