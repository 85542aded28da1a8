"""One PDF from saved results; it computes nothing.

A section kind is one file that turns one kind of result file into blocks (``blocks.py``) and one line in
``sections.py``. Blocks reach the Typst template as JSON data, so that no text of a unit is read as markup.
"""
