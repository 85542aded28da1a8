"""Bodies and contacts of a gear chain as arrays: what the equilibrium solver works on.

Torques are shares of the rated torque and angles shares of the reducer's angle scale, all referred to the output shaft.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Chain(NamedTuple):
    """Stages in series from the output shaft (0) to the locked input; each has ``flanks`` contacts on either side.

    A flank of stage j touches when the mesh has turned by ``open_up[j, i]`` upwards or ``open_down[j, i]`` downwards and then
    carries ``stiff * depth**power``. It grips tangentially with ``tangential`` up to ``mu`` times that load. Bearings hold the
    stage's body to the housing by bristles of stiffness ``bristle`` up to ``bearing`` plus ``bearing_load`` times the torque
    beyond ``bearing_onset``. ``film`` is a weak centring stiffness of the mesh. ``worn`` opens the gaps from the start and
    ``wear`` by so much for each unit of friction work. ``stick`` holds a brittle contact: body, static and kinetic torque,
    stiffness.
    """

    open_up: np.ndarray
    open_down: np.ndarray
    stiff_up: np.ndarray
    stiff_down: np.ndarray
    power_up: np.ndarray
    power_down: np.ndarray
    mu: np.ndarray
    tangential: np.ndarray
    film: np.ndarray
    bearing: np.ndarray
    bristle: np.ndarray
    bearing_load: np.ndarray
    bearing_onset: float = 0.0
    worn: float = 0.0
    wear: float = 0.0
    stick: np.ndarray = np.zeros(4)


def contact_stiffness(open_angle, power, film, deflection, load=1.0):
    """Stiffness of each flank such that the mesh carries ``load`` at ``deflection`` beyond its first contact.

    ``open_angle`` has shape (stages, flanks), ``power``, ``film`` and ``deflection`` (stages,); the same for all flanks.
    """
    turned = open_angle.min(axis=1) + deflection
    depth = np.maximum(turned[:, None] - open_angle, 0.0)
    carried = np.maximum(load - film * turned, 0.1 * load)
    return np.broadcast_to((carried / np.sum(depth ** power[:, None], axis=1))[:, None], open_angle.shape).copy()
