"""Contact law of one mesh across its clearance: flanks that engage one after another, each a power-law spring.

Source: Hunt and Crossley, J. Appl. Mech. 42, 1975 (static part of the contact law, force proportional to penetration^p).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LIMIT = 2.5
"""Largest torque of a compliance table, as a share of the rated torque."""


@dataclass(frozen=True)
class Mesh:
    """One mesh in shares of the rated torque and of the angle scale.

    ``half_gap`` is free travel to either side, held by a weak centring spring that reaches ``engagement`` at its end;
    ``deflection`` is the travel beyond it at the rated torque; ``flanks`` engage over the share ``spread`` of it.
    """

    half_gap: float
    engagement: float
    deflection: float
    power: float
    spread: float
    flanks: int

    def gaps(self):
        """Free travel of each flank, shape (flanks,)."""
        return self.half_gap + self.spread * self.deflection * np.linspace(0.0, 1.0, self.flanks) ** 1.5

    @property
    def centring(self) -> float:
        """Stiffness of the weak spring; half of the whole where there is no gap."""
        return self.engagement / (self.half_gap + 2.0 * self.engagement * self.deflection)


def compliance_table(mesh: Mesh):
    """Torque and travel of the mesh on rising nodes, two arrays of shape (nodes,), odd; beyond them it goes on straight."""
    gaps = mesh.gaps()
    whole = mesh.half_gap + mesh.deflection
    beyond = mesh.deflection * np.concatenate([np.linspace(0.0, 0.1, 60, endpoint=False) ** 1.5, np.linspace(0.1**1.5, 4.0, 400)])
    travel = np.concatenate([np.linspace(0.0, mesh.half_gap, 30, endpoint=False), mesh.half_gap + beyond])
    travel = np.unique(travel[1:]) if mesh.half_gap > 0 else np.unique(beyond[1:])
    share = (1.0 - mesh.centring * whole) / _pressed(whole, gaps, mesh.power)
    torque = mesh.centring * travel + share * _pressed(travel, gaps, mesh.power)
    kept = torque <= LIMIT
    torque, travel = torque[kept], travel[kept]
    return np.concatenate([-torque[::-1], [0.0], torque]), np.concatenate([-travel[::-1], [0.0], travel])


def _pressed(travel, gaps, power):
    return (np.maximum(np.asarray(travel)[..., None] - gaps, 0.0) ** power).sum(axis=-1)
