"""The reducer of the contact bench: a train of stages whose flanks meet one after another."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.draws import scattered

BRISTLES = 7
IN_PROPORTION = (
    "clearance_share", "elastic_share", "shaft_share", "gap_scatter", "film", "drag", "presliding", "flank_friction", "grip",
    "spread", "clearance_ratio", "compliance_ratio", "drag_ratio",
)  # fmt: skip
_HELD = {"load_dependent_friction": ("flank_friction",), "hardening_stiffness": ("exponent", "gap_scatter")}


@dataclass(frozen=True)
class ContactReducer:
    """A reducer: torques as shares of ``rated_torque_nm`` [N·m], angles as shares of ``angle_rad`` [rad].

    At T_r all meshes together have turned by ``clearance_share`` freely and by ``elastic_share`` against their flanks, and the
    output shaft by ``shaft_share``. Stages share clearance, compliance and drag in geometric sequences of the given ratios.
    Further flanks touch up to ``gap_scatter`` of the stage's deflection later, at ``gap_ranks`` (stages, flanks) of it;
    a flank's load grows with depth to the ``exponent`` (Hertz: 1.5). ``film`` is the torque that centres a floating
    mesh at the edge of its gap, ``drag`` the bearings' friction, built up over ``presliding`` of angle; ``flank_friction`` is the
    Coulomb ratio of the flanks, ``grip`` their tangential over their normal stiffness at T_r, ``spread`` the log-sd of both.
    """

    kind: str
    rated_torque_nm: float
    angle_rad: float
    reduction_ratio: float
    clearance_share: float
    elastic_share: float
    shaft_share: float
    gap_scatter: float
    gap_ranks: tuple[tuple[float, ...], ...]
    exponent: float
    film: float
    drag: float
    presliding: float
    flank_friction: float
    grip: float
    spread: float
    clearance_ratio: float
    compliance_ratio: float
    drag_ratio: float

    @property
    def stages(self) -> int:
        """Number of stages."""
        return len(self.gap_ranks)

    def half_gaps(self):
        """Half of each stage's clearance, shape (stages,)."""
        return self.clearance_share * _sequence(self.clearance_ratio, self.stages)

    def deflections(self):
        """Elastic turn of each stage at T_r, shape (stages,)."""
        return self.elastic_share * _sequence(self.compliance_ratio, self.stages)

    def flank_levels(self):
        """Friction ratio of each flank over their mean, shape (stages, flanks)."""
        return _levels(self.spread, self.stages, len(self.gap_ranks[0]))

    def bearing_levels(self):
        """Friction of each bristle over the drag of all bearings, shape (stages, BRISTLES)."""
        levels = _levels(self.spread, self.stages, BRISTLES)
        return levels / levels.sum(axis=1, keepdims=True) * _sequence(self.drag_ratio, self.stages)[:, None]

    def chain(self) -> Chain:
        """Its contacts and bearings."""
        deflection, power = self.deflections(), np.full(self.stages, self.exponent)
        touch = self.half_gaps()[:, None] + self.gap_scatter * deflection[:, None] * np.array(self.gap_ranks)
        film = self.film / (self.half_gaps() + 0.2 * deflection)
        stiff = contact_stiffness(touch, power, film, deflection)
        bearing = self.drag * self.bearing_levels()
        yields = self.presliding * np.linspace(0.3, 1.7, BRISTLES) * _sequence(self.compliance_ratio, self.stages)[:, None]
        grip = self.grip * self.exponent / deflection[:, None] / len(self.gap_ranks[0])
        return Chain(
            open_up=touch, open_down=touch, stiff_up=stiff, stiff_down=stiff, power_up=power, power_down=power,
            mu=self.flank_friction * self.flank_levels(), tangential=np.broadcast_to(grip, touch.shape).copy(), film=film,
            bearing=bearing, bristle=bearing / yields, bearing_load=np.zeros(self.stages),
        )  # fmt: skip

    def floating_angles(self, floating: float):
        """Angles of the bodies when every mesh floats at ``floating`` (-1 to 1) in its gap, shape (stages,)."""
        return np.cumsum((floating * self.half_gaps())[::-1])[::-1].copy()

    def turned(self, held: tuple[str, ...] = ()) -> tuple[ContactReducer, ...]:
        """The reducer with each parameter in turn greater by 2 % (exponent: by 0.02); ``held`` names effects not to be turned."""
        kept = {name for effect in held for name in _HELD.get(effect, ())}
        names = [name for name in IN_PROPORTION if name not in kept and getattr(self, name) != 0.0]
        moved = [replace(self, **{name: 1.02 * getattr(self, name)}) for name in names]
        return (*moved, *(() if "exponent" in kept else (replace(self, exponent=self.exponent + 0.02),)))


def _sequence(ratio, stages):
    share = ratio ** np.arange(stages)
    return share / share.sum()


def _levels(spread, stages, count):
    # Scattered over a stage's flanks and different from stage to stage.
    k = np.arange(stages * count).reshape(stages, count)
    level = np.exp(spread * ndtri(scattered(k)))
    return level / level.mean(axis=1, keepdims=True)
