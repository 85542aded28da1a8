"""Effects of the springs: flanks that differ, stiffness that follows the load, and delayed compliance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class AsymmetricStiffness(Effect):
    """One flank (``side``) is softer: in proportion, growing with load, or beyond a ``knee``; strength is angle share."""

    side: float
    law: str
    knee: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Extra deflection of the soft flank [rad]."""
        load = np.maximum(self.side * transmitted_nm / run.reducer.rated_torque_nm, 0.0)
        if self.law == "quadratic":
            load = load**2
        elif self.law == "late":
            load = np.maximum(load - self.knee, 0.0)
        return self.strength * self.side * run.reducer.angle_rad * load


def draw_asymmetric_stiffness(rng, reducer):
    """Either flank, three laws."""
    return AsymmetricStiffness(0.0, sign(rng), str(rng.choice(["flank", "quadratic", "late"])), rng.uniform(0.15, 0.4))


@dataclass(frozen=True)
class HardeningStiffness(Effect):
    """Deflection taken away as the load grows (segment springs, or a polynomial), or added; strength is angle share.

    ``knee`` is the share of rated torque near which teeth come into or out of contact.
    """

    law: str
    knee: float

    most = 0.9

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Change of the deflection [rad]."""
        load = transmitted_nm / run.reducer.rated_torque_nm
        size = np.abs(load)
        if self.law == "segments":
            knees = self.knee * np.linspace(0.4, 1.6, 7)
            change = -np.maximum(size[:, None] - knees, 0.0).mean(axis=1)
        elif self.law == "cubic":
            change = -(size**3) / 3.0
        else:
            change = np.maximum(size - self.knee, 0.0) ** 2
        return self.strength * run.reducer.angle_rad * np.sign(load) * change


def draw_hardening_stiffness(rng, reducer):
    """Segments, cubic hardening, or softening."""
    return HardeningStiffness(0.0, str(rng.choice(["segments", "cubic", "softening"])), rng.uniform(0.2, 0.5))


@dataclass(frozen=True)
class ViscoelasticCreep(Effect):
    """Elements with ``time_constants_s`` and ``shares`` creep under the transmitted load; strength is angle share at T_r.

    ``threshold`` (share of rated torque) is the load that creeps not at all. Source: Findley, Lai & Onaran, Creep and
    Relaxation of Nonlinear Viscoelastic Materials, 1976, section 5.
    """

    time_constants_s: tuple[float, ...]
    shares: tuple[float, ...]
    threshold: float

    most = 3.0

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Crept angle [rad]."""
        load = transmitted_nm / run.reducer.rated_torque_nm
        crept = elements.dashpots(run.time_s, load, self.time_constants_s, self.threshold)
        return self.strength * run.reducer.angle_rad * (crept @ np.array(self.shares))


def draw_viscoelastic_creep(rng, reducer):
    """One or two time constants of 0.5-20 s, a stretched spectrum of them, or a threshold creep."""
    variant, tau = str(rng.choice(["one", "two", "stretched", "threshold"])), log_uniform(rng, 0.5, 20.0)
    if variant == "two":
        share = rng.uniform(0.3, 0.7)
        return ViscoelasticCreep(0.0, (tau, float(np.clip(tau * rng.uniform(4, 10), 0.5, 20))), (share, 1 - share), 0.0)
    if variant == "stretched":
        spread = np.linspace(-1.5, 1.5, 7)
        shares = np.exp(-0.5 * spread**2)
        taus = tau * np.exp(rng.uniform(0.5, 1.0) * spread)
        return ViscoelasticCreep(0.0, tuple(taus.tolist()), tuple((shares / shares.sum()).tolist()), 0.0)
    threshold = rng.uniform(0.15, 0.5) if variant == "threshold" else 0.0
    return ViscoelasticCreep(0.0, (tau,), (1.0,), threshold)
