"""Diagnose a folder of units, each by itself, and write the answers and one table.

    python studies/sealed.py ../shared/blind/units --out reports/blind/sealed-1

Nothing is tuned on such units; the table says how often they were run.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from backdrive_bayes.commands.output import write_json
from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.records.unit_folder import read_unit

NOTE = "Probabilities of an inconclusive unit are those at the fit that the search had found when it ended."


def answer(job) -> dict:
    """Diagnosis of one unit folder; residual curves are left out of the file to keep it small."""
    warnings.simplefilter("ignore")
    folder, out = job
    began = time.perf_counter()
    result = diagnose(read_unit(folder)).json
    result.pop("residual")
    target = out / folder.name
    target.mkdir(parents=True, exist_ok=True)
    write_json(target / "diagnosis.json", result)
    return result | {"folder": folder.name, "took_s": time.perf_counter() - began}


def row(result) -> str:
    """One line of the table."""
    top = ", ".join(f"{w['effect']} {w['probability']:.2f}" for w in result["which"][:3])
    closed = result["shrink"]["closed_fraction"]
    share = f"{closed['median']:.2f}" if closed else "–"
    named = "inconclusive" if result["inconclusive"] else " + ".join(result["answer"]["effects"]) or "none"
    return f"| {result['folder']} | {named} | {top} | {share} | {result['took_s']:.0f} |"


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, default=Path("reports/blind/sealed-1"))
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--run", type=int, default=1, help="how often these units have been diagnosed, this time included")
    options = parser.parse_args()
    jobs = [(p.parent, options.out) for p in sorted(options.folder.glob("*/unit.toml"))]
    rows = []
    with ProcessPoolExecutor(options.workers) as pool:
        for result in pool.map(answer, jobs):
            rows.append(row(result))
            print(rows[-1], flush=True)
    head = ["# Answers", "", f"Run number {options.run} on these units; labels unknown, nothing tuned on them.", NOTE, ""]
    head += ["| unit | answer | most probable | closed fraction | s |", "|---|---|---|---|---|"]
    (options.out / "README.md").write_text("\n".join(head + rows) + "\n", encoding="utf-8")
    (options.out / "run.json").write_text(json.dumps({"run": options.run, "units": len(rows)}))


if __name__ == "__main__":
    main()
