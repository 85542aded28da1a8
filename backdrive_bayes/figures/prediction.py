"""The angle that a posterior predicts for a torque history, over the torque and over time."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures.style import BLUE, Figure, few_ticks, legend_below, new_figure, settled, shown_unit, styled
from backdrive_bayes.results import PREDICTION, read_result

CAPTION = (
    "Predicted angle with its 90 % interval over the torque (left) and over time (right). The interval is that of single points, "
    "each with the encoder offset of one of the measured records."
)
FILE, COLUMNS = "prediction.json", ("time_s", "torque_Nm", "angle_mean_arcmin", "angle_lo90_arcmin", "angle_hi90_arcmin")
SHOWN = 4000
"""Samples that are drawn of a longer history, evenly taken, beside the extremes between them."""


def read_prediction(folder: Path) -> tuple[dict, np.ndarray]:
    """What a prediction rests on and its curve, (samples, columns) like COLUMNS; BadInput where they do not belong together."""
    result, path = read_result(Path(folder) / FILE, PREDICTION), Path(folder) / "prediction.csv"
    try:
        text = path.read_bytes()
    except OSError as error:
        raise BadInput(path, f"the curve of {FILE}", error.strerror or type(error).__name__) from None
    if hashlib.sha256(text).hexdigest() != result["prediction_sha256"]:
        raise BadInput(path, f"the file as it was written beside {FILE}", "another one, or changed (predict it again)")
    return result, np.loadtxt(text.decode().splitlines(), delimiter=",", skiprows=1, ndmin=2)


def prediction_figures(curve: np.ndarray) -> dict[str, Figure]:
    """The figure of a predicted curve (samples, columns) by name."""
    shown = curve[_drawn(curve[:, 1])]
    time, torque, *angle = (shown - [shown[0, 0], 0.0, 0.0, 0.0, 0.0]).T
    factor, unit = shown_unit("N·m", torque)
    with styled():
        figure = new_figure(2.9)
        axes = figure.subplots(1, 2, sharey=True)
        along = ((factor * torque, f"torque [{unit}]"), (time, "time from the first sample [s]"))
        for panel, (at, name) in zip(axes, along, strict=True):
            panel.plot(at, angle[0], color=BLUE, label="mean")
            _band(panel, at, angle)
            panel.set_xlabel(name)
            few_ticks(panel, 6)
        axes[0].set_ylabel("angle [arcmin]")
        legend_below(figure, axes[0], columns=2)
    return settled({"prediction": figure})


def _drawn(torque) -> np.ndarray:
    """Numbers of the samples that are drawn: evenly taken ones, and the extremes of the torque between them."""
    even = np.unique(np.linspace(0, torque.size - 1, SHOWN).astype(int))
    parts = np.split(np.arange(torque.size), even[1:])
    return np.unique([even, *([part[of(torque[part])] for part in parts] for of in (np.argmin, np.argmax))])


def _band(panel, at, angle):
    """Between the interval's ends along the curve: a branch goes back over the same torques, each with its own piece."""
    look = {"color": BLUE, "alpha": 0.25, "linewidth": 0.0}
    if np.ptp(at) == 0.0:
        panel.vlines(at[:1], angle[1].min(), angle[2].max(), label="90 % interval", color=BLUE, alpha=0.25, linewidth=3.0)
        return
    turns = np.flatnonzero(np.diff(np.sign(np.diff(at)))) + 1
    for i, (start, stop) in enumerate(zip(np.r_[0, turns], np.r_[turns, at.size - 1], strict=True)):
        own = slice(start, stop + 1)
        panel.fill_between(at[own], angle[1][own], angle[2][own], label=None if i else "90 % interval", **look)
