"""Build the wheel, install it with the lowest and the newest dependencies under several Pythons, and test what is installed."""

from __future__ import annotations

import argparse
import json
import platform
import re
import shutil
import subprocess
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.13")
EXTRAS = ("figures", "report", "readers", "mdf")
TESTERS = ("pytest", "hypothesis", "pypdf")
SUBSET = (
    "tests/records/test_foreign_files.py", "tests/records/test_unit_folder.py", "tests/records/test_mat5.py", "tests/schemas",
    "tests/decisions/test_evidence.py", "tests/decisions/test_comparison.py", "tests/decisions/test_claims.py",
    "tests/report/test_report.py", "tests/report/test_company_template.py", "tests/engine/test_posterior_file.py",
    "tests/commands/test_bad_input.py", "tests/commands/test_decision_verbs.py", "tests/commands/test_fit_loads.py",
    "tests/commands/test_screen.py",
)  # fmt: skip
SHOWN = ("numpy", "scipy", "emcee", "arviz-stats", "xarray", "h5py", "numba", "pandas", "msgspec", "rich", "pyarrow")
ROW = "row.json"
HEAD = """# Versions

    python studies/versions.py --out reports/versions

The wheel, built from the sources and installed into new environments with the extras {extras}; the tests run beside it in a
folder without the sources. "Lowest" holds every dependency that pyproject.toml names at its lowest release series, "newest" takes
what is offered. A subset of the tests: {subset}. The last column is `check`, `fit` and `report` of a packaged unit, and
the demo, by the installed command in an empty folder.

"""


def main():
    """Run all environments and write README.md; exit code 1 where one fails."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for README.md (default: none is written)")
    parser.add_argument("--only", choices=("lowest", "newest"), help="one kind of environment; --room may hold the other")
    parser.add_argument("--room", type=Path, help="folder to work in (default: a temporary one)")
    options = parser.parse_args()
    room = (options.room or Path(tempfile.mkdtemp(prefix="versions-"))).resolve()
    room.mkdir(exist_ok=True)
    wheel = _build(room)
    kinds = [("lowest", PYTHONS[0]), *(("newest", python) for python in PYTHONS)]
    for kind, python in kinds:
        if options.only in (None, kind):
            row = _environment(room, wheel, kind, python)
            (room / f"{kind}-{python}" / ROW).write_text(json.dumps(row))
    rows = [json.loads(path.read_text()) for path in sorted(room.glob(f"*/{ROW}"))]
    if options.out:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "README.md").write_text(_readme(rows, wheel), encoding="utf-8")
    raise SystemExit(not all(row["passed"] for row in rows))


def lowest() -> list[str]:
    """Constraints that hold every named dependency at its lowest release series."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [*project["dependencies"], *(r for extra in EXTRAS for r in project["optional-dependencies"][extra])]
    bounds = dict(requirement.split(">=") for requirement in named)
    return [f"{name}=={bound}{('.0.*', '.*', '')[bound.count('.')]}" for name, bound in bounds.items()]


def _build(room: Path) -> Path:
    shutil.rmtree(room / "wheel", ignore_errors=True)
    source = room / "source"
    shutil.rmtree(source, ignore_errors=True)
    ignored = shutil.ignore_patterns("__pycache__", "*.nbc", "*.nbi")
    shutil.copytree(ROOT / "backdrive_bayes", source / "backdrive_bayes", ignore=ignored)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    _run([_python(PYTHONS[0]), "-m", "pip", "wheel", "-q", "--no-deps", "-w", room / "wheel", source], room)
    return next((room / "wheel").glob("*.whl"))


def _environment(room: Path, wheel: Path, kind: str, python: str) -> dict:
    """Install, test and try one environment."""
    folder = room / f"{kind}-{python}"
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("tests", "examples", "data", "studies"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    _run([_python(python), "-m", "venv", folder / "env"], folder)
    own = folder / "env" / "bin" / "python"
    constraints = folder / "constraints.txt"
    constraints.write_text("\n".join(lowest() if kind == "lowest" else []))
    wanted = [f"{wheel}[{','.join(EXTRAS)}]", *TESTERS]
    _run([own, "-m", "pip", "install", "-q", "--disable-pip-version-check", "-c", constraints, *wanted], folder)
    listed = _run([own, "-m", "pip", "list", "--format=freeze", "--disable-pip-version-check"], folder).stdout
    versions = dict(line.split("==") for line in listed.split() if "==" in line)
    began = time.perf_counter()
    tests = _run([own, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "default", *SUBSET], folder, check=False)
    summary = tests.stdout.strip().split("\n")[-1]
    print(kind, python, summary, flush=True)
    if tests.returncode:
        print(tests.stdout[-6000:], tests.stderr[-2000:], flush=True)
    tried = _try(folder)
    passed = not tests.returncode and not any(tried.values())
    counts = ", ".join(re.findall(r"\d+ (?:passed|failed|skipped|errors?)", summary))
    return {"kind": kind, "python": _run([own, "-V"], folder).stdout.split()[1], "versions": versions, "tests": counts,
            "seconds": time.perf_counter() - began, "tried": tried, "passed": passed}  # fmt: skip


def _try(folder: Path) -> dict[str, int]:
    """Exit codes of the installed command by verb, called in an empty folder."""
    empty, command = folder / "empty", folder / "env" / "bin" / "backdrive-bayes"
    empty.mkdir()
    unit = folder / "data" / "reducer-1"
    calls: dict[str, list] = {"check": [unit, "-o", "out"], "fit": [unit, "-o", "out"], "report": ["out"], "demo": ["-o", "demo"]}
    return {verb: _run([command, verb, *arguments], empty, check=False).returncode for verb, arguments in calls.items()}


def _python(version: str) -> str:
    """An interpreter of that version: on the path, or among those of pyenv."""
    found = shutil.which(f"python{version}")
    known = sorted((Path.home() / ".pyenv" / "versions").glob(f"{version}.*/bin/python"))
    if known:
        return str(known[-1])
    if not found:
        raise SystemExit(f"no Python {version} found")
    return found


def _run(arguments, folder, check=True):
    done = subprocess.run([str(a) for a in arguments], cwd=folder, capture_output=True, text=True)
    if check and done.returncode:
        raise SystemExit(f"{' '.join(map(str, arguments))}: {done.stderr[-3000:]}")
    return done


def _readme(rows: list[dict], wheel: Path) -> str:
    head = HEAD.format(extras=", ".join(EXTRAS), subset=", ".join(f"`{name}`" for name in SUBSET))
    lines = ["| dependencies | Python | tests | seconds | installed command | |", "|---|---|---|--:|---|---|"]
    for row in rows:
        tried = ", ".join(f"{verb} {code}" for verb, code in row["tried"].items())
        verdict = "pass" if row["passed"] else "**FAIL**"
        lines.append(f"| {row['kind']} | {row['python']} | {row['tests']} | {row['seconds']:.0f} | {tried} | {verdict} |")
    names = " | ".join(f"{row['kind']}, {row['python']}" for row in rows)
    lines += ["", f"| package | {names} |", "|---|" + "---|" * len(rows)]
    lines += [f"| {name} | {' | '.join(r['versions'].get(name, '–') for r in rows)} |" for name in SHOWN]
    return head + "\n".join([*lines, "", f"{wheel.name}, {platform.platform(terse=True)}."]) + "\n"


if __name__ == "__main__":
    main()
