"""The posterior that `fit` gives."""

from __future__ import annotations

from backdrive_bayes.engine.infer import infer, prepare
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.records.record import Unit


def fit_posterior(unit: Unit, modules=BASELINE, seed: int = 0, note=lambda text: None) -> Posterior:
    """Posterior of a unit."""
    return infer(prepare(unit, modules, note), (), seed, note)
