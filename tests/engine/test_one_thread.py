"""Results are computed in one BLAS thread, whatever the machine offers and whoever calls."""

from types import SimpleNamespace

import pytest
from support.decided import evidence
from threadpoolctl import threadpool_info, threadpool_limits

from backdrive_bayes.commands import results
from backdrive_bayes.decisions import acceptance, comparison
from backdrive_bayes.engine import infer, posterior_file, prediction
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.gap import averaged, diagnose
from backdrive_bayes.pooling import pool


def threads():
    return {lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"}


@pytest.fixture
def two():
    with threadpool_limits(2, user_api="blas"):
        assert threads() == {2}
        yield


def test_one_within_and_what_there_was_after(two):
    with one_thread():
        with one_thread():
            assert threads() == {1}
        assert threads() == {1}
    assert threads() == {2}


class Reached(Exception):
    """The first step of a computation was reached."""


@pytest.mark.parametrize(
    ("room", "first_step", "start"),
    [
        (infer, "reduce_unit", lambda: infer.prepare(None)),
        (infer, "levels", lambda: infer.infer(SimpleNamespace(design=SimpleNamespace(scales=None)))),
        (prediction, "nodes", lambda: prediction.predict_angles(None, [], [])),
        (acceptance, "weigh", lambda: acceptance.assess([evidence()], None)),
        (comparison, "unique_names", lambda: comparison.compare([evidence("a"), evidence("b")])),
        (averaged, "weighed_unit", lambda: averaged.fit_posterior(None)),
        (diagnose, "examine", lambda: diagnose.diagnose(None)),
        (diagnose, "diagnose", lambda: results.diagnose_unit(None, results.FitOptions())),
        (posterior_file, "posterior_groups", lambda: posterior_file.write_posterior(None, "")),
        (pool, "_comparable", lambda: pool.pool_batch("a", [])),
    ],
    ids=lambda v: getattr(v, "__name__", "") if not isinstance(v, str) else v,
)
def test_every_computation_runs_in_one(room, first_step, start, two, monkeypatch):
    seen = []

    def step(*args, **options):
        seen.append(threads())
        raise Reached

    monkeypatch.setattr(room, first_step, step)
    monkeypatch.setattr(infer, "without_wild", lambda unit: unit)
    with pytest.raises(Reached):
        start()
    assert seen == [{1}] and threads() == {2}
