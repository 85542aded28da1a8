"""First-order relaxation along sampled inputs, exact for inputs that are straight between samples.

x' = (input - x) / T is a linear recursion over samples; it is solved by doubling (an associative scan), in log2(samples)
passes over whole arrays instead of a loop over samples.
"""

from __future__ import annotations

import numpy as np


def relax(signal, time_s, constant_s, start):
    """Relaxed signal, shape (…, samples), for ``signal`` of that shape and ``time_s`` (samples,).

    ``constant_s`` (…, 1) is the time constant, ``start`` (…, 1) the state at the first sample.
    """
    signal = np.asarray(signal, float)
    ratio = np.diff(time_s) / constant_s
    decay = np.exp(-ratio)
    # Mean weight of the input at the interval's end; expm1 keeps it accurate for short intervals.
    share = -np.expm1(-ratio) / np.maximum(ratio, 1e-300)
    late = np.where(ratio > 1e-9, 1 - share, 0.5 * ratio)
    drive = late * signal[..., 1:] + (1 - decay - late) * signal[..., :-1]
    gain = np.concatenate([np.zeros_like(decay[..., :1]), decay], axis=-1)
    state = np.concatenate([start + np.zeros_like(drive[..., :1]), drive], axis=-1)
    gain = np.broadcast_to(gain, state.shape).copy()
    step = 1
    while step < state.shape[-1]:
        state[..., step:] += gain[..., step:] * state[..., :-step]
        gain[..., step:] *= gain[..., :-step]
        step *= 2
    return state
