"""The building blocks of a page: plain data that the template lays out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar


@dataclass(frozen=True)
class Block:
    """Something that a page is made of; ``kind`` names the template's function for it."""

    kind: ClassVar[str]

    def data(self) -> dict[str, Any]:
        """The block as JSON data."""
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self)}


@dataclass(frozen=True)
class Heading(Block):
    """A heading that also enters the outline."""

    kind = "heading"
    text: str
    level: int = 2


@dataclass(frozen=True)
class Paragraph(Block):
    """Running text."""

    kind = "paragraph"
    text: str


@dataclass(frozen=True)
class Note(Block):
    """Small text beneath a table."""

    kind = "note"
    text: str


@dataclass(frozen=True)
class Banner(Block):
    """A verdict in a frame; ``tone`` is "good", "caution" or "bad"."""

    kind = "banner"
    tone: str
    title: str
    text: str


@dataclass(frozen=True)
class Facts(Block):
    """Pairs of a name and its value."""

    kind = "facts"
    rows: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Table(Block):
    """Rows under column names; a cell of two texts has the second one small beneath; ``widths`` in shares (0:
    as wide as needed).
    """

    kind = "table"
    columns: list[str]
    rows: Sequence[Sequence[str | Sequence[str]]]
    widths: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Picture(Block):
    """A figure by name, with its caption, which is also its alternative text.

    One that ``floats`` lets the text behind it go first; one that is ``spilt`` is shown only where its
    summary had no room for it.
    """

    kind = "picture"
    name: str
    caption: str
    floats: bool = False
    spilt: bool = False


@dataclass(frozen=True)
class Links(Block):
    """Rows of a name, the file that it leads to (a path beside the report), and words."""

    kind = "links"
    rows: list[tuple[str, str, str]]


@dataclass(frozen=True)
class Signature(Block):
    """Lines to be filled in by hand."""

    kind = "signature"
    labels: list[str]


@dataclass(frozen=True)
class Letterhead(Block):
    """A company's letterhead; what it says stands once in the report's data."""

    kind = "letterhead"


@dataclass(frozen=True)
class About:
    """What the overview tells of a fitted unit: facts by name, and key indicators (name, unit, text) at one loop; ``data`` tells
    units of one name apart. The numbers of a ``provisional`` unit are marked, one of ``forced`` data says so.
    """

    unit: str
    facts: list[tuple[str, str]]
    loop: str
    indicators: list[tuple[str, str, str]]
    data: str = ""
    provisional: bool = False
    forced: bool = False


@dataclass(frozen=True)
class Contents(Block):
    """The list of contents with page numbers."""

    kind = "contents"


@dataclass(frozen=True)
class Chapter:
    """What one result contributes: a summary of one page, ``pages`` that follow it, details for the appendix, and figures.

    ``outcome`` is its one line on the overview, ``about`` what the overview knows of its unit, ``terms`` what the report's last
    section says once for all chapters alike. A ``provisional`` chapter carries a watermark and is not to be signed.
    """

    title: str
    summary: Sequence[Block]
    details: Sequence[Block]
    figures: dict[str, Any]
    pages: Sequence[Block] = field(default_factory=list)
    outcome: str = ""
    provisional: bool = False
    about: About | None = None
    terms: Sequence[Block] = field(default_factory=list)
