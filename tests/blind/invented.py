"""Keys and answers made up for the tests of scoring, and diagnosers that fresh processes can import."""

import os
import sys

import numpy as np

from backdrive_bayes.blind.answers import Answer
from backdrive_bayes.blind.request import LISTED

LABELS = ("none", *LISTED, "unknown")
EDGES = [0.0, 1.0, 2.0]


def entry(number, label, severity=1.0, limited=False, where=True):
    """A unit of the key whose gap lies evenly on the upper half of load+ and unload+ of one record."""
    none, share = label == "none", {"load+": [0.0, 0.5], "unload+": [0.0, 0.5], "load-": [0.0, 0.0], "unload-": [0.0, 0.0]}
    name = "mains_hum" if label == "unknown" else label
    truth = [{"record": "a", "edges_Nm": EDGES, "share": share}] if where and not none else None
    return {
        "unit": f"unit-{number:04d}",
        "label": label,
        "effects": [] if none else label.split("+"),
        "planted": [] if none else [{"name": name, "severity": severity}],
        "severity": None if none else severity,
        "height": 0.0 if none else 10.0 * severity,
        "limited": limited,
        "where": {"remainder": truth, "effect": truth},
    }


def make_key(labels, severity=1.0):
    return {"units": [entry(k, label, severity) for k, label in enumerate(labels, 1)]}


def cell(share, low=1.0, high=2.0, branch="load+", record="a"):
    return {"record": record, "branch": branch, "torque_lo_Nm": low, "torque_hi_Nm": high, "share": share}


def says(label, p=0.9, credible=None, closed=0.9, gap=None, cells=()):
    """An answer that gives ``label`` the probability ``p`` and spreads the rest evenly."""
    others = [name for name in LABELS if name != label]
    probabilities = {label: p} | dict.fromkeys(others, (1 - p) / len(others))
    gap = float(label != "none") if gap is None else gap
    return Answer(label, None, probabilities, tuple(credible or [label]), gap, tuple(cells), closed)


def replies(key, answer):
    return {e["unit"]: answer(e) for e in key["units"]}


def many_labels(rng, count):
    return [str(name) for name in rng.choice(LABELS, count)]


def honest(rng, label, p):
    """An answer that is sure to the degree ``p`` and right so often."""
    return says(label if rng.random() < p else str(rng.choice([n for n in LABELS if n != label])), p)


def diagnosis(label="none", note=""):
    """An object of diagnosis.json."""
    effects = [] if label == "none" else [label]
    return {
        "gap": {"probability": 0.2},
        "where": {"summary": note, "map": []},
        "which": [{"effect": label, "probability": 0.7}, *({"effect": n, "probability": 0.3 / 11} for n in LABELS if n != label)],
        "answer": {"effects": effects, "credible_set_90": [label, "unknown"]},
        "shrink": {"closed_fraction": {"median": 0.5, "lo": 0.4, "hi": 0.6}},
    }


def look_around(folder, allowed):
    """A diagnoser that reports every file near the unit that is none of a unit's, and its own command line."""
    out = folder.parents[1]
    files = [str(p.relative_to(out)) for p in out.rglob("*") if p.is_file() and p.name != "unit.toml" and ".csv" not in p.name]
    return diagnosis(note=" ".join([f for f in files if not f.startswith("answers/")] + sys.argv[1:]))


def stumble(folder, allowed):
    """A diagnoser that raises on one unit, dies on another, and names what an oracle allows."""
    if folder.name == "unit-0002":
        raise ValueError("two\nlines")
    if folder.name == "unit-0003" and allowed is None:
        os._exit(1)
    return diagnosis(allowed[0] if allowed and len(allowed) == 1 else "none")


def never(folder, allowed):
    raise AssertionError("an answer was there already")


RNG = np.random.default_rng
