"""The kinds of values that stand in files, each with the words by which an error asks for it."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

_LARGEST = 1e300
"""Far beyond any measurement; sums and squares of a few such numbers must not become infinite before they are judged."""

Text = Annotated[str, Meta(pattern=r"\S", title="text")]
Finite = Annotated[float, Meta(ge=-_LARGEST, le=_LARGEST, title="a finite number")]
Positive = Annotated[float, Meta(gt=0.0, lt=_LARGEST, title="a positive number")]
Risk = Annotated[float, Meta(gt=0.0, lt=0.5, title="a probability above 0 and below 0.5")]
