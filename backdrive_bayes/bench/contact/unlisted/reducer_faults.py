"""Unlisted effects inside the reducer: flanks, wear, temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect, loaded_angle
from backdrive_bayes.bench.draws import log_uniform, sign


@dataclass(frozen=True)
class PittedFlank(ContactEffect):
    """A pit that the contact runs through at one output angle; ``place`` and ``width`` are angle shares, strength its depth.

    The pit's sides are those of a sphere: it is left as it is entered, under whatever load.
    """

    place: float
    width: float
    direction: float

    def deflect(self, test, run):
        """Angle lost in the pit."""
        off = (run.angle - self.place) / self.width
        return self.direction * self.strength * np.maximum(1.0 - off**2, 0.0) ** 1.5


@dataclass(frozen=True)
class BrokenTooth(ContactEffect):
    """Beyond output angle ``place`` one tooth less carries, back in after ``width``; strength is the extra turn at T_r."""

    place: float
    width: float
    edge: float

    def deflect(self, test, run):
        """Extra turn where the tooth is missing."""
        rise, fall = ((run.angle - at) / self.edge for at in (self.place, self.place + self.width))
        missing = np.clip(rise, 0.0, 1.0) - np.clip(fall, 0.0, 1.0)
        return self.strength * missing * np.sign(run.mesh[:, 0]) * np.abs(run.mesh[:, 0]) ** (2.0 / 3.0)


@dataclass(frozen=True)
class FlankWear(ContactEffect):
    """Gaps that open with the flanks' work during the test (Archard, J. Appl. Phys. 24, 1953) and with each record before it.

    Strength is the opening for one unit (T_r times the angle scale) of work; a record counts as ``per_record`` units.
    """

    per_record: float

    most = 0.5

    def chain(self, test, chain):
        """Chain that wears."""
        return chain._replace(worn=self.strength * self.per_record * test.where.index / test.reducer.stages, wear=self.strength)


@dataclass(frozen=True)
class WarmingContacts(ContactEffect):
    """Contacts get softer or stiffer by strength as the unit warms over ``scale_s``; between records, each at one temperature."""

    scale_s: float
    direction: float

    guess = 0.05
    most = 0.9

    def chain(self, test, chain):
        """Chain at this record's temperature."""
        warm = 1.0 - np.exp(-(test.where.start_s + 0.5 * test.where.path.end_s) / self.scale_s) - 0.5
        factor = 1.0 + self.direction * self.strength * warm
        return chain._replace(stiff_up=chain.stiff_up * factor, stiff_down=chain.stiff_down * factor)


@dataclass(frozen=True)
class EccentricStage(ContactEffect):
    """Run-out of a fast stage, felt in proportion to the load; ``period`` is an output angle share, strength the turn at T_r."""

    period: float
    phase: float

    def deflect(self, test, run):
        """Periodic turn."""
        return self.strength * np.abs(run.mesh[:, -1]) * np.sin(2 * np.pi * run.angle / self.period + self.phase)


def draw_pit(rng, reducer):
    """Anywhere on the loaded flanks, over a fifth of their turn at most."""
    width = (1.0 - reducer.clearance_share) * rng.uniform(0.08, 0.2)
    return PittedFlank(0.0, loaded_angle(rng, reducer), width, sign(rng))


def draw_broken(rng, reducer):
    """On either loaded side."""
    loaded = 1.0 - reducer.clearance_share
    width, middle = loaded * rng.uniform(0.15, 0.35), loaded_angle(rng, reducer, 0.3, 0.75)
    return BrokenTooth(0.0, middle - 0.5 * width, width, loaded * rng.uniform(0.01, 0.05))


def draw_wear(rng, reducer):
    """More of it during the test, or between records."""
    return FlankWear(0.0, log_uniform(rng, 0.3, 5.0))


def draw_warming(rng, reducer):
    """One to five minutes, softer or stiffer."""
    return WarmingContacts(0.0, log_uniform(rng, 60.0, 300.0), sign(rng))


def draw_eccentric(rng, reducer):
    """Two to eight periods while the flanks are loaded."""
    return EccentricStage(0.0, (1.0 - reducer.clearance_share) * log_uniform(rng, 0.25, 1.0), rng.uniform(0.0, 2 * np.pi))
