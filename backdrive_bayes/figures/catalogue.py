"""All figures of a result folder, drawn and saved."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from backdrive_bayes.figures import (
    acceptance,
    amplitude,
    blind,
    comparison,
    corner_plot,
    diagnosis,
    energy,
    fleet,
    loop,
    modules,
    pool,
    predictive,
    torque_energy,
    trace,
)
from backdrive_bayes.figures.diagnosis_saved import FILE as DIAGNOSIS
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import PER_FIGURE, PNG_DPI, SERIES, Figure, in_parts, numbered, settled, styled
from backdrive_bayes.results import BLIND, COMPARISON, FLEET, POOL, VERDICT, read_result

CAPTIONS = {
    "loop": loop.CAPTION,
    "modules": modules.CAPTION,
    "torque-energy": torque_energy.CAPTION,
    "amplitude": amplitude.CAPTION,
    "energy": energy.CAPTION,
    "corner": corner_plot.CAPTION,
    "trace": trace.CAPTION,
    "predictive": predictive.CAPTION,
    **diagnosis.CAPTIONS,
    "acceptance": acceptance.CAPTION,
    "comparison-loops": comparison.LOOPS,
    "comparison-energy": comparison.ENERGY,
    "comparison-ratios": comparison.RATIOS,
    "comparison-mechanism": comparison.MECHANISM,
}


def caption(name: str, level: float | None = None) -> str:
    """What a figure of :func:`all_figures` shows, in words, with the level of its intervals; briefly where it is continued."""
    kind, text = next((k, t) for k, t in CAPTIONS.items() if name == k or name.startswith(f"{k}-"))
    if level:
        text = re.sub(r"\b(and|with) (intervals?)\b", rf"\1 {100 * level:.3g} % \2", text)
    return text if name == kind else f"{text.partition('. ')[0].rstrip('.')}, continued."


def all_figures(folder: Path) -> dict[str, Figure]:
    """Every figure of one result folder of ``fit`` or ``diagnose`` by name: loop, loop-2, … predictive, diagnosis …"""
    diagnosed = (Path(folder) / DIAGNOSIS).exists()
    fitted = (Path(folder) / "indicators.json").exists() or not diagnosed
    out = figures_of(Saved.read(folder)) if fitted else {}
    return out | (diagnosis.figures_of(Diagnosed.read(folder)) if diagnosed else {})


def figures_of(saved: Saved, wanted=lambda name: True) -> dict[str, Figure]:
    """The same from results already read, as far as ``wanted`` by name; those that need draws only where they were saved."""
    everything = list(range(len(saved.records)))
    makers = numbered("loop", loop.draw, saved, everything, PER_FIGURE)
    makers |= numbered("modules", modules.draw, saved, modules.distinct(saved), 1)
    makers |= numbered("torque-energy", torque_energy.draw, saved, everything, PER_FIGURE)
    makers |= numbered("amplitude", amplitude.draw, saved, everything, len(SERIES))
    makers["energy"] = partial(energy.draw, saved)
    if saved.posterior_file:
        shared = list(corner_plot.shared_parameters(saved))
        makers |= numbered("corner", corner_plot.draw, saved, shared, corner_plot.in_one_figure(len(shared)))
        makers["trace"] = partial(trace.draw, saved)
        makers |= numbered("predictive", predictive.draw, saved, everything, PER_FIGURE)
    return settled({name: make() for name, make in makers.items() if wanted(name)})


def verdict_figures(verdict: dict) -> dict[str, Figure]:
    """The figures of a verdict object: acceptance, acceptance-2, …"""
    rows = list(range(len(verdict["limits"])))
    makers = numbered("acceptance", acceptance.draw, verdict, rows, acceptance.AT_MOST)
    return settled({name: make() for name, make in makers.items()})


def comparison_figures(result: dict) -> dict[str, Figure]:
    """The figures of a comparison object."""
    overlays = comparison.overlaid(result)
    makers = in_parts("comparison-loops", comparison.draw_loops, result, overlays)
    makers |= in_parts("comparison-energy", comparison.draw_energy, result, overlays)
    makers |= numbered("comparison-ratios", comparison.draw_ratios, result, comparison.with_ratios(result), 1)
    makers["comparison-mechanism"] = partial(comparison.draw_mechanism, result)
    return settled({name: make() for name, make in makers.items()})


_OF_FILE = {
    "verdict.json": (VERDICT, verdict_figures),
    "comparison.json": (COMPARISON, comparison_figures),
    "blind.json": (BLIND, blind.blind_figures),
    "fleet.json": (FLEET, fleet.fleet_figures),
    "pool.json": (POOL, pool.pool_figures),
}
"""Schema and figures of the result files besides those of fits and diagnoses."""


def save_figures(folder: Path, out: Path, file: str = "indicators.json") -> list[Path]:
    """Write the figures of a result ``file`` in ``folder`` into ``out`` as .svg and .png; equal results give equal bytes.

    Those of a fit and of its diagnosis are written together, whichever of the two files is named.
    """
    if file in _OF_FILE:
        schema, draw = _OF_FILE[file]
        figures = draw(read_result(Path(folder) / file, schema))
    else:
        figures = all_figures(folder)
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in figures.items():
        written += [save_svg(figure, out / f"{name}.svg"), _save_png(figure, out / f"{name}.png")]
    return written


def save_svg(figure: Figure, path: Path) -> Path:
    """Write one figure as SVG with text kept as text, without a date."""
    with styled():
        figure.savefig(path, format="svg", metadata={"Date": None})
    return path


def _save_png(figure, path):
    with styled():
        figure.savefig(path, format="png", dpi=PNG_DPI)
    return path
