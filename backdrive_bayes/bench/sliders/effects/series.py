"""Parts in series on the output side: a second clearance, and a clamp that slips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class SecondBacklash(Effect):
    """Parts that float with ``drag`` and engage within ``engagement`` (shares of rated torque); strength is angle share."""

    drag: float
    engagement: float
    uneven: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Angle from the second clearance [rad]."""
        rated, place = run.reducer.rated_torque_nm, np.linspace(-1.0, 1.0, 9)
        drag = np.full((torque_nm.size, place.size), rated * self.drag) * (1.0 + self.uneven * place)
        width = np.full(place.size, rated * self.engagement / 3)
        moved = elements.gaps(torque_nm, drag, rated * self.engagement * place, width, width)
        return 0.5 * self.strength * run.reducer.angle_rad * moved.mean(axis=1)


def draw_second_backlash(rng, reducer):
    """A second step well apart from the first, where settled loops still cross it."""
    drag = rng.uniform(max(0.12, 3 * reducer.drag), 0.5)
    return SecondBacklash(0.0, drag, log_uniform(rng, 0.01, 0.06), rng.uniform(0.0, 0.15))


@dataclass(frozen=True)
class InterfaceSlip(Effect):
    """Contact patches let go one after another from ``threshold`` on (share of rated torque); strength is angle share.

    ``springs_back`` tells patches that the clamp's own elasticity pushes back, so that they slip again as soon as the load has
    fallen by twice their threshold, from patches that rest where they are. Source: partial slip of clamped joints, Johnson,
    Contact Mechanics, 1985, section 7.2.
    """

    threshold: float
    patches_spread: float
    law: str
    springs_back: bool

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Slip [rad]."""
        patches = self.threshold + self.patches_spread * np.linspace(-1, 1, 9)
        load = torque_nm / run.reducer.rated_torque_nm

        def advance(over):
            if self.law == "accelerating":
                return over + 4.0 * over * np.abs(over)
            return 0.15 * np.sign(over) * np.log1p(np.abs(over) / 0.15) if self.law == "saturating" else over

        if self.springs_back:
            drive = load[:, None]
            slip = elements.drag_between(advance(drive - patches), advance(drive + patches), np.zeros(patches.size)).mean(axis=1)
        else:
            slip = elements.slip_while_loading(
                load, lambda size: np.mean([advance(np.maximum(size - patch, 0.0)) for patch in patches], axis=0)
            )
        return self.strength * run.reducer.angle_rad * slip


def draw_interface_slip(rng, reducer):
    """Thresholds from half to nine tenths of the rated torque."""
    law, back = str(rng.choice(["linear", "accelerating", "saturating"])), bool(rng.integers(2))
    return InterfaceSlip(0.0, rng.uniform(0.5, 0.85), rng.uniform(0.01, 0.06), law, back)
