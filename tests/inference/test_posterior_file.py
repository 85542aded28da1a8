"""Replicated data of a posterior: they must look like the data they come from."""

import numpy as np
from support.bench import unit_of
from support.known import SCALE

from backdrive_bayes.inference.fit import fit
from backdrive_bayes.inference.posterior_file import posterior_groups
from backdrive_bayes.inference.sampling import Settings

BRIEF = Settings(max_seconds=0.0, block=30, kept_per_ensemble=400)


def offset_gap(baseline):
    """Offset of data less mean replicate, in standard deviations of the replicates' own offsets."""
    posterior = fit(unit_of(4, rate=0.05), baseline=baseline, seed=1, settings=BRIEF, scale=SCALE)
    groups, weight = posterior_groups(posterior), posterior.problem.records[0].offset_weight
    replicate = groups["posterior_predictive"]["angle_rad"].values.astype(float)
    observed = groups["observed_data"]["angle_rad"].values
    assert np.isfinite(replicate).all() and replicate.shape[-1] == observed.size
    return abs(weight @ (observed - replicate.mean(axis=(0, 1)))) / (replicate @ weight).std()


def test_replicates_sit_on_the_data_where_the_model_is_true():
    assert offset_gap(("geometric", "elastic", "friction")) < 3


def test_replicates_sit_on_the_data_where_there_is_model_error():
    assert offset_gap(("elastic",)) < 3
