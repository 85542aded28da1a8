"""Settled loops of posterior draws: model, discrepancy and module parts on a torque grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.inference.discrepancy import Discrepancy, amplitude_nm, settled_path
from backdrive_bayes.inference.problem import Problem

POINTS = 161
CHUNK = 500


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

    def __add__(self, other: Loops) -> Loops:
        return Loops(self.torque_nm, self.rising + other.rising, self.falling + other.falling)

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


def torque_grid(amplitude: float, exact=()) -> np.ndarray:
    """Odd-symmetric torques from -T to +T, dense around zero, that hold zero and ±``exact`` [N·m]."""
    half = np.sinh(np.linspace(0, 4, POINTS // 2 + 1))
    # Divided by its own end, not by sinh(4): numpy's scalar and vector sinh may differ in the last bit.
    half = amplitude * (half / half[-1])
    extra = [abs(t) for t in exact if 0 < abs(t) < amplitude]
    half = np.unique(np.concatenate([half, extra]))
    return np.concatenate([-half[:0:-1], half])


def model_loops(problem: Problem, z, record: int, torque, rate_nm_per_s: float | None = None) -> Loops:
    """The reducer's settled loops on ``torque`` (points,) for draws ``z`` (draws, dimension), by default at the record's rate."""
    path, reducer = settled_path(torque, rate_nm_per_s or problem.loading_rate_nm_per_s(record)), problem.model.reducer
    return _cut(torque, _in_chunks(lambda v: reducer.angle(v, path), problem, z, record))


def module_loops(problem: Problem, z, record: int, torque) -> dict[str, Loops]:
    """The loops of each module alone, by its name; they add up to :func:`model_loops`."""
    path, reducer = settled_path(torque, problem.loading_rate_nm_per_s(record)), problem.model.reducer
    pieces: dict[str, list] = {}
    for a in range(0, len(z), CHUNK):
        for name, angle in reducer.parts(problem.values(z[a : a + CHUNK], record), path).items():
            pieces.setdefault(name, []).append(np.broadcast_to(angle, (len(z[a : a + CHUNK]), path.torque_nm.size)))
    return {name: _cut(torque, np.concatenate(angle)) for name, angle in pieces.items()}


def discrepancy_loops(problem: Problem, discrepancy: Discrepancy, weights, record: int, torque) -> Loops:
    """The discrepancy on the record's own loops for coefficients ``weights`` (draws, terms)."""
    path = settled_path(torque, problem.loading_rate_nm_per_s(record))
    basis = discrepancy.basis_on(problem, record, path, model=problem.model.reducer)
    return _cut(torque, weights @ basis.T)


def record_amplitude_nm(problem: Problem, record: int) -> float:
    """Amplitude T of a record [N·m]."""
    return amplitude_nm(problem, record)


def _in_chunks(function, problem, z, record):
    return np.concatenate([function(problem.values(z[a : a + CHUNK], record)) for a in range(0, len(z), CHUNK)])


def _cut(torque, angle):
    """Loops out of angles along ``settled_path``: …, +T → −T → +T with both tips in the falling branch."""
    n = torque.size
    loop = angle[..., -(2 * n - 1) :]
    return Loops(torque, loop[..., n - 1 :], loop[..., :n][..., ::-1])
