"""What pooling takes of a unit: draws of its indicators and parameters, and of what its prior alone says of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.engine.parameters import PARAMETERS, prior_weights
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.indicators.draws import CORE, UNITS, IndicatorDraws

PRIOR_DRAWS = 1000


@dataclass(frozen=True, eq=False)
class Told:
    """What a unit tells of one quantity: ``draws`` (draws,) of the posterior and of the ``prior``, in SI units.

    ``rate`` [N·m/s] and ``amplitude`` [N·m] are those of the loop, None for a parameter.
    """

    name: str
    unit: str
    rate: float | None
    amplitude: float | None
    draws: np.ndarray
    prior: np.ndarray


@dataclass(frozen=True, eq=False)
class UnitDraws:
    """A unit by its ``name`` in the batch, what makes it comparable with others, and everything that it tells."""

    name: str
    usable: bool
    rated_torque_nm: float
    k: float
    data_hashes: tuple[str, ...]
    told: tuple[Told, ...]


def unit_draws(evidence: Evidence, name: str | None = None, seed: int = 0) -> UnitDraws:
    """Draws of a fit's indicators at its measured loops and of its parameters, with as many of its prior.

    ``name`` is the unit's own by default; ``seed`` is that of the prior's draws.
    """
    about = evidence.about
    prior = IndicatorDraws(prior_of(evidence.draws.posterior, PRIOR_DRAWS, seed), about["k"])
    usable = evidence.converged and not about.get("forced", False)
    return UnitDraws(
        name or evidence.name, usable, evidence.rated_torque, float(about["k"]), tuple(about["data_sha256"]),
        (*_of_loops(evidence, prior), *_of_parameters(evidence, prior)),
    )  # fmt: skip


def _of_loops(evidence, prior) -> Iterator[Told]:
    for loop in evidence.measured:
        for name in CORE:
            own, before = (d.values(name, loop.rate, loop.amplitude) for d in (evidence.draws, prior))
            yield Told(name, UNITS[name], loop.rate, loop.amplitude, own, before)


def _of_parameters(evidence, prior) -> Iterator[Told]:
    for parameter in PARAMETERS:
        if parameter.name in evidence.parameters:
            own, before = evidence.parameters[parameter.name], prior.parameters[parameter.name]
            yield Told(parameter.name, parameter.unit, None, None, own, before)


def prior_of(posterior: Posterior, draws: int, seed: int = 0) -> Posterior:
    """One chain of ``draws`` reducers from the prior of the class with a posterior's knots, without effects."""
    drawn = prior_weights(posterior, draws, np.random.default_rng([seed, 17]))
    log_scale, weights = ({name: values[None] for name, values in of_parts.items()} for of_parts in drawn)
    return replace(posterior, weights=weights, log_scale=log_scale, log_density=np.zeros((1, draws)), effects=())
