"""Bench of contact mechanics: gapped flanks in series, friction by energy minimisation."""

from backdrive_bayes.bench.contact.mechanics import MECHANICS

__all__ = ["MECHANICS"]
