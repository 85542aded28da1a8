"""Result folders to one PDF: figures as SVG, text as JSON, compiled by Typst in process."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

from backdrive_bayes.errors import MissingExtra
from backdrive_bayes.report.company import CompanyTemplate
from backdrive_bayes.report.dress import dressed
from backdrive_bayes.report.logo import refuse_undrawable
from backdrive_bayes.report.text import Address, Free, every_string, free, map_strings, printable, typeset

STANDARD = "ua-1"
"""PDF/UA-1: tagged, titled, with alternative texts. (PDF/A would force a creation date into the file.)"""
NAMED = 4
TITLE = "Backdrivability report"
_LAYOUT = ("template.typ", "company.typ")


def write_report(folders: Iterable[Path], out_pdf: Path, template: CompanyTemplate | None = None) -> Path:
    """Write one PDF of all results in ``folders``, dressed in a company's template; the same input gives the same bytes.

    Raises BadInput for a folder without results or with results of different data, or a logo that cannot be drawn, MissingExtra
    without typst or matplotlib.
    """
    pdf, out_pdf = report_bytes([Path(f) for f in folders], template), Path(out_pdf)
    out_pdf.parent.mkdir(parents=True, exist_ok=True)
    out_pdf.write_bytes(pdf)
    return out_pdf


def report_bytes(folders: list[Path], template: CompanyTemplate | None = None) -> bytes:
    """The PDF of :func:`write_report` as bytes."""
    return compile_report(folders, template, format="pdf", pdf_standards=[STANDARD])


def compile_report(folders: list[Path], template: CompanyTemplate | None = None, **options):
    """What Typst makes of the report with the given output options (bytes, or a list of bytes for images)."""
    typst = _typst()
    from backdrive_bayes.report.sections import chapters

    if template and template.logo:
        refuse_undrawable(template.logo, typst)
    found = [c for folder in folders for c in chapters(folder)]
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        title = template.title if template and template.title else TITLE
        data = _data(found, room, title)
        data, fonts = _fit_to_fonts(dressed(data, template, room) if template else data, typst)
        (room / "data.json").write_text(json.dumps(data), encoding="utf-8")
        for layout in _LAYOUT:
            text = files("backdrive_bayes.report").joinpath(layout).read_text(encoding="utf-8")
            (room / layout).write_text(text, encoding="utf-8")
        return typst.compile(str(room / "template.typ"), root=str(room), **fonts, **options)


def _typst():
    try:
        import typst
    except ImportError:
        raise MissingExtra("the PDF report", "typst", "report") from None
    return typst


def _data(found, room: Path, title: str) -> dict:
    """Everything that the template prints; figures are written into ``room``."""
    from backdrive_bayes.report.blocks import Heading
    from backdrive_bayes.report.method_text import method_blocks
    from backdrive_bayes.report.overview import overview_blocks

    def placed(chapter, i):
        parts = {n: [_placed(b.data(), chapter, i, room) for b in getattr(chapter, n)] for n in ("summary", "pages", "details")}
        if len(found) > 1 and any(not (b["kind"] == "picture" and b["spilt"]) for b in parts["details"]):
            parts["details"].insert(0, Heading(free(f"Appendix: {chapter.title}", 110), 1).data())
        # Nobody signs what is provisional.
        unsigned = [b for b in parts["summary"] if b["kind"] != "signature"]
        return parts | {"provisional": chapter.provisional} | ({"summary": unsigned} if chapter.provisional else {})

    names = [c.title for c in found]
    shown = ", ".join(names[:NAMED]) + (f" and {len(names) - NAMED} more" if len(names) > NAMED else "")
    full = free(f"{title}: {shown}", 160)
    return {
        "title": full,
        "running": free(full, 90),
        "author": f"backdrive-bayes {version('backdrive-bayes')}",
        "overview": [b.data() for b in overview_blocks(found, title)] if len(found) > 1 else [],
        "chapters": [placed(c, i) for i, c in enumerate(found)],
        "method": [b.data() for b in method_blocks(_by_heading([b for c in found for b in c.terms]))],
    }


def _by_heading(blocks):
    """The blocks of all chapters under their headings, each told once."""
    groups, heading = {}, None
    for block in blocks:
        heading = block if block.kind == "heading" else heading
        own = groups.setdefault(heading, [])
        if block not in own:
            own.append(block)
    return [b for own in groups.values() for b in own]


def _placed(block, chapter, i, room):
    """A block with its figure's file."""
    from backdrive_bayes.figures.catalogue import save_svg

    if block["kind"] != "picture":
        return block
    path = room / f"{i}-{block['name']}.svg"
    save_svg(chapter.figures[block["name"]], path)
    return block | {"file": Address(path.name)}


def _fit_to_fonts(data, typst):
    """Printable data, and font options; fonts of the system are used only where the bundled ones lack a
    character.
    """
    from backdrive_bayes.figures.fonts import font_folder, uncovered

    text = "".join(set("".join(every_string(data))))
    missing, system = uncovered(text), False
    if missing:
        have = [f.path for f in typst.Fonts(include_system_fonts=True).fonts() if f.path]
        left = uncovered(text, have)
        missing, system = left, left != missing
    options = {"font_paths": [str(font_folder())], "ignore_system_fonts": not system}
    return map_strings(lambda s: _line(s, frozenset(missing)), data), options


def _line(text, missing):
    if isinstance(text, Address):
        return text
    shown = printable(text, missing)
    return shown if isinstance(text, Free) else typeset(shown)
