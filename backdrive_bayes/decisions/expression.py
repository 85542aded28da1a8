"""The small language of claims: comparisons of a unit's quantities, parsed by Python's grammar and run by this file alone.

Allowed are numbers, ``arcmin`` and ``mJ``, the units' letters with an indicator (``A.loop_area_J``, also with ``rate=`` and
``amplitude=``), the functions of ``series.py``, + − * /, comparisons, ``and``, ``or``, ``not``. Anything else is refused
before anything runs. Every value is an array (draws, series) with a series of 1 where there is none, or a plain number.
"""

from __future__ import annotations

import ast
import math
import operator
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.decisions.series import FUNCTIONS
from backdrive_bayes.engine.parameters import PARAMETERS
from backdrive_bayes.indicators.draws import UNITS

CONSTANTS = {"arcmin": math.pi / 10800, "mJ": 1e-3}
LONGEST, MOST_NODES = 600, 150
METHODS = {
    "width_rad": ("torque",),
    "parameter": (),
    "sensitivity": (),
    "least_squares": (),
    "effect": (),
    "amplitude_Nm": (),
    **dict.fromkeys(UNITS, ("rate", "amplitude")),
}
"""What stands after a unit's letter, with its keywords."""
_OPERATORS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
_SYMBOLS = {ast.Lt: "<", ast.LtE: "≤", ast.Gt: ">", ast.GtE: "≥"}
_PLAIN = ("spread", "ratio_of_extremes", "linearity", "log_slope")
_OTHER_UNITS = {"width_rad": "rad", "effect": "1", "sensitivity": "1", "least_squares": "1", "amplitude_Nm": "N·m"}
_PLACES = ("at_lowest", "at_highest")
PLACE = "along"
"""The unit of what tells where: that of the series' own coordinate."""
_TRUTHS = ("rises", "falls", "one_valley", "double_humped")


class Wrong(ValueError):
    """An expression that is not of the language; its text says what is."""


@dataclass(frozen=True, eq=False)
class Expression:
    """A checked expression over the units with the given letters."""

    text: str
    body: ast.expr
    units: frozenset[str]

    @classmethod
    def parse(cls, text: str, letters) -> Expression:
        """Check ``text``; Wrong names the first thing that is not allowed."""
        if not isinstance(text, str) or not text.strip():
            raise Wrong("expected a comparison as text")
        if len(text) > LONGEST:
            raise Wrong(f"expected at most {LONGEST} characters, found {len(text)}")
        try:
            body = ast.parse(text.strip(), mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
            raise Wrong(f"expected a comparison, found '{text[:60]}' ({type(error).__name__})") from None
        nodes = list(ast.walk(body))
        if len(nodes) > MOST_NODES:
            raise Wrong(f"expected a shorter expression than {len(nodes)} parts")
        used = _check(body, frozenset(letters))
        return cls(text.strip(), body, frozenset(used))

    @np.errstate(divide="ignore", invalid="ignore")  # what is not defined in a draw is said in words
    def run(self, look_up, along=None):
        """The value; ``look_up(letter, method, arguments, keywords)`` gives a unit's quantity, ``along`` is the coordinate."""
        return _run(self.body, look_up, along)

    def asked_of(self, method: str) -> list[str]:
        """Letters of the units of which a quantity is asked, sorted."""
        nodes = (n for n in ast.walk(self.body) if isinstance(n, ast.Attribute) and n.attr == method)
        return sorted({n.value.id for n in nodes if isinstance(n.value, ast.Name)})

    def parts(self) -> list[tuple[str, ast.expr, str]]:
        """What stands behind the answer: text, node and unit of every compared quantity and of every tested series."""
        found: dict[str, tuple[str, ast.expr, str]] = {}
        for node in ast.walk(self.body):
            shown = []
            if isinstance(node, ast.Compare):
                shown = [n for n in (node.left, *node.comparators) if _mentions_unit(n)]
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _TRUTHS:
                shown = node.args[:1]
            for n in shown:
                found.setdefault(ast.unparse(n), (ast.unparse(n), n, _unit(n)))
        return list(found.values())

    @np.errstate(divide="ignore", invalid="ignore")
    def run_part(self, node, look_up, along=None):
        """The value of one of :meth:`parts`."""
        return _run(node, look_up, along)


def _check(node, letters) -> set[str]:
    """The letters that a node uses; Wrong where it is not of the language."""
    if isinstance(node, ast.Constant):
        if isinstance(node.value, bool) or not isinstance(node.value, int | float) or not math.isfinite(float(node.value)):
            raise Wrong(f"expected a number, found {node.value!r}")
        return set()
    if isinstance(node, ast.Name):
        if node.id not in CONSTANTS:
            raise Wrong(f"expected one of {', '.join([*CONSTANTS, *(f'{u}.…' for u in sorted(letters))])}, found '{node.id}'")
        return set()
    if isinstance(node, ast.Attribute):
        return _check_quantity(node, letters)
    if isinstance(node, ast.Call):
        return _check_call(node, letters)
    if isinstance(node, ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Compare):
        kinds = [node.op] if not isinstance(node, ast.Compare) else node.ops
        allowed = (*_OPERATORS, ast.USub, ast.UAdd, ast.Not, ast.And, ast.Or)
        if not all(isinstance(k, allowed) for k in kinds):
            raise Wrong("expected + - * / < <= > >= and or not only")
        children = [c for c in ast.iter_child_nodes(node) if isinstance(c, ast.expr)]
        return set().union(*(_check(c, letters) for c in children))
    raise Wrong(f"expected comparisons of indicators, found '{ast.unparse(node)[:40]}'")


def _check_quantity(node, letters):
    if not isinstance(node.value, ast.Name) or node.value.id not in letters:
        raise Wrong(f"expected a unit out of {', '.join(sorted(letters))}, found '{ast.unparse(node.value)[:40]}'")
    if node.attr not in METHODS:
        raise Wrong(f"expected an indicator out of {', '.join(METHODS)}, found '{node.attr}'")
    return {node.value.id}


def _check_call(node, letters):
    if isinstance(node.func, ast.Attribute):
        used = _check_quantity(node.func, letters)
        names = [k.arg for k in node.keywords]
        if any(n not in METHODS[node.func.attr] for n in names):
            raise Wrong(f"expected {' or '.join(METHODS[node.func.attr]) or 'no keywords'} after {node.func.attr}")
        if node.func.attr in UNITS and node.args:
            raise Wrong(f"expected rate= or amplitude= in {node.func.attr}(…)")
        if not all(isinstance(a, ast.Constant) and isinstance(a.value, str) for a in node.args):
            raise Wrong(f"expected names in quotes in {node.func.attr}(…)")
        for k in node.keywords:
            _check(k.value, frozenset())
        return used
    name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
    if name not in FUNCTIONS or len(node.args) != 1:
        raise Wrong(f"expected one of {', '.join(FUNCTIONS)} of one series, found '{ast.unparse(node)[:60]}'")
    if any(k.arg not in ("below", "above") for k in node.keywords):
        raise Wrong(f"expected below= or above= in {name}(…), found '{ast.unparse(node)[:60]}'")
    for k in node.keywords:
        _check(k.value, frozenset())
    return _check(node.args[0], letters)


def _run(node, look_up, along):
    if isinstance(node, ast.Constant):
        return float(node.value)
    if isinstance(node, ast.Name):
        return CONSTANTS[node.id]
    if isinstance(node, ast.Attribute):
        return look_up(node.value.id, node.attr, [], {})
    if isinstance(node, ast.Call):
        if isinstance(node.func, ast.Attribute):
            keywords = {k.arg: _run(k.value, look_up, along) for k in node.keywords}
            return look_up(node.func.value.id, node.func.attr, [a.value for a in node.args], keywords)
        return _series(node, look_up, along)
    if isinstance(node, ast.BoolOp):
        values = [_run(v, look_up, along) for v in node.values]
        return (np.logical_and if isinstance(node.op, ast.And) else np.logical_or).reduce(np.broadcast_arrays(*values))
    if isinstance(node, ast.UnaryOp):
        value = _run(node.operand, look_up, along)
        return np.logical_not(value) if isinstance(node.op, ast.Not) else -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp):
        left, right = (np.asarray(_run(n, look_up, along)) for n in (node.left, node.right))
        return np.asarray(_OPERATORS[type(node.op)](left, right))
    sides = [_run(n, look_up, along) for n in (node.left, *node.comparators)]
    held = [_OPERATORS[type(op)](a, b) for op, a, b in zip(node.ops, sides[:-1], sides[1:], strict=True)]
    return np.logical_and.reduce(np.broadcast_arrays(*held))


