"""The virtual benches by name; each is imported when it is first asked for."""

from __future__ import annotations

from importlib import import_module

from backdrive_bayes.bench.protocol import Mechanics
from backdrive_bayes.errors import BadInput

BENCHES: dict[str, str] = {
    "sliders": "backdrive_bayes.bench.sliders",
    "contact": "backdrive_bayes.bench.contact",
    "ode": "backdrive_bayes.bench.ode",
    "mujoco": "backdrive_bayes.bench.engine",
}
"""Name -> package with MECHANICS."""

DEFAULT_BENCH = "sliders"


def find_bench(name: str) -> Mechanics:
    """Mechanics of a bench; BadInput for a name that is none, or where a package that it needs is not installed."""
    if name not in BENCHES:
        raise BadInput("bench", f"one of {', '.join(BENCHES)}", f"'{name}'")
    try:
        return import_module(BENCHES[name]).MECHANICS
    except ImportError as error:
        missing = (error.name or "").split(".")[0]
        if missing == __name__.split(".")[0]:
            raise BadInput(f"bench {name}", "a bench of this version", f"no module {error.name}") from None
        found = f"no package '{missing}': pip install 'backdrive-bayes[bench]'"
        raise BadInput(f"bench {name}", "the packages it needs", found) from None
