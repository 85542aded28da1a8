"""A single hinge in series with the output, run by the engine: a spring with friction, stops or a dashpot.

It carries the output's torque, so that it turns by itself and the train does not feel it. Its angle is in its own unit: an
effect's strength scales it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from backdrive_bayes.bench.engine import rows

_INERTIA = 0.01
_STOP_COMPLIANCE = 0.005
_FRICTION_WEIGHT = 1e-5


@dataclass(frozen=True)
class Hinge:
    """Torques over T_r: ``stiffness`` per unit angle, ``friction``, ``preload`` (towards negative angles), ``stops`` (low, high),
    ``relaxation_s`` of the dashpot that spans the spring, 0 for none."""

    stiffness: float
    friction: float = 0.0
    preload: float = 0.0
    stops: tuple[float, float] | None = None
    relaxation_s: float = 0.0


def hinge_angle(hinge: Hinge, load, step_s) -> np.ndarray:
    """Angle of a hinge, shape (steps,), under ``load`` over T_r at steps that last ``step_s`` seconds."""
    durations = np.asarray(step_s if hinge.relaxation_s else ())
    return _run(hinge, np.asarray(load).tobytes(), durations.tobytes())


@lru_cache(maxsize=64)
def _run(hinge, load_bytes, step_bytes):
    load, step_s = np.r_[np.zeros(rows.REST_STEPS), np.frombuffer(load_bytes)], np.frombuffer(step_bytes)
    step_s = np.r_[np.ones(rows.REST_STEPS), step_s] if step_s.size else step_s
    mujoco = rows.load_engine()
    model = mujoco.MjModel.from_xml_string(_document(hinge))
    model.dof_invweight0[:] *= _FRICTION_WEIGHT
    weight = model.tendon_invweight0
    weight[:2] = rows.weight_of_compliance(np.array([1.0 / hinge.stiffness, _STOP_COMPLIANCE]))
    # The dashpot's torque is stiffness x relaxation time x true speed; a step of the engine's clock lasts step_s.
    damping = rows.weight_of_dashpot(hinge.stiffness * hinge.relaxation_s / step_s) if step_s.size else None
    data, step, found = mujoco.MjData(model), mujoco.mj_step, np.empty(load.size)
    applied, angle = data.qfrc_applied, data.qpos
    for i, torque in enumerate(load.tolist()):
        applied[0] = torque
        if damping is not None:
            weight[2] = damping[i]
        step(model, data)
        found[i] = angle[0]
    rows.raise_if_unstable(data)
    found.flags.writeable = False
    return found[rows.REST_STEPS :]


def _document(hinge):
    low, high = hinge.stops or (-1e6, 1e6)
    tendons = rows.twist("spring", 0) + rows.twist("stops", 0, None, rows.stop(low, high, rows.impedance()))
    if hinge.relaxation_s:
        tendons += rows.twist("dashpot", 0, None, rows.dashpot())
    spring = rows.spring("spring", rows.impedance(), -hinge.preload / hinge.stiffness)
    return rows.document(rows.body(0, _INERTIA * hinge.stiffness, hinge.friction), tendons, spring)
