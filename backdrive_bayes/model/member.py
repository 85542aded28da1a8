"""What every member of a model is: frozen, named, with parameters and one pure function at one stage."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from backdrive_bayes.model.parameter import Parameter
from backdrive_bayes.model.path import TorquePath


class Stage(enum.IntEnum):
    """The fixed order in which members act, from the torque that is read to the angle that is read."""

    TORQUE_CHANNEL = 1
    """Error of the torque reading [N·m], the same at all samples, shape (…, 1): the reducer feels the reading less this."""
    FRICTION_LEVEL = 2
    """Factors on the torques at which friction and the clearance's drag hold, a pair of shape (…, 1) each."""
    TRANSMISSION = 3
    """Turns the torque on the reducer into the torque that reaches the elastic parts [N·m]."""
    COMPLIANCE = 4
    """Adds output angle [rad]."""
    ANGLE_CHANNEL = 5
    """Adds to the angle that is read [rad] what is no motion of the reducer."""
    FAST_ANGLE_CHANNEL = 6
    """The same, changing within a sample that is a mean over a block: followed at nodes within the blocks and averaged."""

    @property
    def channel(self) -> bool:
        """Whether the member is a fault of the bench's sensors and no part of the reducer."""
        return self in (Stage.TORQUE_CHANNEL, Stage.ANGLE_CHANNEL, Stage.FAST_ANGLE_CHANNEL)


@dataclass(frozen=True)
class Drive:
    """What a member sees.

    The path that is read and T_r; ``transmitted_nm`` (…, samples), the torque that reaches the elastic parts; ``shift_nm``
    (scalar or (…, 1)), the error of the torque reading; ``friction_factor`` and ``drag_factor`` (scalar or (…, 1)), how much
    more friction and drag hold back than the baseline's level; ``angle_rad`` (…, samples), the angle before the angle channel.
    """

    path: TorquePath
    rated_torque_nm: float
    transmitted_nm: np.ndarray | None = None
    shift_nm: float | np.ndarray = 0.0
    friction_factor: float | np.ndarray = 1.0
    drag_factor: float | np.ndarray = 1.0
    angle_rad: np.ndarray | None = None

    @property
    def torque_nm(self) -> np.ndarray:
        """Torque on the reducer [N·m], shape (…, samples)."""
        return self.path.torque_nm - self.shift_nm


class Member(Protocol):
    """A module of the reducer or a candidate effect.

    ``respond(values, drive)`` takes a mapping from parameter names to arrays of shape (…, 1) and returns what its stage says,
    shape (…, samples) unless said otherwise. ``signature`` is what the member is known by, one phrase.

    ``of_time`` (absent: False) tells that it depends on the time alone, so that its formula errs as a function of the time.
    A member whose parameters are hard to hit by chance may also have a method ``guesses(angle_rad, record, taken_out)``: points
    worth starting a search from, a list of mappings from parameter names to values, of shape (records,) where a record has its
    own. It is given the angle without the member and the number of the record, shape (blocks,) each, and a function that
    returns the least-squares amplitudes (sets, columns) of sets of columns (sets, columns, blocks) in what is unexplained, and
    the chi-square that each set takes out (sets,).
    """

    name: str
    stage: Stage
    parameters: tuple[Parameter, ...]
    source: str
    signature: str

    def respond(self, values: dict[str, np.ndarray], drive: Drive) -> np.ndarray | tuple[np.ndarray, np.ndarray]:
        """Contribution along the path."""
        ...
