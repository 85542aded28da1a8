"""Hostile and foreign inputs against the command line: a corpus with known answers, and mutated files without one.

    python studies/hostile_inputs.py --fuzz 2000 --out reports/hostile

Every case runs in a process of its own. It fails where the exit code or the words are not those expected, where a traceback
shows, where an error is not one line on standard error, where more than 1 GB or 10 s are used, or where litter stays behind.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import contextlib
import dataclasses
import importlib
import io
import resource
import shutil
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
from hostile_corpus import corpus
from hostile_formats import FORMATS, TEXTS, loop, write
from hostile_fuzz import mutated
from hostile_report import readme

RESULTS = ("posterior.nc", "indicators.json")
"""Files that verbs write and read again."""
MOST_SECONDS, MOST_BYTES = 10.0, 1_000_000_000
LONGEST_LINE = 4000
PRELOADED = (
    "backdrive_bayes.records.check", "backdrive_bayes.records.unit_folder", "backdrive_bayes.decisions.acceptance", "pandas",
    "nptdms", "openpyxl", "scipy.io", "h5py", "asammdf", "backdrive_bayes.commands.accept", "backdrive_bayes.decisions.claims",
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What one run of the command line did."""

    code: int
    out: str
    err: str
    seconds: float
    peak_bytes: int
    litter: tuple[str, ...]

    def faults(self) -> list[str]:
        """What no input may cause."""
        lines = self.err.count("\n")
        wrong = {
            "traceback": "Traceback" in self.err or "Traceback" in self.out,
            f"exit code {self.code}": self.code not in (0, 2),
            "no line on standard error": self.code == 2 and lines == 0,
            "something on standard error": self.code == 0 and lines > 0,
            f"{lines} lines on standard error": self.code == 2 and lines > 1,
            "a line that nobody reads to its end": len(self.err) > LONGEST_LINE,
            f"{self.seconds:.1f} s": self.seconds > MOST_SECONDS,
            f"{self.peak_bytes / 1e6:.0f} MB": self.peak_bytes > MOST_BYTES,
            f"litter {self.litter}": bool(self.litter),
        }
        return [what for what, is_so in wrong.items() if is_so]


def run(arguments: list[str], folder: Path) -> Outcome:
    """Run one command in a child process with bounds on time and memory, its output in files."""
    began, out, err = time.perf_counter(), folder / "stdout", folder / "stderr"
    child = os.fork()
    if child == 0:
        _be_child(arguments, folder, out, err)
    _, status, usage = os.wait4(child, 0)
    code = os.waitstatus_to_exitcode(status)
    litter = tuple(p.name for p in folder.rglob("*.part"))
    said, complaints = (path.read_text(errors="replace") if path.exists() else "" for path in (out, err))
    return Outcome(code, said, complaints, time.perf_counter() - began, usage.ru_maxrss * 1024, litter)


def _be_child(arguments, folder, out, err):
    code = 99
    try:
        os.chdir(folder)
        for number, path in ((1, out), (2, err)):
            os.dup2(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        mapped = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (mapped + 2 * MOST_BYTES, mapped + 2 * MOST_BYTES))
        signal.alarm(int(3 * MOST_SECONDS))
        from backdrive_bayes.commands.main import main

        code = main(arguments)
    except BaseException:
        import traceback

        os.write(2, traceback.format_exc().encode())
    finally:
        os._exit(code)


def run_corpus(room: Path, note) -> list[dict]:
    """Every case of the corpus with its outcome."""
    rows = []
    for number, case in enumerate(corpus()):
        folder = _clean(room / f"case-{number}")
        arguments = in_child(case.make, folder)
        arguments += [] if "-o" in arguments or arguments[0] == "report" else ["-o", str(folder / "out")]
        outcome = run(arguments, folder)
        said = outcome.out + outcome.err
        faults = outcome.faults()
        faults += [f"exit code {outcome.code}"] if case.code not in (None, outcome.code) else []
        faults += [f"not said: {word}" for word in case.words if word not in said]
        rows.append(_row(case.name, outcome, faults, {"expected": case.code}, *case.words[:1]))
        note(f"{'pass' if not faults else 'FAIL'}  {case.name}: {outcome.code}  {'; '.join(faults)}")
        shutil.rmtree(folder)
    return rows


