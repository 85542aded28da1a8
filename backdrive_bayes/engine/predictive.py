"""Replicated data: what the bench might have read, from a posterior alone."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.covariance import whitener
from backdrive_bayes.engine.design import class_groups, path_group, tangent_groups
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.reduced import BlockMeans, Jitter
from backdrive_bayes.mechanics.effect import PathEffect

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
    each = zip(posterior.predicted_rad, covariances_rad2(posterior), block_offsets(posterior), _departures(some), strict=True)
    for predicted, covariance, offset, away in each:
        noise = rng.standard_normal((*some.shape, covariance.shape[0])) @ np.linalg.cholesky(covariance).T
        out.append(predicted + offset + away.reshape(noise.shape) + noise)
    return np.concatenate(out, axis=-1).astype(np.float32)


def _departures(posterior: Posterior) -> list[np.ndarray]:
    """Prediction of each draw less the draws' mean [rad], (draws, blocks) for each record."""
    reduced, at = BlockMeans(posterior.records.blocks, posterior.records.noise), posterior.distortion
    design, mean = class_groups(reduced, posterior.reducer, at), {n: w.mean(axis=0) for n, w in posterior.flat.items()}
    drawn = tuple(e for e in posterior.effects if e.name in posterior.flat)
    groups = (*design.groups, *(path_group(reduced, e, at) for e in drawn if isinstance(e, PathEffect)))
    groups += tangent_groups(reduced, posterior.reducer, design, at, mean, drawn)
    away = {g.name: posterior.flat[g.name] - mean[g.name] for g in groups}
    scale = posterior.context.angle_scale_rad
    return [scale * sum(away[g.name] @ g.of_record(r).T for g in groups) for r in range(posterior.records.count)]
