"""A measured record and the unit it belongs to, in SI units."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class Record:
    """One torque-angle record of a reducer whose input shaft is locked.

    ``time_s``, ``torque_nm`` and ``angle_rad`` have shape (samples,) and hold finite float64 values in SI units;
    time rises strictly. ``loading_rate_nm_per_s`` and ``amplitude_nm`` are what the unit file declares (None where it
    is silent). ``notes`` says in words what the reader did to the data (re-timing, dropped rows and so on). ``columns`` maps
    'time', 'torque' and 'angle' to the spelling under which the unit file finds them, a leading minus where a sign is turned.
    ``file_sha256`` is that of the file's bytes, empty for a record that was made in memory.
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

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file's bytes, or of the samples' where there is no file."""
        if self.file_sha256:
            return self.file_sha256
        digest = hashlib.sha256()
        for values in (self.time_s, self.torque_nm, self.angle_rad):
            digest.update(np.ascontiguousarray(values, float).tobytes())
        return digest.hexdigest()


@dataclass(frozen=True, eq=False)
class Unit:
    """A reducer and its records.

    ``rated_torque_nm`` is T_r; ``identity`` holds the free text of the unit file (material, serial, test date, …) as
    data, never as markup; ``file_sha256`` is the SHA-256 of the unit file's bytes, empty where there is none.
    """

    name: str
    rated_torque_nm: float
    records: tuple[Record, ...]
    reduction_ratio: float | None = None
    identity: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    file_sha256: str = ""

    @property
    def data_sha256(self) -> tuple[str, ...]:
        """SHA-256 of every record in order."""
        return tuple(r.sha256 for r in self.records)
