"""A measured record and the unit it belongs to, in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class Record:
    """One torque-angle record of a reducer whose input shaft is locked.

    ``time_s``, ``torque_nm`` and ``angle_rad`` have shape (samples,) and hold finite float64 values in SI units;
    time rises strictly. ``loading_rate_nm_per_s`` and ``amplitude_nm`` are what the unit file declares (None where it
    is silent). ``notes`` says in words what the reader did to the data (re-timing, dropped rows and so on). ``columns`` maps
    'time', 'torque' and 'angle' to the spelling under which the unit file finds them, a leading minus where a sign is turned.
    """

    name: str
    time_s: np.ndarray
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    loading_rate_nm_per_s: float | None = None
    amplitude_nm: float | None = None
    notes: tuple[str, ...] = ()
    columns: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Unit:
    """A reducer and its records.

    ``rated_torque_nm`` is T_r; ``identity`` holds the free text of the unit file (material, serial, test date, …) as
    data, never as markup; ``data_hash`` is the SHA-256 of the files' bytes.
    """

    name: str
    rated_torque_nm: float
    records: tuple[Record, ...]
    reduction_ratio: float | None = None
    identity: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    data_hash: str = ""
