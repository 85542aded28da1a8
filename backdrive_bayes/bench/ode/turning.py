"""Small steps of a reducer's parameters: what a fit could re-tune."""

from __future__ import annotations

from dataclasses import replace

from backdrive_bayes.bench.ode.reducer import OdeReducer

IN_PROPORTION = ("angle_rad", "drag", "engagement", "friction", "load_friction", "presliding", "bristle_ratio")
IN_SHARES = ("clearance_share", "mesh_share", "gap_split", "first_load_share", "bristle_share", "bristle_power")
HARDENING = ("contact_power", "flank_spread")


def turned(reducer: OdeReducer, held: tuple[str, ...] = ()) -> tuple[OdeReducer, ...]:
    """The reducer with each parameter in turn moved by a small step, except those of the ``held`` members."""
    names = [n for n in IN_PROPORTION if not (n == "load_friction" and "load_dependent_friction" in held)]
    moved = [replace(reducer, **{n: 1.02 * getattr(reducer, n)}) for n in names if getattr(reducer, n) > 0.0]
    shares = (*IN_SHARES, *(() if "hardening_stiffness" in held else HARDENING))
    return (*moved, *(replace(reducer, **{n: getattr(reducer, n) + _step(n, reducer)}) for n in shares))


def _step(name, reducer):
    inward = -1.0 if name != "contact_power" and getattr(reducer, name) > 0.5 else 1.0
    return 0.02 * inward
