"""Command line that the examples share."""

import argparse
from pathlib import Path


def options(*units, out):
    """Units, limits and the folder for results."""
    parser = argparse.ArgumentParser()
    parser.add_argument("units", nargs="*", default=list(units))
    parser.add_argument("--limits", type=Path, default=Path("data/limits.toml"))
    parser.add_argument("--out", type=Path, default=Path(out))
    return parser.parse_args()
