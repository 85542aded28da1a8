"""The tutorial's commands on two measured cycloidal units: what they print, and the figures that the tutorial shows.

    python studies/measured_tutorial.py --data ../shared/data/cycloidal --out reports/measured

Data: github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0; read from where they are, not copied
into the project.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

LOW, HIGH = "conic-preload-1", "conic-preload-4"
CLAIMS = Path(__file__).resolve().parents[1] / "examples" / "preload_claims.toml"
STEPS = {
    "check": f"backdrive-bayes check {LOW} -o out/low",
    "fit-low": f"backdrive-bayes fit {LOW} -o out/low --seed 1 --load 20",
    "fit-high": f"backdrive-bayes fit {HIGH} -o out/high --seed 1",
    "diagnose": f"backdrive-bayes diagnose {LOW} -o out/low-diagnosis --seed 1",
    "compare": "backdrive-bayes compare out/low out/high --claims preload_claims.toml -o out/comparison",
    "report": "backdrive-bayes report out/low out/high out/comparison -o out/preload.pdf",
}
"""Name of the transcript and the command, in the order of the tutorial."""
FIGURES = {"loops": "out/low/figures/loop-3.png", "comparison": "out/comparison/figures/comparison-loops.png"}
PROGRESS = re.compile(r"(\d+ min )?\d+ s, +\d+%")
"""Lines that tell the time are left out: they differ from run to run."""
CREDIT = (
    "Credit: measurements by the authors of github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator (`Code/test_data`), "
    "CC BY-SA 4.0; fitted curves added. The figures here are under the same licence.\n"
)


def transcript(command: str, folder: Path) -> str:
    """The command as typed and what it prints, run in ``folder``; the exit code where it is not 0."""
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg", "COLUMNS": "110", "NO_COLOR": "1"}
    words = [sys.executable, "-m", "backdrive_bayes", *shlex.split(command)[1:]]
    done = subprocess.run(words, cwd=folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    lines = [line.rstrip() for line in done.stdout.splitlines() if not PROGRESS.match(line)]
    return "\n".join([f"$ {command}", *lines, *([f"(exit code {done.returncode})"] if done.returncode else [])]) + "\n"


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data/cycloidal"))
    parser.add_argument("--out", type=Path, default=Path("reports/measured"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        for unit in (LOW, HIGH):
            shutil.copytree(options.data / unit, room / unit)
        shutil.copy(CLAIMS, room)
        for step, command in STEPS.items():
            text = transcript(command, room)
            print(text, flush=True)
            (options.out / f"{step}.txt").write_text(text, encoding="utf-8")
        for figure, path in FIGURES.items():
            shutil.copy(room / path, options.out / f"{figure}.png")
    title = "# Measured units\n\nWhat the tutorial's commands print, made by `studies/measured_tutorial.py` for "
    (options.out / "README.md").write_text(f"{title}`{LOW}` and `{HIGH}`.\n\n{CREDIT}", encoding="utf-8")


if __name__ == "__main__":
    main()
