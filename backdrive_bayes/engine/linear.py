"""The linear model of a unit about one mode of the few nonlinear parameters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.marginal import Solution, Whitened, whiten
from backdrive_bayes.engine.reduced import Jitter, Reduced
from backdrive_bayes.mechanics.effect import Distortion, Effect
from backdrive_bayes.mechanics.reducer import ReducerClass


@dataclass(frozen=True, eq=False)
class Linear:
    """The linear model of a unit about its mode.

    ``design`` holds the class and every effect, ``angles`` what its weights explain (tangent effects counted from an undistorted
    bench), ``covariances`` the noise; ``log_scale`` and ``solution`` are those of the joint model, ``predicted`` its
    block means of the angle, in which ``waving`` is the part of an encoder's wave.
    """

    reduced: Reduced
    reducer: ReducerClass
    distortion: Distortion
    design: Design
    effects: tuple[Effect, ...]
    angles: tuple[np.ndarray, ...]
    covariances: tuple[np.ndarray, ...]
    data: Whitened
    log_scale: dict[str, float]
    solution: Solution
    jitter: Jitter
    predicted: tuple[np.ndarray, ...]
    waving: tuple[np.ndarray, ...]

    @property
    def turned(self) -> list[np.ndarray]:
        """Block means of the angle that the reducer turns, which an encoder reads with its wave, from the encoder's zero."""
        found, each = [], zip(self.reduced.angles, self.predicted, self.waving, self.reduced.settled, strict=True)
        for read, predicted, waving, settled in each:
            found.append(predicted - waving + np.mean((read - predicted)[settled]))
        return found

    @property
    def log_marginal(self) -> float:
        """Log marginal likelihood of the joint model, comparable between modes, jitters and designs of one unit."""
        return self.solution.log_marginal + self.data.log_volume

    @property
    def weights(self) -> dict[str, np.ndarray]:
        """Mean weights by group."""
        return self.design.split(self.solution.mean)

    def whitened(self, design: Design) -> Whitened:
        """The columns of another design and the angles, whitened as the unit's own."""
        return whiten(design.records(), self.angles, self.covariances, self.data.noise_dof, self.reduced.settled)

    def residuals(self) -> list[np.ndarray]:
        """Whitened residual of each record's blocks."""
        white = self.data.y - self.data.x @ self.solution.mean
        return np.split(white, np.cumsum([a.size for a in self.angles])[:-1])

    def without(self, name: str) -> Linear:
        """The linear model less one group, its solution as it was beside that group."""
        if name not in self.design.names:
            return self
        keep = self.design.index != self.design.names.index(name)
        design = Design(tuple(g for g in self.design.groups if g.name != name))
        solution = replace(self.solution, mean=self.solution.mean[keep], root=self.solution.root[keep])
        scales = {n: v for n, v in self.log_scale.items() if n != name}
        return replace(self, design=design, data=self.whitened(design), log_scale=scales, solution=solution)

    def beside(self, group: Group, scale: float) -> Linear:
        """The linear model with one more group of columns, whose weights have a standard deviation of about ``scale``."""
        design = self.design.joined(group)
        scales = self.log_scale | {group.name: float(np.log(scale))}
        return replace(self, design=design, data=self.whitened(design), log_scale=scales)
