"""The indicators of a settled loop, each a plain function of loops, vectorised over draws."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.indicators.loop import Loops


def lost_motion_rad(loops: Loops, torque_nm: float) -> np.ndarray:
    """δ = θ̄(+t) − θ̄(−t) at t = kT_r, with θ̄ the mean of both branches [rad], shape (draws,); NaN beyond the loop.

    Source: eq. (13), reconstructed.
    """
    if torque_nm > loops.torque_nm[-1]:
        return np.full(loops.rising.shape[0], np.nan)
    mean = 0.5 * (loops.rising + loops.falling)
    return loops.at(mean, torque_nm) - loops.at(mean, -torque_nm)


def zero_torque_width_rad(loops: Loops) -> np.ndarray:
    """w(0), what most people call backlash [rad], shape (draws,)."""
    return loops.at(loops.width, 0.0)


def peak_angle_rad(loops: Loops) -> np.ndarray:
    """Half the angle between the tips at +T and −T of the settled loop [rad], shape (draws,); free of the encoder's offset."""
    mean = 0.5 * (loops.rising + loops.falling)
    return 0.5 * (mean[:, -1] - mean[:, 0])


def loop_area_j(loops: Loops) -> np.ndarray:
    """S = ∫w dτ, the energy dissipated in one cycle [J], shape (draws,). Source: eq. (21), reconstructed."""
    return np.trapezoid(loops.width, loops.torque_nm, axis=1)


def absorbed_j(loops: Loops) -> np.ndarray:
    """W_abs, the signed ∫τ dθ along the two loading quadrants [J], shape (draws,). Source: eq. (22), reconstructed."""
    middle = 0.5 * (loops.torque_nm[1:] + loops.torque_nm[:-1])
    up, down = middle > 0, middle < 0
    loading = np.diff(loops.rising, axis=1)[:, up] @ middle[up]
    # The falling branch is stored with rising torque but is run through the other way.
    return loading - np.diff(loops.falling, axis=1)[:, down] @ middle[down]


def dissipation_ratio(loops: Loops) -> np.ndarray:
    """u = S / W_abs, shape (draws,)."""
    return loop_area_j(loops) / absorbed_j(loops)


def torque_energy(loops: Loops):
    """The torque–energy curve: |τ| (points,) [N·m] and w averaged over ±τ, J per N·m of torque, shape (draws, points).

    The points are the loop's own, dense near zero torque. Source: eq. (26)-(27), reconstructed.
    """
    centre = loops.torque_nm.size // 2
    mirrored = 0.5 * (loops.width + loops.width[:, ::-1])
    return loops.torque_nm[centre:], mirrored[:, centre:]


def hump_torques_nm(torque, curve):
    """τ₁ and τ₂ of torque–energy curves (draws, points), each of shape (draws,) [N·m].

    τ₁ is where the curve has risen half-way from its valley at low torque to its hump, τ₂ where it has fallen half-way from the
    hump to its lowest value beyond (our convention).
    """
    index = np.arange(curve.shape[1])
    hump = np.argmax(curve, axis=1)[:, None]
    top = np.take_along_axis(curve, hump, axis=1)
    before, after = index <= hump, index >= hump
    valley = np.min(np.where(before, curve, np.inf), axis=1, keepdims=True)
    foot = np.min(np.where(after, curve, np.inf), axis=1, keepdims=True)
    # The last stretch below half before the hump decides, so that ripples at low torque do not.
    below = np.where(before & (curve < 0.5 * (valley + top)), index, -1).max(axis=1)
    fallen = after & (curve <= 0.5 * (foot + top)) & (index > hump)
    beyond = np.where(fallen.any(axis=1), np.argmax(fallen, axis=1), index[-1])
    tau1 = np.where(below < 0, 0.0, _crossing(torque, curve, below, 0.5 * (valley + top)[:, 0]))
    tau2 = _crossing(torque, curve, np.maximum(beyond - 1, 0), 0.5 * (foot + top)[:, 0])
    return tau1, np.where(hump[:, 0] == index[-1], torque[-1], tau2)


def _crossing(torque, curve, left, level):
    """Torque between points ``left`` and ``left + 1`` at which each curve passes ``level``."""
    left = np.clip(left, 0, torque.size - 2)
    row = np.arange(curve.shape[0])
    a, b = curve[row, left], curve[row, left + 1]
    share = np.clip((level - a) / np.where(a == b, 1.0, b - a), 0.0, 1.0)
    return torque[left] + share * (torque[left + 1] - torque[left])


def back_drive(loops: Loops, load_nm: float):
    """B = (θ_L [rad], W_L [J]): angle turned and energy absorbed when a load arrives at zero torque of a settled loop.

    The load runs along the branch that leads to it: the rising one, or for a negative load, whose angle is negative, the
    falling one. Shapes (draws,). Source: eq. (1) and (7), reconstructed.
    """
    if load_nm < 0:
        angle, energy = back_drive(loops.mirrored, -load_nm)
        return -angle, energy
    load = min(load_nm, float(loops.torque_nm[-1]))
    angle = loops.at(loops.rising, load) - loops.at(loops.rising, 0.0)
    within = (loops.torque_nm >= 0) & (loops.torque_nm < load)
    torque = np.append(loops.torque_nm[within], load)
    rising = np.column_stack([loops.rising[:, within], loops.at(loops.rising, load)])
    return angle, np.diff(rising, axis=1) @ (0.5 * (torque[1:] + torque[:-1]))
