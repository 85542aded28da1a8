"""Kill verbs at random moments and run them again: nothing half-written, no litter, the same result as undisturbed."""

from __future__ import annotations

import argparse
import dataclasses
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from hostile_formats import loop, write

UNDISTURBED = ("run.json",)
"""Files that may differ between runs: seconds and the machine."""
SIGNALS = {signal.SIGKILL: -9, signal.SIGINT: 130, signal.SIGTERM: 143}
HEAD = """# Kills

    python studies/hostile_kills.py --kills {kills} --seed {seed} --out reports/kills

Every verb is started and killed at a random moment of the time that it needs undisturbed, again and again into one folder, and at
last left alone. A round fails where a signal leaves a result file that is not whole, where Ctrl-C or SIGTERM say more than one
line or end with another code than 130 and 143, where the last run does not end with the code and the bytes of the undisturbed
one (run.json apart), or where a `.part` file is left. "Late" are signals that came after the end, beside the others;
what Python itself says to a signal before the package's first line runs, within the {boot:.1f} s that `--version` takes, is not
counted.

"""


@dataclasses.dataclass
class Verb:
    """A command into ``out``, the code and the files of the undisturbed run, and its seconds."""

    name: str
    arguments: list[str]
    code: int = 0
    files: dict[str, bytes] = dataclasses.field(default_factory=dict)
    seconds: float = 0.0


def main():
    """Kill every verb and write README.md; exit code 1 where a round fails."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=12, metavar="N", help="signals a verb (default 12)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="folder for README.md (default: none is written)")
    options = parser.parse_args()
    # A shell that runs this in the background has it ignore Ctrl-C, and so would every verb.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    rng, rows = np.random.default_rng(options.seed), []
    with tempfile.TemporaryDirectory(prefix="kills-") as room:
        boot = max(_boot_seconds() for _ in range(3))
        for verb in _verbs(Path(room)):
            rows.append(_round(verb, Path(room), options.kills, rng, boot))
            print(rows[-1], flush=True)
    lines = ["| verb | undisturbed | SIGKILL | SIGINT | SIGTERM | late | faults |", "|---|--:|--:|--:|--:|--:|---|"]
    for row in rows:
        sent = " | ".join(str(row[number]) for number in SIGNALS)
        faults = "; ".join(row["faults"]) or "none"
        lines.append(f"| {row['verb']} | {row['seconds']:.1f} s | {sent} | {row['late']} | {faults} |")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        head = HEAD.format(kills=options.kills, seed=options.seed, boot=boot)
        (options.out / "README.md").write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    raise SystemExit(any(row["faults"] for row in rows))


def _verbs(room: Path):
    write(room / "unit.csv", *loop(120))
    (room / "limits.toml").write_text("[loop_area_J]\nmax = 1.0\n")
    (room / "history.csv").write_text("time_s,torque_Nm\n" + "\n".join(f"{i},{0.4 * np.sin(i / 500):.6f}" for i in range(20000)))
    unit = str(room / "unit.csv")
    yield Verb("check", ["check", unit])
    yield Verb("fit", ["fit", unit])
    yield Verb("diagnose", ["diagnose", unit, "--no-figures"])
    yield Verb("accept", ["accept", unit, "--limits", str(room / "limits.toml"), "--no-figures"])
    yield Verb("predict", ["predict", str(room / "fit-still" / "posterior.nc"), str(room / "history.csv")])
    yield Verb("report", ["report", str(room / "fit-still")])


def _boot_seconds() -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", "backdrive_bayes", "--version"], stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def _round(verb: Verb, room: Path, kills: int, rng, boot: float) -> dict:
    still = room / f"{verb.name}-still"
    began = time.perf_counter()
    verb.code = _start(verb, still, room).wait()
    verb.seconds = time.perf_counter() - began
    verb.files = _files(still)
    row: dict = {"verb": verb.name, "seconds": verb.seconds, "late": 0, "faults": []} | dict.fromkeys(SIGNALS, 0)
    out = room / f"{verb.name}-killed"
    for _ in range(3 * kills):
        sent = sum(row[number] for number in SIGNALS)
        if sent == kills:
            break
        number = list(SIGNALS)[sent % len(SIGNALS)]
        process = _start(verb, out, room)
        after = float(rng.uniform(0.0, verb.seconds))
        time.sleep(after)
        late = process.poll() is not None
        if not late:
            process.send_signal(number)
        said, code = process.communicate()[1], process.returncode
        row["late" if late or code == verb.code else number] += 1
        unheard = number == signal.SIGKILL or late or code == verb.code or after < boot
        row["faults"] += _half(out, verb) + ([] if unheard else _faults(number, code, said))
    code = _start(verb, out, room).wait()
    found = _files(out)
    row["faults"] += [f"code {code} in the end"] if code != verb.code else []
    row["faults"] += [f"{name} differs" for name in sorted({*found, *verb.files}) if found.get(name) != verb.files.get(name)]
    row["faults"] += [f"litter {path.name}" for path in room.rglob("*.part")]
    return row


def _start(verb: Verb, out: Path, room: Path) -> subprocess.Popen:
    command = [sys.executable, "-m", "backdrive_bayes", *verb.arguments, "-o", str(out)]
    return subprocess.Popen(command, cwd=room, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def _faults(number, code: int, said: str) -> list[str]:
    """What a signal must not cause once the package runs."""
    name, lines = signal.Signals(number).name, [line for line in said.split("\n") if line.startswith("backdrive-bayes:")]
    faults = [f"{name}: a traceback"] if "Traceback" in said else []
    faults += [f"{name}: {len(lines)} lines"] if len(lines) > 1 else []
    return faults + ([f"{name}: code {code}"] if code != SIGNALS[number] else [])


def _half(out: Path, verb: Verb) -> list[str]:
    """Files that are there but not whole."""
    return [f"{name} half-written" for name, data in _files(out).items() if verb.files.get(name) != data]


def _files(out: Path) -> dict[str, bytes]:
    files = (p for p in sorted(out.rglob("*")) if p.is_file() and p.name not in UNDISTURBED and ".part" not in p.name)
    return {str(p.relative_to(out)): p.read_bytes() for p in files}


if __name__ == "__main__":
    main()
