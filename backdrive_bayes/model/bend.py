"""A line with a bend: what hardening and softening are made of."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.kernels import bent


def bent_line(torque, knee, straight, bend) -> np.ndarray:
    """straight·τ + bend·tanh(τ/knee), shape (…, samples); ``torque`` (…, samples) or (samples,), the others (…, 1)."""
    knee, straight, bend = np.broadcast_arrays(knee, straight, bend)
    shape = (*np.broadcast_shapes(knee.shape[:-1], torque.shape[:-1]), torque.shape[-1])
    out, torque = np.empty(shape), np.broadcast_to(torque, shape)
    scalars = (np.broadcast_to(v, (*shape[:-1], 1)).reshape(-1) for v in (knee, straight, bend))
    bent(torque.reshape(-1, shape[-1]), *scalars, out.reshape(-1, shape[-1]))
    return out
