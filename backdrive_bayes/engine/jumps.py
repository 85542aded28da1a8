"""Stick-slip: a sawtooth of the angle in the direction of motion, looked for in the samples themselves.

Between leaps the angle hangs behind, at a leap it catches up. Noise, vibration and an encoder's error have no such arrow: teeth
the other way round are weighed against it. So is a trace of teeth, as of every effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.engine.periodic import HARMONICS
from backdrive_bayes.engine.residuals import block_of, residuals
from backdrive_bayes.engine.sawtooth import Series, fit_noise, tooth_gain
from backdrive_bayes.engine.traces import TRACE, trace_probabilities
from backdrive_bayes.records.reduction import Blocks

STEEP = 6.0
"""Slopes beyond so many times the median are clearances being crossed: nothing is looked for there."""
SLOW, AT_REST = 0.1, 0.02
"""Share of a record's travel that is run at less than its slow loading rate, and the share of that rate below which the torque
rests: a contact that nothing pushes on does not leap, and keeps its state until it is pushed on."""
SAMPLES = 4
"""Samples in a correlation time of the noise, fewest samples in a tooth, and fewest teeth in a leg."""
RATIO = 1.35
"""Ratio of the lengths that are averaged over, about the spread of a tooth's length, and of the heights."""
HEIGHTS = 0.5 * RATIO ** np.arange(6)
"""Heights of the teeth in spreads of the residuals that are averaged over; teeth without noise have 2.7."""
SHORTEST_RUN = 20
"""Samples between steep places from which teeth can be told from a slow trend, of degree ``TREND``."""
TREND = 3
SAWTOOTH = np.sqrt(12.0)
"""Height of a sawtooth in its root mean square."""
SEEN = 0.5
"""Share of contacts that stick whose teeth are high and long enough to be seen: a reading without teeth excludes no others."""


@dataclass(frozen=True)
class Jumps:
    """Log Bayes factor of teeth ahead over noise, teeth the other way or a trace of teeth, and the usual size of a leap [rad]."""

    log_factor: float
    size_rad: float


def find_jumps(linear: Linear, wave: float | None = None) -> Jumps:
    """Evidence for leaps in the direction of motion in all records together, which share the torque from leap to leap.

    ``wave`` is the frequency of an encoder's error, which is taken off: an error of the angle looks like teeth too.
    """
    return weigh_teeth(residual_series(linear, wave))


def residual_series(linear: Linear, wave: float | None = None) -> list[Teeth]:
    """Residuals of each record that has enough of them."""
    reduced, found, left = linear.reduced, [], residuals(linear.reduced, linear.predicted)
    for r, (record, blocks, noise) in enumerate(zip(reduced.unit.records, reduced.blocks, reduced.noise, strict=True)):
        slope = np.abs(np.gradient(linear.predicted[r], blocks.mid_s))
        wide = np.maximum.reduce([np.roll(slope, k) for k in (-2, -1, 0, 1, 2)])
        rests, share = standstill(blocks)
        calm = (wide < STEEP * np.median(slope[~rests])) & reduced.settled[r]
        block, rest = block_of(record, blocks), left[r]
        leg, moves = np.where(calm, blocks.leg, -1)[block], ~rests[block]
        if wave is not None:
            rest = without_wave(rest, np.interp(record.time_s, blocks.mid_s, linear.predicted[r]), leg, wave)
        step = float(np.median(np.diff(record.time_s)))
        width = max(1, round(noise.correlation_time_s / SAMPLES / step))
        series = even_series((rest * blocks.direction[blocks.leg[block]])[moves], leg[moves], width)
        if series is not None:
            travel, moving = np.abs(np.diff(blocks.turning_nm)).sum(), (1.0 - share) * reduced.context.duration_s[r]
            rate = float(travel / moving / reduced.torque_scale_nm)
            # Correlated noise as it was estimated holds the teeth themselves.
            found.append(Teeth(series, width * step * rate, TRACE * noise.white_rad))
    return found


def standstill(blocks: Blocks) -> tuple[np.ndarray, float]:
    """Blocks in which the torque rests, (blocks,), and their share of the record's time."""
    span, time = np.abs(np.diff(blocks.edges_nm(), axis=0))[0], blocks.end_s - blocks.begin_s
    rate = span / time
    slowest = np.argsort(rate)
    travel = np.cumsum(span[slowest])
    rests = rate < AT_REST * rate[slowest][np.searchsorted(travel, SLOW * travel[-1])]
    return rests, float(time[rests].sum() / time.sum())


