"""The gear train as a MuJoCo model: coaxial bodies on hinges, bearings as joint friction, flanks as tendon limits.

Units are normalised: torque by T_r, angle by the reducer's angle scale, time by the engine's step. All bodies turn about one
axis and their angles are referred to the output.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.engine import rows

INERTIA = 0.005
"""Inertia of a body in normalised units: small enough that a gap is crossed within a few steps."""
FLANKS = 2
"""Pairs of flanks that share the load of a link with clearance."""
_FRICTION_WEIGHT = 1e-3
"""Makes joint friction this much stiffer than the engine's default, so that they do not creep; still less costs convergence."""
_FAR = 1e6


@dataclass(frozen=True)
class Link:
    """What joins a body to the next: ``compliance`` (secant, at T_r), ``stiffening`` (over that at zero), half ``clearance``.

    ``crossing`` is the torque that the soft spring in the clearance takes from its middle to a flank. ``asymmetry`` e makes
    the flanks of one side 1+e and of the other 1-e as compliant.
    """

    compliance: float
    stiffening: float = 1.0
    clearance: float = 0.0
    crossing: float = 0.0
    asymmetry: float = 0.0


@dataclass(frozen=True)
class Train:
    """Bearings and links from the output (0) to the locked input, in normalised units.

    ``static`` is the excess of static over kinetic friction, ``viscous`` a bearing drag in torque·s per angle, ``running_in`` the
    share of friction lost as bearings turn, ``cogging`` the amplitude, period and phase of a detent torque on the output.
    """

    friction: tuple[float, ...]
    load_friction: tuple[float, ...]
    links: tuple[Link, ...]
    static: float = 0.0
    viscous: float = 0.0
    running_in: float = 0.0
    cogging: tuple[float, float, float] = (0.0, 1.0, 0.0)


def build_train(train: Train):
    """Model and data of a train at rest, and the numbers of its bearings' dashpots among the tendons, if it has any."""
    mujoco = rows.load_engine()
    model = mujoco.MjModel.from_xml_string(_document(train))
    model.dof_invweight0[:] *= _FRICTION_WEIGHT
    names = [model.tendon(i).name for i in range(model.ntendon)]
    for i, name in enumerate(names):
        if not name.endswith("_drag"):
            model.tendon_invweight0[i] = rows.weight_of_compliance(_compliance(train, name))
    return model, mujoco.MjData(model), [i for i, name in enumerate(names) if name.endswith("_drag")]


def _compliance(train, name):
    """Compliance at full load of the row that a tendon stands for, named by link and by flank or 'shaft' or 'gap'."""
    index, part = name.split("_")[:2]
    link = train.links[int(index)]
    if part == "gap":
        return link.clearance / link.crossing
    return link.compliance if part == "shaft" else link.compliance * FLANKS * (1.0 + float(part) * link.asymmetry)


def _document(train):
    # Every bearing has some friction, so that the solver's friction rows stand in the bodies' order.
    bodies = "".join(rows.body(i, INERTIA, max(f, 1e-9)) for i, f in enumerate(train.friction))
    tendons = "".join(_twists(train, i) for i in range(len(train.links)))
    if train.viscous:
        tendons += "".join(rows.twist(f"{i}_drag", i, attributes=rows.dashpot()) for i in range(1, len(train.friction)))
    return rows.document(bodies, tendons, "".join(_spring(i, link) for i, link in enumerate(train.links)))


def _twists(train, index):
    """Relative angle to the next body: of a shaft, or of a gap and its flanks."""
    link, after = train.links[index], index + 1 if index + 1 < len(train.links) else None
    if not link.clearance:
        return rows.twist(f"{index}_shaft", index, after)
    found = [rows.twist(f"{index}_gap", index, after)]
    soft = rows.impedance(link.stiffening, 1.1 * link.compliance)
    for flank in range(FLANKS):
        # The second flank comes into mesh later only where stiffness is to grow with load.
        edge = link.clearance + flank * 0.15 * np.log(link.stiffening) * link.compliance
        for side, span in ((1, (-_FAR, edge)), (-1, (-edge, _FAR))):
            found.append(rows.twist(f"{index}_{side}_{flank}", index, after, rows.stop(*span, soft)))
    return "".join(found)


def _spring(index, link):
    """A shaft, or the soft spring that spans a clearance (seals, grease, a preloaded cage)."""
    if link.clearance:
        return rows.spring(f"{index}_gap", rows.impedance())
    return rows.spring(f"{index}_shaft", rows.impedance(link.stiffening, 1.1 * link.compliance))
