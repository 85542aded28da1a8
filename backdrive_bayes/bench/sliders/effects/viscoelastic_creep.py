"""Delayed compliance of polymer gears: Kelvin-Voigt elements, or creep that starts beyond a threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect

VARIANTS = ("one", "two", "stretched", "threshold")


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


def draw(rng, reducer):
    """One or two time constants of 0.5-20 s, a stretched spectrum of them, or a threshold creep."""
    variant, tau = str(rng.choice(VARIANTS)), log_uniform(rng, 0.5, 20.0)
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
