"""limits.toml: which indicators are limited, where, and which risks are agreed; every mistake is one clear line."""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.decisions.global_risk import SHAPES, Process
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import UNITS
from backdrive_bayes.records.toml_file import read_toml

_KEYS = ("min", "max", "at", "k", "process")
_AT = ("loading_rate_Nm_per_s", "amplitude_Nm")
_PROCESS = ("mean", "sd", "shape")
_RISK = ("consumer", "producer")
CONSUMER, PRODUCER = 0.05, 0.10


@dataclass(frozen=True)
class Limit:
    """One- or two-sided limit on an indicator in SI units; ``rate`` and ``amplitude`` say where it holds (None: everywhere,
    the largest loop). ``k`` is the share of T_r at which a limited lost motion is meant.
    """

    indicator: str
    lo: float = -math.inf
    hi: float = math.inf
    rate: float | None = None
    amplitude: float | None = None
    k: float | None = None
    process: Process | None = None
    where: str = ""


@dataclass(frozen=True)
class Limits:
    """All limits and the agreed risks: of passing a unit that is out of limits, and of failing one that is within."""

    limits: tuple[Limit, ...]
    consumer: float = CONSUMER
    producer: float = PRODUCER


def read_limits(path: Path) -> Limits:
    """Read a limits file; BadInput names the key, what was expected and what was found."""
    path = Path(path)
    table = read_toml(path, "a limits file")
    risk = _table(f"{path}, key risk", table.pop("risk", {}))
    _refuse_unknown(f"{path}, key risk", risk, _RISK)
    consumer = _risk(path, risk, "consumer", CONSUMER)
    producer = _risk(path, risk, "producer", PRODUCER)
    limits = []
    for name, value in table.items():
        if name not in UNITS:
            raise BadInput(f"{path}, key {name}", f"an indicator ({', '.join(UNITS)})", f"'{name}'{_nearest(name, UNITS)}")
        parts = value if isinstance(value, list) else [value]
        for number, part in enumerate(parts, 1):
            where = f"{path}, {name}" + (f" no. {number}" if len(parts) > 1 else "")
            limits.append(_limit(where, name, _table(where, part)))
    if not limits:
        raise BadInput(path, "at least one limit, as in [lost_motion_rad] max = 0.003", "none")
    return Limits(tuple(limits), consumer, producer)


def _limit(where, name, table):
    _refuse_unknown(where, table, _KEYS)
    lo, hi = _number(where, table, "min", -math.inf), _number(where, table, "max", math.inf)
    if not math.isfinite(lo) and not math.isfinite(hi):
        raise BadInput(where, "max, min or both", "neither")
    if lo >= hi:
        raise BadInput(where, "max above min", f"min = {lo:g}, max = {hi:g}")
    at = _at(where, table)
    k = _positive(where, table, "k") if "k" in table else None
    if k is not None and (name != "lost_motion_rad" or k >= 1):
        raise BadInput(f"{where}, key k", "a share of T_r below 1, with lost_motion_rad only", f"{k:g}")
    process = _process(where, table["process"]) if "process" in table else None
    return Limit(name, lo, hi, at.get(_AT[0]), at.get(_AT[1]), k, process, where)


def _at(where, table):
    if "at" not in table:
        return {}
    where = f"{where}, key at"
    at = _table(where, table["at"])
    _refuse_unknown(where, at, _AT)
    if not at:
        raise BadInput(where, f"{' or '.join(_AT)}", "an empty table")
    return {key: _positive(where, at, key) for key in at}


def _process(where, value) -> Process:
    where = f"{where}, key process"
    table = _table(where, value)
    _refuse_unknown(where, table, _PROCESS)
    for key in ("mean", "sd"):
        if key not in table:
            raise BadInput(where, "mean and sd of the production process", f"no {key}")
    shape = table.get("shape", "normal")
    if shape not in SHAPES:
        raise BadInput(f"{where}, shape", f"one of {', '.join(SHAPES)}", repr(shape)[:60])
    if shape == "normal":
        return Process(_number(where, table, "mean", 0.0), _positive(where, table, "sd"), shape)
    return Process(_positive(where, table, "mean"), _positive(where, table, "sd"), shape)


def _risk(path, table, key, default):
    value = _number(f"{path}, key risk", table, key, default)
    if not 0 < value < 0.5:
        raise BadInput(f"{path}, key risk.{key}", "a probability above 0 and below 0.5", f"{value:g}")
    return value


def _number(where, table, key, default):
    if key not in table:
        return default
    value = table[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInput(f"{where}, key {key}", "a finite number", repr(value)[:60])
    return float(value)


def _positive(where, table, key):
    value = _number(where, table, key, 0.0)
    if value <= 0:
        raise BadInput(f"{where}, key {key}", "a positive number", f"{value:g}")
    return value


def _table(where, value):
    if not isinstance(value, dict):
        raise BadInput(where, "a table", repr(value)[:60])
    return value


def _refuse_unknown(where, table, known):
    for key in table:
        if key not in known:
            raise BadInput(f"{where}, key {key}", f"one of {', '.join(known)}", f"'{key}'{_nearest(key, known)}")


def _nearest(key, known):
    near = difflib.get_close_matches(key, list(known), n=1, cutoff=0.6)
    return f" (did you mean {near[0]}?)" if near else ""
