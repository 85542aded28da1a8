"""The one list of everything a model may be made of; a new member is one file and one line here.

Packages elsewhere add members of their own through the entry point group ``backdrive_bayes.effects`` (README, "Effects of
your own").
"""

from __future__ import annotations

from importlib.metadata import entry_points

from backdrive_bayes.errors import BadInput
from backdrive_bayes.model.effects.asymmetric_stiffness import AsymmetricStiffness
from backdrive_bayes.model.effects.encoder_error import EncoderError
from backdrive_bayes.model.effects.hardening_stiffness import HardeningStiffness
from backdrive_bayes.model.effects.interface_slip import InterfaceSlip
from backdrive_bayes.model.effects.load_dependent_friction import LoadDependentFriction
from backdrive_bayes.model.effects.rate_dependent_friction import RateDependentFriction
from backdrive_bayes.model.effects.second_backlash import SecondBacklash
from backdrive_bayes.model.effects.sensor_lag import SensorLag
from backdrive_bayes.model.effects.stick_slip import StickSlip
from backdrive_bayes.model.effects.thermal_drift import ThermalDrift
from backdrive_bayes.model.effects.torque_offset import TorqueOffset
from backdrive_bayes.model.effects.viscoelastic_creep import ViscoelasticCreep
from backdrive_bayes.model.elastic import Elastic
from backdrive_bayes.model.friction import Friction
from backdrive_bayes.model.geometric import Geometric
from backdrive_bayes.model.member import Member

BASELINE = ("geometric", "elastic", "friction")
PART_OF = {"load_dependent_friction": "friction", "hardening_stiffness": "elastic"}
"""Effects that a module of the baseline holds already."""

# Members of the same stage act in this order.
_OWN = (
    Geometric(),
    Elastic(),
    Friction(),
    TorqueOffset(),
    LoadDependentFriction(),
    RateDependentFriction(),
    HardeningStiffness(),
    AsymmetricStiffness(),
    SecondBacklash(),
    InterfaceSlip(),
    ViscoelasticCreep(),
    StickSlip(),
    EncoderError(),
    SensorLag(),
    ThermalDrift(),
)
MEMBERS: dict[str, Member] = {m.name: m for m in _OWN}
for _point in entry_points(group="backdrive_bayes.effects"):
    _member = _point.load()()
    MEMBERS.setdefault(_member.name, _member)


def members_named(names, where: str = "model") -> tuple[Member, ...]:
    """The members of the given names in the registry's order; BadInput, saying ``where``, on an unknown or repeated name."""
    names = list(names)
    for name in names:
        if name not in MEMBERS:
            raise BadInput(where, f"names out of {', '.join(MEMBERS)}", repr(name))
    if not names or len(set(names)) < len(names):
        raise BadInput(where, "at least one member, each once", ",".join(names) or "none")
    return tuple(m for name, m in MEMBERS.items() if name in names)


def candidates_beside(baseline) -> tuple[str, ...]:
    """Names of the effects that may explain what a baseline of these names leaves, those that it holds already left out."""
    return tuple(name for name in MEMBERS if name not in baseline and PART_OF.get(name) not in baseline)
