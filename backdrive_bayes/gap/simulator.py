"""Somebody's simulator, known from what it answered to torque paths: read through the bench and fitted with the class."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.known_truth import BenchNoise, angle_noise
from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.prediction import SLACK
from backdrive_bayes.engine.reduced import Reduced, reduce_unit
from backdrive_bayes.errors import BadInput
from backdrive_bayes.gap import probabilities
from backdrive_bayes.gap.averaged import posterior_of
from backdrive_bayes.gap.hypotheses import weigh
from backdrive_bayes.gap.properties import find_properties
from backdrive_bayes.indicators.same_loop import same_rate
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.noise import ChannelRecord, NoiseEstimate, estimate_common_noise
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.reduction import Blocks, loading_rate

FINE = 400
"""Blocks a leg in which a simulator's own angle is taken along a path that it was asked."""
NODES = (np.arange(5) + 0.5) / 5
"""Where in a block an angle is taken for its mean."""
FEWEST, MOST = 2000, 400_000
"""Samples of a simulated record as the bench would have read it."""


@dataclass(frozen=True, eq=False)
class Simulator:
    """What a simulator's records tell of it.

    ``posterior`` is that of the class with its likeliest effects, ``answers`` are probabilities by the names that a diagnosis of
    its records gives, ``reduced`` its records as they are, ``added`` the noise with which they were read.
    """

    unit: Unit
    reduced: Reduced
    posterior: Posterior
    answers: dict[str, float]
    added: BenchNoise

    @property
    def effects(self) -> tuple[str, ...]:
        """Effects that it has itself, () for none, ("unknown",) for structure that no listed effect explains."""
        return effects_of(next(iter(self.answers)))

    def same_path(self, measured: Reduced, record: int) -> int | None:
        """Number of the simulator's record along the path of a measured one, None where it was not asked that path."""
        blocks, rate = measured.blocks[record], measured.context.rate[record] * measured.torque_scale_nm
        least = SLACK * np.abs(blocks.turning_nm).max()
        for number, own in enumerate(self.reduced.blocks):
            theirs = self.reduced.context.rate[number] * self.reduced.torque_scale_nm
            alike = own.turning_nm.size == blocks.turning_nm.size and same_rate(theirs, rate)
            if alike and np.abs(own.turning_nm - blocks.turning_nm).max() < least:
                return number
        return None

    def along(self, measured: Reduced, record: int) -> np.ndarray:
        """Angle [rad] that it answers at the blocks of a measured record, (blocks,): its own where it was asked this path, else
        the mean of its posterior."""
        blocks, same = measured.blocks[record], self.same_path(measured, record)
        return _along(self.reduced.blocks[same], blocks) if same is not None else _predicted(self.posterior, blocks)


def effects_of(answer: str) -> tuple[str, ...]:
    """Effects that an answer names, () for none."""
    return () if answer == "none" else tuple(answer.split("+"))


def read_simulator(simulated: Unit, measured: Reduced, seed: int, note: Callable[[str], None] = lambda text: None) -> Simulator:
    """Fit the class to a simulator's records as ``measured``'s bench would have read them, and weigh effects in them."""
    reduced, rng = reduce_unit(simulated, FINE), np.random.default_rng([seed, 9])
    unit, added = through_bench(simulated, reduced, measured, rng)
    weighed = weigh(prepare(unit, note=lambda text: note(f"simulator: {text}")))
    properties = {p.name: p.probability for p in find_properties(weighed, rng)}
    answers = probabilities.labels(weighed.joint(properties))
    note("simulator: sampling")
    posterior = posterior_of(weighed, effects_of(next(iter(answers))), seed, note)
    return Simulator(simulated, reduced, posterior, answers, added)


def require_reach(simulated: Unit, unit: Unit) -> None:
    """BadInput where the unit's torques turn beyond those that the simulator was asked, noise of the reading aside."""
    asked, measured = (max(float(np.abs(b.turning_nm).max()) for b in reduce_unit(u).blocks) for u in (simulated, unit))
    if measured > (1.0 + SLACK) * asked:
        reach = f"torques up to {measured:.4g} N·m, the largest of {unit.name}"
        raise BadInput(f"simulated records of {simulated.name}", reach, f"{asked:.4g} N·m")


