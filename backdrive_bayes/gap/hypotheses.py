"""Hypotheses and their fits: the baseline with one or two effects, all parameters fitted jointly."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.gap.setting import JointProblem, Setting, Whitening
from backdrive_bayes.inference.optimum import best_mode
from backdrive_bayes.inference.starts import FEATURE_STARTS, feature_starts, scattered
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.model.registry import BASELINE, members_named

SCREENED = 256
STARTS = 3
PROBE = 1e-4
ENOUGH = 0.1
"""Log posterior that a climb must gain in one of two steps to go on: evidences are told apart by more."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A hypothesis at its mode: ``residual`` (blocks,) and ``jacobian`` (blocks, dimension) in rad, not whitened.

    ``contributions`` (blocks,) in rad, one an effect: how the angle changes when that effect alone is taken out.
    """

    effects: tuple[str, ...]
    problem: JointProblem
    z: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    contributions: tuple[np.ndarray, ...]


def joint_problem(setting: Setting, effects, whitening: Whitening) -> JointProblem:
    """The unit's problem with ``effects`` added to the baseline."""
    base = setting.problem
    model = ReducerModel(members_named([*base.model.names, *effects]), base.model.scale)
    return JointProblem(model, base.records, 0.0, whitener=whitening.matrix)


def fit_from(problem: JointProblem, effects, starts, steps: tuple[int, int] = (6, 12), finalists: int = 2) -> Fitted:
    """The best mode reached from ``starts`` (starts, dimension): all climb the first number of steps, some the second."""
    return linearised(problem, effects, best_mode(problem, starts, steps, finalists, ENOUGH))


def linearised(problem: JointProblem, effects, z) -> Fitted:
    """Residual and Jacobian of the residual at ``z``."""
    n = z.size
    probes = np.concatenate([z[None], z + PROBE * np.eye(n), z - PROBE * np.eye(n)])
    raw = problem.raw_residual(probes)
    contributions = tuple(contribution(problem, z, name) for name in effects)
    return Fitted(tuple(effects), problem, z, raw[0], (raw[1 : n + 1] - raw[n + 1 :]).T / (2 * PROBE), contributions)


def contribution(problem: JointProblem, z, effect: str) -> np.ndarray:
    """Angle [rad] of all blocks with the effect less that without it, each record's mean taken out, shape (blocks,)."""
    model, parts = problem.model, []
    without = replace(model, members=tuple(m for m in model.members if m.name != effect))
    for r, data in enumerate(problem.records):
        values = problem.values(z, r)
        change = model.angle(values, data.path) - without.angle(values, data.path)
        parts.append(change - change.mean())
    return np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class Screen:
    """What an effect could do about the residual of a fitted hypothesis: the most promising of many prior draws.

    ``starts`` (starts, dimension) for ``problem``; ``change`` (starts, blocks), the whitened change of the angle at the amplitude
    that least squares asks for, with what the known parameters can do taken out.
    """

    problem: JointProblem
    starts: np.ndarray
    change: np.ndarray


def screen(setting: Setting, known: Fitted, effect: str, whitening: Whitening, rng, draws: int = SCREENED) -> Screen:
    """Draw the effect's own parameters from their prior and find the amplitude of each draw by least squares."""
    problem = joint_problem(setting, (*known.effects, effect), whitening)
    own = np.array([label not in known.problem.labels for label in problem.labels])
    order = [known.problem.labels.index(label) for label in np.array(problem.labels)[~own]]
    z = np.empty((draws, problem.dimension))
    z[:, ~own] = known.z[order]
    z[:, own] = rng.standard_normal((draws, own.sum()))
    flexible = Flexible.of(known, whitening)
    for row, guess in zip(z, _guessed(problem, effect, known, setting.places.record, flexible, whitening), strict=False):
        _place(problem, row, guess)
    change = flexible.left((known.residual - problem.raw_residual(z)) @ whitening.matrix.T)
    size = np.einsum("ij,ij->i", change, change) + 1.0
    amount = change @ flexible.residual / size
    gain = amount**2 * size * ((amount > 0) | _signed(problem, own))
    best = np.argsort(-gain)[:STARTS]
    starts = z[best]
    _scale_amplitude(problem, own, starts, amount[best])
    return Screen(problem, starts, amount[best][:, None] * change[best])


def _guessed(problem, effect, known, record, flexible, whitening) -> list[dict]:
    """The points that the effect itself takes for promising beside a known hypothesis, if it has an opinion."""
    member = next(m for m in problem.model.members if m.name == effect)
    if not hasattr(member, "guesses"):
        return []

    def taken_out(columns):
        white = flexible.left(columns @ whitening.matrix.T)
        gram, load = np.einsum("sib,sjb->sij", white, white), white @ flexible.residual
        ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2)[:, None, None] * np.eye(gram.shape[-1])
        found = np.linalg.solve(gram + ridge, load[..., None])[..., 0]
        return found, np.einsum("si,si->s", found, load)

    measured = np.concatenate([data.blocks.angle_rad for data in problem.records])
    return member.guesses(measured - known.residual, record, taken_out)


