"""Small known reducers, their prior draws and torque paths, shared by several tests."""

import numpy as np

from backdrive_bayes.indicators.loop import Loops
from backdrive_bayes.model.parameter import Scale
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.model.registry import BASELINE, members_named

RATED = 0.1
SCALE = Scale(RATED, 0.02)


def reducer(names=BASELINE, scale=SCALE):
    return ReducerModel(members_named(names), scale)


def prior_values(model, rng, draws):
    """Parameters by name, each (draws, 1), drawn from the prior."""
    return {
        p.name: p.scaled_prior(model.scale).from_normal(rng.normal(size=(draws, 1))) for p in model.parameters
    }


def typical_values(model, z=0.3):
    """One plausible unit: every parameter at the same normal coordinate, as plain floats."""
    return {p.name: float(p.scaled_prior(model.scale).from_normal(z)) for p in model.parameters}


def as_arrays(values):
    return {k: np.array([v], float) for k, v in values.items()}


def cycles(amplitude, count, points_per_leg=100):
    """0 → +T and then ``count`` whole loops back to +T."""
    return TorquePath.from_turning_points([0.0, amplitude, *[-amplitude, amplitude] * count], points_per_leg)


def settled_loops(model, values, torque, loops=3):
    """The model's last of ``loops`` loops on an odd-symmetric rising grid, as Loops."""
    one = np.concatenate([torque[::-1][1:], torque[1:]])
    path = TorquePath.from_samples(np.concatenate([[0.0], torque[torque > 0], *[one] * loops]))
    angle = np.atleast_2d(model.angle(values, path))[:, -2 * torque.size + 1 :]
    return Loops(torque, angle[:, torque.size - 1 :], angle[:, : torque.size][:, ::-1])


def random_torques(rng, turns=12, amplitude=RATED, points=9):
    """Noise-free torque samples of a random zigzag, with a dwell here and there."""
    corner = np.r_[0.0, amplitude * rng.uniform(-1, 1, turns)]
    pieces = [np.linspace(a, b, points)[1:] for a, b in zip(corner[:-1], corner[1:], strict=True)]
    dwell = [np.full(rng.integers(0, 3), p[-1]) for p in pieces]
    return np.concatenate([corner[:1], *[x for pair in zip(pieces, dwell, strict=True) for x in pair]])
