"""template.toml: what a company puts around its reports."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from backdrive_bayes.errors import BadInput

BLACK = "#000000"
_CONTRAST = 4.5
"""Least contrast of headings on white paper: WCAG 2.2, criterion 1.4.3 (the smaller ones count as body text)."""


def _upto(most: int) -> Meta:
    return Meta(pattern=r"\S", max_length=most, title=f"text of 1 to {most} characters")


Colour = Annotated[str, Meta(pattern=r"^#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})\Z", title="a colour like #1a2b3c")]
Line = Annotated[str, _upto(60)]
Signer = Annotated[str, _upto(30)]
Label = Annotated[str, _upto(28)]
Value = Annotated[str, Meta(max_length=80, title="text of at most 80 characters, a number or a date")] | int | float

Fields = Annotated[dict[Label, Value], Meta(max_length=8, title="a table of at most 8 fields label = text")]


class ColoursTable(Struct, forbid_unknown_fields=True, frozen=True):
    """Colours of headings, which must be read on white, and of lines."""

    headings: Colour = BLACK
    lines: Colour = BLACK

    def __post_init__(self):
        contrast = _contrast(six_digits(self.headings))
        if contrast < _CONTRAST:
            wanted = f"a colour that reads on white, contrast at least {_CONTRAST} to 1"
            raise BadInput("headings", wanted, f"{self.headings}, {contrast:.1f} to 1")


class TemplateFile(Struct, forbid_unknown_fields=True, frozen=True):
    """Texts are data, never markup; what is missing stays as without a template."""

    schema: Literal["backdrive-bayes/template/1"] = "backdrive-bayes/template/1"
    company: Annotated[str, _upto(80)] | None = None
    title: Annotated[str, _upto(60)] | None = None
    footer: Annotated[str, _upto(160)] | None = None
    logo_text: Annotated[str, _upto(120)] | None = None
    address: Annotated[list[Line], Meta(min_length=1, max_length=4, title="a list of 1 to 4 texts")] | None = None
    signatures: Annotated[list[Signer], Meta(min_length=1, max_length=4, title="a list of 1 to 4 texts")] | None = None
    paper: Literal["a4", "us-letter"] = "a4"
    colours: ColoursTable = field(default_factory=ColoursTable)
    fields: Fields = field(default_factory=dict)


def six_digits(colour: str) -> str:
    """A colour as #rrggbb in lower case."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * c for c in colour[1:])
    return f"#{digits.lower()}"


def _contrast(colour: str) -> float:
    """Contrast of a colour with white: WCAG 2.2, relative luminance of sRGB."""
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 1.05 / (0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05)
