"""The bench "ode": bristle friction and contact across clearance, integrated in time."""

from backdrive_bayes.bench.ode.mechanics import MECHANICS

__all__ = ["MECHANICS"]
