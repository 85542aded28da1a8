"""Encoder error: periodic interpolation error of the angle sensor."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Parameter, Uniform

# A longer period would reproduce the angle itself, a shorter one lies within a block: it is looked for in finer ones.
SHORTEST, LONGEST = 0.02, 0.45
"""Periods in the angle scale, which is half the range of the angle."""
COUNTS = np.arange(2 / LONGEST, 2 / SHORTEST, 0.25)
"""Numbers of periods within the range that are looked through."""
GUESSES = 3


class EncoderError:
    """A sine of the angle itself and its second harmonic; the phase is a record's own, because the encoder's zero is."""

    name = "encoder_error"
    stage = Stage.FAST_ANGLE_CHANNEL
    signature = "periodic in the angle that is measured"
    source = "interpolation error of sine-cosine encoders"
    parameters = (
        Parameter("encoder_amplitude", "rad", "angle", LogNormal(0.004, 1.0), 0.0, "thousandths of the peak angle"),
        Parameter("encoder_period", "rad", "angle", LogUniform(SHORTEST, LONGEST), None, "several periods within the loop"),
        Parameter("encoder_harmonic", "1", "none", Uniform(0.0, 0.7), None, "sine and cosine of unequal size"),
        Parameter("encoder_harmonic_phase", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
        Parameter("encoder_phase", "1", "none", Uniform(0.0, 1.0), None, "no preference", True),
    )

    def respond(self, values, drive):
        """What the error adds to the reading [rad], shape (…, samples)."""
        turn = 2 * np.pi * (drive.angle_rad / values["encoder_period"] + values["encoder_phase"])
        second = np.sin(2 * turn + 2 * np.pi * values["encoder_harmonic_phase"])
        left = _left_of_wave(np.gradient(drive.angle_rad, axis=-1) / values["encoder_period"])
        return values["encoder_amplitude"] * (left * np.sin(turn) + left**4 * values["encoder_harmonic"] * second)

    def guesses(self, angle_rad, record, taken_out):
        """The periods whose sine and cosine, each record with amplitudes of its own, take most out of what is unexplained."""
        periods = np.ptp(angle_rad) / COUNTS
        turn = 2 * np.pi * angle_rad / periods[:, None]
        left = _left_of_wave(np.gradient(angle_rad) / periods[:, None])
        own = (np.arange(record.max() + 1)[:, None] == record)[None, :, None, :]
        columns = own * np.stack([left * np.sin(turn), left * np.cos(turn)], axis=1)[:, None]
        found, gain = taken_out(columns.reshape(periods.size, -1, angle_rad.size))
        found = found.reshape(periods.size, -1, 2)
        peaks = [i for i in np.argsort(-gain) if gain[i] == gain[max(i - 4, 0) : i + 5].max()][:GUESSES]
        return [
            {
                "encoder_period": periods[i], "encoder_amplitude": np.sqrt(np.mean(np.sum(found[i] ** 2, axis=-1))),
                "encoder_harmonic": 0.05, "encoder_phase": np.arctan2(found[i, :, 1], found[i, :, 0]) / (2 * np.pi) % 1.0,
            }
            for i in peaks
        ]  # fmt: skip


def _left_of_wave(part):
    """What is left of a wave averaged over ``part`` of a period: sinc to second order, of twice the part its fourth power."""
    return np.exp(-((np.pi * part) ** 2) / 6)
