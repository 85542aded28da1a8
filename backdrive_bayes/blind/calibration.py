"""Do probabilities mean what they say: calibration curves, calibration errors, log score."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.blind.intervals import mean_of, share

BINS = 10
FLOOR = 1e-6
"""Least probability that the log score takes a truth to have been given."""
NEGLIGIBLE = 0.01
"""Probabilities below are left out of the curve over all classes, which they would flatter by their number."""
SIMULATED = 2000


def calibration(forecasts: list[dict[str, float]], truths: list[str]) -> dict:
    """Calibration of the top probability and of all of them, and the log score, for one forecast a unit."""
    top = [max(f, key=f.__getitem__) for f in forecasts]
    entries = [
        (f[label], label == truth) for f, truth in zip(forecasts, truths, strict=True) for label in f if f[label] >= NEGLIGIBLE
    ]
    tops = [(f[t], t == truth) for f, t, truth in zip(forecasts, top, truths, strict=True)]
    return {
        "top": curve(*_columns(tops)),
        "all_classes": curve(*_columns(entries)),
        "log_score": log_score(forecasts, truths),
    }


def curve(probability, hit) -> dict:
    """Calibration of events, arrays (events,): bins of equal width, and the expected calibration error over them.

    The error of a finite number of events is never zero: ``error_if_calibrated`` says what it would be if every probability were
    right, as median and 95 % quantile of simulated events; ``too_far`` is True beyond that quantile.
    """
    probability, hit = np.asarray(probability, float), np.asarray(hit, float)
    if not probability.size:
        return {"of": 0, "expected_error": None, "mean_probability": None, "hit_rate": None, "too_far": None, "bins": []}
    place = np.minimum((probability * BINS).astype(int), BINS - 1)
    error = float(_errors(probability, hit[None], place)[0])
    fair = np.random.default_rng(0).random((SIMULATED, probability.size)) < probability
    null = np.quantile(_errors(probability, fair, place), [0.5, 0.95])
    return {
        "of": probability.size,
        "mean_probability": float(probability.mean()),
        "hit_rate": float(hit.mean()),
        "expected_error": error,
        "error_if_calibrated": {"median": float(null[0]), "q95": float(null[1])},
        "too_far": bool(error > null[1]),
        "bins": [_bin(k, probability[place == k], hit[place == k]) for k in range(BINS) if np.any(place == k)],
    }


def log_score(forecasts, truths) -> dict:
    """Mean of -ln(probability given to the truth) [nats], 0 at best; ``floored`` counts those that were given next to nothing."""
    given = np.array([f.get(truth, 0.0) for f, truth in zip(forecasts, truths, strict=True)])
    return mean_of(-np.log(np.maximum(given, FLOOR))) | {"floored": int(np.sum(given < FLOOR)), "floor": FLOOR}


def _errors(probability, hits, place):
    """Expected calibration error of each row of hits (rows, events)."""
    surplus = (hits - probability) @ (place[:, None] == np.arange(BINS))
    return np.abs(surplus).sum(axis=-1) / probability.size


def _bin(k, probability, hit):
    return {"from": k / BINS, "to": (k + 1) / BINS, "mean_probability": float(probability.mean()), **share(hit)}


def _columns(pairs):
    return tuple(zip(*pairs, strict=True)) if pairs else ((), ())
