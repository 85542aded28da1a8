"""Replicated data of a posterior look like the data they come from; the file opens in the ArviZ that is installed."""

import arviz
import numpy as np
import pytest
from support.bench import unit_of
from support.known import SCALE

from backdrive_bayes.inference.fit import fit
from backdrive_bayes.inference.posterior_file import posterior_groups, write_posterior
from backdrive_bayes.inference.sampling import Settings

BRIEF = Settings(max_seconds=0.0, walkers=40, block=20, kept_per_ensemble=400)


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


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A posterior, and its file as ArviZ opens it."""
    path = tmp_path_factory.mktemp("posterior") / "posterior.nc"
    posterior = fit(unit_of(4, rate=0.05), seed=1, settings=BRIEF, scale=SCALE)
    write_posterior(posterior, path)
    return posterior, arviz.from_netcdf(path)


def test_arviz_opens_every_group(opened):
    posterior, data = opened
    for name, dataset in posterior_groups(posterior).items():
        found = data[name]
        assert set(found.data_vars) == set(dataset.data_vars), name
        for variable in dataset.data_vars:
            np.testing.assert_array_equal(found[variable].values, dataset[variable].values)
    assert data["posterior"].attrs["seed"] == 1


def test_arviz_summarises_every_parameter(opened):
    posterior, data = opened
    table = arviz.summary(data)
    assert {c.parameter.name for c in posterior.problem.coordinates} <= {name.split("[")[0] for name in table.index}
    assert (table["r_hat"].astype(float) < 1.2).all()
