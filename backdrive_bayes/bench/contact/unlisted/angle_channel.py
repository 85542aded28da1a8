"""Unlisted effects of the angle's reading and of the sensor's mount."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect, loaded_angle
from backdrive_bayes.bench.draws import sign


@dataclass(frozen=True)
class MainsHum(ContactEffect):
    """Pick-up at ``frequency_hz`` whose peaks are cut off at ``clip`` of their height; strength is angle share."""

    frequency_hz: float
    phase: float
    clip: float

    of_reducer = False

    def read(self, test, time_s, angle):
        """Humming reading."""
        turn = 2 * np.pi * self.frequency_hz * (test.where.start_s + time_s) + self.phase
        return angle + self.strength * np.clip(np.sin(turn), -1.0, self.clip)


@dataclass(frozen=True)
class MountStep(ContactEffect):
    """The encoder's mount gives way in every ``every``-th record from the first on, at a share ``when`` of it.

    It moves by strength (angle share), by a jump and a settling over ``settling`` of the record.
    """

    every: int
    when: float
    settling: float
    direction: float

    of_reducer = False

    def read(self, test, time_s, angle):
        """Reading with a step."""
        end = test.where.path.end_s
        past = np.maximum(time_s - self.when * end, 0.0) / (self.settling * end)
        moved = np.where(past > 0.0, 1.0 - 0.4 * np.exp(-past), 0.0)
        return angle + self.direction * self.strength * moved * (test.where.index % self.every == 0)


@dataclass(frozen=True)
class RockingFoot(ContactEffect):
    """The stand rocks over onto another foot at load ``over`` and falls back at ``back``; strength is angle share."""

    over: float
    back: float
    side: float

    of_reducer = False

    def deflect(self, test, run):
        """Angle of the stand."""
        pushed, tipped, angle = self.side * run.load, False, np.zeros(run.load.size)
        for k, push in enumerate(pushed.tolist()):
            tipped = push > self.over if not tipped else push > self.back
            angle[k] = tipped
        return self.side * self.strength * angle


@dataclass(frozen=True)
class AngleScale(ContactEffect):
    """The angle's gain is off by strength times one of ``gains``, another in each record."""

    gains: tuple[float, ...]

    of_reducer = False

    def read(self, test, time_s, angle):
        """Reading at a wrong gain."""
        return angle * (1.0 + self.strength * self.gains[test.where.index % len(self.gains)])


@dataclass(frozen=True)
class MissedCounts(ContactEffect):
    """The counter loses counts whenever the angle passes ``marks`` upwards, strength (angle share) each time."""

    marks: tuple[float, ...]

    of_reducer = False

    def deflect(self, test, run):
        """Counts lost so far in the record."""
        lost = np.zeros(run.angle.size)
        for mark in self.marks:
            lost[1:] += (run.angle[:-1] < mark) & (run.angle[1:] >= mark) & (run.time_s[1:] > 0.0)
        return -self.strength * np.cumsum(lost)


def draw_hum(rng, reducer):
    """Mains of 50 or 60 Hz, or a machine nearby at 5-30 Hz."""
    frequency = float(rng.choice([50.0, 60.0, rng.uniform(5.0, 30.0)]))
    return MainsHum(0.0, frequency, rng.uniform(0.0, 2 * np.pi), rng.uniform(0.2, 1.0))


def draw_step(rng, reducer):
    """In each record, in every second or in every third."""
    return MountStep(0.0, int(rng.integers(1, 4)), rng.uniform(0.25, 0.9), rng.uniform(0.005, 0.05), sign(rng))


def draw_foot(rng, reducer):
    """At a third to nearly all of the rated torque."""
    over = rng.uniform(0.35, 0.9)
    return RockingFoot(0.0, over, over - rng.uniform(0.05, 0.3), sign(rng))


def draw_scale(rng, reducer):
    """A gain error for each record."""
    return AngleScale(0.0, tuple(rng.uniform(-1, 1, 8).tolist()))


def draw_counts(rng, reducer):
    """One to three marks that are passed under load."""
    return MissedCounts(0.0, tuple(float(loaded_angle(rng, reducer)) for _ in range(int(rng.integers(1, 4)))))
