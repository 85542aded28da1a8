"""What the studies of fleets share: many small units, and work on one that is real and takes a fraction of a second."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from make_fleet import make_unit

from backdrive_bayes.indicators.least_squares import least_squares_json
from backdrive_bayes.records.unit_folder import read_unit

STUDIES = Path(__file__).resolve().parent
if str(STUDIES) not in sys.path:
    sys.path.append(str(STUDIES))


@dataclass(frozen=True)
class Classic:
    """The classic least-squares indicators of every record, ``repeats`` times over; they stand in for a fit of many seconds."""

    repeats: int = 1

    def __call__(self, path: Path, folder: Path | None) -> list[dict]:
        unit, rows = read_unit(path), []
        for record in unit.records:
            for _ in range(self.repeats):
                found = least_squares_json(record, unit.rated_torque_nm, 0.03)
            rows.append({"name": unit.name, "file": record.name, "data_sha256": record.sha256, **found["indicators"]})
        return rows


def make_units(folder: Path, units: int) -> Path:
    """Virtual reducers, one loop each, in a folder that is made once."""
    for number in range(1, units + 1):
        place = folder / f"batch-{number % 10}" / f"unit-{number:04d}"
        if not (place / "unit.toml").is_file():
            make_unit(place, number, f"batch-{number % 10}", 1.0, seed=1)
    return folder
