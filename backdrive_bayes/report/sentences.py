"""Sentences of a result file, which this package once wrote, as the report says them."""

from __future__ import annotations

import re

from backdrive_bayes.figures.style import in_words
from backdrive_bayes.report.text import LONGEST, cut


def sentence(text, longest: int = LONGEST) -> str:
    """The sentence with indicators in words and symbols to be typeset; markup in it stays text, and it is cut like free text."""
    return cut(in_words(proposal(str(text))), longest)


def proposal(text: str) -> str:
    """Tests that tie, joined by " or: ", as one sentence."""
    text = _LOWER.sub(lambda m: m[0].upper(), text)
    return text.replace(" or: ", "; or, equally informative: ")


_LOWER = re.compile(r"(?<=\. )[a-z](?=[a-z]+ the )")
"""The first letter of a sentence that tells what to do."""
