"""chain.h5: the ensembles of a fit whose budget ran out, from which the same fit goes on."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.inference.sampling import Chains, load_chains, save_chains
from backdrive_bayes.model.registry import members_named

SCHEMA = "backdrive-bayes/chain/1"
CHECKED = 32
"""Draws of each ensemble whose log posterior is computed again before a chain goes on."""
UNREADABLE = (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError)


@dataclass(frozen=True, eq=False)
class Unfinished:
    """A fit that ran out of time: where its ensembles are, the points at which it began again, and its seconds so far."""

    path: Path
    restarts: np.ndarray
    seconds: float

    def chains(self, log_posterior) -> Chains:
        """The ensembles, ready to go on; BadInput where they were not drawn from ``log_posterior``."""
        try:
            chains = load_chains(self.path, log_posterior)
            same = all(_drawn_from(log_posterior, sampler) for sampler in chains.samplers)
        except UNREADABLE as error:
            raise _unreadable(self.path, error) from None
        if not same:
            raise BadInput(self.path, "draws from this unit's posterior", "draws with another log posterior")
        return chains


def _drawn_from(log_posterior, sampler) -> bool:
    z, value = sampler.get_chain(flat=True), sampler.get_log_prob(flat=True)
    picked = np.linspace(0, value.size - 1, CHECKED).astype(int)
    return np.isfinite(z).all() and np.allclose(log_posterior(z[picked]), value[picked], rtol=1e-6, atol=1e-3)


def write_chain(posterior, path: Path) -> None:
    """Write the ensembles of a posterior whose budget ran out, with what tells whose they are."""
    with h5py.File(path, "w") as file:
        file.attrs.update(_identity(posterior.unit, posterior.problem.model.names, posterior.seed))
        file.attrs["seconds"] = posterior.convergence.seconds
        file["restarts"] = posterior.restarts
    save_chains(posterior.ensembles.chains, path)


def read_chain(path: Path, unit, baseline, seed: int) -> Unfinished:
    """What :func:`write_chain` left for the same data, baseline, seed and version; BadInput for anything else."""
    modules = [member.name for member in members_named(baseline)]
    if not path.is_file():
        raise BadInput(path, "the chain that a fit leaves when its budget runs out", "no such file")
    try:
        with h5py.File(path) as file:
            found, restarts = dict(file.attrs), file["restarts"][()]
            unfinished = Unfinished(path, restarts, float(found["seconds"]))
    except UNREADABLE as error:
        raise _unreadable(path, error) from None
    for key, expected in _identity(unit, modules, seed).items():
        if found.get(key) != expected:
            raise BadInput(path, f"a chain with {key} {expected}", found.get(key))
    return unfinished


def _identity(unit, modules, seed):
    return {
        "schema": SCHEMA,
        "version": version("backdrive-bayes"),
        "data_sha256": unit.data_hash,
        "modules": ",".join(modules),
        "seed": seed,
    }


def _unreadable(path, error):
    return BadInput(path, "the chain of an unfinished fit", f"unreadable file ({type(error).__name__})")
