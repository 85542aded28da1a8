"""The clean reducer: three nodes that rub on the housing, two meshes with clearance and a shaft to the locked input."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.ode.contact import Mesh

IN_PROPORTION = ("angle_rad", "drag", "engagement", "friction", "load_friction", "presliding", "bristle_ratio")
IN_SHARES = ("clearance_share", "mesh_share", "gap_split", "first_load_share", "bristle_share", "bristle_power")
HARDENING = ("contact_power", "flank_spread")


@dataclass(frozen=True)
class OdeReducer:
    """A reducer: torques as shares of ``rated_torque_nm`` [N·m], angles as shares of ``angle_rad`` [rad].

    ``clearance_share`` of the half range is free travel, ``gap_split`` of it in the output mesh, the rest in the mesh behind;
    ``mesh_share`` of the deflection is in the two meshes, the rest in the shaft. ``drag`` rubs at the output node, ``friction``
    at the input node, and ``load_friction`` times the torque passed on at all three, ``first_load_share`` of it at the first.
    Bristles bend over ``presliding``, the second kind (``bristle_share``) over ``bristle_ratio`` times that, with Dahl's
    exponent ``bristle_power`` (1 is LuGre's).
    """

    rated_torque_nm: float
    angle_rad: float
    reduction_ratio: float
    kind: str
    clearance_share: float
    gap_split: float
    engagement: float
    mesh_share: float
    contact_power: float
    flank_spread: float
    flanks: int
    drag: float
    friction: float
    load_friction: float
    first_load_share: float
    presliding: float
    bristle_share: float
    bristle_ratio: float
    bristle_power: float

    def meshes(self) -> tuple[Mesh, ...]:
        """Output mesh, second mesh and shaft."""
        free, elastic = self.clearance_share, 1.0 - self.clearance_share
        first, second = 0.6 * self.mesh_share * elastic, 0.4 * self.mesh_share * elastic
        law = (self.contact_power, self.flank_spread, self.flanks)
        return (
            Mesh(free * self.gap_split, self.engagement, first, *law),
            Mesh(free * (1.0 - self.gap_split), self.engagement, second, *law),
            Mesh(0.0, 0.1, elastic - first - second, 0.5 + 0.5 * self.contact_power, 0.5 * self.flank_spread, self.flanks),
        )

    def levels(self):
        """Constant friction of the nodes and its ratio to the torque passed on, two arrays of shape (nodes,)."""
        rest = 0.5 * (1.0 - self.first_load_share)
        return np.array([self.drag, 0.0, self.friction]), self.load_friction * np.array([self.first_load_share, rest, rest])

    def carried(self):
        """Torque in each mesh when T_r loads the output and all bristles are bent, shape (nodes,)."""
        constant, ratio = self.levels()
        first = (1.0 - constant[0]) / (1.0 + ratio[0])
        second = (first - constant[1]) / (1.0 + ratio[1])
        return np.array([first, second, (second - constant[2]) / (1.0 + ratio[2])])

    def turned(self, held: tuple[str, ...] = ()) -> tuple[OdeReducer, ...]:
        """The reducer with each parameter in turn moved by a small step, except those of the ``held`` members."""
        names = [n for n in IN_PROPORTION if not (n == "load_friction" and "load_dependent_friction" in held)]
        moved = [replace(self, **{n: 1.02 * getattr(self, n)}) for n in names if getattr(self, n) > 0.0]
        shares = (*IN_SHARES, *(() if "hardening_stiffness" in held else HARDENING))
        return (*moved, *(replace(self, **{n: getattr(self, n) + self._step(n)}) for n in shares))

    def _step(self, name):
        return -0.02 if name != "contact_power" and getattr(self, name) > 0.5 else 0.02
