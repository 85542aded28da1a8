"""A posterior goes through its file unchanged, opens in ArviZ, and a file that was harmed is one line."""

import gc
import json
import re
import warnings

import numpy as np
import pytest
from support.made_posterior import made_posterior

from backdrive_bayes.engine.parameters import posterior_parameters
from backdrive_bayes.engine.posterior_file import as_saved, write_posterior
from backdrive_bayes.engine.posterior_read import read_posterior
from backdrive_bayes.errors import BadInput


@pytest.fixture(scope="module")
def posterior():
    return as_saved(made_posterior(lag_s=0.01))


@pytest.fixture(scope="module")
def path(posterior, tmp_path_factory):
    found = tmp_path_factory.mktemp("file") / "posterior.nc"
    write_posterior(posterior, found, {"options": {"k": 0.03}})
    return found


def same(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    return same(vars(a), vars(b)) if hasattr(a, "__dataclass_fields__") and not a.__dataclass_params__.eq else a == b


def test_what_is_read_is_what_was_written(posterior, path):
    again = read_posterior(path)
    for name in posterior.__dataclass_fields__:
        if name != "reducer":
            assert same(getattr(posterior, name), getattr(again, name)), name
    assert np.array_equal(posterior.reducer.knots, again.reducer.knots) and posterior.reducer.modules == again.reducer.modules


def test_any_history_gives_the_same_angles_to_the_last_bit(posterior, path):
    again = read_posterior(path)
    time = np.linspace(0, 5, 200)
    torque = 0.09 * np.sin(time**1.5)
    assert np.array_equal(posterior.along(time, torque), again.along(time, torque))


def test_the_same_posterior_gives_the_same_bytes(posterior, path, tmp_path):
    write_posterior(posterior, tmp_path / "again.nc", {"options": {"k": 0.03}})
    assert (tmp_path / "again.nc").read_bytes() == path.read_bytes()


def test_arviz_finds_its_groups_and_the_parameters(posterior, path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import arviz

        data = arviz.from_netcdf(path)
    found = data.groups() if callable(data.groups) else data.children  # ArviZ before 1.0, and from then on
    assert {"posterior", "sample_stats", "posterior_predictive", "observed_data", "constant_data"} <= set(found)
    assert data.posterior["clearance_rad"].dims == ("chain", "draw")
    np.testing.assert_allclose(data.posterior["clearance_rad"].values.ravel(), posterior_parameters(posterior)["clearance_rad"])
    assert data.posterior.attrs["data_sha256"] == posterior.data_hashes[0]
    assert json.loads(data.posterior.attrs["options"]) == {"k": 0.03}


def test_replicates_are_about_the_measurement(path):
    import xarray

    groups = ("posterior_predictive", "observed_data")
    replicates, observed = (xarray.load_dataset(path, group=g, engine="h5netcdf")["angle_rad"].values for g in groups)
    assert replicates.dtype == np.float32
    score = (observed - replicates.mean(axis=(0, 1))) / replicates.std(axis=(0, 1))
    assert np.sqrt(np.mean(score**2)) < 1.5 and np.abs(score).max() < 6


def spoiled(path, tmp_path, change):
    """A copy of the file with an attribute or variable changed through HDF5 itself."""
    import h5py

    copy = tmp_path / "copy.nc"
    copy.write_bytes(path.read_bytes())
    with h5py.File(copy, "a") as file:
        change(file)
    return copy


def lose_an_attribute(file):
    del file["constant_data"].attrs["distortion"]


def lose_a_variable(file):
    del file["constant_data/knots"]


def change_a_number(file):
    file["sample_stats/lp"][0, 0] += 1e-9


def other_schema(file):
    for group in file:
        file[group].attrs["schema"] = "backdrive-bayes/posterior/1"


@pytest.mark.parametrize("change", [lose_an_attribute, lose_a_variable, change_a_number, other_schema])
def test_a_changed_file_is_one_line(path, tmp_path, change):
    with pytest.raises(BadInput, match="copy.nc: expected") as caught:
        read_posterior(spoiled(path, tmp_path, change))
    assert "\n" not in str(caught.value)


def test_flipped_bytes_are_one_line_or_change_nothing(posterior, path, tmp_path):
    whole, rng = path.read_bytes(), np.random.default_rng(5)
    refused = 0
    for at in rng.integers(0, len(whole), 40):
        copy = tmp_path / "flipped.nc"
        copy.write_bytes(whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :])
        try:
            again = read_posterior(copy)
        except BadInput:
            refused += 1
        else:
            assert same(posterior.weights, again.weights) and same(posterior.predicted_rad, again.predicted_rad)
    assert refused > 25


def test_no_file_and_no_netcdf_are_one_line(tmp_path):
    with pytest.raises(BadInput, match="none.nc"):
        read_posterior(tmp_path / "none.nc")
    (tmp_path / "bad.nc").write_bytes(b"no hdf5")
    with pytest.raises(BadInput, match="bad.nc"):
        read_posterior(tmp_path / "bad.nc")


@pytest.mark.parametrize("header", [0, 1, 2])
def test_a_damaged_header_is_one_line_and_nothing_beside_it(posterior, path, tmp_path, header):
    """What fails while a half-open file is forgotten would be written to standard error, and is an error of this test."""
    data = bytearray(path.read_bytes())
    at = [match.start() for match in re.finditer(b"OHDR", data)][header]
    data[at + 8 : at + 40] = b"\xff" * 32
    broken = tmp_path / "broken.nc"
    broken.write_bytes(data)
    with pytest.raises(BadInput, match="broken.nc: expected") as refused:
        read_posterior(broken)
    del refused
    gc.collect()
