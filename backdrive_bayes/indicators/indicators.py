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
    return _at(loops, mean, torque_nm) - _at(loops, mean, -torque_nm)


def zero_torque_width_rad(loops: Loops) -> np.ndarray:
    """w(0), what most people call backlash [rad], shape (draws,)."""
    return _at(loops, loops.width, 0.0)


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


def torque_energy(loops: Loops, points: int = 101):
    """The torque–energy curve: |τ| (points,) [N·m] and w averaged over ±τ, J per N·m of torque, shape (draws, points).

    Source: eq. (26)-(27), reconstructed.
    """
    torque = np.linspace(0, loops.torque_nm[-1], points)
    index = np.clip(np.searchsorted(loops.torque_nm, torque), 1, loops.torque_nm.size - 1)
    low, high = loops.torque_nm[index - 1], loops.torque_nm[index]
    share = (torque - low) / (high - low)
    mirrored = 0.5 * (loops.width + loops.width[:, ::-1])
    return torque, (1 - share) * mirrored[:, index - 1] + share * mirrored[:, index]


def hump_torques_nm(torque, curve):
    """τ₁ and τ₂ of torque–energy curves (draws, points), each of shape (draws,) [N·m].

    τ₁ is where the curve has risen half-way from its valley at low torque to its hump, τ₂ where it has fallen half-way from the
    hump to its lowest value beyond (our convention).
    """
    n = curve.shape[1]
    index = np.arange(n)
    hump = np.argmax(curve, axis=1)[:, None]
    top = np.take_along_axis(curve, hump, axis=1)
    before, after = index <= hump, index >= hump
    valley = np.min(np.where(before, curve, np.inf), axis=1, keepdims=True)
    foot = np.min(np.where(after, curve, np.inf), axis=1, keepdims=True)
    risen = before & (curve >= 0.5 * (valley + top))
    # The last stretch below half before the hump decides, so that ripples at low torque do not.
    below = np.where(before & ~risen, index, -1).max(axis=1)
    fallen = after & (curve <= 0.5 * (foot + top))
    beyond = np.where(fallen.any(axis=1), np.argmax(fallen, axis=1), n - 1)
    step = torque[1] - torque[0]
    tau1 = np.where(below < 0, 0.0, torque[np.minimum(below + 1, n - 1)] - 0.5 * step)
    tau2 = np.where(beyond == hump[:, 0], torque[beyond], torque[beyond] - 0.5 * step)
    return tau1, tau2


def back_drive(loops: Loops, load_nm: float):
    """B = (θ_L [rad], W_L [J]): angle turned and energy absorbed when a load arrives on the rising branch at zero torque.

    Shapes (draws,). Source: eq. (1) and (7), reconstructed.
    """
    load = min(load_nm, float(loops.torque_nm[-1]))
    angle = _at(loops, loops.rising, load) - _at(loops, loops.rising, 0.0)
    torque = loops.torque_nm
    middle = 0.5 * (torque[1:] + torque[:-1])
    part = (middle > 0) & (torque[1:] <= load * (1 + 1e-9))
    return angle, np.diff(loops.rising, axis=1)[:, part] @ middle[part]


def _at(loops, curve, torque):
    index = int(np.clip(np.searchsorted(loops.torque_nm, torque), 1, loops.torque_nm.size - 1))
    low, high = loops.torque_nm[index - 1], loops.torque_nm[index]
    share = (torque - low) / (high - low)
    return (1 - share) * curve[:, index - 1] + share * curve[:, index]
