"""Settled loops of posterior draws, whole and by module, of any amplitude and rate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.mechanics.history import History, through

POINTS = 161
RUN_IN_POINTS = 12
"""Points a leg of the cycle that settles the loop: the class needs turning points only, creep some shape in between."""


@dataclass(frozen=True, eq=False)
class Loops:
    """Settled loops: ``torque_nm`` (points,) rising from -T to +T; ``rising`` and ``falling`` angle [rad] (draws, points)."""

    torque_nm: np.ndarray
    rising: np.ndarray
    falling: np.ndarray

    @property
    def width(self) -> np.ndarray:
        """w(τ) = θ₋ − θ₊ [rad], shape (draws, points)."""
        return self.falling - self.rising

    @property
    def mirrored(self) -> Loops:
        """The same loops with torque and angle of the other sign."""
        return Loops(-self.torque_nm[::-1], -self.falling[:, ::-1], -self.rising[:, ::-1])

    def at(self, curve: np.ndarray, torque_nm: float) -> np.ndarray:
        """A curve (draws, points) over these torques at one of them, shape (draws,); linear between points."""
        index = int(np.clip(np.searchsorted(self.torque_nm, torque_nm), 1, self.torque_nm.size - 1))
        low, high = self.torque_nm[index - 1], self.torque_nm[index]
        share = (torque_nm - low) / (high - low)
        return (1 - share) * curve[:, index - 1] + share * curve[:, index]

    def within(self, torque_nm: float) -> Loops:
        """The window |τ| ≤ ``torque_nm`` cut out of these loops; its branches need not meet at its ends."""
        inside = np.abs(self.torque_nm) < torque_nm
        torque = np.concatenate([[-torque_nm], self.torque_nm[inside], [torque_nm]])
        return Loops(torque, *(self._cut_to(curve, inside, torque_nm) for curve in (self.rising, self.falling)))

    def _cut_to(self, curve, inside, torque_nm):
        return np.column_stack([self.at(curve, -torque_nm), curve[:, inside], self.at(curve, torque_nm)])

    def late(self, torque_nm: float) -> Loops:
        """The same loops read by an angle channel that is late by ``torque_nm`` of the torque."""
        earlier = [np.interp(self.torque_nm - s * torque_nm, self.torque_nm, np.arange(self.torque_nm.size)) for s in (1, -1)]
        return Loops(self.torque_nm, *(_between(c, at) for c, at in zip((self.rising, self.falling), earlier, strict=True)))


def _between(curves, at):
    """Curves (draws, points) at fractional indices ``at`` (points,)."""
    low = np.minimum(at.astype(int), curves.shape[1] - 2)
    return curves[:, low] + (at - low) * (curves[:, low + 1] - curves[:, low])


def torque_grid(amplitude: float, exact=()) -> np.ndarray:
    """Odd-symmetric torques from -T to +T, dense around zero, that hold zero and ±``exact`` [N·m]."""
    half = np.sinh(np.linspace(0, 4, POINTS // 2 + 1))
    # Divided by its own end, not by sinh(4): numpy's scalar and vector sinh may differ in the last bit.
    half = amplitude * (half / half[-1])
    extra = [abs(t) for t in exact if 0 < abs(t) < amplitude]
    half = np.unique(np.concatenate([half, extra]))
    return np.concatenate([-half[:0:-1], half])


def loop_grid(posterior: Posterior, amplitude_nm: float, exact=()) -> np.ndarray:
    """A torque grid that also holds the knots of the clearance, between which settled loops are nearly straight."""
    return torque_grid(amplitude_nm, (*posterior.reducer.knots * posterior.context.torque_scale_nm, *exact))


def settled_history(torque, rate_nm_per_s: float, torque_scale_nm: float) -> History:
    """From rest through one cycle between the ends of ``torque`` (points,), then down and up along it at that rate."""
    low, top = torque[0], torque[-1]
    run_in = np.r_[0.0, np.linspace(0, top, RUN_IN_POINTS)[1:], np.linspace(top, low, 2 * RUN_IN_POINTS)[1:]]
    whole = np.r_[run_in, np.linspace(low, top, 2 * RUN_IN_POINTS)[1:], torque[::-1][1:], torque[1:]]
    time = np.r_[0.0, np.cumsum(np.abs(np.diff(whole)))] / rate_nm_per_s
    return through(time, whole, torque_scale_nm)


def settled_loops(posterior: Posterior, torque, rate_nm_per_s: float, modules=None) -> Loops:
    """The reducer's settled loops on ``torque`` (points,), rising; of some ``modules`` alone where given."""
    angle = posterior.angles(settled_history(torque, rate_nm_per_s, posterior.context.torque_scale_nm), rate_nm_per_s, modules)
    return cut_loops(torque, angle)


def cut_loops(torque, angle) -> Loops:
    """Loops out of angles (draws, segments) along :func:`settled_history`."""
    n = torque.size
    loop = angle[..., -(2 * n - 1) :]
    return Loops(torque, loop[..., n - 1 :], loop[..., :n][..., ::-1])


def module_loops(posterior: Posterior, torque, rate_nm_per_s: float) -> dict[str, Loops]:
    """The loops of each module alone by its name; the whole loop is their sum and what effects add.

    Elements of friction turn with the torque once they slip. What they turn in the mean of both branches is single-valued, so it
    counts as elasticity here; friction is what its branches differ from that, and encloses the same area.
    """
    found = {m: settled_loops(posterior, torque, rate_nm_per_s, (m,)) for m in posterior.reducer.modules}
    if "friction" in found:
        turned, friction = found["elastic"], found["friction"]
        middle = 0.5 * (friction.rising + friction.falling)
        found["elastic"] = replace(turned, rising=turned.rising + middle, falling=turned.falling + middle)
        found["friction"] = replace(friction, rising=friction.rising - middle, falling=friction.falling - middle)
    return found
