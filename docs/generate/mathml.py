"""Equations as MathML, which every browser draws by itself, in a font that the pages bring along."""

from __future__ import annotations

import shutil
from importlib.resources import files
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert

FONT = "STIXTwoMath-Regular.ttf"


def _inline(self, node):
    self.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _display(self, node):
    self.body.append(convert(node.astext(), display="block"))
    raise nodes.SkipNode


def setup_mathml(app) -> None:
    """Register the renderer under the name ``mathml`` and lay the font STIX Two Math (OFL) beside the style sheet."""
    static = Path(app.srcdir) / "_generated" / "static"
    static.mkdir(parents=True, exist_ok=True)
    shutil.copy(str(files("ziamath").joinpath("fonts", FONT)), static)
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))
