"""Encoder error: periodic interpolation error of the angle sensor."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Parameter, Uniform


class EncoderError:
    """A sine of the angle itself and its second harmonic; the phase is a record's own, because the encoder's zero is."""

    name = "encoder_error"
    stage = Stage.ANGLE_CHANNEL
    signature = "periodic in the angle that is measured"
    source = "interpolation error of sine-cosine encoders"
    parameters = (
        Parameter("encoder_amplitude", "rad", "angle", LogNormal(0.004, 1.0), 0.0, "thousandths of the peak angle"),
        # A longer period would reproduce the angle itself.
        Parameter("encoder_period", "rad", "angle", LogUniform(0.01, 0.45), None, "several periods within the loop"),
        Parameter("encoder_harmonic", "1", "none", Uniform(0.0, 0.7), None, "sine and cosine of unequal size"),
        Parameter("encoder_harmonic_phase", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
        Parameter("encoder_phase", "1", "none", Uniform(0.0, 1.0), None, "no preference", True),
    )

    def respond(self, values, drive):
        """What the error adds to the reading [rad], shape (…, samples)."""
        turn = 2 * np.pi * (drive.angle_rad / values["encoder_period"] + values["encoder_phase"])
        second = np.sin(2 * turn + 2 * np.pi * values["encoder_harmonic_phase"])
        return values["encoder_amplitude"] * (np.sin(turn) + values["encoder_harmonic"] * second)
