"""Small units for fleets and work that takes milliseconds: numbers read off the loop, and ways to die while doing it."""

import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from conftest import answer, ramps, write_csv

from backdrive_bayes.records.unit_folder import read_unit

INDICATORS = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")


def make_unit(folder, *, clearance=0.02, seed=0, name=None, **about):
    """A unit folder of one record of a quarter of a second of work."""
    folder.mkdir(parents=True)
    time_s, torque = ramps(noise=0.002, hertz=100.0)
    angle = answer(torque, clearance=clearance) * 10800 / np.pi
    write_csv(folder / "a.csv", time_s, torque, angle + 0.1 * np.random.default_rng(seed).normal(size=len(time_s)))
    lines = [f'{key} = "{value}"' for key, value in about.items()]
    (folder / "unit.toml").write_text(
        "\n".join(
            ['schema = "backdrive-bayes/unit/1"', f'name = "{name or folder.name}"', "rated_torque_Nm = 1.0", *lines,
             "", "[[record]]", 'file = "a.csv"', ""]
        )
    )  # fmt: skip
    return folder


def make_fleet(folder, units=6, **options):
    """A folder of units that differ, named u-1, u-2, …"""
    for i in range(1, units + 1):
        make_unit(folder / f"u-{i}", clearance=0.02 + 0.001 * i, seed=i, serial=f"S{i}", **options)
    return folder


def row(name, value=1.0, **more):
    """A row of the table as the verb writes it, with the columns that a summary reads."""
    interval = {f"{n}{end}": value * factor for n in INDICATORS for end, factor in (("", 1.0), ("_lo", 0.98), ("_hi", 1.02))}
    return {
        "name": name, "serial": None, "batch": None, "test_date": None, "rated_torque_Nm": 1.0, "forced": False,
        "converged": True, "data_sha256": "0" * 64, "verdict": None, "conformance_probability": None, "limiting": None,
        "answer": None, "file": "a.csv", "loading_rate_Nm_per_s": 1.0, "amplitude_Nm": 1.0, **interval, **more,
    }  # fmt: skip


@dataclass(frozen=True)
class Read:
    """Work that reads a unit and takes its numbers off the samples; ``scale`` is an option that they depend on."""

    scale: float = 1.0
    seconds: float = 0.0

    def __call__(self, path: Path, folder: Path | None):
        unit = read_unit(path)
        time.sleep(self.seconds)
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "posterior.nc").write_bytes(b"draws")
        about = {key: unit.identity.get(key) for key in ("serial", "batch", "test_date")}
        size = {r.name: self.scale * float(np.ptp(r.angle_rad)) for r in unit.records}
        return [row(unit.name, size[r.name], file=r.name, data_sha256=",".join(unit.data_sha256), **about) for r in unit.records]


@dataclass(frozen=True)
class Dies:
    """The same, but the units called ``names`` take their worker down, each as often as ``times`` says."""

    marks: Path
    names: tuple[str, ...]
    times: int = 1000

    def __call__(self, path: Path, folder: Path | None):
        mark = self.marks / f"{path.name}.deaths"
        deaths = mark.stat().st_size if mark.exists() else 0
        if path.name in self.names and deaths < self.times:
            with mark.open("a") as file:
                file.write("x")
            os.kill(os.getpid(), signal.SIGKILL)
        return Read()(path, folder)