def without_wave(rest, angle, leg, frequency: float) -> np.ndarray:
    """Residuals (samples,) less the wave of the angle, with its harmonics, that fits them best."""
    known = leg >= 0
    phase = 2 * np.pi * frequency * angle[known, None] * np.arange(1, HARMONICS + 1)
    levels = (leg[known, None] == np.unique(leg[known])).astype(float)
    columns = np.hstack([np.sin(phase), np.cos(phase), levels])
    left = rest.copy()
    left[known] -= columns @ np.linalg.lstsq(columns.T @ columns, columns.T @ rest[known], rcond=None)[0]
    return left


def even_series(signed, leg, width: int) -> Series | None:
    """Means over ``width`` samples of residuals (samples,), less a slow trend of each run of one leg; leg -1 is left out."""
    values, fresh = [], []
    for run in np.split(np.arange(leg.size), np.flatnonzero(np.diff(leg)) + 1):
        count = run.size // width
        if leg[run[0]] >= 0 and count >= SHORTEST_RUN:
            mean = signed[run[: count * width]].reshape(count, width).mean(axis=1)
            basis = np.linalg.qr(np.vander(np.linspace(-1, 1, count), TREND + 1))[0]
            values.append(mean - basis @ (basis.T @ mean))
            fresh.append(np.arange(count) == 0)
    return Series(np.concatenate(values), np.concatenate(fresh)) if values else None


@dataclass(frozen=True, eq=False)
class Teeth:
    """One record's residuals; ``step`` is the torque between its samples in shares of the largest, ``trace_rad`` the root mean
    square of a trace of teeth."""

    series: Series
    step: float
    trace_rad: float

    @cached_property
    def levels(self) -> list:
        """The series, its means of two, four, ... samples, and the noise of each."""
        found, series = [], self.series
        while self._longest(series) >= SAMPLES:
            found.append((series, fit_noise(series)))
            series = series.halved()
        return found

    @property
    def lengths(self) -> tuple[float, float]:
        """Shortest and longest torque between leaps that can be seen."""
        return SAMPLES * self.step, self._longest(self.series) * self.step

    def gain(self, length: float, side: int) -> tuple[float, float, float]:
        """Log Bayes factors of teeth of a length in torque and of a trace of them over noise, and the leaps' size [rad]."""
        if not self.lengths[0] <= length <= self.lengths[1]:
            return 0.0, 0.0, 0.0
        samples, level = length / self.step, 0
        while samples >= 4 * SAMPLES and level + 1 < len(self.levels):
            samples, level = samples / 2, level + 1
        series, noise = self.levels[level]
        memories, heights = (noise.memory, noise.memory**2), side * HEIGHTS
        found = np.array([[tooth_gain(series, noise, m, h, samples) for h in heights] for m in memories])
        sizes = trace_probabilities(HEIGHTS * noise.scale / SAWTOOTH, RATIO, self.trace_rad)
        trace = log_mean([logsumexp(np.r_[0.0, row], b=sizes) for row in found])
        return float(log_mean(found)), float(trace), float(HEIGHTS[int(np.argmax(found.max(axis=0)))] * noise.scale)

    @staticmethod
    def _longest(series: Series) -> float:
        return np.diff(np.r_[np.flatnonzero(series.fresh), series.value.size]).max() / SAMPLES


def weigh_teeth(records: list[Teeth]) -> Jumps:
    """Evidence of all records; that of every length is averaged."""
    if not records:
        return Jumps(0.0, 0.0)
    shortest, longest = min(t.lengths[0] for t in records), max(t.lengths[1] for t in records)
    lengths = shortest * RATIO ** np.arange(1 + int(np.log(max(longest / shortest, 1.0)) / np.log(RATIO)))
    ahead, back = (np.array([[t.gain(x, side) for t in records] for x in lengths]) for side in (1, -1))
    total, best = ahead.sum(axis=1), ahead[int(np.argmax(ahead[:, :, 0].sum(axis=1)))]
    against = log_mean([0.0, log_mean(back[:, :, 0].sum(axis=1)), log_mean(total[:, 1])])
    seen = log_mean(total[:, 0]) - against
    return Jumps(float(np.logaddexp(np.log(1.0 - SEEN), np.log(SEEN) + seen)), float(best[int(np.argmax(best[:, 0])), 2]))
