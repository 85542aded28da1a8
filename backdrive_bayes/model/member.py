"""What every member of a model is: frozen, named, with parameters and one pure function at one stage."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from backdrive_bayes.model.parameter import Parameter
from backdrive_bayes.model.path import TorquePath


class Stage(enum.IntEnum):
    """The fixed order in which members act, from the applied torque to the angle that is read."""

    TRANSMISSION = 1
    """Turns applied torque into the torque that reaches the elastic parts [N·m]."""
    COMPLIANCE = 2
    """Adds output angle [rad]."""


@dataclass(frozen=True)
class Drive:
    """What a member sees: the path, T_r, and the torque that reaches the elastic parts, shape (…, samples)."""

    path: TorquePath
    rated_torque_nm: float
    transmitted_nm: np.ndarray


class Member(Protocol):
    """A module of the reducer or a candidate effect.

    ``respond(values, drive)`` takes a mapping from parameter names to arrays of shape (…, 1) and returns shape
    (…, samples): torque [N·m] for a member of the transmission stage, angle [rad] for one of the compliance stage.
    """

    name: str
    stage: Stage
    parameters: tuple[Parameter, ...]
    source: str

    def respond(self, values: dict[str, np.ndarray], drive: Drive) -> np.ndarray:
        """Contribution along the path."""
        ...
