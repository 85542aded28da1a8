"""One PDF from saved results; it computes nothing.

A section kind is one file that turns one kind of result file into blocks (``blocks.py``) and one line in
``sections.py``. Blocks reach the Typst template as JSON data, so that no text of a unit is read as markup.
"""

import sys
from importlib import import_module
from types import ModuleType


class _Room(ModuleType):
    """The room can be called: ``from backdrive_bayes import report`` finds the function or, once imported, this room."""

    def __call__(self, *results, **options):
        return import_module("backdrive_bayes.api").report(*results, **options)


sys.modules[__name__].__class__ = _Room
