"""The posterior of one unit: draws of weights and scales, and what evaluates them on any torque history."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from backdrive_bayes.engine.design import effect_columns
from backdrive_bayes.engine.diagnostics import Convergence
from backdrive_bayes.mechanics.effect import Context, Distortion, Effect, GrowthEffect
from backdrive_bayes.mechanics.history import History, through
from backdrive_bayes.mechanics.reducer import GROWING, GROWING_MODULES, ReducerClass
from backdrive_bayes.records.reduction import loading_rate


@dataclass(frozen=True, eq=False)
class RecordFacts:
    """What a posterior keeps of each record: names, rates [N·m/s], amplitudes [N·m], blocks and noise (tuples over records)."""

    names: tuple[str, ...]
    rate_nm_per_s: np.ndarray
    amplitude_nm: np.ndarray
    blocks: tuple
    noise: tuple

    @property
    def count(self) -> int:
        """Number of records."""
        return len(self.names)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of one unit.

    ``weights`` maps groups to arrays (chains, draws, weights) in shares of the angle scale, ``log_scale`` to arrays (chains,
    draws); tangent effects' weights are values of their parameter. ``predicted_rad`` and ``residual`` hold the mode's block means
    and whitened residuals (zero where the past decides) by record. ``hypothesis`` names the effects that are present
    (None: each at a scale of its own),
    ``jitter`` is standard deviation and correlation length of the crossing torques [N·m], ``doubts`` say what in the measurement
    speaks against it.
    """

    unit_name: str
    data_hashes: tuple[str, ...]
    rated_torque_nm: float
    reducer: ReducerClass
    distortion: Distortion
    effects: tuple[Effect, ...]
    context: Context
    records: RecordFacts
    weights: dict[str, np.ndarray]
    log_scale: dict[str, np.ndarray]
    log_density: np.ndarray
    predicted_rad: tuple[np.ndarray, ...]
    residual: tuple[np.ndarray, ...]
    noise_sd_rad: tuple[np.ndarray, ...]
    convergence: Convergence
    acceptance: float
    seed: int
    hypothesis: tuple[str, ...] | None = ()
    jitter: tuple[float, float] = (0.0, 0.0)
    doubts: tuple[str, ...] = ()

    @property
    def converged(self) -> bool:
        """Whether every log scale and indicator passed the diagnostics and the measurement does not contradict."""
        return self.convergence.converged and not self.doubts

    @property
    def shape(self) -> tuple[int, int]:
        """Chains and draws."""
        return self.log_density.shape

    @cached_property
    def flat(self) -> dict[str, np.ndarray]:
        """Weights (draws, weights) by group, chains one after the other."""
        return {n: w.reshape(-1, w.shape[-1]) for n, w in self.weights.items()}

    def thinned(self, most: int) -> Posterior:
        """At most ``most`` draws of each chain, evenly taken."""
        return self.taken(np.linspace(0, self.shape[1] - 1, min(most, self.shape[1])).astype(int))

    def taken(self, keep) -> Posterior:
        """The draws ``keep`` of each chain, numbers or a slice."""
        return replace(
            self,
            weights={n: w[:, keep] for n, w in self.weights.items()},
            log_scale={n: s[:, keep] for n, s in self.log_scale.items()},
            log_density=self.log_density[:, keep],
        )

    def angles(self, history: History, rate_nm_per_s: float, modules=None) -> np.ndarray:
        """Angles [rad] of the reducer at the ends of a history's segments, (draws, segments), without faults of the channel.

        ``modules`` restricts the class to some of its modules and leaves out effects.
        """
        log_rate = self._log_rate(rate_nm_per_s) + history.surge
        found = np.zeros(())
        at = self.distortion if modules is None else replace(self.distortion, shaft_drag=0.0)
        growth = at.growth(log_rate, history.log_amplitude, self.context)
        base = self.reducer.ends(history, growth)
        for name, columns in base.items():
            if modules is None or self.reducer.part(name).module in modules:
                found = found + self.flat[name] @ columns.T
        law = self.distortion.law(log_rate, history.log_amplitude, self.context)
        mean = {n: self.flat[n].mean(axis=0) for n in base}
        if modules is None:
            found = found + self._effects(history, growth, base, mean)
        # A drag before all parts is of no module.
        parts = range(len(GROWING)) if modules is None else [i for i, m in enumerate(GROWING_MODULES) if m in modules]
        return sum((self._grown(part, history, law, growth, mean) for part in parts), found) * self.context.angle_scale_rad

    def _effects(self, history, growth, base, mean):
        """What effects of the reducer itself add, (draws, segments) in shares of the angle scale."""
        found, turned = 0.0, sum(base[n] @ mean[n] for n in base)
        for effect in self.effects:
            if effect.name not in self.flat or not effect.of_reducer:
                continue
            columns = effect_columns(effect, self.reducer, history, mean, growth, turned, self.context, ends=True)
            if columns is not None:
                found = found + self.flat[effect.name] @ columns.T
        return found

    def _grown(self, part: int, history, law, growth, mean):
        """What growths of one kind of thresholds other than the mode's add, (draws, segments): those that are the same all along
        the history together."""
        found = steady = np.zeros(())
        for effect in (e for e in self.effects if isinstance(e, GrowthEffect) and e.part == part and e.name in self.flat):
            away, term = self.flat[effect.name][:, 0] - getattr(self.distortion, effect.parameter), law[effect.term]
            if np.ptp(term) > 0.0:
                found = found + self.reducer.shifted(history, mean, growth, part, away, term)
            else:
                steady = steady + away * float(np.mean(term))
        return found + self.reducer.shifted(history, mean, growth, part, steady) if np.any(steady) else found

    def along(self, time_s, torque_nm) -> np.ndarray:
        """Angles [rad] for a torque history, (draws, samples), zero at the first sample's neutral state."""
        torque = np.asarray(torque_nm, float)
        rate = loading_rate(time_s, torque) or float(self.records.rate_nm_per_s[0])
        start = np.r_[torque[:1], torque]
        history = through(np.r_[time_s[:1], time_s], start, self.context.torque_scale_nm)
        return self.angles(history, rate)

    def _log_rate(self, rate_nm_per_s) -> float:
        measured = self.records.rate_nm_per_s
        return float(np.log(rate_nm_per_s) - np.log(measured).mean())
