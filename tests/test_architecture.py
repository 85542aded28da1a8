"""The house's one direction, read from the imports themselves."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1] / "backdrive_bayes"
PACKAGE = ROOT.name
ORDER = (
    "errors",
    "schemas",
    "number_text",
    "results",
    "records",
    "mechanics",
    "engine",
    "indicators",
    "decisions",
    "pooling",
    "bench",
    "gap",
    "blind",
    "fleet",
    "figures",
    "report",
    "commands",
    "api",
    "__main__",
)
"""A room imports only from itself and from rooms to its left."""

FORBIDDEN = {
    "bench": {"engine", "indicators"},
    # A figure or a report is made from saved results and computes nothing.
    "figures": {"records", "mechanics", "engine", "indicators", "decisions", "bench", "gap", "blind", "pooling", "fleet"},
    "report": {"records", "mechanics", "engine", "indicators", "decisions", "bench", "gap", "blind", "pooling", "fleet"},
}
ALONE = {"mechanics": {"backdrive_bayes.records.reduction", "backdrive_bayes.errors"}}
"""What a room may import from others; mechanics know of a record nothing but its blocks."""
HEAVY = ("matplotlib", "corner", "typst", "dask", "distributed", "pyarrow", "nptdms", "openpyxl", "asammdf")


def module_name(path):
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(p): p for p in sorted(ROOT.rglob("*.py"))}


def absolute(node, name):
    """The module an ImportFrom names, relative imports resolved."""
    if not node.level:
        return node.module or ""
    package = name if MODULES[name].name == "__init__.py" else name.rpartition(".")[0]
    base = package.split(".")[: len(package.split(".")) - node.level + 1]
    return ".".join([*base, *([node.module] if node.module else [])])


@cache
def imports_of(name, source=None):
    """Everything a module imports, at its top or inside functions, as dotted names."""
    found = set()
    for node in ast.walk(ast.parse(source or MODULES[name].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = absolute(node, name)
            found |= {f"{base}.{a.name}" if f"{base}.{a.name}" in MODULES else base for a in node.names}
    return found


def own_imports(name, source=None):
    return {i for i in imports_of(name, source) if i.split(".")[0] == PACKAGE and i != PACKAGE}


def room(name):
    return (name.split(".") + [""])[1]


def wrong_way(name, source=None):
    """Imports of a module that go against the order."""
    here, forbidden = ORDER.index(room(name)), FORBIDDEN.get(room(name), set())
    allowed = ALONE.get(room(name))
    strange = {i for i in own_imports(name, source) if room(i) != room(name) and allowed is not None and i not in allowed}
    return strange | {i for i in own_imports(name, source) if ORDER.index(room(i)) > here or room(i) in forbidden}


def cycle(graph):
    """One cycle of a mapping from names to sets of names, or None."""
    done, trail = set(), []

    def visit(node):
        if node in trail:
            return [*trail[trail.index(node) :], node]
        if node in done:
            return None
        trail.append(node)
        found = next((c for c in map(visit, sorted(graph.get(node, ()))) if c), None)
        trail.pop()
        done.add(node)
        return found

    return next((c for c in map(visit, sorted(graph)) if c), None)


def test_every_room_has_its_place():
    assert {room(m) for m in MODULES} - {""} == set(ORDER)
    assert not own_imports(PACKAGE), "importing the package's root must import nothing"


@pytest.mark.parametrize("name", [m for m in MODULES if room(m)])
def test_module_imports_only_what_stands_before_it(name):
    assert not wrong_way(name)


def test_there_is_no_cycle():
    assert cycle({m: own_imports(m) for m in MODULES}) is None


def test_the_checks_see_what_they_forbid():
    assert wrong_way("backdrive_bayes.records.noise", "from backdrive_bayes.mechanics.cells import Cells")
    assert wrong_way("backdrive_bayes.mechanics.cells", "def f():\n    import backdrive_bayes.engine.infer")
    assert wrong_way("backdrive_bayes.mechanics.cells", "from backdrive_bayes.records.record import Record")
    assert wrong_way("backdrive_bayes.figures.loop", "import backdrive_bayes.indicators.loop")
    assert wrong_way("backdrive_bayes.engine.infer", "from ..indicators.loop import Loops")
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) == ["a", "b", "c", "a"]


def docstring(source):
    return ast.get_docstring(ast.parse(source)) or ""


@pytest.mark.parametrize("name", MODULES)
def test_every_module_says_what_it_is(name):
    assert len(docstring(MODULES[name].read_text(encoding="utf-8"))) > 10


def test_a_comment_is_no_docstring():
    assert not docstring("# What this is.\nx = 1")


def importers_of(library):
    return {m for m in MODULES if any(i.split(".")[0] == library for i in imports_of(m))}


def test_emcee_is_known_to_one_module():
    assert importers_of("emcee") == {"backdrive_bayes.engine.sample"}


@pytest.mark.parametrize("library", HEAVY)
def test_optional_libraries_stay_out_of_the_core(library):
    readers = {"pyarrow", "nptdms", "openpyxl", "asammdf"}
    at_home = {"records"} if library in readers else {"figures", "report", "commands"}
    at_home |= {"fleet"} if library in {"dask", "distributed", "pyarrow"} else set()
    assert {room(m) for m in importers_of(library)} <= at_home


def test_dask_is_known_to_one_module():
    assert importers_of("distributed") == importers_of("dask") == {"backdrive_bayes.fleet.cluster"}


def loaded_after(statement):
    code = f"import sys; {statement}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT.parent)
    return set(done.stdout.split())


def test_the_core_loads_no_optional_library():
    loaded = loaded_after("import backdrive_bayes.engine.infer, backdrive_bayes.indicators.summary")
    assert not loaded & set(HEAVY)
    assert "emcee" in loaded, "the subprocess must have loaded the core for this to mean something"
    assert "pyarrow" in loaded_after("import pyarrow")


@pytest.mark.parametrize("module", ["figures.catalogue", "report.sections"])
def test_figures_and_reports_load_what_reads_results_and_no_more(module):
    loaded = loaded_after(f"import backdrive_bayes.{module}")
    allowed = {"errors", "schemas", "number_text", "results", "figures", "report"}
    assert {room(m) for m in loaded if m.startswith(f"{PACKAGE}.")} <= allowed
    assert not loaded & {"emcee", "arviz", "arviz_stats"}
    assert "matplotlib" in loaded, "the subprocess must have loaded the figures for this to mean something"


def test_importing_the_package_is_light():
    loaded = loaded_after("import backdrive_bayes")
    assert not loaded & {*HEAVY, "numpy", "scipy", "emcee", "xarray", "arviz_stats"}
    assert "numpy" in loaded_after("import backdrive_bayes; backdrive_bayes.Unit")


def test_decisions_load_no_optional_library():
    modules = ", ".join(m for m in MODULES if room(m) == "decisions")
    assert not loaded_after(f"import {modules}") & {*HEAVY}
    assert not loaded_after("import backdrive_bayes.api") & {*HEAVY}


def test_effects_are_named_in_the_registry_only():
    """A new effect is one file and one line: nothing else imports the module of an effect that an answer may name."""
    effects = {m for m in MODULES if ".mechanics.effects." in m} - {f"{PACKAGE}.mechanics.effects.bench_hysteresis"}
    assert len(effects) >= 7
    for effect in effects:
        users = {m for m in MODULES if effect in own_imports(m)}
        assert users <= {"backdrive_bayes.mechanics.registry", *effects}, effect
