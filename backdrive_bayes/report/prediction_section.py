"""The chapter of a prediction: the curve, and what it rests on."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.prediction import CAPTION, COLUMNS, prediction_figures, read_prediction
from backdrive_bayes.figures.style import shown_unit
from backdrive_bayes.number_text import plain, significant
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Picture
from backdrive_bayes.report.findings import findings_blocks, warned
from backdrive_bayes.report.text import digests, free
from backdrive_bayes.results import usable

_START = {"unknown": "unloaded from one of several preloads, each as likely", "rest": "neutral at the first torque"}


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``predict`` and lay out its page."""
    result, curve = read_prediction(folder)
    figures, outcome = prediction_figures(curve), result["outcome"]
    title = free(f"Prediction, {result['unit']}", 80)
    caveat, word = outcome["caveat"], outcome["word"].upper()
    banner = Banner("caution" if caveat else "good", word, free(caveat or outcome["reason"], 600))
    notes = [Note(free(f"Of the history: {note}.", 300)) for note in result["notes"]]
    return Chapter(
        title,
        [
            Heading(title, 1),
            banner,
            *findings_blocks(result),
            _facts(result, curve),
            *(Picture(name, CAPTION) for name in figures),
            *notes,
        ],
        [],
        figures,
        outcome=", ".join(filter(None, [word, outcome["reason"], "with a caveat" * bool(caveat), warned(result)])),
        provisional=not usable(result),
    )


def _facts(result, curve):
    column = dict(zip(COLUMNS, curve.T, strict=True))
    factor, unit = shown_unit("N·m", column["torque_Nm"])
    low, high = (plain(factor * float(end)) for end in (column["torque_Nm"].min(), column["torque_Nm"].max()))
    half = 0.5 * float((column["angle_hi90_arcmin"] - column["angle_lo90_arcmin"]).max())
    return Facts(
        [
            ("Unit", free(result["unit"])),
            ("Torque history", free(result["history"]["file"])),
            ("", f"{len(curve)} samples in {plain(float(column['time_s'][-1] - column['time_s'][0]))} s, {low} to {high} {unit}"),
            ("Begins", _START[result["options"]["start"]]),
            ("Interval", f"90 % at each sample, half as wide as {significant(half)} arcmin at most"),
            ("Posterior, SHA-256", digests(result["posterior_sha256"])),
            ("Data, SHA-256", digests(result["data_sha256"])),
        ]
    )
