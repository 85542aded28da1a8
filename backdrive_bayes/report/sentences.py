"""Sentences of a result file, which this package once wrote, as the report says them."""

from __future__ import annotations

from backdrive_bayes.figures.style import in_words
from backdrive_bayes.report.text import LONGEST, cut


def sentence(text, longest: int = LONGEST) -> str:
    """The sentence with indicators in words and symbols to be typeset; markup in it stays text, and it is cut like free text."""
    return cut(in_words(str(text)), longest)
