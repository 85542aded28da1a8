"""One sound record written in every readable format, and text files that verbs read: what the hostile inputs are made of."""

from __future__ import annotations

import gzip
import lzma
from pathlib import Path

import numpy as np

UNIT = """schema = "backdrive-bayes/unit/1"
name = "u"
rated_torque_Nm = 1.0
reduction_ratio = 64
serial = "7"

[[record]]
file = "{file}"
loading_rate_Nm_per_s = 1.0
amplitude_Nm = 1.0
"""
LIMITS = """[lost_motion_rad]
max = 0.0029
[[loop_area_J]]
at = {loading_rate_Nm_per_s = 0.05}
max = 4.0e-4
process = {mean = 3e-4, sd = 1e-5}
[risk]
consumer = 0.05
producer = 0.10
"""
CLAIMS = """schema = "backdrive-bayes/claims/1"

[[claim]]
text = "A turns less than B at every rate"
holds = "A.peak_angle_rad < B.peak_angle_rad"
every = "rate"

[[claim]]
text = "The lost motion of A is below 34 arcmin, whatever the rate"
holds = "largest(A.lost_motion_rad) < 34*arcmin + 2*A.loop_area_J(rate=0.05)"
along = "rate"
"""
TEMPLATE = """schema = "backdrive-bayes/template/1"
company = "Example Drives Ltd"
address = ["Test laboratory, hall 4"]
footer = "TR-0815"
[colours]
headings = "#0b3c5d"
[fields]
Customer = "Robotics & Sons"
Calibrated = 2024-03-01
"""


def loop(samples_per_ramp: int = 250, seed: int = 0, noise: float = 3e-5):
    """Time [s], torque [N·m] and angle [rad] of a play operator in parallel with a spring, 0 → 1 → −1 → 1 N·m."""
    generator = np.random.default_rng(seed)
    time = np.linspace(0.0, 5.0, 5 * samples_per_ramp + 1)
    torque = np.interp(time, [0, 1, 3, 5], [0, 1, -1, 1])
    position, angle = 0.0, np.empty_like(torque)
    for k, level in enumerate(torque):
        position = min(max(position, level - 0.3), level + 0.3)
        angle[k] = 0.01 * level + 0.01 * position
    size = len(time)
    return time, torque + 0.002 * generator.normal(size=size), angle + noise * generator.normal(size=size)


def table(time, torque, angle, names="time_s,torque_Nm,angle_deg", separator=",", decimal=".") -> str:
    """The record as text."""
    values = zip(time, torque, np.degrees(angle), strict=True)
    rows = (separator.join(f"{v:.7f}".replace(".", decimal) for v in row) for row in values)
    return "\n".join([names, *rows]) + "\n"


def write(path: Path, time, torque, angle) -> Path:
    """The record in the format that the path's ending names."""
    degrees, name = np.degrees(angle), path.name
    columns = {"time_s": time, "torque_Nm": torque, "angle_deg": degrees}
    if ".csv" in name:
        german = name.startswith("german")
        names = "Prüfstand 3\nZeit;Drehmoment;Winkel\ns;Nm;deg" if german else "time_s,torque_Nm,angle_deg"
        text = table(time, torque, angle, names, *((";", ",") if german else (",", "."))).encode()
        pack = gzip.compress if name.endswith(".gz") else lzma.compress if name.endswith(".xz") else bytes
        path.write_bytes(pack(text))
    else:
        {".xlsx": _excel, ".parquet": _parquet, ".tdms": _tdms, ".mf4": _mdf, ".mat": _mat}[path.suffix](path, columns)
    return path


def _excel(path, columns):
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("bench")
    sheet.append(list(columns))
    for row in zip(*columns.values(), strict=True):
        sheet.append([float(v) for v in row])
    book.save(path)


def _parquet(path, columns):
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(columns), path)


def _tdms(path, columns):
    import nptdms

    units = {"torque_Nm": ("M", "Nm"), "angle_deg": ("phi", "deg")}
    wave = {"wf_increment": float(columns["time_s"][1]), "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        channels = [nptdms.ChannelObject("g", n, columns[k], wave | {"unit_string": u}) for k, (n, u) in units.items()]
        writer.write_segment(channels)


def _mdf(path, columns):
    import asammdf

    units = {"torque_Nm": "Nm", "angle_deg": "deg"}
    signals = [asammdf.Signal(columns[k], columns["time_s"], name=k, unit=u) for k, u in units.items()]
    with asammdf.MDF(version="4.10") as file:
        file.append(signals)
        file.save(path, overwrite=True)


def _mat(path, columns):
    if path.name.startswith("hdf5"):
        import h5py

        with h5py.File(path, "w", userblock_size=512) as file:
            for name, values in columns.items():
                file[f"run/{name}"] = values[None, :]
    else:
        from scipy.io import savemat

        content = {"run": columns} if path.name.startswith("struct") else columns
        savemat(path, content, do_compression=path.name.startswith("packed"))


FORMATS = (
    "plain.csv", "german.csv", "a.csv.gz", "a.csv.xz", "a.xlsx", "a.parquet", "a.tdms", "a.mf4",
    "plain.mat", "packed.mat", "struct.mat", "hdf5.mat",
)  # fmt: skip
TEXTS = {"unit.toml": UNIT, "limits.toml": LIMITS, "claims.toml": CLAIMS, "template.toml": TEMPLATE}
