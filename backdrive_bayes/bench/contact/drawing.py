"""Reducers of the contact bench at random: kinds and the ranges of their parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.reducer import ContactReducer
from backdrive_bayes.bench.draws import log_uniform


@dataclass(frozen=True)
class Ranges:
    """Ranges of one kind's parameters; ``angle_arcmin`` and ``torque_nm`` are log-uniform, the others uniform."""

    angle_arcmin: tuple[float, float]
    torque_nm: tuple[float, float]
    stages: tuple[int, int]
    flanks: tuple[int, int]
    clearance: tuple[float, float]
    exponent: tuple[float, float]
    scatter: tuple[float, float]
    friction: tuple[float, float]
    ratio: tuple[float, float]


KINDS: dict[str, Ranges] = {
    "spur_train": Ranges((0.5, 60), (0.05, 1000), (3, 4), (3, 5), (0.3, 0.8), (1.1, 1.6), (0.1, 0.5), (0.02, 0.12), (20, 300)),
    "strain_wave": Ranges((0.2, 20), (0.5, 1000), (1, 2), (12, 20), (0.0, 0.06), (1.0, 1.4), (0.2, 0.9), (0.05, 0.3), (50, 160)),
    "cycloid": Ranges((0.2, 20), (1.0, 1000), (2, 2), (8, 16), (0.03, 0.4), (1.1, 1.5), (0.1, 0.7), (0.04, 0.2), (30, 200)),
    "worm": Ranges((0.5, 60), (0.05, 1000), (1, 1), (3, 6), (0.05, 0.6), (1.0, 1.5), (0.1, 0.6), (0.25, 0.8), (10, 80)),
    "plastic": Ranges((20, 360), (0.05, 20), (3, 4), (3, 6), (0.05, 0.6), (1.2, 2.0), (0.1, 0.6), (0.08, 0.35), (16, 1000)),
}


def draw_reducer(rng, kind: str | None = None, without: tuple[str, ...] = ()) -> ContactReducer:
    """A clean reducer at random; ``kind`` is one of KINDS or None.

    ``without`` names members it shall lack: load_dependent_friction, hardening_stiffness.
    """
    kind = kind or str(rng.choice(list(KINDS)))
    span = KINDS[kind]
    stages, flanks = (int(rng.integers(low, high + 1)) for low, high in (span.stages, span.flanks))
    clearance, shaft = rng.uniform(*span.clearance), rng.uniform(0.0, 0.5)
    exponent, scatter, friction = rng.uniform(*span.exponent), rng.uniform(*span.scatter), rng.uniform(*span.friction)
    if "hardening_stiffness" in without:
        exponent, scatter = 1.0, 0.0
    return ContactReducer(
        kind=kind,
        rated_torque_nm=float(f"{log_uniform(rng, *span.torque_nm):.3g}"),
        angle_rad=float(np.radians(log_uniform(rng, *span.angle_arcmin) / 60.0)),
        reduction_ratio=float(np.round(log_uniform(rng, *span.ratio))),
        clearance_share=clearance,
        elastic_share=(1.0 - clearance) * (1.0 - shaft),
        shaft_share=(1.0 - clearance) * shaft,
        gap_scatter=scatter,
        gap_ranks=tuple(_ranks(rng, flanks) for _ in range(stages)),
        exponent=exponent,
        film=log_uniform(rng, 0.002, 0.04),
        drag=log_uniform(rng, 0.004, 0.1),
        presliding=log_uniform(rng, 0.01, 0.1) * (1.0 - clearance),
        flank_friction=0.0 if "load_dependent_friction" in without else friction,
        grip=log_uniform(rng, 3.0, 15.0) * max(friction, 0.08),
        spread=rng.uniform(0.05, 0.7),
        clearance_ratio=log_uniform(rng, 0.3, 1.0),
        compliance_ratio=log_uniform(rng, 0.3, 1.0),
        drag_ratio=log_uniform(rng, 0.3, 2.0),
    )


def _ranks(rng, flanks):
    return (0.0, *(float(rank) for rank in np.sort(rng.uniform(0.05, 1.0, flanks - 1))))
