"""A measured record and the unit it belongs to, in SI units."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real

import numpy as np

from backdrive_bayes.errors import BadInput

_CHANNELS = ("time_s", "torque_nm", "angle_rad")


@dataclass(frozen=True, eq=False)
class Record:
    """One torque-angle record of a reducer whose input shaft is locked.

    ``time_s``, ``torque_nm`` and ``angle_rad`` have shape (samples,) and hold finite float64 values in SI units;
    time rises strictly (BadInput else). ``loading_rate_nm_per_s`` and ``amplitude_nm`` are what the unit file declares (None
    where it is silent). ``notes`` says in words what the reader did to the data (re-timing, dropped rows and so on).
    ``columns`` maps 'time', 'torque' and 'angle' to the spelling under which the unit file finds them, a leading minus where a
    sign is turned. ``file_sha256`` is that of the file's bytes, empty for a record that was made in memory.
    """

    name: str
    time_s: np.ndarray
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    loading_rate_nm_per_s: float | None = None
    amplitude_nm: float | None = None
    notes: tuple[str, ...] = ()
    columns: dict[str, str] = field(default_factory=dict)
    file_sha256: str = ""

    def __post_init__(self):
        for name in _CHANNELS:
            values = _samples(getattr(self, name), f"record {self.name}, {name}")
            object.__setattr__(self, name, values)
            if values.size != self.time_s.size:
                raise BadInput(f"record {self.name}, {name}", f"{self.time_s.size} samples", str(values.size))
        if np.any(back := np.diff(self.time_s) <= 0.0):
            at = int(np.argmax(back)) + 1
            where = f"record {self.name}, time_s[{at}]"
            raise BadInput(where, f"more than {self.time_s[at - 1]:.9g} s", f"{self.time_s[at]:.9g} s")

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file's bytes, or of the samples' where there is no file."""
        if self.file_sha256:
            return self.file_sha256
        digest = hashlib.sha256()
        for name in _CHANNELS:
            digest.update(np.ascontiguousarray(getattr(self, name)).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class Unit:
    """A reducer and its records.

    ``rated_torque_nm`` is T_r, above zero, and there is one record or more (BadInput else); ``identity`` holds the free text of
    the unit file (material, serial, test date, …) as data, never as markup; ``file_sha256`` is the SHA-256 of the unit file's
    bytes, empty where there is none.
    """

    name: str
    rated_torque_nm: float
    records: tuple[Record, ...]
    reduction_ratio: float | None = None
    identity: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    file_sha256: str = ""

    def __post_init__(self):
        for name in ("rated_torque_nm", "reduction_ratio"):
            value = getattr(self, name)
            if name == "reduction_ratio" and value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, Real) or not 0.0 < value < math.inf:
                raise BadInput(f"unit {self.name}, {name}", "a finite number above zero", repr(value)[:100])
        if not self.records:
            raise BadInput(f"unit {self.name}, records", "one record or more", "none")

    @property
    def data_sha256(self) -> tuple[str, ...]:
        """SHA-256 of every record in order."""
        return tuple(r.sha256 for r in self.records)


def _samples(values, where: str) -> np.ndarray:
    """The values as an array of finite floats, (samples,)."""
    try:
        found = np.asarray(values, float)
    except (TypeError, ValueError) as error:
        raise BadInput(where, "numbers", f"{type(values).__name__}: {error}") from error
    if found.ndim != 1:
        raise BadInput(where, "an array of shape (samples,)", f"one of shape {found.shape}")
    if not np.isfinite(found).all():
        at = int(np.argmin(np.isfinite(found)))
        raise BadInput(f"{where}[{at}]", "a finite number", str(found[at]))
    return found
