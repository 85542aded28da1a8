"""Partial pooling: what the units of a batch have in common, from each unit's stored draws, without fitting any of them again."""
