"""Sphinx: pages in Markdown (MyST), docstrings by numpydoc, equations as MathML, nothing fetched from elsewhere."""

import sys
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "generate"))

from mathml import setup_mathml  # noqa: E402
from pages import NUMBERS, write_pages  # noqa: E402

project = "backdrive_bayes"
author = "the authors of backdrive_bayes"
try:
    release = version_of("backdrive-bayes")
except PackageNotFoundError:
    release = "not installed"

extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath", "substitution", "deflist", "colon_fence"]
myst_heading_anchors = 3
myst_substitutions = NUMBERS
exclude_patterns = ["generate", "draw", "_generated/parts"]
numpydoc_show_class_members = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"

html_theme = "furo"
html_title = "backdrive_bayes"
html_math_renderer = "mathml"
html_copy_source = False
html_show_copyright = False
html_static_path = ["static", "_generated/static"]
html_css_files = ["drawings.css"]
# The theme's footer would link to other sites; the pages name their own source only.
html_theme_options = {"footer_icons": []}


def setup(app):
    """Hooks: equations as MathML, and the pages and tables that are read from the package itself."""
    setup_mathml(app)
    write_pages(Path(app.srcdir))
