"""A pooled batch as knowledge of a production process: its predictive distribution, and the global risks under it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from backdrive_bayes.decisions.global_risk import NODES, REACH, GlobalRisks
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.intervals import interval
from backdrive_bayes.indicators.same_loop import same_amplitude, same_rate
from backdrive_bayes.number_text import plain
from backdrive_bayes.results import POOL, read_result

NAME = "pool.json"


@dataclass(frozen=True, eq=False)
class Predictive:
    """A process of unknown ``mean`` and ``spread``, draws (draws,) of both; of the logarithm where ``log``.

    ``next_unit`` is the object of the predictive distribution, ``units`` the number of units behind it.
    """

    mean: np.ndarray
    spread: np.ndarray
    log: bool
    next_unit: dict
    units: int

    def risks(self, uncertainty: float, limit, accepted, rejected_outside, level: float) -> dict:
        """Global risks as :func:`~backdrive_bayes.decisions.global_risk.global_risks` gives them, as they are saved.

        They are linear in the process's density, so that those of the predictive distribution are the draws' mean; their
        intervals at ``level`` say how well the batch determines them. JCGM 106:2012, 9.5.
        """
        x, mass = self._nodes(uncertainty, (limit, accepted, rejected_outside))
        inside = (x >= limit[0]) & (x <= limit[1])
        taken, kept = (0.0 if a is None else _within(x, uncertainty, a) for a in (accepted, rejected_outside))
        parts = {
            "consumer": ~inside * taken, "producer": inside * (1.0 - kept), "nonconforming": ~inside, "accepted": taken,
            "rejected": 1.0 - kept,
        }  # fmt: skip
        shares = {name: np.sum(mass * part, axis=(1, 2)) for name, part in parts.items()}
        found = GlobalRisks(**{name: float(share.mean()) for name, share in shares.items()})
        return found.to_json() | {f"{who}_interval": interval(shares[who], level) for who in ("consumer", "producer")}

    def _nodes(self, uncertainty, intervals):
        """Values and masses of a quadrature under every draw, (draws, pieces, nodes), cut where an integrand bends."""
        ends = [e for i in intervals if i is not None for e in i if np.isfinite(e)]
        bends = np.array([e + s * uncertainty for e in ends for s in (-REACH, -2, 0, 2, REACH)])
        if self.log:
            bends = np.log(np.maximum(bends, 1e-300))
        bends = np.clip((bends - self.mean[:, None]) / self.spread[:, None], -REACH, REACH)
        whole = np.broadcast_to([-REACH, -3.0, 0.0, 3.0, REACH], (self.mean.size, 5))
        edges = np.sort(np.hstack([whole, bends]), axis=1)
        node, weight = np.polynomial.legendre.leggauss(NODES)
        half, middle = 0.5 * np.diff(edges)[..., None], 0.5 * (edges[:, 1:] + edges[:, :-1])[..., None]
        z = middle + half * node
        x = self.mean[:, None, None] + self.spread[:, None, None] * z
        return np.exp(x) if self.log else x, half * weight * np.exp(-0.5 * z**2) / np.sqrt(2 * np.pi)

    def to_json(self) -> dict:
        """As saved: what the next unit is expected to have, its median as mean and half the width that holds 68 % as sd."""
        return {"mean": self.next_unit["median"], "sd": self.next_unit["sd"], "shape": "pooled"}


def _within(x, uncertainty, accepted):
    """Probability that a reading of ``x`` lies in an interval; none does in one that holds nothing, as (inf, -inf)."""
    return np.maximum(ndtr((accepted[1] - x) / uncertainty) - ndtr((accepted[0] - x) / uncertainty), 0.0)


@dataclass(frozen=True, eq=False)
class Pool:
    """The object of a pool.json and where it was read from."""

    about: dict
    where: str

    @classmethod
    def read(cls, folder: Path) -> Pool:
        """From the folder of a batch below ``pools`` of a fleet; BadInput where it is none."""
        path = Path(folder) / NAME
        return cls(read_result(path, POOL), str(path))

    @property
    def name(self) -> str:
        """The batch's name."""
        return self.about["batch"]

    def predictive(self, name: str, rate: float, amplitude: float, lost_motion_at: float) -> Predictive:
        """What the batch tells of an indicator of the next unit at a loop.

        Raises BadInput where it was not pooled, was refused, or its lost motion was taken at another torque than
        ``lost_motion_at`` [N·m].
        """
        taken = self.about["k"] * self.about["rated_torque_Nm"]
        if name == "lost_motion_rad" and not same_amplitude(taken, lost_motion_at):
            raise BadInput(self.where, f"lost motion at ±{plain(lost_motion_at)} N·m", f"at ±{plain(taken)} N·m")
        found = next((q for q in self.about["quantities"] if q["name"] == name and _same_loop(q, rate, amplitude)), None)
        at = f"{name} at {plain(rate)} N·m/s, ±{plain(amplitude)} N·m"
        if found is None:
            raise BadInput(self.where, f"{at} among what was pooled", "none")
        if found["refused"]:
            raise BadInput(self.where, f"{at} with a result", f"refused: {found['refused']}")
        mean, spread = (np.array(found["predictive"][key]) for key in ("mean", "spread"))
        return Predictive(mean, spread, found["scale"] == "log", found["next_unit"], found["units"])


def _same_loop(quantity, rate, amplitude) -> bool:
    own = quantity["loading_rate_Nm_per_s"], quantity["amplitude_Nm"]
    return None not in own and same_rate(own[0], rate) and same_amplitude(own[1], amplitude)
