"""A virtual bench whose mechanics are a rigid-body engine's: MuJoCo, an optional extra."""

from backdrive_bayes.bench.engine.mechanics import MECHANICS

__all__ = ["MECHANICS"]