def run_fuzz(room: Path, count: int, seed: int, note) -> list[dict]:
    """``count`` mutated inputs, the formats and text files in turn; input ``n`` depends on the seed and n alone."""
    sound = in_child(_sound, _clean(room / "sound"))
    names, rows = [*FORMATS, "history.csv", *TEXTS, *RESULTS], []
    for number in range(count):
        name = names[number % len(names)]
        folder = _clean(room / "fuzz")
        data = mutated(name, sound[name], np.random.default_rng([seed, number]))
        outcome = run(_arguments(name, data, folder, sound["posterior.nc"]), folder)
        faults = outcome.faults()
        rows.append(_row(f"{number} {name}", outcome, faults, {"format": name}))
        if faults:
            kept = room / f"fail-{number}-{name}"
            kept.write_bytes(data)
            note(f"FAIL  {number} {name}: {'; '.join(faults)}; kept in {kept}")
        if number % 200 == 199:
            note(f"{number + 1} mutated inputs, {sum(bool(row['faults']) for row in rows)} failed")
    return rows


def _sound(folder: Path) -> dict[str, bytes]:
    columns = loop(samples_per_ramp=120)
    found = {name: write(folder / name, *columns).read_bytes() for name in FORMATS}
    lines = (f"{i},{0.4 * np.sin(i / 30):.6f}" for i in range(200))
    found["history.csv"] = "\n".join(["time_s,torque_Nm", *lines, ""]).encode()
    from backdrive_bayes.commands.main import main

    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        main(["fit", str(folder / "plain.csv"), "-o", str(folder / "fit"), "--no-figures"])
    found |= {name: (folder / "fit" / name).read_bytes() for name in RESULTS}
    return found | {name: text.replace("{file}", "a.csv").encode() for name, text in TEXTS.items()}


def _arguments(name: str, data: bytes, folder: Path, posterior: bytes) -> list[str]:
    """A command that opens the input; a history is read after the ``posterior``, which must be sound."""
    (folder / name).write_bytes(data)
    out = ["-o", str(folder / "out")]
    if name == "limits.toml":
        return ["accept", str(folder / "none"), "--limits", str(folder / name), *out]
    if name == "claims.toml":
        return ["compare", str(folder / "none"), str(folder / "none"), "--claims", str(folder / name), *out]
    if name == "template.toml":
        return ["report", str(folder / "none"), "--template", str(folder), *out]
    if name == "history.csv":
        (folder / "sound.nc").write_bytes(posterior)
        return ["predict", str(folder / "sound.nc"), str(folder / name), *out]
    if name == "posterior.nc":
        (folder / "history.csv").write_text("time_s,torque_Nm\n0,0\n1,0.5\n2,0\n")
        return ["predict", str(folder / name), str(folder / "history.csv"), *out]
    if name == "indicators.json":
        return ["report", str(folder), *out]
    if name == "unit.toml":
        write(folder / "a.csv", *loop(samples_per_ramp=60))
        return ["check", str(folder), *out]
    return ["check", str(folder / name), *out]


def in_child(function, folder: Path):
    """What a function returns, computed in a process of its own, so that no library's threads start in this one."""
    import pickle

    answer = folder / ".answer"
    child = os.fork()
    if child == 0:
        code = 1
        try:
            answer.write_bytes(pickle.dumps(function(folder)))
            code = 0
        finally:
            os._exit(code)
    if os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]):
        raise RuntimeError(f"a case could not be made in {folder}")
    value = pickle.loads(answer.read_bytes())
    answer.unlink()
    return value


def _row(name, outcome, faults, more, wanted="") -> dict:
    lines = (outcome.err + outcome.out).strip().split("\n")
    line = next((line for line in lines if wanted in line), lines[0]).strip()[:300]
    return {"case": name, "code": outcome.code, "line": line, "seconds": outcome.seconds, "peak_MB": outcome.peak_bytes / 1e6,
            "faults": faults} | more  # fmt: skip


def _clean(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def main():
    """Run corpus and fuzz and write README.md; exit code 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--fuzz", type=int, default=0, metavar="N", help="also run N mutated inputs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="folder for README.md (default: none is written)")
    parser.add_argument("--room", type=Path, help="folder to work in; keeps the inputs that failed")
    options = parser.parse_args()
    for module in PRELOADED:
        importlib.import_module(module)
    room = _clean(options.room) if options.room else Path(tempfile.mkdtemp(prefix="hostile-"))
    note = lambda text: print(text, flush=True)  # noqa: E731
    cases = run_corpus(room, note)
    fuzz = run_fuzz(room, options.fuzz, options.seed, note)
    failed = sum(bool(row["faults"]) for row in [*cases, *fuzz])
    note(f"{len(cases)} cases and {len(fuzz)} mutated inputs: {failed} failed")
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "README.md").write_text(readme(cases, fuzz, options, str(room)), encoding="utf-8")
    if not failed:
        shutil.rmtree(room)
    raise SystemExit(min(failed, 1))


if __name__ == "__main__":
    main()
