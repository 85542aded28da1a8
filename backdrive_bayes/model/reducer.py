"""A reducer model: a tuple of members and the angle they give along a torque path."""

from __future__ import annotations

from dataclasses import dataclass, replace

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

    @property
    def reducer(self) -> ReducerModel:
        """The same model without the faults of the bench's channels."""
        return replace(self, members=tuple(m for m in self.members if not m.stage.channel))

    def transmitted_nm(self, values, path: TorquePath) -> np.ndarray:
        """Torque that reaches the elastic parts [N·m], shape (…, samples)."""
        return self._transmit(values, self._at_the_output(values, path)).transmitted_nm

    def parts(self, values, path: TorquePath) -> dict[str, np.ndarray]:
        """Angle [rad] of each member, shape (…, samples) each; they add up to :meth:`angle`.

        What a member of the transmission does is the change of the elastic angle when it acts, and a torque channel's part
        is the change of the whole angle. Those of the friction's level have none: they act through friction and drag.
        """
        drive = self._at_its_level(values, Drive(path, self.scale.torque_nm, path.torque_nm))
        whole, parts = self, {m.name: np.zeros(path.torque_nm.shape) for m in self._at(Stage.FRICTION_LEVEL)}
        for member in self._at(Stage.TORQUE_CHANNEL):
            others = replace(whole, members=tuple(m for m in whole.members if m is not member))
            parts[member.name] = whole.angle(values, path) - others.angle(values, path)
            whole = others
        parts |= {m.name: m.respond(values, drive) + np.zeros(path.torque_nm.shape) for m in self._at(Stage.COMPLIANCE)}
        before = sum(parts[m.name] for m in self._at(Stage.COMPLIANCE))
        for member in self._at(Stage.TRANSMISSION):
            drive = replace(drive, transmitted_nm=member.respond(values, drive))
            after = self._comply(values, drive)
            parts[member.name] = after - before
            before = after
        if self._averaged(path):
            return parts | whole._read_within(values, path)[1]
        return parts | self._read(values, replace(drive, angle_rad=before))[1]

    def angle(self, values, path: TorquePath) -> np.ndarray:
        """Output angle [rad] without the encoder's offset, shape (…, samples).

        ``values`` maps every parameter's name to an array of shape (…, 1) in SI units.
        """
        if self._averaged(path):
            before, channel = self._read_within(values, path)
            return before + sum(channel.values())
        drive = self._transmit(values, self._at_the_output(values, path))
        return self._read(values, replace(drive, angle_rad=self._comply(values, drive)))[0]

    def _at_the_output(self, values, path):
        drive = Drive(path, self.scale.torque_nm)
        for member in self._at(Stage.TORQUE_CHANNEL):
            drive = replace(drive, shift_nm=drive.shift_nm + member.respond(values, drive))
        return self._at_its_level(values, replace(drive, transmitted_nm=drive.torque_nm))

    def _at_its_level(self, values, drive):
        for member in self._at(Stage.FRICTION_LEVEL):
            friction, drag = member.respond(values, drive)
            drive = replace(drive, friction_factor=drive.friction_factor * friction, drag_factor=drive.drag_factor * drag)
        return drive

    def _transmit(self, values, drive):
        for member in self._at(Stage.TRANSMISSION):
            drive = replace(drive, transmitted_nm=member.respond(values, drive))
        return drive

    def _comply(self, values, drive):
        angle = np.zeros(drive.path.torque_nm.shape)
        for member in self._at(Stage.COMPLIANCE):
            angle = angle + member.respond(values, drive)
        return angle

    def _read(self, values, drive):
        """The angle that is read, and what each member of the angle channel adds to it."""
        parts = self._added(values, drive, (Stage.ANGLE_CHANNEL, Stage.FAST_ANGLE_CHANNEL))
        return drive.angle_rad + sum(parts.values()), parts

    def _read_within(self, values, path):
        """The angle before the angle channel, and what each member of that adds, fast ones to the means over blocks."""
        bare = replace(self, members=tuple(m for m in self.members if m.stage < Stage.ANGLE_CHANNEL))
        nodes = Drive(path.within, self.scale.torque_nm, angle_rad=bare.angle(values, path.within))
        before = _by_block(nodes.angle_rad, path)
        before = before[..., before.shape[-1] // 2]
        slow = self._added(values, Drive(path, self.scale.torque_nm, angle_rad=before), (Stage.ANGLE_CHANNEL,))
        within = sum(self._added(values, nodes, (Stage.ANGLE_CHANNEL,)).values())
        fast = self._added(values, replace(nodes, angle_rad=nodes.angle_rad + within), (Stage.FAST_ANGLE_CHANNEL,))
        return before, slow | {name: _by_block(part, path).mean(axis=-1) for name, part in fast.items()}

    def _added(self, values, drive, stages):
        parts = {}
        for member in (m for stage in stages for m in self._at(stage)):
            parts[member.name] = member.respond(values, drive)
            drive = replace(drive, angle_rad=drive.angle_rad + parts[member.name])
        return parts

    def _averaged(self, path):
        return path.within is not None and bool(self._at(Stage.FAST_ANGLE_CHANNEL))

    def _at(self, stage: Stage):
        return [m for m in self.members if m.stage is stage]


def _by_block(angle, path):
    """Angles at the nodes within blocks, shape (…, blocks, nodes)."""
    return angle.reshape(*angle.shape[:-1], path.torque_nm.size, -1)
