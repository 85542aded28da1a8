"""Recordings made for other purposes, written by hand in their public formats: what `check` and `fit` make of each.

Each must end in a refusal, in a warning, or in the right loop area; the area of what was written is known.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

WITHIN = 0.05
"""Share of the true area by which a fitted one may be wrong where its interval does not hold it."""
OPEN, SHUT = ("right", "warned"), ("refused",)
HEAD = """# Recordings made for other purposes

    python studies/foreign_recordings.py --out reports/foreign

The formats follow their public descriptions and were written by hand; the physics is a sum of play operators and a spring with
noise, or what the recording's purpose brings. "Right" means that the 90 % interval of the loop area holds the true area or that
the median is within 5 % of it.

"""


@dataclasses.dataclass(frozen=True)
class Recording:
    """``write`` fills a folder and returns the path to give and the true loop area [J], None where there is none."""

    name: str
    form: str
    write: Callable[[Path], tuple[Path, float | None]]
    wanted: tuple[str, ...]


def recordings() -> list[Recording]:
    """All of them; ``wanted`` are the ends that are sensible."""
    return [
        Recording("steering on-centre test, 0.2 Hz sine", "MDF4, signals with units", _steering, OPEN),
        Recording("torsional friction damper", "testing machine's CSV: preamble, German names, units row", _damper, OPEN),
        Recording("torsion of a rubber bush, three cycles", "TDMS waveforms without a time channel", _bush, OPEN),
        Recording("axial friction damper, N and mm", "testing machine's CSV", _axial, SHUT),
        Recording("robot joint, point-to-point moves", "PlotJuggler's CSV of joint states", _joint, SHUT),
        Recording("servo axis, trace of the drive", "scope export: tabs, a clock a channel, torque in 0.1 %", _servo, SHUT),
        Recording("bolt tightened once, torque over angle", "spreadsheet", _bolt, SHUT),
    ]


def loop(torque, stiffness, plays, noise, seed):
    """Angle [rad] of a spring and plays [(threshold N·m, compliance rad/(N·m))], and the area [J] of its last whole cycle."""
    angle = torque / stiffness
    for threshold, compliance in plays:
        position, path = 0.0, np.empty_like(torque)
        for i, level in enumerate(torque):
            position = min(max(position, level - threshold), level + threshold)
            path[i] = position
        angle = angle + compliance * path
    rng = np.random.default_rng(seed)
    largest = float(np.abs(torque).max())
    area = sum(4.0 * compliance * threshold * (largest - threshold) for threshold, compliance in plays)
    return angle + noise * rng.standard_normal(torque.size), area


def _ramps(peak, period_s, cycles, hertz):
    time = np.arange(0.0, (cycles + 0.25) * period_s, 1.0 / hertz)
    phase = time / period_s
    return time, peak * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * phase))


def _steering(folder):
    import asammdf

    time = np.arange(0.0, 16.0, 0.01)
    torque = 3.0 * np.sin(2.0 * np.pi * 0.2 * time)
    angle, area = loop(torque, 9.0, [(0.6, 0.05), (1.2, 0.04)], 4e-4, 1)
    signals = [
        asammdf.Signal(torque + 0.004 * np.random.default_rng(2).standard_normal(time.size), time, name="torque", unit="Nm"),
        asammdf.Signal(np.degrees(angle), time, name="angle", unit="deg"),
    ]
    path = folder / "steering.mf4"
    with asammdf.MDF(version="4.10") as file:
        file.append(signals)
        file.save(path, overwrite=True)
    return path, area


def _damper(folder):
    time, torque = _ramps(800.0, 20.0, 2, 50.0)
    angle, area = loop(torque, 2.0e4, [(250.0, 4e-4), (400.0, 2e-4)], 5e-5, 3)
    rows = zip(time, torque, np.degrees(angle), strict=True)
    text = ";".join(("Zeit", "Drehmoment", "Winkel")) + "\ns;Nm;deg\n"
    text += "\n".join(";".join(f"{v:.5f}".replace(".", ",") for v in row) for row in rows)
    path = folder / "daempfer.csv"
    path.write_text(f"Prüfprotokoll 17\nPrüfer;AB\nProbe;D-3\n\n{text}\n", encoding="utf-8")
    return path, area


def _bush(folder):
    import nptdms

    time, torque = _ramps(12.0, 8.0, 3, 100.0)
    angle, area = loop(torque, 60.0, [(2.0, 4e-3), (5.0, 5e-3)], 2e-4, 5)
    wave = {"wf_increment": 0.01, "wf_start_offset": 0.0}
    path = folder / "bush.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([
            nptdms.ChannelObject("Torsion", "Torque", torque, wave | {"unit_string": "Nm"}),
            nptdms.ChannelObject("Torsion", "Angle", np.degrees(angle), wave | {"unit_string": "deg"}),
        ])  # fmt: skip
    del time
    return path, area


def _axial(folder):
    time, force = _ramps(10.0, 10.0, 2, 50.0)
    travel, _ = loop(force, 4.0, [(3.0, 0.2)], 1e-3, 7)
    rows = "\n".join(f"{t:.3f},{x:.5f},{f:.5f}" for t, x, f in zip(time, travel, force, strict=True))
    path = folder / "axial.csv"
    path.write_text(f'"Time","Axial Displacement","Axial Force"\n"(s)","(mm)","(kN)"\n{rows}\n')
    return path, None


def _joint(folder):
    rng = np.random.default_rng(9)
    time = np.arange(0.0, 20.0, 0.008)
    goal = np.repeat(rng.uniform(-1.5, 1.5, 10), time.size // 10)
    position = np.convolve(goal, np.hanning(60) / np.hanning(60).sum(), "same")
    speed = np.gradient(position, 0.008)
    effort = 4.0 * np.gradient(speed, 0.008) + 2.0 * np.sign(speed) + 6.0 * np.cos(position)
    rows = "\n".join(f"{1.6e9 + t:.4f},{p:.6f},{e:.4f}" for t, p, e in zip(time, position, effort, strict=True))
    path = folder / "joint_states.csv"
    path.write_text(f"__time,/joint_states/joint_1/position,/joint_states/joint_1/effort\n{rows}\n")
    names = ("__time [s]", "/joint_states/joint_1/effort [Nm]", "/joint_states/joint_1/position [rad]")
    columns = '[record.columns]\ntime = "{}"\ntorque = "{}"\nangle = "{}"\n'.format(*names)
    unit = 'schema = "backdrive-bayes/unit/1"\nname = "joint"\nrated_torque_Nm = 28.0\n[[record]]\nfile = "joint_states.csv"\n'
    (folder / "unit.toml").write_text(unit + columns)
    return folder, None


def _servo(folder):
    time = np.arange(0.0, 8.0, 0.002)
    torque = 120.0 * np.sin(2 * np.pi * 0.5 * time)
    position = 1000.0 * time + 3.0 * np.sin(2 * np.pi * 0.5 * time)
    rows = "\n".join(f"{1e3 * t:.1f}\t{p:.3f}\t{1e3 * t:.1f}\t{m:.0f}" for t, p, m in zip(time, position, torque, strict=True))
    head = "Name\tAxis 1\nSymbolComment\tActPos\t\tActTorque\nTime [ms]\tActPos\tTime [ms]\tActTorque"
    path = folder / "scope.csv"
    path.write_text(f"{head}\n{rows}\n")
    return path, None


def _bolt(folder):
    import openpyxl

    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["time [s]", "torque [Nm]", "angle [deg]"])
    for t in np.linspace(0.0, 6.0, 600):
        sheet.append([float(t), float(40.0 * max(t - 1.0, 0.0) / 5.0 + 0.5), float(60.0 * t)])
    path = folder / "bolt.xlsx"
    book.save(path)
    return path, None


def judged(recording: Recording, folder: Path) -> dict:
    """Run `check` and `fit` and say how it ended."""
    folder.mkdir()
    given, area = recording.write(folder)
    out = folder / "out"
    check, fit = (_run(verb, given, out) for verb in ("check", "fit"))
    row = {"name": recording.name, "form": recording.form, "check": check.returncode, "fit": fit.returncode, "area": area}
    warnings = [line for line in fit.stdout.split("\n") if line.startswith("warning:")]
    if fit.returncode == 2:
        end, said = "refused", fit.stderr.strip().split("\n")[-1].removeprefix("backdrive-bayes: ")
    else:
        found = json.loads((out / "indicators.json").read_text())
        interval = found["records"][0]["indicators"]["loop_area_J"]
        right = interval["lo"] <= area <= interval["hi"] or abs(interval["median"] / area - 1.0) < WITHIN
        end = "right" if right and not fit.returncode else "warned" if warnings or fit.returncode == 4 else "WRONG"
        said = f"∮ {interval['median']:.4g} J [{interval['lo']:.4g}, {interval['hi']:.4g}], true {area:.4g} J"
        said += "".join(f"; {line}" for line in [*warnings, *([found["outcome"]["reason"]] if fit.returncode else [])])
    return row | {"end": end, "said": said.replace(str(folder), "…"), "sensible": end in recording.wanted}


def _run(verb, given, out):
    more = ["--no-figures"] if verb == "fit" else []
    command = [sys.executable, "-m", "backdrive_bayes", verb, str(given), "-o", str(out), *more]
    return subprocess.run(command, capture_output=True, text=True)


def main():
    """Judge all and write README.md; exit code 1 where one ends in nothing sensible."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, help="folder for README.md (default: none is written)")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as room:
        for number, recording in enumerate(recordings()):
            rows.append(judged(recording, Path(room) / f"recording-{number}"))
            print({k: rows[-1][k] for k in ("name", "check", "fit", "end", "said")}, flush=True)
    lines = ["| recording | format | check | fit | end | said |", "|---|---|--:|--:|---|---|"]
    for row in rows:
        said = row["said"].replace("|", "\\|").replace("[[", "\\[\\[")
        end = row["end"] if row["sensible"] else f"**{row['end']}**"
        lines.append(f"| {row['name']} | {row['form']} | {row['check']} | {row['fit']} | {end} | {said[:400]} |")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "README.md").write_text(HEAD + "\n".join(lines) + "\n", encoding="utf-8")
    raise SystemExit(not all(row["sensible"] for row in rows))


if __name__ == "__main__":
    main()
