"""Blind check of `diagnose --simulated`: pairs of a simulator and a reality, effects and parameters withheld until scoring.

    python studies/simulated_pairs.py run [--pairs 60] [--workers 1] [--out reports/simulated]
    python studies/simulated_pairs.py score [--out reports/simulated]

Three simulators stand against each reality:

0. the reality's own mechanics with shifted parameters and no effect, noise-free;
1. the mechanics of another bench, noise-free, on the same or on other torque paths;
2. the same mechanics, shifted and noisy, with the reality's effect itself; or the reality itself where it is clean, noise-free.

``run`` goes on where it was stopped and writes answers and key apart. Beside some pairs a swapped simulator is diagnosed in the
first one's place, and its truth is said to be the first one's: the score must find these.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.stats import binom
from simulated_truth import draw_reality, draw_simulator

from backdrive_bayes.errors import BadInput
from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.gap.examine import LEVEL
from backdrive_bayes.gap.shrink import SMALLEST_GAP, closed_fraction
from backdrive_bayes.gap.simulated import compared
from backdrive_bayes.gap.simulator import read_simulator

SEED, VARIANTS = 2611, 3
KINDS = ("own mechanics, shifted", "other mechanics", "the effect itself, or the reality")
SWAPPED = (3, 9, 15)
"""Realities whose first simulator is diagnosed once more with the records of one whose angles are a fifth larger."""
SWAP = 1.2
COVERED = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")
"""Indicators, which a result gives in simulator and unit."""
RISK = 0.01
"""Probability at which a check would fail though all is well."""


def answers_of(found: dict, seconds: float) -> dict:
    """What is kept of a diagnosis."""
    simulator, indicators = found["simulator"], found["shrink"]["indicators"]
    rows = {p["name"]: {"simulated": p["simulated_interval"], "measured": p["measured"], "change": p["change"]}
            for p in simulator["parameters"]}  # fmt: skip
    rows |= {name: {"simulated": indicators[name]["before"], "measured": indicators[name]["after"]} for name in COVERED}
    kept = ("told", "effects", "closed_by_retuning", "closed_by_effect", "left", "closed_by_both", "rms_rad", "same_path")
    return {
        "answer": found["answer"],
        "inconclusive": found["inconclusive"],
        "converged": bool(found["convergence"]["converged"] and simulator["convergence"]["converged"]),
        "which": [r for r in found["which"] if r["probability"] > 1e-3],
        "simulator": {key: simulator[key] for key in kept},
        "parameters": rows,
        "processor_s": round(seconds, 1),
    }


def run(args) -> None:
    """Diagnose pairs that have no answer yet, one reality after the other in each process."""
    args.out.mkdir(parents=True, exist_ok=True)
    answers, key = (_read(args.out / name) for name in ("answers.json", "key.json"))
    wanted = {number: _jobs(number) for number in range(-(-args.pairs // VARIANTS))}
    left = [number for number, jobs in wanted.items() if not all(job in answers and job in key for job in jobs)]
    with ProcessPoolExecutor(args.workers) as pool:
        for done in as_completed([pool.submit(diagnose_pairs, args.seed, number) for number in left]):
            found, truths = done.result()
            answers, key = answers | found, key | truths
            _write(args.out / "key.json", key)
            _write(args.out / "answers.json", answers)
            print(*found, "done", flush=True)


def _jobs(number: int) -> list[str]:
    return [f"{number}-{variant}" for variant in range(VARIANTS)] + ([f"{number}-swapped"] if number in SWAPPED else [])


def diagnose_pairs(seed: int, number: int) -> tuple[dict, dict]:
    """Answers and truths of the pairs of one reality, by job."""
    answers, key = {}, {}
    reality = draw_reality(np.random.default_rng([seed, number]), number)
    found = diagnose(reality.unit, seed=number)
    for job in _jobs(number):
        swapped, began = job.endswith("swapped"), time.process_time()
        variant = 0 if swapped else int(job[-1])
        simulator = draw_simulator(np.random.default_rng([seed, number, variant]), reality, variant, number)
        unit = _larger(simulator.unit) if swapped else simulator.unit
        key[job] = {
            "bench": reality.bench, "kind": KINDS[variant],
            "reality": list(reality.effects), "simulator": list(simulator.effects),
            "measured": reality.parameters(), "simulated": simulator.parameters,
            "gap_rad": simulator.gap_rad, "remainder_rad": simulator.remainder_rad,
        }  # fmt: skip
        try:
            fitted = read_simulator(unit, found.weighed.linear.reduced, number)
            answers[job] = answers_of(compared(found, fitted, number, 0.03).json, time.process_time() - began)
        except (BadInput, FloatingPointError, ValueError, np.linalg.LinAlgError) as error:
            answers[job] = {"error": repr(error)[:300]}
    return answers, key


def _larger(unit):
    return replace(unit, records=tuple(replace(r, angle_rad=SWAP * r.angle_rad) for r in unit.records))


def _read(path):
    return json.loads(path.read_text()) if path.exists() else {}


def _write(path, table):
    """Write pairs in the order of their numbers."""
    ordered = {job: table[job] for job in sorted(table, key=lambda job: (int(job.split("-")[0]), job))}
    path.write_text(json.dumps(ordered, indent=0, default=float))


def pair_scores(row: dict, truth: dict) -> dict:
    """Scores of one pair: name, intervals that hold the truth by what they are of, closed fractions beside the oracle."""
    lacks = [e for e in truth["reality"] if e not in truth["simulator"]]
    right = "+".join(sorted(lacks)) or "none"
    named = "+".join(sorted(row["answer"]["effects"])) or "none"
    sets = ["+".join(sorted(label.split("+"))) for label in row["answer"]["credible_set_90"]]
    which = {"+".join(sorted(r["effect"].split("+"))): r["probability"] for r in row["which"]}
    held = [_held(own, truth["simulated"].get(name), truth["measured"].get(name)) for name, own in row["parameters"].items()]
    kinds = {k: [h[k] for h in held if h.get(k) is not None] for k in ("simulated", "measured", "change")}
    floor = row["simulator"]["rms_rad"]["noise_floor"]
    gap = truth["gap_rad"] is None or np.hypot(truth["gap_rad"], floor) > (1.0 + SMALLEST_GAP) * floor
    return {
        "lacks": right, "named": "inconclusive" if row["inconclusive"] else named, "in set": right in sets,
        "log score": float(np.log(max(which.get(right, 0.0), 1e-3))),
        "told rightly": bool(gap) == row["simulator"]["told"], **kinds, **_oracle(row, truth),
    }  # fmt: skip


def _held(own, simulated, measured) -> dict:
    """Whether the intervals of a quantity in simulator and unit, and of its change, hold the truth."""

    def inside(interval, value):
        return bool(interval["lo"] <= value <= interval["hi"])

    found = {}
    if own["simulated"] and simulated is not None:
        found["simulated"] = inside(own["simulated"], simulated)
    if own["measured"] and measured is not None:
        found["measured"] = inside(own["measured"], measured)
    if own.get("change") and simulated is not None and measured is not None:
        found["change"] = inside(own["change"], measured - simulated)
    return found


def _oracle(row, truth) -> dict:
    """Closed fraction by re-tuning, what the benches know of it, and that of both, of which all could be closed."""
    simulator = row["simulator"]
    if not simulator["told"] or truth["gap_rad"] is None:
        return {}
    floor = simulator["rms_rad"]["noise_floor"] ** 2
    best = float(closed_fraction(truth["gap_rad"] ** 2 + floor, truth["remainder_rad"] ** 2 + floor, floor))
    return {"retuning": simulator["closed_by_retuning"]["median"], "oracle": best, "both": simulator["closed_by_both"]["median"]}


def score(args) -> None:
    """Open the key and write README.md."""
    answers, key = (_read(args.out / name) for name in ("answers.json", "key.json"))
    failed = [job for job, row in answers.items() if "error" in row]
    rows = {job: pair_scores(row, key[job]) | {"kind": key[job]["kind"], "bench": key[job]["bench"]}
            for job, row in answers.items() if job not in failed}  # fmt: skip
    true = {job: row for job, row in rows.items() if not job.endswith("swapped")}
    swapped = [row for job, row in rows.items() if job.endswith("swapped")]
    benches = dict.fromkeys(row["bench"] for row in true.values())
    groups = {"all": list(true.values())}
    groups |= {kind: [r for r in true.values() if r["kind"] == kind] for kind in KINDS}
    groups |= {f"bench {bench}": [r for r in true.values() if r["bench"] == bench] for bench in benches}
    groups["effect missing"] = [r for r in true.values() if r["lacks"] != "none"]
    groups["nothing missing"] = [r for r in true.values() if r["lacks"] == "none"]
    groups["swapped"] = swapped
    lines = [HEAD, f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    lines += [_line(name, group) for name, group in groups.items() if group]
    lines += ["", f"Diagnosed: {len(true)} of {args.pairs} pairs. Failed: {len(failed)} {failed}.", ""]
    lines += [planted_fault(true.values(), swapped), ""]
    (args.out / "README.md").write_text("\n".join(lines))
    print("\n".join(lines))


def planted_fault(true, swapped) -> str:
    """Whether swapped simulators are found: their intervals must hold the withheld truth less often than those of true pairs."""
    good, bad = ([h for row in group for h in row["simulated"]] for group in (list(true), swapped))
    if not bad:
        return "No swapped simulators yet."
    rate = float(np.mean(good))
    chance = float(binom.cdf(sum(bad), len(bad), rate))
    found = "found" if chance < RISK else "NOT FOUND"
    return (
        f"Planted fault: {len(swapped)} swapped simulators: {sum(bad)} of {len(bad)} intervals hold the truth of the simulator "
        f"in whose place they stand, of true pairs {rate:.2f}; probability {chance:.1e}: {found}."
    )


def _line(name, group) -> str:
    def mean(values):
        return f"{np.mean(values):.2f}" if len(values) else "–"

    told = [r for r in group if "oracle" in r]
    error = f"{np.sqrt(np.mean([(r['retuning'] - r['oracle']) ** 2 for r in told])):.2f}" if told else "–"
    cells = [
        str(len(group)), mean([r["named"] == r["lacks"] for r in group]), mean([r["named"] == "inconclusive" for r in group]),
        mean([r["in set"] for r in group]), mean([r["log score"] for r in group]), mean([r["told rightly"] for r in group]),
        *(mean([h for r in group for h in r[k]]) for k in ("simulated", "measured", "change")),
        error, f"{np.median([r['both'] for r in told]):.2f}" if told else "–",
    ]  # fmt: skip
    return f"| {name} | " + " | ".join(cells) + " |"


COLUMNS = (
    "pairs", "number", "named rightly", "inconclusive", "right in the 90 % set", "log score", "gap told rightly",
    "intervals of the simulator", "of the unit", "of the change", "re-tuning, rms off the oracle", "closed by both, median",
)  # fmt: skip
HEAD = f"""# Simulators set against reality

    python studies/simulated_pairs.py run && python studies/simulated_pairs.py score

Pairs of a simulator and a reality; which effect acts and how parameters were shifted was withheld until scoring (`key.json`).
Per pair: whether what the simulator lacks was named (`none` where nothing is missing); whether a gap was told where there is
one; the share of {LEVEL:.0%} intervals that hold the truth (parameters as far as the mechanics have them, and indicators); the
rms difference of the share that re-tuning closes from the benches' own (the true gap, and what no parameter of the reality's
mechanics closes, parameters known exactly); and the held-out fraction that re-tuning and the named effect close (all could be).
"""


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    for name, verb in (("run", run), ("score", score)):
        one = verbs.add_parser(name)
        one.add_argument("--pairs", type=int, default=60)
        one.add_argument("--seed", type=int, default=SEED)
        one.add_argument("--workers", type=int, default=1)
        one.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "reports" / "simulated")
        one.set_defaults(run=verb)
    args = parser.parse_args()
    args.run(args)


if __name__ == "__main__":
    main()
