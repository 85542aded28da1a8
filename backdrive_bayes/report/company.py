"""A company's template for the report: what it may say, judged key by key; every mistake is one clear line."""

from __future__ import annotations

import datetime
import difflib
import re
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.report.logo import Logo
from backdrive_bayes.report.text import Free, free

FILE_NAME = "template.toml"
SCHEMA = "backdrive-bayes/template/1"
PAPERS = ("a4", "us-letter")
BLACK = "#000000"
_LONGEST = {"company": 80, "title": 60, "footer": 160, "logo_text": 120}
_LISTS = {"address": (4, 60), "signatures": (4, 30)}
_COLOURS = ("headings", "lines")
_KEYS = ("schema", *_LONGEST, *_LISTS, "paper", "colours", "fields")
_MOST_FIELDS, _LABEL, _VALUE = 8, 28, 80
_CONTRAST = 4.5
"""Least contrast of headings on white paper: WCAG 2.2, criterion 1.4.3 (the smaller ones count as body text)."""


@dataclass(frozen=True)
class CompanyTemplate:
    """What a company puts around its reports; texts are data, never markup.

    ``headings`` and ``lines`` are colours (#rrggbb), ``fields`` rows of a label and a text; empty means "as without".
    """

    company: Free = Free()
    title: Free = Free()
    footer: Free = Free()
    logo_text: Free = Free()
    address: tuple[Free, ...] = ()
    signatures: tuple[Free, ...] = ()
    paper: str = PAPERS[0]
    headings: str = BLACK
    lines: str = BLACK
    fields: tuple[tuple[Free, Free], ...] = ()
    logo: Logo | None = None


def company_template(path: Path, table: dict, logo: Logo | None) -> CompanyTemplate:
    """The template of a read ``template.toml``; BadInput names the key, what was expected and what was found."""
    _refuse_unknown(path, table, _KEYS)
    if table.get("schema", SCHEMA) != SCHEMA:
        raise BadInput(f"{path}, key schema", f"'{SCHEMA}'", _shown(table["schema"]))
    if table.get("paper", PAPERS[0]) not in PAPERS:
        raise BadInput(f"{path}, key paper", " or ".join(PAPERS), _shown(table["paper"]))
    texts = {k: _text(f"{path}, key {k}", table[k], most) for k, most in _LONGEST.items() if k in table}
    lists = {k: _texts(f"{path}, key {k}", table[k], *most) for k, most in _LISTS.items() if k in table}
    paper = table.get("paper", PAPERS[0])
    return CompanyTemplate(**texts, **lists, **_colours(path, table), paper=paper, fields=_fields(path, table), logo=logo)


def _texts(where, value, most, longest):
    if not isinstance(value, list) or not 1 <= len(value) <= most:
        found = f"{len(value)}" if isinstance(value, list) else _shown(value)
        raise BadInput(where, f"a list of 1 to {most} texts", found)
    return tuple(_text(f"{where}, no. {i}", v, longest) for i, v in enumerate(value, 1))


def _text(where, value, longest):
    if not isinstance(value, str) or not value.strip():
        raise BadInput(where, "text", _shown(value))
    return _short(where, value, longest)


def _short(where, text, longest):
    text = free(text, len(text))
    if len(text) > longest:
        raise BadInput(where, f"at most {longest} characters", f"{len(text)}")
    return text


def _fields(path, table):
    where, fields = f"{path}, key fields", table.get("fields", {})
    if not isinstance(fields, dict):
        raise BadInput(where, "a table of label = text", _shown(fields))
    if len(fields) > _MOST_FIELDS:
        raise BadInput(where, f"at most {_MOST_FIELDS} fields", f"{len(fields)}")
    return tuple((_text(f"{where}, label", k, _LABEL), _value(f"{where}.{k}", v)) for k, v in fields.items())


def _value(where, value):
    """Text, a number or a date as text; an empty one is left to be filled in by hand."""
    if isinstance(value, bool) or not isinstance(value, str | int | float | datetime.date | datetime.time):
        raise BadInput(where, "text, a number or a date", _shown(value))
    return _short(where, str(value), _VALUE)


def _colours(path, table):
    where, colours = f"{path}, key colours", table.get("colours", {})
    if not isinstance(colours, dict):
        raise BadInput(where, f"a table with {' or '.join(_COLOURS)}", _shown(colours))
    _refuse_unknown(where, colours, _COLOURS)
    found = {k: _colour(f"{where}.{k}", v) for k, v in colours.items()}
    contrast = _contrast(found.get("headings", BLACK))
    if contrast < _CONTRAST:
        seen = f"{colours['headings']}, {contrast:.1f} to 1"
        raise BadInput(f"{where}.headings", f"a colour that reads on white, contrast at least {_CONTRAST} to 1", seen)
    return found


def _colour(where, value):
    if not isinstance(value, str) or not re.fullmatch("#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})", value):
        raise BadInput(where, "a colour like #1a2b3c", _shown(value))
    digits = value[1:] if len(value) == 7 else "".join(2 * c for c in value[1:])
    return f"#{digits.lower()}"


def _contrast(colour):
    """Contrast of a colour with white: WCAG 2.2, relative luminance of sRGB."""
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 1.05 / (0.2126 * red + 0.7152 * green + 0.0722 * blue + 0.05)


def _refuse_unknown(where, table, known):
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key.lower(), known, n=1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise BadInput(f"{where}, key {key}"[:200], f"one of {', '.join(known)}", f"{_shown(key)}{hint}")


def _shown(value):
    return repr(value)[:60]
