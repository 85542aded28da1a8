"""The effects that a diagnosis knows by name."""
