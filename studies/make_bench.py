"""Labelled units of a virtual bench: OUT/case-XX/ as unit folders, and OUT/key.json with the truth about each.

    python studies/make_bench.py OUT --bench contact --units 60 --seed 1 --workers 2
    python studies/make_bench.py OUT --bench ode --units 30 --clean
    python studies/make_bench.py OUT --bench ode --units 30 --unlisted

Of the units 30 % are clean, 40 % have one listed effect, 15 % an unlisted one (named x_… in the key) and 15 % a pair of listed
ones, at severities 1, 0.4 and 0.2 dealt evenly. Three in five are run at the default plan, the others at plans drawn at random.
With --clean none has an effect, with --unlisted each has an unlisted one at the least severity. The same arguments give the same
bytes.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.benches import BENCHES, DEFAULT_BENCH, find_bench
from backdrive_bayes.bench.plan import DEFAULT_PLAN, random_plan
from backdrive_bayes.bench.registry import MEMBERS, NONE
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.bench.writing import plain, write_unit

SEVERITIES = (1.0, 0.4, 0.2)
SHARES = {NONE: 0.30, "single": 0.40, "unlisted": 0.15, "pair": 0.15}
DEFAULT_PLAN_SHARE = 0.6
INDICATORS = {
    "lost_motion_rad": "lost_motion_rad",
    "zero_torque_width_rad": "backlash_rad",
    "loop_area_J": "area_J",
    "absorbed_J": "absorbed_J",
    "dissipation_ratio": "dissipation_ratio",
    "peak_angle_rad": "peak_rad",
}
THIRDS = 3


def deal(mechanics, units, rng, clean=False, unlisted=False) -> list[dict[str, float]]:
    """Effects and severities of every unit, in random order; names within a kind of unit come up evenly."""
    if clean:
        return [{} for _ in range(units)]
    if unlisted:
        return [dict.fromkeys(own, SEVERITIES[-1]) for own in _hand([(n,) for n in mechanics.unlisted], units, rng)]
    listed = [name for name in mechanics.effects if name not in MEMBERS]
    pairs = [{a, b} for i, a in enumerate(listed) for b in listed[i + 1 :]]
    hands = {NONE: [()], "single": [(n,) for n in listed], "unlisted": [(n,) for n in mechanics.unlisted]}
    hands["pair"] = [tuple(sorted(pair)) for pair in pairs]
    counts = {kind: int(share * units) for kind, share in SHARES.items()}
    counts[NONE] += units - sum(counts.values())
    dealt = [effects for kind, count in counts.items() for effects in _hand(hands[kind], count, rng)]
    return [dealt[i] for i in rng.permutation(units)]


def _hand(names, count, rng):
    severities = SEVERITIES if names != [()] else (0.0,)
    drawn = []
    while len(drawn) < count:
        order = [names[i] for i in rng.permutation(len(names))]
        start = int(rng.integers(len(severities)))
        drawn += [dict.fromkeys(own, severities[(start + i) % len(severities)]) for i, own in enumerate(order)]
    return drawn[:count]


def make(job) -> tuple[str, dict, float]:
    """Write one unit; its name, its entry of the key, and the seconds it took."""
    out, bench, seed, index, name, effects = job
    began, rng = time.perf_counter(), np.random.default_rng([seed, list(BENCHES).index(bench), index])
    plan = DEFAULT_PLAN if rng.random() < DEFAULT_PLAN_SHARE else random_plan(rng)
    unit = draw_unit(rng, effects, bench=bench, plan=plan, name=name)
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    write_unit(unit, folder)
    return name, entry(unit, plan), time.perf_counter() - began


def entry(bench, plan) -> dict:
    """What the key holds of a unit, in SI units."""
    truth, records = bench.truth, list(zip(bench.unit.records, bench.truth.records, strict=True))
    by_amplitude = sorted(records, key=lambda pair: pair[0].amplitude_nm)
    held, planted = truth.held, [p for p in truth.planted if p.answer in truth.answer]
    return rounded(
        {
            "effects": [p.name if p.name == p.answer else f"x_{p.name}" for p in planted],
            "size": max((p.severity for p in planted), default=1),
            "heights": [p.height for p in planted],
            "limited": any(p.limited for p in planted),
            "kind": truth.kind,
            "bench": truth.bench,
            "tr": bench.unit.rated_torque_nm,
            "rms_over_noise": float(np.sqrt(np.mean(truth.remainder**2))),
            "seen": max((p.height for p in truth.planted), default=0),
            "where": where(truth.remainder, plan) if truth.planted else None,
            "indicators": {f"{r.loading_rate_nm_per_s:g}": named(t.indicators) for r, t in by_amplitude},
            "clean_indicators": {f"{r.loading_rate_nm_per_s:g}": named(t.clean_indicators) for r, t in by_amplitude},
            "records": [
                {
                    "file": r.name,
                    "rate": r.loading_rate_nm_per_s,
                    "amplitude": r.amplitude_nm,
                    "indicators": named(t.indicators),
                    "clean_indicators": named(t.clean_indicators),
                }
                for r, t in records
            ],
            "traces": {t.name: t.height for t in truth.traces},
            "held": {
                "rate": held.rate_nm_per_s,
                "time": held.time_s,
                "torque": held.torque_nm,
                "angle": held.angle_rad,
                "angle_without": held.without_rad,
            },
        }
    )


def named(indicators) -> dict[str, float]:
    """Indicators under the key's names."""
    return {ours: indicators[theirs] for theirs, ours in INDICATORS.items()}


def where(remainder, plan) -> list | None:
    """Shares of the remainder's square: a record, a quarter of a cycle, a third of it along time."""
    energy = []
    for row, loop in zip(remainder**2, plan.loops, strict=True):
        quarters = 4 * loop.cycles + 1
        parts = np.array_split(row, quarters * THIRDS)
        energy.append(np.array([part.sum() for part in parts]).reshape(quarters, THIRDS))
    total = sum(e.sum() for e in energy)
    return [(e / total).tolist() for e in energy] if total > 0 else None


def rounded(value):
    """Plain data with eight significant digits."""
    if isinstance(value, dict):
        return {k: rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [rounded(v) for v in plain(value)]
    return float(f"{value:.8g}") if isinstance(value, float) else value


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--bench", default=DEFAULT_BENCH, choices=list(BENCHES))
    parser.add_argument("--units", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--clean", action="store_true", help="no effect in any unit")
    parser.add_argument("--unlisted", action="store_true", help="an unlisted effect of severity 0.2 in every unit")
    args = parser.parse_args(argv)
    dealt = deal(find_bench(args.bench), args.units, np.random.default_rng([args.seed, 7]), args.clean, args.unlisted)
    width, key = max(2, len(str(args.units))), {}
    jobs = [(args.out, args.bench, args.seed, i, f"case-{i + 1:0{width}d}", e) for i, e in enumerate(dealt)]
    args.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(args.workers) as pool:
        for name, own, seconds in pool.map(make, jobs):
            key[name] = own
            print(name, own["kind"], "+".join(own["effects"]) or NONE, own["size"], f"{own['seen']:.1f}", f"{seconds:.1f} s")
    (args.out / "key.json").write_text(json.dumps(key, allow_nan=False) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
