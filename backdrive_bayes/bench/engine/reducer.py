"""A reducer of the engine bench: a chain of gear bodies with bearings, flanks and shafts, and how one is drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.engine.train import Link, Train

BODIES = 7
KINDS = ("planetary", "cycloidal", "strain_wave", "plastic")
IN_PROPORTION = ("angle_rad", "clearance", "crossing", "drag", "friction", "load_friction", "stiffening", "flank_share")
_STEP = 0.02


@dataclass(frozen=True)
class EngineReducer:
    """A reducer: torques as shares of ``rated_torque_nm`` [N·m], angles as shares of ``angle_rad`` [rad].

    ``clearance`` is half the free angle of all ``gaps`` (numbers of the links that have one), crossed against a soft spring that
    takes ``crossing``; ``drag`` the bearing friction before the first gap, ``friction`` behind it, ``load_friction`` what grows
    with the transmitted torque, ``stiffening`` the secant stiffness at T_r over that at zero, ``flank_share`` the part of the
    compliance that lies in the links with a gap. ``weights`` (3, bodies) share out friction, load friction and compliance,
    ``gap_weights`` the clearance.
    """

    kind: str
    rated_torque_nm: float
    angle_rad: float
    clearance: float
    crossing: float
    drag: float
    friction: float
    load_friction: float
    stiffening: float
    flank_share: float
    gaps: tuple[int, ...]
    weights: tuple[tuple[float, ...], ...]
    gap_weights: tuple[float, ...]
    reduction_ratio: float = 100.0

    def train(self) -> Train:
        """What the engine receives: bearings and links in normalised units."""
        friction, load, compliance = (np.array(w) for w in self.weights)
        first = self.gaps[0] if self.gaps else BODIES // 2
        before = np.arange(BODIES) <= first
        bearing = self.drag * _shares(friction * before) + self.friction * _shares(friction * ~before)
        flank = np.isin(np.arange(BODIES), self.gaps)
        parts = (self.flank_share * _shares(compliance * flank), (1.0 - self.flank_share) * _shares(compliance * ~flank))
        soft = (1.0 - self.clearance) * (sum(parts) if self.gaps else _shares(compliance))
        width = dict(zip(self.gaps, self.clearance * _shares(np.array(self.gap_weights)), strict=True))
        links = tuple(Link(float(c), self.stiffening, float(width.get(i, 0.0)), self.crossing) for i, c in enumerate(soft))
        return Train(tuple(bearing.tolist()), tuple((self.load_friction * _shares(load)).tolist()), links)

    def turned(self, held: tuple[str, ...] = ()):
        """The reducer with each parameter in turn moved by about 2 %; see the protocol."""
        fixed = {"load_friction"} if "load_dependent_friction" in held else set()
        fixed |= {"stiffening"} if "hardening_stiffness" in held else set()
        fixed |= set() if self.gaps else {"clearance", "crossing", "flank_share"}
        names = [name for name in IN_PROPORTION if name not in fixed]
        return tuple(replace(self, **{n: _moved(getattr(self, n))}) for n in names) + self._redistributed()

    def _redistributed(self):
        """Friction and compliance moved from the first half of the chain to the second."""
        tilt = np.exp(2.0 * _STEP * np.linspace(1.0, -1.0, BODIES))
        tilted = [tuple((np.array(w) * tilt).tolist()) for w in self.weights]
        rows = ((tilted[0], *self.weights[1:]), (*self.weights[:2], tilted[2]))
        return tuple(replace(self, weights=w) for w in rows)


def draw_reducer(rng: np.random.Generator, kind: str | None = None, without: tuple[str, ...] = ()) -> EngineReducer:
    """A clean reducer at random; ``kind`` is one of KINDS or None, ``without`` names members it lacks."""
    kind = kind or str(rng.choice(KINDS))
    torque, arcmin, clearance, drag, friction, load, stiffening = _RANGES[kind]
    gaps = _draw_gaps(rng, kind)
    hardening = rng.uniform(*stiffening)
    loaded = log_uniform(rng, *load)
    return EngineReducer(
        kind=kind,
        rated_torque_nm=float(f"{log_uniform(rng, *torque):.3g}"),
        angle_rad=float(np.radians(log_uniform(rng, *arcmin) / 60.0)),
        clearance=float(rng.uniform(*clearance)) if gaps else 0.0,
        crossing=log_uniform(rng, 0.004, 0.04),
        drag=log_uniform(rng, *drag),
        friction=log_uniform(rng, *friction),
        load_friction=0.0 if "load_dependent_friction" in without else loaded,
        stiffening=1.0 if "hardening_stiffness" in without else float(hardening),
        flank_share=float(rng.uniform(0.3, 0.8)),
        gaps=gaps,
        weights=_draw_weights(rng),
        gap_weights=tuple(rng.uniform(0.5, 1.5, len(gaps)).tolist()),
        reduction_ratio=float(rng.integers(8, 300)),
    )


# Rated torque [N·m], half the angle range [arcmin], clearance, drag, friction, load friction, stiffening.
_RANGES = {
    "planetary": ((0.05, 200.0), (1.0, 60.0), (0.2, 0.8), (0.004, 0.08), (0.005, 0.12), (0.005, 0.2), (1.0, 2.2)),
    "cycloidal": ((5.0, 1000.0), (0.2, 6.0), (0.02, 0.3), (0.003, 0.05), (0.004, 0.1), (0.01, 0.25), (1.2, 2.4)),
    "strain_wave": ((1.0, 1000.0), (0.4, 15.0), (0.0, 0.05), (0.01, 0.1), (0.01, 0.2), (0.02, 0.3), (1.3, 2.6)),
    "plastic": ((0.05, 5.0), (15.0, 360.0), (0.02, 0.8), (0.01, 0.15), (0.02, 0.25), (0.03, 0.35), (1.0, 2.0)),
}


def _draw_gaps(rng, kind):
    """Which links have clearance: meshes, never the output shaft; a strain wave gear has one or none."""
    if kind == "strain_wave":
        return () if rng.uniform() < 0.6 else (3,)
    count = int(rng.integers(1, 4))
    return tuple(sorted(int(i) for i in rng.choice(np.arange(1, BODIES), count, replace=False)))


def _draw_weights(rng):
    """Uneven shares of the bodies; the output flange has no bearing friction, so that a reversal begins elastically."""
    rows = np.exp(rng.uniform(0.2, 0.7) * rng.standard_normal((3, BODIES)))
    rows[:2, 0] = 0.0
    return tuple(tuple(row.tolist()) for row in rows)


def _shares(weights):
    total = weights.sum()
    return weights / total if total > 0 else weights


def _moved(value):
    """Moved by 2 %, or by a hundredth of the whole where there is nothing to take 2 % of."""
    return value * (1.0 + _STEP) if value > 0.0 else 0.01
