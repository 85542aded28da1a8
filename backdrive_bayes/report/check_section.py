"""The chapter of a check: what the records hold, and what speaks against them."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.style import MJ_PER_J, shortened, words
from backdrive_bayes.number_text import ARCMIN_PER_RAD, plain, significant, with_error
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Table
from backdrive_bayes.report.text import digests, free
from backdrive_bayes.results import CHECK, read_result

MOST_ROWS, ON_SUMMARY = 30, 12
"""Rows of a table, and rows of all tables that have room on the first page."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``check`` and lay out its pages."""
    result = read_result(Path(folder) / "check.json", CHECK)
    outcome, title = result["outcome"], free(f"Check, {result['unit']}", 80)
    told = "inference may go on" if result["may_infer"] else "inference should not go on"
    banner = Banner("good" if result["may_infer"] else "bad", f"{outcome['word'].upper()}: {told}", free(outcome["reason"], 600))
    summary, more = [Heading(title, 1), banner, _facts(result), *_records(result)], [*_findings(result), *_measured(result)]
    if 2 * len(result["records"]) + len(result["findings"]) <= ON_SUMMARY:
        summary, more = summary + more, []
    return Chapter(title, summary, [], {}, more, outcome=f"{outcome['word'].upper()}: {outcome['reason']}")


def _facts(result):
    identity = [(free(words(key).capitalize(), 20), free(value)) for key, value in result["identity"].items()]
    rows = [("Unit", free(result["unit"])), *identity, ("Rated torque", f"{result['rated_torque_Nm']:g} N·m")]
    return Facts([*rows, ("Data, SHA-256", digests(result["data_sha256"]))])


def _records(result):
    yield Heading("Records")
    rows = [_record(record) for record in result["records"][:MOST_ROWS]]
    columns = ["Record", "Samples", "Time [s]", "Amplitude [N·m]", "Rate [N·m/s]", "Cycles", "Branches", "Closure [arcmin]"]
    yield Table(columns, rows, [1.6, 0.8, 0.7, 1.0, 1.1, 0.6, 0.8, 1.0])
    more = len(result["records"]) - MOST_ROWS
    yield Note(
        "Amplitude and rate as they were found. Closure: by how much the angle differs a cycle later, with its standard error."
        + f" And {more} more records in check.json." * (more > 0)
    )


def _record(record):
    closure = record["closure"]
    found = (record[key]["estimated"] for key in ("amplitude_Nm", "loading_rate_Nm_per_s"))
    return [
        free(shortened(record["record"], 40)),
        str(record["samples"]),
        plain(record["duration_s"]),
        *(significant(value) for value in found),
        str(record["cycles"]),
        str(len(record["branches"])),
        with_error(*(ARCMIN_PER_RAD * closure[key] for key in ("difference_rad", "sd_rad"))) if closure else "–",
    ]


def _measured(result):
    yield Heading("Noise and measured cycles")
    rows = [_cycle(record) for record in result["records"][:MOST_ROWS]]
    angles = ["White noise [arcmin]", "Correlated [arcmin]", "Torque noise [mN·m]"]
    columns = ["Record", *angles, "∮τ dθ [mJ]", "Half range [arcmin]", "w(0) [arcmin]"]
    yield Table(columns, rows, [1.6, 0.8, 1.0, 0.9, 1.2, 1.2, 1.0])
    yield Note("Standard deviations of the noise; area, half of the range and width at zero torque of the measured cycle.")


def _cycle(record):
    noise, loop = record["noise"], record["measured_loop"] or {}
    levels = (("white_rad", ARCMIN_PER_RAD), ("correlated_rad", ARCMIN_PER_RAD), ("torque_Nm", 1e3))
    read = (("loop_area_J", MJ_PER_J), ("half_peak_to_peak_rad", ARCMIN_PER_RAD), ("zero_torque_width_rad", ARCMIN_PER_RAD))
    return [
        free(shortened(record["record"], 40)),
        *(significant(noise[key], 2, factor) for key, factor in levels),
        *("–" if loop.get(key) is None else with_error(factor * loop[key], factor * loop[f"{key}_sd"]) for key, factor in read),
    ]


def _findings(result):
    found = sorted(result["findings"], key=lambda f: ("error", "warning", "note").index(f["level"]))
    if found:
        yield Heading("Findings")
        rows = [[f["level"], free(shortened(f["record"] or "unit", 40)), free(f["text"], 400)] for f in found[:MOST_ROWS]]
        yield Table(["", "Of", "Found"], rows, [0.5, 1.0, 3.5])
        if len(found) > MOST_ROWS:
            yield Note(f"And {len(found) - MOST_ROWS} more in check.json.")
