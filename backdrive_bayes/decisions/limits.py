"""limits.toml as decisions use it: which indicators are limited, where, and which risks are agreed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.decisions.global_risk import Process
from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.limits_file import CONSUMER, PRODUCER, LimitsFile, LimitTable
from backdrive_bayes.schemas.toml_file import read_typed


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

    def only_k(self, where: object) -> float | None:
        """The share of T_r at which all limited lost motions are meant, None where none says; BadInput where they differ."""
        wanted = sorted({limit.k for limit in self.limits if limit.k is not None})
        if len(wanted) > 1:
            raise BadInput(where or "limits", "one k for all limits on the lost motion", ", ".join(f"{k:g}" for k in wanted))
        return wanted[0] if wanted else None


def read_limits(path: Path | str) -> Limits:
    """Read a limits file; BadInput names the key, what was expected and what was found."""
    path = Path(path)
    file = read_typed(path, LimitsFile, "a limits file")
    limits = [
        _limit(f"{path}, {name}" + (f" {number}" if len(tables) > 1 else ""), name, table)
        for name, tables in file.by_indicator()
        for number, table in enumerate(tables, 1)
    ]
    return Limits(tuple(limits), file.risk.consumer, file.risk.producer)


def _limit(where: str, name: str, table: LimitTable) -> Limit:
    lo = -math.inf if table.min is None else table.min
    hi = math.inf if table.max is None else table.max
    at = table.at
    process = Process(table.process.mean, table.process.sd, table.process.shape) if table.process else None
    rate, amplitude = (at.loading_rate_Nm_per_s, at.amplitude_Nm) if at else (None, None)
    return Limit(name, lo, hi, rate, amplitude, table.k, process, where)
