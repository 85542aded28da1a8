"""Saved results of one fit, read for display."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from backdrive_bayes.results import INDICATORS, read_group, read_result

DEFAULT_RATE = 0.05
"""The default loading rate of the published test [N·m/s]."""


@dataclass(eq=False)
class Saved:
    """Indicators object and posterior file of one result folder; ``posterior_file`` is None where only the
    JSON is there.
    """

    indicators: dict
    posterior_file: Path | None
    _groups: dict = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> Saved:
        """Read a result folder of ``fit``."""
        path = Path(folder) / "posterior.nc"
        indicators = read_result(Path(folder) / "indicators.json", INDICATORS)
        return cls(indicators, path if path.exists() else None)

    @property
    def records(self) -> list[dict]:
        """The record objects of indicators.json."""
        return self.indicators["records"]

    @property
    def main_record(self) -> int:
        """The record that stands for the unit: of the largest loops the one whose rate is nearest to the default."""
        widest = max(r["amplitude_Nm"] for r in self.records)
        near = [i for i, r in enumerate(self.records) if r["amplitude_Nm"] > 0.98 * widest]
        return min(near, key=lambda i: abs(np.log(self.records[i]["loading_rate_Nm_per_s"] / DEFAULT_RATE)))

    def group(self, name: str):
        """A group of the posterior file as an xarray dataset, read once."""
        if name not in self._groups:
            self._groups[name] = read_group(Path(self.posterior_file or "posterior.nc"), name)
        return self._groups[name]

    def attributes(self) -> dict:
        """Attributes of the posterior file (versions, seed, data hash …); empty without that file."""
        return dict(self.group("sample_stats").attrs) if self.posterior_file else {}


@dataclass(frozen=True, eq=False)
class RecordBlocks:
    """Blocks of one record, arrays of shape (blocks,), replicates (draws, blocks).

    ``angle_rad`` and ``replicates_rad`` are free of the encoder's offset; ``direction`` is +1 or -1;
    ``first`` marks the first loading from rest.
    """

    torque_nm: np.ndarray
    angle_rad: np.ndarray
    replicates_rad: np.ndarray
    leg: np.ndarray
    direction: np.ndarray
    first: np.ndarray

    @property
    def predicted_rad(self) -> np.ndarray:
        """Mean of the replicates, shape (blocks,)."""
        return self.replicates_rad.mean(axis=0)

    @property
    def residual_rad(self) -> np.ndarray:
        """Measured minus predicted angle, shape (blocks,)."""
        return self.angle_rad - self.predicted_rad

    def residual_band_rad(self, level: float) -> np.ndarray:
        """Central ``level`` band of the replicates about their mean, shape (2, blocks)."""
        ends = [0.5 - level / 2, 0.5 + level / 2]
        return np.quantile(self.replicates_rad, ends, axis=0) - self.predicted_rad


def record_blocks(saved: Saved, record: int) -> RecordBlocks:
    """The blocks of one record with everything that loops and predictive checks show."""
    constant = saved.group("constant_data")
    own = constant["block_record"].values == record
    offset = float(constant["offset_rad"].values[record])
    replicates = saved.group("posterior_predictive")["angle_rad"].values[..., own]
    turning = constant["turning_nm"].values[constant["turning_record"].values == record]
    leg = constant["leg"].values[own]
    from_rest = abs(turning[0]) < 0.5 * np.abs(turning).max()
    return RecordBlocks(
        constant["torque_nm"].values[own],
        saved.group("observed_data")["angle_rad"].values[own] - offset,
        replicates.reshape(-1, own.sum()).astype(float) - offset,
        leg,
        np.sign(np.diff(turning))[leg],
        (leg == 0) & from_rest,
    )
