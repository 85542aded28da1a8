"""The generalised play operator with odd-symmetric boundaries over a monotone-leg path, in closed form.

A play operator keeps its state between a rising lower boundary and a falling upper one (Brokate & Sprekels, Hysteresis
and Phase Transitions, 1996, section 2.2). Over a monotone leg it needs no recursion over samples: rising torque gives
max(state, lower(torque)), falling torque min(state, -lower(-torque)).
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.path import TorquePath


def play(path: TorquePath, lower, state, shift_nm=0.0):
    """State of a generalised play operator along ``path``, shape (…, samples).

    ``lower`` maps torque [N·m] of shape (samples,) to the rising boundary of shape (…, samples), never above the falling
    one, -lower(-torque). ``state`` (…, 1) is where the operator is before the path begins; it is moved between the
    boundaries at the first torque. The operator feels the path's torque less ``shift_nm`` (scalar or (…, 1)).
    """
    direction = path.direction
    bound = lower(direction * (path.torque_nm - shift_nm))
    bound *= direction
    signs = np.array([leg.direction for leg in path.legs], float)
    ends = lower(signs * (np.array([leg.end_torque_nm for leg in path.legs]) - shift_nm)) * signs
    start = lower((path.start_torque_nm - shift_nm) * np.array([1.0, -1.0]))
    state = np.clip(state, start[..., :1], -start[..., 1:])
    for k, leg in enumerate(path.legs):
        hold = np.maximum if leg.direction > 0 else np.minimum
        part = bound[..., leg.start : leg.stop]
        hold(part, state, out=part)
        state = hold(state, ends[..., k : k + 1])
    return bound
