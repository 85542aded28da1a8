"""A bench of sliders, gaps, stops and dashpots in series."""

from backdrive_bayes.bench.sliders.mechanics import MECHANICS

__all__ = ["MECHANICS"]