def _series(node, look_up, along):
    value = np.asarray(_run(node.args[0], look_up, along))
    if along is None or value.ndim != 2 or value.shape[1] != len(along):
        raise Wrong(f"{node.func.id} needs a series: say along = \"rate\", \"amplitude\" or \"torque\"")
    along, cut = np.asarray(along), {k.arg: _run(k.value, look_up, None) for k in node.keywords}
    # An end of the range belongs to it, rounding aside.
    part = (along <= cut.get("below", np.inf) * (1 + 1e-3)) & (along >= cut.get("above", -np.inf) * (1 - 1e-3))
    if part.sum() < 2:
        raise Wrong(f"{node.func.id} needs a series of two values or more, found {int(part.sum())}")
    return np.asarray(FUNCTIONS[node.func.id](value[:, part], along[part]))[:, None]


def _mentions_unit(node) -> bool:
    return any(isinstance(n, ast.Attribute) for n in ast.walk(node))


def _unit(node) -> str:
    """Unit of a quantity for display, as far as it shows from its form."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        if node.func.id in _PLAIN:
            return "1"
        return PLACE if node.func.id in _PLACES else _unit(node.args[0])
    if isinstance(node, ast.Call):
        return _unit_of_parameter(node) if getattr(node.func, "attr", "") == "parameter" else _unit(node.func)
    if isinstance(node, ast.Attribute):
        return (_OTHER_UNITS | UNITS).get(node.attr, "")
    if isinstance(node, ast.BinOp):
        sides = _unit(node.left), _unit(node.right)
        if isinstance(node.op, ast.Div) and _same_quantity(node.left, node.right):
            return "1"
        return sides[0] if isinstance(node.op, ast.Add | ast.Sub) and sides[0] == sides[1] else ""
    return ""


def _unit_of_parameter(node) -> str:
    wanted = getattr(node.args[0], "value", None) if node.args else None
    return next((p.unit for p in PARAMETERS if p.name == wanted), "")


def _same_quantity(a, b):
    """Whether two quantities are the same one of different units."""
    strip = [ast.unparse(n).partition(".")[2] for n in (a, b)]
    return strip[0] == strip[1] != ""
