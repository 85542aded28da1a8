"""Covariances of what no model explains: smooth or rough functions of the place on the loop, of time, of the record."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.inference.covariance import local_slope
from backdrive_bayes.inference.discrepancy import LoopCoordinate, amplitude_nm
from backdrive_bayes.inference.problem import Problem

SAME_LOOP = 0.05
"""Relative difference of amplitudes below which two records run the same loop."""
FIRST_LEG_SHARED = 0.5
SHARP = 6.0
RIPPLE = 0.3
"""Error of the torque at which a record's steps come, in standard deviations of the torque's noise."""
STEEP, TURNING = 3.0, 1.0
"""Misfit of the baseline in noise units where the loop is more than ten times as steep as usual, and just after a reversal."""


class Places:
    """Where every block lies: phase on the loop, whether on the first leg, record, time; arrays of shape (blocks,)."""

    def __init__(self, problem: Problem, z):
        data = problem.records
        coordinates = [LoopCoordinate.of(problem, z, r) for r in range(len(data))]
        self.phase = np.concatenate([c.phase(d.path.torque_nm, d.path.direction) for c, d in zip(coordinates, data, strict=True)])
        self.record = np.concatenate([np.full(d.blocks.count.size, r) for r, d in enumerate(data)])
        self.first = np.concatenate([d.blocks.leg == 0 for d in data])
        self.time = np.concatenate(
            [(d.blocks.mid_s - d.blocks.begin_s[0]) / (d.blocks.end_s[-1] - d.blocks.begin_s[0]) for d in data]
        )
        amplitude = np.array([amplitude_nm(problem, r) for r in range(len(data))])
        self.same_loop = np.abs(np.log(amplitude[:, None] / amplitude)) < SAME_LOOP
        span = np.array([np.ptp(d.blocks.angle_rad) for d in data])
        self.relative = (span / span.max())[self.record]
        slopes = [_slope(problem, z, r) for r in range(len(data))]
        self.uncertain = np.concatenate([_uncertain(problem, r, slope) for r, slope in enumerate(slopes)])
        self.ripple = np.concatenate([_ripple(d, slope) for d, slope in zip(data, slopes, strict=True)])

    def _same_record(self):
        return self.record[:, None] == self.record

    def _scaled(self, kernel):
        return kernel * np.outer(self.relative, self.relative)

    def loop(self, length: float) -> np.ndarray:
        """Rough function of the place on the loop (Matérn-1/2 of ``length`` loops), half of it common to equal loops."""
        apart = np.abs(self.phase[:, None] - self.phase)
        apart = np.minimum(apart, 1 - apart)
        share = np.where(self.first[:, None] == self.first, 1.0, FIRST_LEG_SHARED)
        common = 0.5 * self.same_loop[np.ix_(self.record, self.record)] + 0.5 * self._same_record()
        return self._scaled(share * common * np.exp(-apart / length))

    def shape(self, length: float) -> np.ndarray:
        """Function of the place on the loop with smooth and sharp parts, half of it common to all records."""
        apart = np.abs(self.phase[:, None] - self.phase)
        apart = np.sqrt(3) * np.minimum(apart, 1 - apart) / length
        smooth, sharp = ((1 + d) * np.exp(-d) for d in (apart, SHARP * apart))
        common = 0.5 + 0.5 * self._same_record()
        share = np.where(self.first[:, None] == self.first, 1.0, FIRST_LEG_SHARED)
        return common * share * 0.5 * (smooth + sharp)

    def misfit(self, length: float) -> np.ndarray:
        """What a bench that is never quite clean leaves of any model: mostly the same in equal loops, a little of each kind."""
        return 0.6 * self.loop(length) + 0.2 * self.own_loop(length) + 0.2 * self.time_smooth(0.3)

    def sharp(self, length: float) -> np.ndarray:
        """Misfit at steps and reversals, where the baseline's formulas are known least, in noise units squared."""
        return np.outer(self.uncertain, self.uncertain) * self.misfit(length)

    def torque_ripple(self) -> np.ndarray:
        """Covariance [rad²] of loops that are wider or narrower by a torque of each record's own, which shows at steps.

        Ripple of the torque dithers friction and drag, more or less at each rate, and samples have a width.
        """
        return self._same_record() * np.outer(self.ripple, self.ripple)

    def own_loop(self, length: float) -> np.ndarray:
        """The same, each record by itself."""
        apart = np.abs(self.phase[:, None] - self.phase)
        apart = np.minimum(apart, 1 - apart)
        return self._scaled(self._same_record() * np.exp(-apart / length))

    def time_alone(self, length: float) -> np.ndarray:
        """Smooth function of the time within each record (Matérn-3/2 of ``length`` records), as large in small loops."""
        apart = np.sqrt(3) * np.abs(self.time[:, None] - self.time) / length
        return self._same_record() * (1 + apart) * np.exp(-apart)

    def time_smooth(self, length: float) -> np.ndarray:
        """The same, as large as the loop."""
        return self._scaled(self.time_alone(length))

    def time_rough(self, length: float) -> np.ndarray:
        """Rough function of the time within each record (Matérn-1/2), which may jump."""
        apart = np.abs(self.time[:, None] - self.time) / length
        return self._scaled(self._same_record() * np.exp(-apart))


def _slope(problem, z, record):
    """|dθ/dτ| [rad/(N·m)] of a record along the baseline's loop, shape (blocks,)."""
    data = problem.records[record]
    angle = problem.model.angle(problem.values(z, record), data.path)
    return local_slope(data.blocks, angle, RIPPLE * data.noise.torque_nm)


def _ripple(data, slope):
    """What a later step takes from the angle [rad], one standard deviation, shape (blocks,)."""
    return RIPPLE * data.noise.torque_nm * data.path.direction * slope


def _uncertain(problem, record, slope):
    """Size of the baseline's misfit at the steps and reversals of a record, in noise units, shape (blocks,)."""
    blocks, amplitude = problem.records[record].blocks, amplitude_nm(problem, record)
    steep = np.clip((slope / np.median(slope) - 1) / 9, 0, 1)
    begin = blocks.turning_nm[blocks.leg]
    turning = np.where(blocks.leg > 0, np.exp(-np.abs(blocks.torque_nm - begin) / (0.1 * amplitude)), 0.0)
    return STEEP * steep + TURNING * turning
