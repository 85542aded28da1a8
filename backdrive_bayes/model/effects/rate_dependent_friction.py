"""Rate-dependent friction: the friction level changes with the logarithm of the loading rate."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Normal, Parameter

REFERENCE = 0.5
"""Loading rate in T_r per second at which the friction has the baseline's level."""


class RateDependentFriction:
    """All torque that friction holds back is multiplied by exp(c x + b x²), x = ln(rate / (0.5 T_r/s)); no relaxation.

    The logarithmic law of dry and boundary-lubricated contacts, as a power c of either sign so that friction stays positive; the
    bend b lets it level off or turn as Stribeck's curve does.
    """

    name = "rate_dependent_friction"
    stage = Stage.TRANSMISSION
    signature = "the width of the loop changes with the logarithm of the loading rate, without relaxation"
    source = "rate-and-state friction, doi:10.1029/JB088iB12p10359; Stribeck's falling branch"
    parameters = (
        Parameter("friction_rate_exponent", "1", "none", Normal(0.12), 0.0, "some per cent to some tens of per cent a decade"),
        Parameter("friction_rate_bend", "1", "none", Normal(0.06), 0.0, "a fraction of the exponent over a decade"),
    )

    def respond(self, values, drive):
        """Transmitted torque [N·m], shape (…, samples)."""
        rate = np.log(np.maximum(drive.path.rate_nm_per_s / (REFERENCE * drive.rated_torque_nm), 1e-3))
        change = values["friction_rate_exponent"] * rate + values["friction_rate_bend"] * rate**2
        return drive.torque_nm - (drive.torque_nm - drive.transmitted_nm) * np.exp(np.minimum(change, 3.0))
