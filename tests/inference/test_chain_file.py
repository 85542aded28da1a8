"""A fit that ran out of time goes on where it stood, and only where it stood."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
from emcee.backends import HDFBackend
from support.bench import unit_of
from support.known import SCALE

from backdrive_bayes.errors import BadInput
from backdrive_bayes.inference.chain_file import read_chain, write_chain
from backdrive_bayes.inference.fit import BASELINE, fit
from backdrive_bayes.inference.problem import Problem
from backdrive_bayes.inference.sampling import Settings

NO_TIME = Settings(max_seconds=0.0, walkers=40, block=10)


UNIT = unit_of(3)


def run(settings, resume=None):
    return fit(UNIT, seed=1, settings=settings, scale=SCALE, resume=resume)


def counting(work):
    """What ``work`` returns, and at how many points it evaluated the log posterior."""
    counts, real = [], Problem.log_posterior
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Problem, "log_posterior", lambda self, z: counts.append(len(np.atleast_2d(z))) or real(self, z))
        return work(), sum(counts)


@pytest.fixture(scope="module")
def first():
    return counting(lambda: run(NO_TIME))


@pytest.fixture(scope="module")
def stopped(first):
    return first[0]


@pytest.fixture
def saved(stopped, tmp_path):
    write_chain(stopped, tmp_path / "chain.h5")
    return tmp_path / "chain.h5"


def read(path, unit=UNIT, baseline=BASELINE, seed=1):
    return read_chain(path, unit, baseline, seed)


@pytest.fixture(scope="module")
def second(stopped, tmp_path_factory):
    path = tmp_path_factory.mktemp("chain") / "chain.h5"
    write_chain(stopped, path)
    return counting(lambda: run(NO_TIME, read(path)))


@pytest.fixture(scope="module")
def resumed(second):
    return second[0]


def test_resumed_fit_keeps_the_first_draws(stopped, resumed):
    found, chains = resumed.ensembles, stopped.ensembles.chains
    assert found.steps > stopped.ensembles.steps
    step = found.step[0].reshape(chains.samplers[0].nwalkers, -1)[0]
    early = step[step < stopped.ensembles.steps]
    assert 0 < early.size < step.size
    for z, sampler in zip(found.z, chains.samplers, strict=True):
        kept = z.reshape(sampler.nwalkers, step.size, -1)[:, : early.size]
        np.testing.assert_array_equal(kept, sampler.get_chain()[early].swapaxes(0, 1))


def test_resumed_fit_has_twice_the_draws_for_fewer_evaluations(stopped, resumed, first, second):
    assert resumed.ensembles.steps == 2 * stopped.ensembles.steps
    assert second[1] < first[1]


def test_resumed_fit_is_the_same_bit_for_bit(resumed, saved):
    again = run(NO_TIME, read(saved))
    np.testing.assert_array_equal(again.z, resumed.z)
    np.testing.assert_array_equal(again.weights, resumed.weights)


def test_seconds_of_both_runs_count(stopped, resumed, saved):
    assert read(saved).seconds == stopped.convergence.seconds
    assert resumed.convergence.seconds > stopped.convergence.seconds


def test_points_where_the_fit_began_again_are_replayed(stopped, tmp_path):
    """The chain was drawn without them: after a replay it is another problem's."""
    write_chain(replace(stopped, restarts=stopped.ensembles.z[0, :1]), tmp_path / "chain.h5")
    with pytest.raises(BadInput, match="another log posterior"):
        run(NO_TIME, read(tmp_path / "chain.h5"))


def test_the_file_is_emcees_own(saved, stopped):
    kept = HDFBackend(saved, name="ensemble_2", read_only=True)
    np.testing.assert_array_equal(kept.get_chain(), stopped.ensembles.chains.samplers[2].get_chain())
    assert kept.iteration == stopped.ensembles.steps


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"seed": 2}, "seed 2, found 1"),
        ({"baseline": ("elastic", "friction")}, "modules elastic,friction, found geometric,elastic,friction"),
        ({"unit": replace(UNIT, data_hash="other")}, "data_sha256 other"),
    ],
    ids=["seed", "model", "data"],
)
def test_chain_of_another_fit_is_refused(saved, changes, said):
    with pytest.raises(BadInput, match=said):
        read(saved, **changes)


def bend_draws(file):
    file["ensemble_1/chain"][...] *= 1.01


def bend_values(file):
    file["ensemble_3/log_prob"][...] += 1.0


def no_number(file):
    file["ensemble_0/chain"][3, 4, 0] = np.nan


def another_version(file):
    file.attrs["version"] = "0.0.0"


TAMPERED = {
    "draws": (bend_draws, "another log posterior"),
    "values": (bend_values, "another log posterior"),
    "not a number": (no_number, "another log posterior"),
    "ensemble gone": (lambda f: f.pop("ensemble_2"), "unreadable"),
    "proposal gone": (lambda f: f.pop("proposal"), "unreadable"),
    "restarts gone": (lambda f: f.pop("restarts"), "unreadable"),
    "seconds gone": (lambda f: f.attrs.pop("seconds"), "unreadable"),
    "version": (another_version, "version"),
}


@pytest.mark.parametrize(("tamper", "said"), TAMPERED.values(), ids=TAMPERED)
def test_tampered_chain_is_refused(saved, stopped, tamper, said):
    with h5py.File(saved, "a") as file:
        tamper(file)
    with pytest.raises(BadInput, match=said) as refused:
        read(saved).chains(stopped.problem.log_posterior)
    assert "\n" not in str(refused.value)


def test_no_file_and_no_hdf5_are_refused(tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        read(tmp_path / "chain.h5")
    (tmp_path / "chain.h5").write_bytes(b"nonsense")
    with pytest.raises(BadInput, match="unreadable"):
        read(tmp_path / "chain.h5")
