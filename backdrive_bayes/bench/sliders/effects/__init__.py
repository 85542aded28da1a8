"""The effects that a diagnosis knows by name, one file each."""
