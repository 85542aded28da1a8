"""Pages and tables that are read from the package and its committed results, so that they cannot disagree with them."""

from __future__ import annotations

import contextlib
import inspect
import io
import os
import re
import tomllib
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import msgspec
import numpy as np

import backdrive_bayes.schemas
from backdrive_bayes.commands.main import VERBS, main
from backdrive_bayes.engine import (
    covariance,
    diagnostics,
    disturbance,
    flanks,
    infer,
    linearise,
    parameters,
    periodic,
    prediction,
    reduced,
    sample,
    search,
    traces,
)
from backdrive_bayes.gap import examine, probabilities, properties, shrink
from backdrive_bayes.indicators import same_loop
from backdrive_bayes.indicators.draws import UNITS
from backdrive_bayes.mechanics import clearance, friction, history, part, reducer
from backdrive_bayes.mechanics.effects import noncongruent_loops, viscoelastic_creep
from backdrive_bayes.mechanics.registry import LIBRARY

NUMBERS = {
    "thresholds": str(friction.THRESHOLDS.size),
    "read_outs": str(len(friction.READ_OUTS) - 1),
    "seen": f"{friction.LEFT_OUT:g}",
    "flanks": str(search.MOST_FLANKS),
    "ratios": str(flanks.RATIOS.size),
    "film": f"{history.FILM:g}",
    "resting": f"{history.RESTING:g}",
    "noncongruent": f"{noncongruent_loops.USUAL:g}",
    "bent": f"{linearise.BENT:g}",
    "harmonics": str(periodic.HARMONICS),
    "shared": f"{part.SHARED:g}",
    "alike": f"{clearance.ALIKE:g}",
    "largest_drag": f"{clearance.LARGEST_DRAG:g}",
    "power": f"{infer.POWER:.2f}",
    "power_dof": f"{infer.POWER_DOF:g}",
    "reached": f"{100 * infer.REACHED:g} %",
    "max_rhat": f"{diagnostics.MAX_RHAT:g}",
    "min_ess": f"{diagnostics.MIN_ESS:g}",
    "ensembles": str(sample.ENSEMBLES),
    "least_closed": f"{100 * examine.LEAST_CLOSED:g} %",
    "usual": f"{properties.USUAL:g}",
    "large": f"{properties.LARGE:g}",
    "own_share": f"{properties.OWN[0]:g}",
    "own_size": f"{properties.OWN[1]:g}",
    "softening_share": f"{properties.SOFTENING[0]:g}",
    "softening_size": f"{properties.SOFTENING[1]:g}",
    "property_odds": f"{properties.ODDS:g}",
    "lowest": f"{properties.TORQUES[0]:g}",
    "highest": f"{properties.TORQUES[-1]:g}",
    "widths": ", ".join(f"{w:g}" for w in properties.WIDTHS),
    "onsets": ", ".join(f"{q:g}" for q in properties.ONSETS),
    "before": f"{properties.BEFORE:g}",
    "same_torque": f"{100 * prediction.SLACK:g} %",
    "same_rate": f"{100 * same_loop.SAME_RATE:g} %",
    "smallest_gap": f"{100 * shrink.SMALLEST_GAP:g} %",
    "sure": f"{properties.SURE:g}",
    "lowest_line": f"{disturbance.SIZES[0]:.1g}",
    "highest_line": f"{disturbance.SIZES[-1]:g}",
    "line_tolerance": f"{disturbance.TOLERANCE:g}",
    "nyquist": f"{disturbance.NYQUIST:g}",
    "line_periods": f"{disturbance.PERIODS:g}",
    "hann": f"{disturbance.HANN:g}",
    "above": f"{traces.ABOVE:g}",
    "creep_times": str(viscoelastic_creep.TIMES),
    "creep_before": f"{viscoelastic_creep.BEFORE:g}",
    "unread": f"{reduced.UNREAD:g}",
    "zero": f"{reduced.ZERO:g}",
    "unread_length": f"{reduced.UNREAD_LENGTH:g}",
    "bend_error": f"{covariance.BEND_ERROR:g}",
    "trace": f"{traces.TRACE:g}",
}
"""Constants of the code that the pages name."""
_LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((?!https?:)[^)]+\)")
_PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")


def write_pages(source: Path) -> None:
    """Write everything below ``source``/_generated; unchanged files keep their time."""
    root, parts = source.parent, source / "_generated" / "parts"
    parts.mkdir(parents=True, exist_ok=True)
    _write(parts / "verbs.md", _verbs())
    _write(parts / "effects.md", _effects())
    _write(parts / "parameters.md", _parameters())
    _write(parts / "class.md", _class())
    _write(parts / "calibration.md", _calibration())
    _write(parts / "units.md", _units())
    _write(parts / "schemas.md", _schemas("_file"))
    _write(parts / "result-schemas.md", _schemas("_json", "_parts"))
    _write(parts / "promises.md", _promises(root, source))
    reports = source / "_generated" / "reports"
    reports.mkdir(exist_ok=True)
    found = {p.parent.name: p for p in sorted((root / "reports").glob("*/README.md"))}
    for old in reports.glob("*.md"):
        if old.stem not in found:
            old.unlink()
    for name, path in found.items():
        _write(reports / f"{name}.md", _report(path))


