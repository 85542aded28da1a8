"""Replicated data: what the bench might have read, from a posterior alone."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.covariance import whitener
from backdrive_bayes.engine.design import effect_columns
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.reduced import BlockMeans, Jitter
from backdrive_bayes.mechanics.history import of_blocks

REPLICATES_A_CHAIN = 50


def covariances_rad2(posterior: Posterior) -> list[np.ndarray]:
    """Covariance of each record's block means about the mode [rad²], (blocks, blocks) each."""
    scale, angle = posterior.context.torque_scale_nm, posterior.context.angle_scale_rad
    reduced = BlockMeans(posterior.records.blocks, posterior.records.noise)
    jitter = Jitter(posterior.jitter[0] / scale, max(posterior.jitter[1] / scale, 1e-12))
    slopes = reduced.slopes([p / angle for p in posterior.predicted_rad])
    return [c * reduced.angle_scale_rad**2 for c in reduced.covariances(slopes, jitter)]


def block_offsets(posterior: Posterior) -> list[float]:
    """The encoder's offset of each record [rad]: what is left between reading and prediction in the mean, by generalised
    least squares over the settled blocks.
    """
    found, settled = [], BlockMeans(posterior.records.blocks, posterior.records.noise).settled
    for blocks, predicted, covariance, own in zip(
        posterior.records.blocks, posterior.predicted_rad, covariances_rad2(posterior), settled, strict=True
    ):
        both = np.column_stack([np.ones(blocks.count.size), blocks.angle_rad - predicted])
        one, left = (whitener(covariance[np.ix_(own, own)]) @ both[own]).T
        found.append(float(one @ left / (one @ one)))
    return found


def replicates(posterior: Posterior) -> np.ndarray:
    """Replicated block means [rad], float32 (chains, draws, blocks): the mode, each draw's departure and new noise."""
    some = posterior.thinned(REPLICATES_A_CHAIN)
    rng = np.random.default_rng([posterior.seed, 6])
    out = []
    for r, (covariance, offset) in enumerate(zip(covariances_rad2(posterior), block_offsets(posterior), strict=True)):
        noise = rng.standard_normal((*some.shape, covariance.shape[0])) @ np.linalg.cholesky(covariance).T
        out.append(posterior.predicted_rad[r] + offset + _departures(some, r).reshape(noise.shape) + noise)
    return np.concatenate(out, axis=-1).astype(np.float32)


def _departures(posterior: Posterior, record: int) -> np.ndarray:
    """Prediction of each draw less the draws' mean [rad], (draws, blocks); of the reducer and of the record's own columns."""
    context, distortion = posterior.context, posterior.distortion
    blocks, own = posterior.records.blocks[record], posterior.records
    history = of_blocks(blocks, context.torque_scale_nm, distortion.offset, distortion.lag_s)
    growth = distortion.growth(context.log_rate[record] + history.surge, history.log_amplitude, context)
    columns = posterior.reducer.columns(history, growth)
    mean = {n: posterior.flat[n].mean(axis=0) for n in columns}
    shared = posterior.reducer, history, mean, growth, sum(columns[n] @ mean[n] for n in mean), context, record
    for effect in (e for e in posterior.effects if e.name in posterior.flat):
        if (by := effect_columns(effect, *shared)) is not None:
            columns[effect.name] = by
    per_record = {e.name for e in posterior.effects if e.per_record}
    found = np.zeros(())
    for name, column in columns.items():
        weights = posterior.flat[name]
        if name in per_record:
            weights = np.split(weights, own.count, axis=1)[record]
        found = found + (weights - weights.mean(axis=0)) @ column.T
    return found * context.angle_scale_rad
