"""MATLAB files of level 5, read by lengths that are checked; and of level 4."""

import struct

import numpy as np
import pytest
from scipy.io import savemat

from backdrive_bayes.records.readers import limits
from backdrive_bayes.records.readers.mat5 import is_level_5, leaves

CONTENT = {
    "t": np.arange(5.0),
    "short": np.arange(3, dtype=np.int16)[:, None],
    "run": {"m": np.linspace(0, 1, 7), "deep": {"a": np.arange(4, dtype=np.float32), "text": "bench"}},
    "word": "text",
    "complex": np.array([1j, 2.0]),
}


def written(tmp_path, **options):
    savemat(tmp_path / "a.mat", CONTENT, **options)
    return (tmp_path / "a.mat").read_bytes()


@pytest.mark.parametrize("packed", [False, True])
def test_numbers_and_fields_of_structures_are_found(tmp_path, packed):
    data = written(tmp_path, do_compression=packed)
    assert is_level_5(data[:128])
    found = {leaf.name: leaf for leaf in leaves(data)}
    assert sorted(found) == ["run.deep.a", "run.m", "short", "t"]
    np.testing.assert_array_equal(found["t"].values, CONTENT["t"])
    np.testing.assert_array_equal(found["short"].values, [0, 1, 2])
    np.testing.assert_array_equal(found["run.deep.a"].values, np.arange(4))
    assert found["short"].shape == (3, 1)


def test_every_cut_is_an_error_or_a_shorter_list(tmp_path):
    data = written(tmp_path)
    for stop in range(128, len(data), 7):
        try:
            assert len(leaves(data[:stop])) <= 4
        except ValueError:
            pass


def test_every_flipped_byte_is_an_error_or_a_reading(tmp_path):
    data = written(tmp_path)
    for at in range(128, len(data)):
        for bit in (0x01, 0x80):
            spoilt = bytearray(data)
            spoilt[at] ^= bit
            try:
                [leaf.values for leaf in leaves(bytes(spoilt))]
            except ValueError:
                pass


def test_a_bomb_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(limits, "FREE_INFLATED_BYTES", 1000)
    monkeypatch.setattr(limits, "MAX_INFLATION", 2)
    savemat(tmp_path / "a.mat", {"x": np.zeros(100_000)}, do_compression=True)
    with pytest.raises(ValueError, match="far larger"):
        leaves((tmp_path / "a.mat").read_bytes())


def test_big_endian_files_are_read():
    values = struct.pack(">3d", 1, 2, 3)
    parts = struct.pack(">IIII", 6, 8, 6, 0) + struct.pack(">IIii", 5, 8, 1, 3) + struct.pack(">HH4s", 1, 1, b"x\0\0\0")
    matrix = parts + struct.pack(">II", 9, 24) + values
    data = b" " * 124 + b"\x01\x00MI" + struct.pack(">II", 14, len(matrix)) + matrix
    (leaf,) = leaves(data)
    assert (leaf.name, leaf.shape) == ("x", (1, 3))
    np.testing.assert_array_equal(leaf.values, [1, 2, 3])


def test_level_4_is_still_read(tmp_path):
    from conftest import answer, ramps

    from backdrive_bayes.records.unit_folder import read_unit

    time, torque = ramps()
    columns = {"time_s": time, "torque_Nm": torque, "angle_deg": np.degrees(answer(torque))}
    savemat(tmp_path / "a.mat", columns, format="4")
    assert read_unit(tmp_path / "a.mat").records[0].torque_nm == pytest.approx(torque)
