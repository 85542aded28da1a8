"""The reducer on the virtual bench: sliders, gaps and springs in series, without any effect."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from backdrive_bayes.bench.draws import log_uniform, scattered
from backdrive_bayes.bench.sliders import elements

SLIDERS = 192
GAPS = 96
STOPS = 24
KINDS = ("geometric", "elastic", "intermediate")
IN_PROPORTION = ("clearance_share", "drag", "engagement", "compliance_share", "knee", "friction", "load_friction", "spread")
IN_SHARES = ("springback_share", "release", "stiffening", "free_share")
"""Parameters a fit may turn to make an effect look smaller: by a factor of 1.02, or by 0.01 of a share."""
_HELD = {"load_dependent_friction": "load_friction", "hardening_stiffness": "stiffening"}


@dataclass(frozen=True)
class BenchReducer:
    """A reducer: torques as shares of ``rated_torque_nm`` [N·m], angles as shares of ``angle_rad`` [rad].

    ``stiffening`` is the share of the compliance that springs with a stop near ``knee`` carry; ``spread`` the log-sd of the
    sliders' friction; ``free_share`` of the torque meets no friction; ``springback_share`` of the clearance is pushed back, on
    either side, as soon as the torque has fallen to ``release`` of the drag.
    """

    rated_torque_nm: float
    angle_rad: float
    clearance_share: float
    drag: float
    engagement: float
    springback_share: float
    release: float
    compliance_share: float
    stiffening: float
    knee: float
    friction: float
    load_friction: float
    spread: float
    free_share: float
    reduction_ratio: float = 100.0

    def half_widths_nm(self, torque_nm):
        """What each slider holds back at these torques [N·m], shape (steps, elements)."""
        constant, load = slider_levels(self.spread)
        held = self.load_friction * load * np.abs(torque_nm)[:, None]
        held += self.friction * self.rated_torque_nm * constant
        return held

    def transmitted_nm(self, torque_nm, half_width_nm):
        """Torque behind the sliders [N·m], shape (steps,)."""
        held = elements.sliders(torque_nm, half_width_nm).mean(axis=1)
        return self.free_share * torque_nm + (1.0 - self.free_share) * held

    def drags_nm(self, steps: int):
        """Drag on each floating part [N·m], shape (steps, GAPS): half of the torque between its two crossings."""
        up, _ = self._crossings()
        half = np.maximum(0.5 * (up + up[::-1]), 0.0)
        return np.full((steps, 1), self.rated_torque_nm) * half

    def gap_angle_rad(self, torque_nm, drag_nm, start: float):
        """Angle [rad] from the clearance of all stages, shape (steps,); ``start`` from -1 to 1 is where parts float at first."""
        up, width = self._crossings()
        centre, rated = 0.5 * (up - up[::-1]), self.rated_torque_nm
        first = np.where(_levels(GAPS) < 0.5 * (1.0 + start), 1.0, -1.0)
        moved = elements.gaps(torque_nm, drag_nm, rated * centre, rated * width, rated * width[::-1], first)
        return 0.5 * self.clearance_share * self.angle_rad * moved.mean(axis=1)

    def _crossings(self):
        """Torques over T_r at which the parts cross upwards and over what range, (GAPS,) each; downwards is the mirror image.

        Gaps are unequal (logistic); the last parts to engage are the first that their springs push back.
        """
        level, back = _levels(GAPS), self.springback_share
        pushed = level < back
        rank = np.where(pushed, level / max(back, 1e-9), (level - back) / (1.0 - back))
        rank = np.clip(rank, 0.25 / GAPS, 1.0 - 0.25 / GAPS)
        up = np.where(pushed, -self.release * self.drag, self.drag) + 0.5 * self.engagement * np.log(rank / (1.0 - rank))
        spacing = 0.5 / (GAPS * np.where(pushed, back, 1.0 - back) * rank * (1.0 - rank))
        return up, self.engagement * np.clip(spacing, 0.02, 0.7)

    def spring_angle_rad(self, torque_nm):
        """Elastic angle [rad], shape (steps,)."""
        stop = self.knee * self.rated_torque_nm * np.arctanh(np.sqrt(_levels(STOPS)))
        felt = elements.stops(torque_nm, stop, np.full(STOPS, 1.0 / STOPS))
        load = (1.0 - self.stiffening) * torque_nm + self.stiffening * felt
        return self.compliance_share * self.angle_rad * load / self.rated_torque_nm

    def turned(self, held: tuple[str, ...] = ()) -> tuple[BenchReducer, ...]:
        """The reducer with each parameter in turn moved a little."""
        fixed = {_HELD[name] for name in held if name in _HELD}
        moved = {name: getattr(self, name) * 1.02 for name in IN_PROPORTION}
        moved |= {name: getattr(self, name) + 0.01 for name in IN_SHARES}
        return tuple(replace(self, **{name: value}) for name, value in moved.items() if name not in fixed)


def slider_levels(spread: float):
    """Constant and load-proportional friction of the sliders over their means, two arrays of shape (elements,)."""
    k = np.arange(SLIDERS)
    first, second = (k + 0.5) / SLIDERS, scattered(k)
    levels = [np.exp(spread * ndtri(u)) for u in (first, second)]
    return tuple(level / level.mean() for level in levels)


def draw_reducer(rng, kind: str | None = None, without: tuple[str, ...] = ()) -> BenchReducer:
    """A reducer at random; ``kind`` is one of KINDS or None.

    ``without`` names members it shall lack: 'load_dependent_friction', 'hardening_stiffness'.
    """
    kind = kind or str(rng.choice(KINDS))
    clearance = {"geometric": (0.9, 1.5), "elastic": (0.0, 0.1), "intermediate": (0.25, 0.8)}[kind]
    friction = {"geometric": (0.008, 0.04), "elastic": (0.01, 0.05), "intermediate": (0.01, 0.06)}[kind]
    load = {"geometric": (0.01, 0.08), "elastic": (0.06, 0.2), "intermediate": (0.02, 0.12)}[kind]
    share, drag = rng.uniform(*clearance), log_uniform(rng, 0.01, 0.05)
    bent = 0.0 if "hardening_stiffness" in without else rng.uniform(0.0, 0.75)
    knee = rng.uniform(0.3, 0.7)
    loaded = 0.0 if "load_dependent_friction" in without else rng.uniform(*load)
    return BenchReducer(
        rated_torque_nm=float(np.round(log_uniform(rng, 0.05, 5.0), 3)),
        angle_rad=float(np.radians(log_uniform(rng, 0.3, 6.0))),
        clearance_share=share,
        drag=drag,
        engagement=drag * log_uniform(rng, 0.12, 0.5),
        springback_share=rng.uniform(0.0, 0.25),
        release=rng.uniform(0.05, 0.6),
        compliance_share=float((1.0 - 0.5 * share) / (1.0 - bent * (1.0 - knee * np.tanh(1.0 / knee)))),
        stiffening=bent,
        knee=knee,
        friction=log_uniform(rng, *friction),
        load_friction=loaded,
        spread=rng.uniform(0.3, 0.9),
        free_share=rng.uniform(0.0, 0.4),
        reduction_ratio=float(rng.integers(20, 300)),
    )


def _levels(count):
    return (np.arange(count) + 0.5) / count
