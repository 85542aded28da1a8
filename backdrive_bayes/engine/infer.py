"""The one way from a unit to a posterior."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import gammaincinv

from backdrive_bayes.engine.levels import learn_scales, levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.linearise import linearise
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.posterior import Posterior, RecordFacts
from backdrive_bayes.engine.reduced import Reduced, reduce_unit
from backdrive_bayes.engine.sample import sample
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.reducer import BASELINE, GROWING
from backdrive_bayes.mechanics.registry import UNSEEN, library_terms
from backdrive_bayes.records.faults import without_wild
from backdrive_bayes.records.record import Unit

POWER, POWER_DOF, POWER_LEVELS = 0.7, 4.0, 16
"""Mean power of the likelihood from which weights are drawn, scales seeing all of it (a coarsened posterior: Miller and Dunson,
JASA 114, 2019): no reducer is quite of the class, and how far it is from it is not known either. The power is therefore a
chi-square variable of POWER_DOF degrees of freedom over that number, at POWER_LEVELS equally likely values, which makes Student's
t of what would be normal. reports/interval-coverage says how often intervals hold the truth."""
POWERS = tuple(POWER * 2.0 * gammaincinv(POWER_DOF / 2.0, (np.arange(POWER_LEVELS) + 0.5) / POWER_LEVELS) / POWER_DOF)

REACHED = 0.03
"""Share by which the amplitude that was reached may miss the declared one."""


@one_thread()
def prepare(unit: Unit, modules=BASELINE, note: Callable[[str], None] = lambda text: None) -> tuple[Linear, ...]:
    """The linear models of a unit about its modes, the joint one first; BadInput where its records tell nothing."""
    note("reducing the records")
    try:
        reduced = reduce_unit(without_wild(unit))
        note("finding the modes")
        return linearise(reduced, library_terms(), modules)
    except (np.linalg.LinAlgError, ZeroDivisionError):
        raise BadInput(unit.name, "records with noise and with an angle that moves", "equations without a solution") from None


@one_thread()
def infer(
    linear: Linear, hypothesis: tuple[str, ...] = (), seed: int = 0, note=lambda text: None, off: tuple[str, ...] = ()
) -> Posterior:
    """Posterior of a unit.

    ``hypothesis`` names effects that are present while all others stay at trace level, ``off`` modules that the class lacks.
    """
    scales, mode, solution = learn_scales(linear, levels(linear, hypothesis, off))
    drawn = sample(linear.data, scales, mode, linear.design.names, seed, note, POWERS)
    reduced, names = linear.reduced, linear.design.names
    weights = np.split(drawn.weights, np.cumsum([g.width for g in linear.design.groups])[:-1], axis=-1)
    unlearnt = _unlearnt(linear, drawn.log_density.shape, seed)
    return Posterior(
        unit_name=reduced.unit.name,
        data_hashes=reduced.unit.data_sha256,
        rated_torque_nm=reduced.unit.rated_torque_nm,
        reducer=linear.reducer,
        distortion=linear.distortion,
        effects=linear.effects,
        context=reduced.context,
        records=record_facts(reduced),
        weights=dict(zip(names, weights, strict=True)) | unlearnt,
        log_scale={n: drawn.log_scale[..., i] for i, n in enumerate(names)},
        log_density=drawn.log_density,
        predicted_rad=tuple(p * reduced.angle_scale_rad for p in linear.predicted),
        residual=tuple(np.split(linear.data.y - linear.data.x @ solution.mean, np.cumsum([a.size for a in linear.angles])[:-1])),
        noise_sd_rad=tuple(np.sqrt(np.diag(c)) * reduced.angle_scale_rad for c in linear.covariances),
        convergence=drawn.convergence,
        acceptance=drawn.acceptance,
        seed=seed,
        hypothesis=hypothesis,
        jitter=(linear.jitter.torque * reduced.torque_scale_nm, linear.jitter.length * reduced.torque_scale_nm),
    )


def _unlearnt(linear: Linear, shape: tuple[int, int], seed: int) -> dict[str, np.ndarray]:
    """Draws from their priors, (chains, draws, 1) each, of what any reducer may have and the records do not tell: loops of one
    amplitude or of one rate know nothing of how thresholds follow it, and at another one it counts. That the exponent changes in
    turn is not supposed of what was not seen."""
    rng, context = np.random.default_rng([seed, 5]), linear.reduced.context
    there = {p.name for p in linear.reducer.parts}
    own = (e for e in UNSEEN if e.name not in linear.design.names and there.intersection(GROWING[e.part]))
    return {e.name: e.present(context) * rng.standard_normal((*shape, 1)) for e in own if e in linear.effects}


def record_facts(reduced: Reduced) -> RecordFacts:
    """Names, loading rates [N·m/s] and amplitudes [N·m] of a unit's records, with their blocks and noise."""
    rate = reduced.context.rate * reduced.torque_scale_nm
    pairs = zip(reduced.blocks, reduced.unit.records, strict=True)
    amplitude = np.array([_amplitude(blocks.amplitude_nm, record.amplitude_nm) for blocks, record in pairs])
    return RecordFacts(tuple(b.name for b in reduced.blocks), rate, amplitude, reduced.blocks, reduced.noise)


def _amplitude(reached_nm: float, declared_nm: float | None) -> float:
    """Amplitude of the loop whose indicators a record is asked for: the declared one where the torque reached it."""
    return declared_nm if declared_nm and abs(reached_nm / declared_nm - 1.0) <= REACHED else reached_nm
