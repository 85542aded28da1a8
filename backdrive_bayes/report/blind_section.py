"""The chapter of a blind check: the marks, then what stands behind them."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.blind import CAPTIONS, blind_figures
from backdrive_bayes.number_text import significant
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Picture, Table
from backdrive_bayes.results import BLIND, read_result

TITLE = "Blind check"
_VERDICT = {True: "met", False: "missed", None: "not scored"}


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``blind`` and lay out its pages."""
    result = read_result(Path(folder) / "blind.json", BLIND)
    figures = blind_figures(result)
    return Chapter(
        TITLE,
        [Heading(TITLE, 1), _banner(result), _facts(result), Heading("Marks"), _marks(result), *_failed(result)],
        [Heading("Scores"), *(Picture(name, CAPTIONS[name]) for name in figures)],
        figures,
    )


def _banner(result):
    scored = [mark for mark in result["marks"] if mark["met"] is not None]
    met = sum(mark["met"] for mark in scored)
    tone = "good" if met == len(scored) else "caution"
    text = "Effects were drawn and withheld; the key was opened after the last diagnosis."
    return Banner(tone, f"{met} of {len(scored)} marks met", text)


def _facts(result):
    counts, request = result["counts"], result["request"]
    return Facts(
        [
            ("Units", f"{counts['units']}, of them {counts['failed']} without an answer"),
            ("Severities", ", ".join(f"{s:g}" for s in request["severities"])),
            ("Seed", str(request["seed"])),
            ("Key, SHA-256", result["key_sha256"]),
        ]
    )


def _marks(result):
    return Table(["mark", "wanted", "found", ""], [_row(mark) for mark in result["marks"]])


def _row(mark):
    wanted = f"at least {mark['least']:g}" if mark["least"] is not None else f"at most {mark['most']:g}"
    return [mark["mark"], wanted, significant(mark["found"]), _VERDICT[mark["met"]]]


def _failed(result):
    names = [failure["unit"] for failure in result["failures"]]
    if names:
        yield Note(f"Without an answer: {', '.join(names[:20])}{' …' if len(names) > 20 else ''}.")
