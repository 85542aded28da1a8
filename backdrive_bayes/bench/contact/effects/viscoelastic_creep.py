"""Delayed compliance of the teeth, driven by the torque that each mesh passes on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.drawing import log_uniform
from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.relaxation import relax, yielding_relax


@dataclass(frozen=True)
class ViscoelasticCreep(ContactEffect):
    """Teeth that go on bending under load; strength is the delayed turn at T_r once relaxed, angle share.

    ``law`` 'bending' is one Kelvin element, 'prony' three with constants a factor ``ratio`` apart, 'indentation' grows with
    load^(2/3) (Lee and Radok, J. Appl. Mech. 27, 1960), 'yield' rests within ``threshold`` of its target.
    """

    law: str
    constant_s: float
    ratio: float
    threshold: float

    guess = 0.05

    def deflect(self, test, run):
        """Delayed turn of all stages, softer stages creeping more."""
        weight = test.reducer.deflections() / test.reducer.elastic_share
        load = run.mesh @ weight
        if self.law == "indentation":
            load = np.sign(load) * np.abs(load) ** (2.0 / 3.0)
        if self.law == "yield":
            return self.strength * yielding_relax(run.time_s, load, self.constant_s, self.threshold)
        constants = [self.constant_s]
        if self.law == "prony":
            constants = [self.constant_s / self.ratio, self.constant_s, self.constant_s * self.ratio]
        return self.strength * np.mean([relax(run.time_s, load, complex(c)).real for c in constants], axis=0)


def draw(rng, reducer):
    """Time constants from half a second to half a minute, four laws."""
    law = str(rng.choice(["bending", "prony", "indentation", "yield"]))
    return ViscoelasticCreep(0.0, law, log_uniform(rng, 0.5, 30.0), rng.uniform(3.0, 8.0), rng.uniform(0.1, 0.35))
