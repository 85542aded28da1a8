"""A company's logo: one small SVG or PNG file that shows the same on every machine."""

from __future__ import annotations

import io
import tempfile
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from backdrive_bayes.errors import BadInput

NAMES = ("logo.svg", "logo.png")
MAX_BYTES = 1_000_000
MAX_PIXELS = 4000
_ALONE = '#set page(width: 60mm, height: 14mm, margin: 0mm)\n#image("{}", width: 100%, height: 100%, fit: "contain")'


@dataclass(frozen=True)
class Logo:
    """A logo's file and its content."""

    path: Path
    data: bytes


def read_logo(folder: Path) -> Logo | None:
    """The logo in a template folder, None without one; BadInput where it is not a single small SVG or PNG file."""
    found = sorted(p for p in folder.iterdir() if p.stem.lower() == "logo")
    if not found:
        return None
    if len(found) > 1 or found[0].name not in NAMES:
        raise BadInput(folder, f"one logo, {' or '.join(NAMES)}", ", ".join(p.name for p in found)[:120])
    path = found[0]
    if not path.is_file():
        raise BadInput(path, "an image file", "a folder" if path.is_dir() else "nothing there")
    with path.open("rb") as file:
        data = file.read(MAX_BYTES + 1)
    if len(data) > MAX_BYTES:
        raise BadInput(path, "a logo of at most 1 MB", "a larger one")
    (_refuse_svg if path.suffix == ".svg" else _refuse_png)(path, data)
    return Logo(path, data)


def refuse_undrawable(logo: Logo, typst) -> None:
    """BadInput where Typst cannot draw the logo, or where nothing of it shows on white paper."""
    from backdrive_bayes.figures.style import matplotlib

    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        (room / logo.path.name).write_bytes(logo.data)
        (room / "alone.typ").write_text(_ALONE.format(logo.path.name), encoding="utf-8")
        try:
            seen = typst.compile(str(room / "alone.typ"), root=name, ignore_system_fonts=True, format="png", ppi=72)
        except typst.TypstError as error:
            raise BadInput(logo.path, "an image that can be drawn", f"{error}"[:200]) from error
    if matplotlib.image.imread(io.BytesIO(seen))[..., :3].min() > 0.9:
        raise BadInput(logo.path, "a logo that shows on white paper", "nothing darker than white")


def _refuse_svg(path, data):
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise BadInput(path, "an SVG image", f"no XML: {error}") from error
    if _local(root.tag) != "svg":
        raise BadInput(path, "an SVG image", f"XML of another kind, <{_local(root.tag)[:40]}>")
    for element in root.iter():
        # A font that another machine lacks would change the logo, and its text would not stay above 8 pt.
        if _local(element.tag) == "text":
            raise BadInput(path, "shapes only (convert text to paths)", "a <text> element")
        if _local(element.tag) == "image":
            _refuse_links(path, element)


def _refuse_links(path, element):
    for name, value in element.attrib.items():
        if _local(name) == "href" and not value.lstrip().startswith("data:"):
            raise BadInput(path, "a logo in one file", f"a link to '{value[:60]}'")


def _local(tag):
    return str(tag).rpartition("}")[2]


def _refuse_png(path, data):
    if not data.startswith(b"\x89PNG\r\n\x1a\n") or len(data) < 24:
        raise BadInput(path, "a PNG image", "another kind of file" if data else "an empty file")
    sides = [int.from_bytes(data[i : i + 4], "big") for i in (16, 20)]
    if max(sides) > MAX_PIXELS:
        raise BadInput(path, f"at most {MAX_PIXELS} pixels a side", f"{sides[0]} x {sides[1]}")
