"""First-order relaxation along sampled inputs, exact for inputs that are straight between samples."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.kernels import relaxed


def relax(signal, time_s, constant_s, start):
    """Relaxed signal, shape (…, samples), for ``signal`` of that shape and ``time_s`` (samples,): x' = (signal - x) / T.

    ``constant_s`` (…, 1) is the time constant, ``start`` (…, 1) the state at the first sample.
    """
    samples = np.shape(time_s)[0]
    shape = np.broadcast_shapes(np.shape(signal)[:-1], np.shape(constant_s)[:-1], np.shape(start)[:-1])
    signal = np.ascontiguousarray(np.broadcast_to(signal, (*shape, samples)), float).reshape(-1, samples)
    constant, start = (np.ascontiguousarray(np.broadcast_to(v, (*shape, 1)), float).ravel() for v in (constant_s, start))
    out = np.empty(signal.shape)
    relaxed(signal, np.diff(time_s), constant, start, out)
    return out.reshape(*shape, samples)
