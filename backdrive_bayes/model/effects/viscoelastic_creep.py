"""Viscoelastic creep: delayed compliance of polymer gears."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Normal, Parameter, Uniform
from backdrive_bayes.model.relaxation import relax

SLOWER = 6.0
"""Ratio of the two relaxation times."""
POLYMER = "weakly informative: delayed compliance of some per cent of the elastic one, seconds to minutes"


class ViscoelasticCreep:
    """Two Kelvin-Voigt elements in series, relaxing with T and 6T towards the load and at rest within a threshold of it.

    They begin ``initial_creep`` rated torques away from rest.
    """

    name = "viscoelastic_creep"
    stage = Stage.COMPLIANCE
    signature = "the angle lags the load by seconds: more of it at slower rates, relaxing after each change"
    source = "Kelvin-Voigt chain; threshold creep for the rate behaviour told in doi:10.1177/00202940261442382"
    parameters = (
        Parameter("creep_compliance", "rad/(N·m)", "compliance", LogNormal(0.04, 1.2), 0.0, POLYMER),
        # Faster creep would be lag of the sensor, slower creep compliance.
        Parameter("creep_time", "s", "none", LogUniform(0.3, 30.0), None, POLYMER),
        Parameter("creep_slow_share", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
        Parameter("initial_creep", "1", "none", Normal(0.05), None, "the unit's past is unknown", True),
        # A fast creep near full load would be slip.
        Parameter("creep_threshold", "N·m", "torque", Uniform(0.0, 0.5), None, "up to half the rated torque"),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        threshold, constant, slow = values["creep_threshold"], values["creep_time"], values["creep_slow_share"]
        start = drive.transmitted_nm[..., :1]
        start = start - np.clip(start, -threshold, threshold) + values["initial_creep"] * drive.rated_torque_nm
        fast = _creep(drive, threshold, constant, start)
        return values["creep_compliance"] * (fast + slow * (_creep(drive, threshold, SLOWER * constant, start) - fast))


def _creep(drive, threshold, constant, start):
    """State (…, samples) of an element that relaxes towards the load less a threshold and rests within it.

    Over a leg the element first follows the former direction until the load meets it, then rests, then follows the new one.
    """
    load, time, state, pieces = drive.transmitted_nm, drive.path.time_s, start, []
    for leg in drive.path.legs:
        # The last sample of the leg before is where relaxation goes on from.
        own = slice(max(leg.start - 1, 0), leg.stop)
        ahead, elapsed = leg.direction * load[..., own], time[own]
        ending = -np.maximum.accumulate(relax(-ahead - threshold, elapsed, constant, -leg.direction * state), axis=-1)
        rest = ending[..., -1:]
        moved = ending + relax(np.maximum(ahead - threshold, rest), elapsed, constant, rest) - rest
        pieces.append(leg.direction * moved[..., leg.start - own.start :])
        state = pieces[-1][..., -1:]
    return np.concatenate(pieces, axis=-1)
