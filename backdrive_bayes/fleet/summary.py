"""What a fleet looks like: counts, control charts, drift, batches and its worst units, as the object of fleet.json."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np
from scipy.stats import kruskal

from backdrive_bayes.decisions.loops import measured_loops
from backdrive_bayes.fleet.drift import FALSE_ALARM, FEWEST, find_drift
from backdrive_bayes.fleet.store import DONE, UNITS, hashes
from backdrive_bayes.fleet.table import rows_of
from backdrive_bayes.fleet.units import FleetUnit
from backdrive_bayes.indicators.same_loop import most_alike, same_amplitude
from backdrive_bayes.number_text import probability_text
from backdrive_bayes.results import FLEET

INDICATORS = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")
SIGMAS = 3.0
"""Half-width of the control limits; of a normal process one unit in 370 lies outside."""
MEAN_RANGE = 2.0 / np.sqrt(np.pi)
"""Mean of a moving range of two in standard deviations of a normal process (d₂)."""
LARGEST_RANGE = 1.0 + SIGMAS * np.sqrt(2.0 - MEAN_RANGE**2) / MEAN_RANGE
"""The upper limit of a moving range in its means (D₄): so many of its own standard deviations above."""
MOST_WORST = 20
ORDERS = ("test_date", "serial", "unit")
_NEEDED = (
    *("unit", "name", "status", "error", "converged", "forced", "data_sha256", "rated_torque_Nm", "serial", "batch", "test_date"),
    *("verdict", "conformance_probability", "limiting", "answer", "loading_rate_Nm_per_s", "amplitude_Nm"),
    *(f"{name}{end}" for name in INDICATORS for end in ("", "_lo", "_hi")),
)
FEWEST_IN_BATCH = 3


def collect(out: Path, units: list[FleetUnit]) -> list[tuple[str, str, list[dict]]]:
    """Name, key and table rows of every unit that has a result, with no more columns than the summary needs."""
    found = ((unit, rows_of(out, unit)) for unit in units)
    return [(unit.name, unit.key, [{k: row.get(k) for k in _NEEDED} for row in rows]) for unit, rows in found if rows]


def summarise(units: list[tuple[str, str, list[dict]]], order: str | None = None) -> dict:
    """The object of fleet.json, from what :func:`collect` gives.

    ``order`` is "test_date", "serial" or "unit" (the path); None takes the first of them that every unit has.
    """
    firsts = [rows[0] for _, _, rows in units]
    done = [(name, rows) for name, _, rows in units if rows[0]["status"] == DONE]
    order = order or next(key for key in ORDERS if all(rows[0].get(key) for _, rows in done))
    charted, loop = _charted(done)
    charted.sort(key=lambda row: _natural(str(row.get(order) or ""), row["unit"]))
    charts = [_chart(name, charted) for name in INDICATORS] if charted else []
    return {
        "schema": FLEET,
        "counts": _counts(firsts),
        "data_sha256": [digest for first in firsts for digest in hashes(first)],
        "verdicts": _shares(rows[0].get("verdict") for _, rows in done),
        "effects": _shares(rows[0].get("answer") for _, rows in done),
        "failures": [{"unit": f["unit"], "status": f["status"], "error": f["error"]} for f in firsts if f["status"] != DONE],
        "same_names": _same_names(done),
        "order": order,
        "loop": loop,
        "charted": [{"unit": row["unit"], "batch": batch_of(row), "order": str(row.get(order) or "")} for row in charted],
        "false_alarm": FALSE_ALARM,
        "sigmas": SIGMAS,
        "charts": charts,
        "batches": _batches(charted),
        "worst": _worst(done, charted, charts, {name: key for name, key, _ in units}),
    }


def _counts(firsts):
    status = Counter(first["status"] for first in firsts)
    done = [first for first in firsts if first["status"] == DONE]
    return {
        "units": len(firsts), "done": status[DONE], "failed": status["failed"], "set_aside": status["set_aside"],
        "converged": sum(first["converged"] for first in done), "forced": sum(first["forced"] for first in done),
    }  # fmt: skip


def _shares(answers):
    return dict(Counter(answer for answer in answers if answer).most_common())


def _same_names(done):
    found = defaultdict(list)
    for unit, rows in done:
        found[rows[0]["name"]].append(unit)
    return {name: where for name, where in sorted(found.items()) if len(where) > 1}


def _charted(done):
    """One row a unit of the loop that most units share, at the rated torque that most have, and what loop that is."""
    usable = [(unit, rows) for unit, rows in done if rows[0]["converged"] and not rows[0]["forced"]]
    if not usable:
        return [], None
    # That of a bare record file is the largest torque that was read.
    rated = most_alike([rows[0]["rated_torque_Nm"] for _, rows in usable])
    rows = [r for _, own in usable for r in own if same_amplitude(own[0]["rated_torque_Nm"], rated)]
    loops = measured_loops([r["loading_rate_Nm_per_s"] for r in rows], [r["amplitude_Nm"] for r in rows])
    shared = max(loops, key=lambda x: (len({rows[i]["unit"] for i in x.records}), x.amplitude, -x.rate))
    chosen = {}
    for i in shared.records:
        chosen.setdefault(rows[i]["unit"], rows[i])
    kept = [r for r in chosen.values() if all(r.get(name) is not None for name in INDICATORS)]
    about = {
        "rated_torque_Nm": rated, "loading_rate_Nm_per_s": shared.rate, "amplitude_Nm": shared.amplitude,
        "units": len(kept), "left_out": len(done) - len(kept),
    }  # fmt: skip
    return kept, about


def _chart(name, charted):
    values = np.array([row[name] for row in charted])
    sigma = _sigma(values) if values.size >= FEWEST else 0.0  # 0: no limits
    drift = find_drift(values, FALSE_ALARM / len(INDICATORS))
    # Where the level changed, each side has its own: else a shift would put all units outside.
    parts = np.split(values, [drift.first] if drift and drift.first else [])
    centre = np.concatenate([np.full(part.size, np.median(part)) for part in parts])
    outside = np.flatnonzero(np.abs(values - centre) > SIGMAS * sigma) if sigma > 0 else []
    return {
        "indicator": name,
        "median": values.tolist(),
        "lo": [row[f"{name}_lo"] for row in charted],
        "hi": [row[f"{name}_hi"] for row in charted],
        "centre": centre.tolist(),
        "sigma": sigma,
        "outside": [charted[i]["unit"] for i in outside],
        "drift": drift and {
            "path": drift.path.tolist(), "limit": drift.limit, "probability": drift.probability,
            "false_alarm": drift.false_alarm, "alarm": drift.first is not None,
            "first": None if drift.first is None else charted[drift.first]["unit"],
        },
    }  # fmt: skip


def _sigma(values):
    """From the moving ranges, those beyond their own limit left out (Nelson, Journal of Quality Technology 14 (1982) 172)."""
    ranges = np.abs(np.diff(values))
    return float(ranges[ranges <= LARGEST_RANGE * ranges.mean()].mean() / MEAN_RANGE)


def batch_of(row):
    """What the unit file names, else the folder that the unit lies in; empty where it lies in none."""
    return str(row.get("batch") or row["unit"].rpartition("/")[0])


def _batches(charted):
    """Units and spread of each indicator by batch, and the probability of such differences by chance (Kruskal and Wallis)."""
    groups = defaultdict(list)
    for row in charted:
        groups[batch_of(row)].append(row)
    if len(groups) < 2:
        return None
    rows, tests = [], {}
    for batch, members in groups.items():
        quantiles = {n: np.quantile([m[n] for m in members], [0.5, 0.25, 0.75]).tolist() for n in INDICATORS}
        parts = {n: dict(zip(("median", "quarter", "three_quarters"), q, strict=True)) for n, q in quantiles.items()}
        rows.append({"batch": batch, "units": len(members), "indicators": parts})
    for name in INDICATORS:
        sample = [[m[name] for m in members] for members in groups.values() if len(members) >= FEWEST_IN_BATCH]
        tests[name] = float(kruskal(*sample).pvalue) if len(sample) > 1 else None
    return {"rows": rows, "probability": tests}


def _worst(done, charted, charts, keys):
    """Units by conformance where they were judged, else by how far outside of the charts they lie."""
    found = []
    for unit, rows in done:
        p = rows[0].get("conformance_probability")
        if p is not None and rows[0]["verdict"] != "accepted":
            why = f"{rows[0]['verdict']}, conforms with probability {probability_text(p)} ({rows[0]['limiting']})"
            found.append((p - 1e3, unit, why))
    judged = {unit for _, unit, _ in found}
    for i, row in enumerate(charted):
        far = [(abs(c["median"][i] - c["centre"][i]) / c["sigma"], c["indicator"]) for c in charts if c["sigma"] > 0]
        away, name = max(far, default=(0.0, ""))
        if away > SIGMAS and row["unit"] not in judged:
            found.append((-away, row["unit"], f"{name} lies {away:.1f} sigma from the centre"))
    return [{"unit": unit, "why": why, "result": f"{UNITS}/{keys[unit]}.json"} for _, unit, why in sorted(found)[:MOST_WORST]]


def _natural(text, then):
    """Sorts no. 10 behind no. 9."""
    return [(part.isdigit(), int(part) if part.isdigit() else 0, part) for part in re.split(r"(\d+)", text)], then
