"""What only the bench knows of a unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from backdrive_bayes.bench.chain import Chain
from backdrive_bayes.bench.channel_noise import ChannelNoise
from backdrive_bayes.bench.loop_truth import HeldRecord
from backdrive_bayes.bench.protocol import BenchEffect
from backdrive_bayes.bench.rig import Rig
from backdrive_bayes.bench.soil import Trace
from backdrive_bayes.records.record import Unit


@dataclass(frozen=True, eq=False)
class PlantedEffect:
    """An effect in a unit: its name on the bench, what a diagnosis should answer, and how far it stands out.

    ``height`` is what severity.py defines, in noise standard deviations; it falls short of ``severity`` where ``limited``.
    """

    name: str
    answer: str
    severity: float
    effect: BenchEffect
    height: float
    limited: bool


@dataclass(frozen=True, eq=False)
class RecordTruth:
    """Noise-free truth of one record: arrays of shape (samples,), at the true ``time_s`` of the samples.

    ``torque_nm`` is as commanded, ``angle_rad`` as read, traces included, the rig's unread torques not. ``effect_rad`` is what
    the planted effects make of it: the angle with them less that without, and less the record's mean, which an encoder's offset
    hides. ``remainder_rad`` is the part of it that the reducer's parameters cannot absorb (severity.py), computed on coarse
    samples. ``noise_rad`` is the noise's total standard deviation. ``indicators`` are of the reducer's own settled loop, in SI
    units, ``clean_indicators`` the same without planted effects.
    """

    time_s: np.ndarray
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    effect_rad: np.ndarray
    remainder_rad: np.ndarray
    noise_rad: np.ndarray
    indicators: dict[str, float]
    clean_indicators: dict[str, float]


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth about a unit; ``answer`` is what a diagnosis should say, () for none.

    ``remainder`` (records, coarse samples) is what cannot be absorbed of the planted effects together, in noise sd.
    """

    bench: str
    kind: str
    answer: tuple[str, ...]
    planted: tuple[PlantedEffect, ...]
    reducer: Any
    noise: ChannelNoise
    chain: Chain
    rig: Rig
    traces: tuple[Trace, ...]
    records: tuple[RecordTruth, ...]
    remainder: np.ndarray
    held: HeldRecord


@dataclass(frozen=True, eq=False)
class BenchUnit:
    """A unit as a reader would give it, and the truth about it."""

    unit: Unit
    truth: Truth
