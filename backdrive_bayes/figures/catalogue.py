"""All figures of a result folder, drawn and saved."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path

from backdrive_bayes.figures import (
    acceptance,
    amplitude,
    comparison,
    corner_plot,
    diagnosis,
    energy,
    loop,
    modules,
    predictive,
    torque_energy,
    trace,
)
from backdrive_bayes.figures.diagnosis_saved import FILE as DIAGNOSIS
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import PER_FIGURE, SERIES, Figure, parts, styled
from backdrive_bayes.results import COMPARISON, VERDICT, read_result

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
PNG_DPI = 150


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
    makers = _makers("loop", loop.draw, saved, everything, PER_FIGURE)
    makers |= _makers("modules", modules.draw, saved, modules.distinct(saved), 1)
    makers |= _makers("torque-energy", torque_energy.draw, saved, everything, PER_FIGURE)
    makers |= _makers("amplitude", amplitude.draw, saved, everything, len(SERIES))
    makers["energy"] = partial(energy.draw, saved)
    if saved.posterior_file:
        shared = list(corner_plot.shared_parameters(saved))
        makers |= _makers("corner", corner_plot.draw, saved, shared, corner_plot.in_one_figure(len(shared)))
        makers["trace"] = partial(trace.draw, saved)
        makers |= _makers("predictive", predictive.draw, saved, everything, PER_FIGURE)
    return {name: make() for name, make in makers.items() if wanted(name)}


def verdict_figures(verdict: dict) -> dict[str, Figure]:
    """The figures of a verdict object: acceptance, acceptance-2, …"""
    return _split("acceptance", acceptance.draw, verdict, list(range(len(verdict["limits"]))), acceptance.AT_MOST)


def comparison_figures(result: dict) -> dict[str, Figure]:
    """The figures of a comparison object."""
    overlays = list(range(len(result["overlays"])))
    out = _split("comparison-loops", comparison.draw_loops, result, overlays, PER_FIGURE)
    out |= _split("comparison-energy", comparison.draw_energy, result, overlays, PER_FIGURE)
    pairs = [i for i, p in enumerate(result["pairs"]) if p["conditions"]]
    for n, i in enumerate(pairs, 1):
        out["comparison-ratios" if n == 1 else f"comparison-ratios-{n}"] = comparison.draw_ratios(result, i)
    return out | {"comparison-mechanism": comparison.draw_mechanism(result)}


def _makers(name, draw, saved, records, at_most):
    """Functions that draw the parts of a figure, by name."""
    numbered = enumerate(parts(records, at_most))
    return {name if i == 0 else f"{name}-{i + 1}": partial(draw, saved, part) for i, part in numbered}


def _split(name, draw, saved, records, at_most):
    return {n: make() for n, make in _makers(name, draw, saved, records, at_most).items()}


def save_figures(folder: Path, out: Path) -> list[Path]:
    """Write every figure of ``folder`` into ``out`` as .svg and .png; equal results give equal bytes."""
    return save_each(all_figures(folder), out)


def save_verdict_figures(folder: Path, out: Path) -> list[Path]:
    """The same for the verdict in ``folder``."""
    return save_each(verdict_figures(read_result(Path(folder) / "verdict.json", VERDICT)), out)


def save_comparison_figures(folder: Path, out: Path) -> list[Path]:
    """The same for the comparison in ``folder``."""
    return save_each(comparison_figures(read_result(Path(folder) / "comparison.json", COMPARISON)), out)


def save_each(figures: dict[str, Figure], out: Path) -> list[Path]:
    """Write figures by name into ``out`` as .svg and .png."""
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
