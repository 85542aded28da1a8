"""Sensor lag: the angle channel is late against the torque channel."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, Parameter, Uniform
from backdrive_bayes.model.relaxation import relax


class SensorLag:
    """The angle that is read is late by ``lag_time``: a share of it as a first-order low-pass, the rest as a pure delay."""

    name = "sensor_lag"
    stage = Stage.FAST_ANGLE_CHANNEL
    signature = "the loop grows wider with rate times slope"
    source = "filters and buses of encoders and torque amplifiers"
    parameters = (
        Parameter("lag_time", "s", "none", LogNormal(0.05, 1.0), 0.0, "filters of tens of milliseconds"),
        Parameter("lag_low_pass_share", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
    )

    def respond(self, values, drive):
        """What the lag adds to the reading [rad], shape (…, samples)."""
        time, angle = drive.path.time_s, drive.angle_rad
        low_pass = np.maximum(values["lag_time"] * values["lag_low_pass_share"], 1e-15)
        # The record begins half a sample before its first sample, at rest.
        behind = 0.5 * (angle[..., :1] - angle[..., 1:2])
        start = angle[..., :1] + behind * np.exp(-0.5 * (time[1] - time[0]) / low_pass)
        slow = relax(angle, time, low_pass, start)
        return delayed(slow, time, values["lag_time"] * (1 - values["lag_low_pass_share"])) - angle


def delayed(signal, time_s, delay_s):
    """Signal (…, samples) read ``delay_s`` (…, 1) later, straight between samples, constant half a sample before the first."""
    signal = np.asarray(signal)
    wanted = np.maximum(time_s - delay_s, 1.5 * time_s[0] - 0.5 * time_s[1])
    right = np.clip(np.searchsorted(time_s, wanted), 1, time_s.size - 1)
    share = (wanted - time_s[right - 1]) / (time_s[right] - time_s[right - 1])
    shape = np.broadcast_shapes(signal.shape, wanted.shape)
    signal, right = np.broadcast_to(signal, shape), np.broadcast_to(right, shape)
    before, after = np.take_along_axis(signal, right - 1, -1), np.take_along_axis(signal, right, -1)
    return before + share * (after - before)