def _place(problem, z, guess):
    """Overwrite coordinates ``z`` (dimension,) in place by the guessed values of parameters."""
    for name, value in guess.items():
        own = [i for i, c in enumerate(problem.coordinates) if c.parameter.name == name]
        prior = problem.coordinates[own[0]].parameter.scaled_prior(problem.model.scale)
        z[own] = np.clip(prior.to_normal(value), -3, 3)


@dataclass(frozen=True, eq=False)
class Flexible:
    """A fitted hypothesis whose parameters give way: whitened ``residual`` (blocks,), and what takes its directions out."""

    residual: np.ndarray
    jacobian: np.ndarray
    solve: np.ndarray

    @classmethod
    def of(cls, fitted: Fitted, whitening: Whitening) -> Flexible:
        """Linear in the parameters around the mode."""
        jacobian = whitening.matrix @ fitted.jacobian
        solve = np.linalg.solve(np.eye(fitted.z.size) + jacobian.T @ jacobian, jacobian.T)
        residual = whitening.matrix @ fitted.residual - jacobian @ fitted.z
        return cls(residual - jacobian @ (solve @ residual), jacobian, solve)

    def left(self, change):
        """What of whitened changes (…, blocks) the parameters cannot do."""
        return change - (change @ self.solve.T) @ self.jacobian.T


def _amplitudes(problem, own):
    return [i for i in np.flatnonzero(own) if problem.coordinates[i].parameter.null == 0.0]


def _signed(problem, own):
    return all(type(problem.coordinates[i].parameter.prior).__name__ == "Normal" for i in _amplitudes(problem, own))


def _scale_amplitude(problem, own, starts, amount):
    """Multiply the parameters that vanish at the null by ``amount`` (starts,), in place and within four prior deviations."""
    for i in _amplitudes(problem, own):
        prior = problem.coordinates[i].parameter.scaled_prior(problem.model.scale)
        value = prior.from_normal(starts[:, i]) * amount
        with np.errstate(divide="ignore", invalid="ignore"):
            z = prior.to_normal(value)
        starts[:, i] = np.clip(np.nan_to_num(z, nan=0.0, posinf=3, neginf=-3), -3, 3)


def fit_none(setting: Setting, whitening: Whitening) -> Fitted:
    """The baseline alone, from the mode found when the unit was prepared."""
    return fit_from(joint_problem(setting, (), whitening), (), [setting.z])


def fit_screened(found: Screen, effects, rng) -> Fitted:
    """The best mode from the starts of a screen; a module that the baseline was left without is also read off the loop."""
    starts = found.starts
    if set(effects) & set(BASELINE):
        starts = np.concatenate([starts, feature_starts(found.problem, rng)])
    return fit_from(found.problem, effects, starts)


def rebased(fitted: Fitted, other: Fitted) -> Fitted:
    """The same hypothesis begun anew with the baseline's parameters of another mode."""
    z = fitted.z.copy()
    for i, label in enumerate(fitted.problem.labels):
        if label in other.problem.labels:
            z[i] = other.z[other.problem.labels.index(label)]
    return fit_from(fitted.problem, fitted.effects, [z], (0, 15))


def simplified(setting: Setting, fitted: Fitted, effects, whitening: Whitening) -> Fitted:
    """A simpler hypothesis begun from the mode of one that holds it, which may have found a better baseline."""
    problem = joint_problem(setting, effects, whitening)
    start = fitted.z[[fitted.problem.labels.index(label) for label in problem.labels]]
    return fit_from(problem, effects, [start], (0, 20))


def polished(fitted: Fitted, rng) -> Fitted:
    """The same hypothesis climbed to the end, also from what the loops look like without the effects' contributions.

    The baseline's mode may have been a makeshift for the effect that was missing.
    """
    problem, change, row, records = fitted.problem, sum(fitted.contributions, 0.0), 0, []
    for data in problem.records:
        own = slice(row, row + data.blocks.count.size)
        angle = data.blocks.angle_rad - (change[own] if fitted.effects else 0.0)
        records.append(replace(data, blocks=replace(data.blocks, angle_rad=angle)))
        row = own.stop
    model = replace(problem.model, members=tuple(m for m in problem.model.members if m.name not in fitted.effects))
    cleaned = replace(problem, model=model, records=tuple(records))
    starts = np.repeat(fitted.z[None], FEATURE_STARTS, axis=0)
    known = [problem.labels.index(label) for label in cleaned.labels]
    starts[:, known] = feature_starts(cleaned, rng)
    return fit_from(problem, fitted.effects, np.concatenate([scattered(fitted.z, rng), starts]), (12, 40), 4)
