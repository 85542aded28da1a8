"""A batch pooled: which units it is made of, and every indicator and parameter that enough of them tell of."""

from __future__ import annotations

from collections import Counter

import numpy as np

from backdrive_bayes.decisions.loops import measured_loops
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import CORE
from backdrive_bayes.indicators.intervals import LEVEL
from backdrive_bayes.indicators.same_loop import most_alike, same_amplitude
from backdrive_bayes.pooling.hierarchy import FEWEST_UNITS
from backdrive_bayes.pooling.loss import MOST_BITS
from backdrive_bayes.pooling.quantity import pool_quantity
from backdrive_bayes.pooling.unit import Told, UnitDraws
from backdrive_bayes.results import POOL


@one_thread()
def pool_batch(batch: str, units: list[UnitDraws], seed: int = 0, level: float = LEVEL) -> dict:
    """The object of pool.json. BadInput where fewer units than a hierarchy needs can be compared.

    Pooled are units that converged and were not forced, of the rated torque and lost-motion torque that most of them share, and
    no record twice: a copy tells nothing of the batch.
    """
    kept, left = _comparable(units)
    if len(kept) < FEWEST_UNITS:
        raise BadInput(f"batch '{batch}'", f"at least {FEWEST_UNITS} units that can be pooled", f"{len(kept)} of {len(units)}")
    return {
        "schema": POOL,
        "batch": batch,
        "units": [u.name for u in kept],
        "left_out": left,
        "rated_torque_Nm": kept[0].rated_torque_nm,
        "k": kept[0].k,
        "level": level,
        "most_bits": MOST_BITS,
        "data_sha256": [h for u in kept for h in u.data_hashes],
        "seed": seed,
        "quantities": [_pooled(found, seed, level) for found in _quantities(kept) if len(found) >= FEWEST_UNITS],
    }


def _comparable(units):
    """Units that may be pooled, and the others with the reason."""
    used = [u for u in units if u.usable]
    k = Counter(u.k for u in used).most_common(1)[0][0] if used else None
    rated = most_alike([u.rated_torque_nm for u in used if u.k == k]) if used else None
    kept, left, of_record = [], [], {}
    for unit in units:
        copied = next((of_record[h] for h in unit.data_hashes if h in of_record), None)
        why = f"a record of {copied}" if copied else ""
        if not unit.usable:
            why = "not converged, or forced"
        elif unit.k != k or not same_amplitude(unit.rated_torque_nm, rated):
            why = "another rated torque or k"
        if why:
            left.append({"unit": unit.name, "why": why})
        else:
            kept.append(unit)
            of_record |= dict.fromkeys(unit.data_hashes, unit.name)
    return kept, left


def _quantities(units):
    """What the units tell of each quantity, [(unit's name, told)], for indicators loop by loop and for parameters."""
    told = [(u.name, t) for u in units for t in u.told if np.isfinite(t.draws).all()]
    of_loops = [(name, t) for name, t in told if t.rate is not None]
    if of_loops:
        for loop in measured_loops([t.rate for _, t in of_loops], [t.amplitude for _, t in of_loops]):
            here = [of_loops[i] for i in loop.records]
            yield from (_first(here, name, loop.rate, loop.amplitude) for name in CORE)
    parameters = [(name, t) for name, t in told if t.rate is None]
    yield from (_first(parameters, name, None, None) for name in dict.fromkeys(t.name for _, t in parameters))


def _first(told, name, rate, amplitude):
    """One a unit, under the loop's common rate and amplitude."""
    found = {}
    for unit, t in told:
        if t.name == name:
            found.setdefault(unit, Told(name, t.unit, rate, amplitude, t.draws, t.prior))
    return list(found.items())


def _pooled(found, seed, level) -> dict:
    first = found[0][1]
    about = {"name": first.name, "unit": first.unit, "loading_rate_Nm_per_s": first.rate, "amplitude_Nm": first.amplitude}
    names, told = zip(*found, strict=True)
    priors = [t.prior[np.isfinite(t.prior)] for t in told]
    return about | pool_quantity(names, [t.draws for t in told], priors, seed, level)
