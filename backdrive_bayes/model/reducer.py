"""A reducer model: a tuple of members and the angle they give along a torque path."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.model.member import Drive, Member, Stage
from backdrive_bayes.model.parameter import Parameter, Scale
from backdrive_bayes.model.path import TorquePath


@dataclass(frozen=True)
class ReducerModel:
    """Members acting in the order of their stages on a unit of the given scale."""

    members: tuple[Member, ...]
    scale: Scale

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the members."""
        return tuple(m.name for m in self.members)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, shared ones and those of each record, in the members' order."""
        return tuple(p for m in self.members for p in m.parameters)

    def transmitted_nm(self, values, path: TorquePath) -> np.ndarray:
        """Torque that reaches the elastic parts [N·m], shape (…, samples)."""
        torque = path.torque_nm
        for member in self._at(Stage.TRANSMISSION):
            torque = member.respond(values, Drive(path, self.scale.torque_nm, torque))
        return torque

    def parts(self, values, path: TorquePath) -> dict[str, np.ndarray]:
        """Angle [rad] of each module, shape (…, samples) each; they add up to :meth:`angle`.

        What friction does is the change of the elastic angle when the friction acts.
        """
        free = Drive(path, self.scale.torque_nm, path.torque_nm)
        drive = Drive(path, self.scale.torque_nm, self.transmitted_nm(values, path))
        parts = {}
        held = 0.0
        for member in self._at(Stage.COMPLIANCE):
            parts[member.name] = member.respond(values, free)
            held = held + member.respond(values, drive) - parts[member.name]
        for member in self._at(Stage.TRANSMISSION):
            parts[member.name] = held + np.zeros(path.torque_nm.shape)
        return parts

    def angle(self, values, path: TorquePath) -> np.ndarray:
        """Output angle [rad] without the encoder's offset, shape (…, samples).

        ``values`` maps every parameter's name to an array of shape (…, 1) in SI units.
        """
        drive = Drive(path, self.scale.torque_nm, self.transmitted_nm(values, path))
        angle = np.zeros(path.torque_nm.shape)
        for member in self._at(Stage.COMPLIANCE):
            angle = angle + member.respond(values, drive)
        return angle

    def _at(self, stage: Stage):
        return [m for m in self.members if m.stage is stage]
