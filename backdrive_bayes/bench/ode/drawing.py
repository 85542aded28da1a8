"""Clean reducers at random: five kinds with the ranges of their catalogues."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.ode.reducer import OdeReducer

ARCMIN = np.pi / 10800.0


@dataclass(frozen=True)
class Kind:
    """Ranges of one kind: angle scale [arcmin], clearance share, friction and drag over T_r, load friction, and contact."""

    angle_arcmin: tuple[float, float]
    clearance: tuple[float, float]
    drag: tuple[float, float]
    friction: tuple[float, float]
    load_friction: tuple[float, float]
    power: tuple[float, float]
    spread: tuple[float, float]
    presliding: tuple[float, float]
    ratio: tuple[int, int]


KINDS = {
    "planetary": Kind(
        (0.5, 60), (0.25, 0.8), (0.005, 0.05), (0.002, 0.03), (0.01, 0.15), (1, 1.5), (0, 0.4), (0.004, 0.05), (3, 150)
    ),
    "cycloidal": Kind(
        (0.2, 12), (0.03, 0.35), (0.005, 0.06), (0.004, 0.06), (0.02, 0.25), (1, 1.6), (0.1, 0.8), (0.01, 0.1), (11, 180)
    ),
    "strain_wave": Kind(
        (0.3, 25), (-0.03, 0.03), (0.002, 0.07), (0.001, 0.1), (0.02, 0.4), (1, 1.7), (0, 0.9), (0.03, 0.3), (30, 160)
    ),
    "plastic": Kind((5, 360), (-0.05, 0.6), (0.01, 0.09), (0.01, 0.09), (0.05, 0.4), (1, 1.4), (0, 0.6), (0.01, 0.15), (10, 300)),
    "worm": Kind((1, 30), (0.02, 0.3), (0.02, 0.15), (0.01, 0.1), (0.2, 0.6), (1, 1.4), (0, 0.4), (0.01, 0.1), (8, 80)),
}
"""Kind -> ranges."""


def draw_reducer(rng, kind: str | None = None, without: tuple[str, ...] = ()) -> OdeReducer:
    """A reducer at random; ``without`` names members it shall lack: load_dependent_friction, hardening_stiffness."""
    kind = kind or str(rng.choice(list(KINDS)))
    of = KINDS[kind]
    power, spread, load = rng.uniform(*of.power), rng.uniform(*of.spread), log_uniform(rng, *of.load_friction)
    if "hardening_stiffness" in without:
        power, spread = 1.0, 0.0
    drag = log_uniform(rng, *of.drag)
    # Half of the strain-wave gears and some of the plastic ones run without clearance.
    clearance = max(0.0, rng.uniform(*of.clearance))
    return OdeReducer(
        rated_torque_nm=float(f"{log_uniform(rng, 0.05, 1000.0):.3g}"),
        angle_rad=ARCMIN * log_uniform(rng, *of.angle_arcmin),
        reduction_ratio=float(rng.integers(*of.ratio)),
        kind=kind,
        clearance_share=clearance,
        gap_split=rng.uniform(0.5, 0.9),
        engagement=min(max(drag * log_uniform(rng, 0.12, 0.6), 0.001), 0.6 * drag),
        mesh_share=rng.uniform(0.25, 0.6),
        contact_power=power,
        flank_spread=spread,
        flanks=int(rng.integers(3, 13)),
        drag=drag,
        friction=log_uniform(rng, *of.friction),
        load_friction=0.0 if "load_dependent_friction" in without else load,
        first_load_share=rng.uniform(0.2, 0.6),
        presliding=log_uniform(rng, *of.presliding),
        bristle_share=rng.uniform(0.2, 0.7),
        bristle_ratio=log_uniform(rng, 2.0, 6.0),
        bristle_power=float(rng.choice([1.0, rng.uniform(0.6, 1.8)])),
    )
