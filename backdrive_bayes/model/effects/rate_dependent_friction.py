"""Rate-dependent friction: the friction level changes with the loading rate."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Normal, Parameter, Uniform

REFERENCE = 0.5
"""Loading rate in T_r per second at which the friction has the baseline's level."""
LARGEST = 8.0
"""Factor beyond which the level does not change further."""


class RateDependentFriction:
    """Friction holds at torques multiplied by exp(c x + b x²), x = ln(rate / (0.5 T_r/s)); no relaxation.

    The logarithmic law of dry and boundary-lubricated contacts, as a power c of either sign so that friction stays positive; the
    bend b lets it level off or turn as Stribeck's curve does. The clearance's drag takes part by a power ``drag_follows`` of the
    factor. The rate is the record's, its median over the samples; the friction's grid bounds what is held.
    """

    name = "rate_dependent_friction"
    stage = Stage.FRICTION_LEVEL
    signature = "the width of the loop changes with the logarithm of the loading rate, without relaxation"
    source = "rate-and-state friction, doi:10.1029/JB088iB12p10359; Stribeck's falling branch"
    parameters = (
        Parameter("friction_rate_exponent", "1", "none", Normal(0.2), 0.0, "some per cent to some tens of per cent a decade"),
        Parameter("friction_rate_bend", "1", "none", Normal(0.1), 0.0, "a fraction of the exponent over a decade"),
        Parameter("drag_follows", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
    )

    def respond(self, values, drive):
        """Factors of friction and of the clearance's drag, shape (…, 1) each."""
        rate = float(np.median(drive.path.rate_nm_per_s)) / (REFERENCE * drive.rated_torque_nm)
        x = np.log(max(rate, 1e-3))
        change = values["friction_rate_exponent"] * x + values["friction_rate_bend"] * x**2
        power = np.clip(change, -np.log(LARGEST), np.log(LARGEST))
        return np.exp(power), np.exp(values["drag_follows"] * power)