def through_bench(simulated: Unit, reduced: Reduced, measured: Reduced, rng) -> tuple[Unit, BenchNoise]:
    """The simulated records with as many samples a torque travelled as the measured one nearest in rate and as much noise, and
    what was added.

    What can be told of the simulator is then what can be told of the unit. Records noisier than the bench stay as they are.
    """
    real = measured.unit.records
    density = np.array([r.time_s.size / _travel(b) for r, b in zip(real, measured.blocks, strict=True)])
    rates = [np.log(r.context.rate * r.torque_scale_nm) for r in (reduced, measured)]
    nearest = density[np.abs(rates[0][:, None] - rates[1]).argmin(axis=1)]
    step = float(np.median([np.median(np.diff(r.time_s)) for r in real]))
    own_records = zip(simulated.records, reduced.blocks, nearest, strict=True)
    records = [_sampled(r, each * _travel(b)) for r, b, each in own_records]
    own, bench = _noise(records), measured.noise[0]
    added = BenchNoise(
        _missing(bench.white_rad, own.white_rad),
        _missing(bench.correlated_rad, own.correlated_rad),
        float(np.median([n.correlation_time_s for n in measured.noise])),
        _missing(float(np.median([n.torque_nm for n in measured.noise])), own.torque_nm),
    )
    read = tuple(_read(r, step, added, rng) for r in records)
    return replace(simulated, records=read, rated_torque_nm=measured.unit.rated_torque_nm, file_sha256=""), added


def _travel(blocks: Blocks) -> float:
    return float(np.abs(np.diff(blocks.turning_nm)).sum())


def _sampled(record: Record, samples: float) -> Record:
    time = np.linspace(record.time_s[0], record.time_s[-1], int(np.clip(samples, FEWEST, MOST)))
    torque, angle = (np.interp(time, record.time_s, values) for values in (record.torque_nm, record.angle_rad))
    return replace(record, time_s=time, torque_nm=torque, angle_rad=angle, file_sha256="")


def _noise(records: list[Record]) -> NoiseEstimate:
    channels = [ChannelRecord(r.time_s, r.torque_nm, r.angle_rad, find_segments(r.time_s, r.torque_nm)) for r in records]
    return estimate_common_noise(channels)[0]


def _missing(wanted: float, own: float) -> float:
    return float(np.sqrt(max(wanted**2 - own**2, 0.0)))


def _read(record: Record, step_s: float, added: BenchNoise, rng) -> Record:
    samples = record.time_s.size
    angle = record.angle_rad + angle_noise(samples, step_s, added, rng)
    return replace(record, angle_rad=angle, torque_nm=record.torque_nm + added.torque_nm * rng.standard_normal(samples))


def _along(own: Blocks, blocks: Blocks) -> np.ndarray:
    """Angle of one record at the blocks of another along the same path, leg by leg over the torque."""
    found, (low, high) = np.empty(blocks.torque_nm.size), blocks.edges_nm()
    for k, sign in enumerate(own.direction):
        theirs, here = own.leg == k, blocks.leg == k
        ends, torque, angle = own.turning_nm[k : k + 2], own.torque_nm[theirs], own.angle_rad[theirs]
        first, last = (_beyond(torque[p], angle[p], end) for p, end in zip((slice(3), slice(-3, None)), ends, strict=True))
        nodes = low[here] + (high - low)[here] * NODES[:, None]
        found[here] = np.interp(sign * nodes, sign * np.r_[ends[0], torque, ends[1]], np.r_[first, angle, last]).mean(axis=0)
    return found


def _beyond(torque, angle, at: float) -> float:
    """Angle at a torque on the straight line through the first and last of some points."""
    run = torque[-1] - torque[0]
    return float(angle[0] + (at - torque[0]) * (angle[-1] - angle[0]) / run if run else angle[-1])


def _predicted(posterior: Posterior, blocks: Blocks) -> np.ndarray:
    """The posterior's mean angle at the blocks; a record that begins at its largest torque had turned before."""
    low, high = blocks.edges_nm()
    share = np.r_[0.0, NODES]
    torque = (low + (high - low) * share[:, None]).T.ravel()
    time = (blocks.begin_s + (blocks.end_s - blocks.begin_s) * share[:, None]).T.ravel()
    first, rate = blocks.turning_nm[0], loading_rate(blocks.path_s, blocks.path_nm)
    before = np.array([0.0, -first] if abs(first) >= 0.9 * np.abs(blocks.turning_nm).max() else [])
    early = time[0] - np.cumsum(np.abs(np.diff(np.r_[before, first]))[::-1])[::-1] / rate
    angle = posterior.thinned(50).along(np.r_[early, time], np.r_[before, torque]).mean(axis=0)
    return angle[before.size :].reshape(-1, share.size)[:, 1:].mean(axis=1)