def _write(path, text):
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _table(head, rows) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(c).replace("|", "\\|").replace("\n", " ") for c in row) + " |" for row in lines) + "\n"


def _help(*arguments) -> str:
    os.environ |= {"COLUMNS": "100", "NO_COLOR": "1"}
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        main([*arguments, "--help"])
    return text.getvalue().rstrip()


def _verbs() -> str:
    return "\n".join(f"## {verb}\n\n```text\n{_help(verb)}\n```\n" for verb in VERBS)


def _effects() -> str:
    rows = [
        [f"`{name}`", term.breaks, term.signature, "reducer" if term.of_reducer else "measuring channel", term.source]
        for name, terms in LIBRARY.items()
        for term in terms[:1]
    ]
    return _table(["effect", "breaks", "signature", "where", "source"], rows)


def _parameters() -> str:
    rows = [[f"`{p.name}`", p.symbol, p.module, p.unit, p.definition] for p in parameters.PARAMETERS]
    return _table(["name", "symbol", "module", "unit", "definition"], rows)


def _class() -> str:
    parts = reducer.ReducerClass(np.array([0.0, 1.0])).parts
    rows = [[f"`{p.name}`", p.module, f"{np.exp(p.log_scale[0]):.3g}", f"{p.log_scale[1]:g}"] for p in parts]
    return _table(["part", "module", "median of σ_b, in the angle scale", "standard deviation of ln σ_b"], rows)


def _calibration() -> str:
    rows = [[f"`{name}`", f"{value:g}"] for name, value in vars(probabilities.CALIBRATION).items()]
    return _table(["number", "value"], rows)


def _units() -> str:
    return _table(["name", "unit"], [[f"`{name}`", unit] for name, unit in UNITS.items()])


def _schemas(*endings) -> str:
    """Every class of the modules with those endings: its keys, each with what it holds."""
    text = []
    for module in iter_modules(backdrive_bayes.schemas.__path__, "backdrive_bayes.schemas."):
        if not module.name.endswith(endings):
            continue
        loaded = import_module(module.name)
        shapes = [
            shape
            for _, shape in inspect.getmembers(loaded, inspect.isclass)
            if issubclass(shape, msgspec.Struct) and shape.__module__ == module.name
        ]
        if shapes:
            text.append(f"### {(inspect.getdoc(loaded) or module.name).splitlines()[0].rstrip('.')}\n")
        for shape in sorted(shapes, key=lambda s: inspect.getsourcelines(s)[1], reverse=True):
            text.append(f"**{shape.__name__}**: {(inspect.getdoc(shape) or '').splitlines()[0]}\n")
            text.append(_table(["key", "holds", "needed"], _keys(shape)))
    return "\n".join(text)


def _keys(shape):
    found = msgspec.inspect.type_info(shape)
    # A key that may be left out is left out where it has no value, never null.
    words = [(f, _words(f.type) if f.required else _words(f.type).removesuffix(" or null")) for f in found.fields]
    return [[f"`{f.encode_name}`", text, "yes" if f.required else "no"] for f, text in words]


def _words(kind) -> str:
    """A type in words: its title where it has one."""
    info = msgspec.inspect
    if isinstance(kind, info.Metadata):
        return (kind.extra_json_schema or {}).get("title") or _words(kind.type)
    if isinstance(kind, info.UnionType):
        return " or ".join(dict.fromkeys("null" if isinstance(k, info.NoneType) else _words(k) for k in kind.types))
    if isinstance(kind, info.LiteralType):
        return " or ".join(f"`{v}`" for v in kind.values)
    if isinstance(kind, info.StructType):
        return kind.cls.__name__
    if isinstance(kind, info.ListType | info.VarTupleType):
        return f"list of {_words(kind.item_type)}"
    if isinstance(kind, info.DictType):
        return f"table of {_words(kind.value_type)}"
    if isinstance(kind, info.AnyType):
        return "anything"
    plain = {"StrType": "text", "FloatType": "number", "IntType": "whole number", "BoolType": "true or false"}
    return plain.get(type(kind).__name__, type(kind).__name__.removesuffix("Type").lower())


def _promises(root, source) -> str:
    """The promises of promises.toml with the report that shows each, or that none has been committed."""
    rows = []
    for promise in tomllib.loads((source / "promises.toml").read_text(encoding="utf-8"))["promise"]:
        name = promise["report"]
        there = (root / "reports" / name / "README.md").is_file()
        result = f"[{name}](_generated/reports/{name}.md)" if there else "no result committed yet"
        rows.append([promise["text"], f"`{promise['script']}`", result])
    return _table(["what", "made by", "figures"], rows)


def _report(path) -> str:
    """A report's text; its pictures are those beside it, its links to data become names."""
    folder = f"../../../reports/{path.parent.name}"
    text = _PICTURE.sub(rf"![\1]({folder}/\2)", path.read_text(encoding="utf-8"))
    return _LINK.sub(r"\1", text)
