"""The page that sets a simulator against a unit: the split of the gap, where its parts lie, parameters from and to."""

from __future__ import annotations

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import parameter_words
from backdrive_bayes.figures.style import in_words, shown_unit
from backdrive_bayes.number_text import ARCMIN_PER_RAD, interval_text, level_text, like_interval, share_text, significant
from backdrive_bayes.report.blocks import Block, Heading, Note, Paragraph, Picture, Table
from backdrive_bayes.report.text import free

PARTS = (
    ("closed_by_retuning", "retuning", "closed by re-tuning"),
    ("closed_by_effect", "effect", "closed by what is missing"),
    ("left", "left", "left"),
)
STAGES = (("simulated", "as it is"), ("retuned", "re-tuned"), ("explained", "with what it lacks"), ("noise_floor", "noise"))


def pages(saved: Diagnosed, pictures: list[Picture]) -> list[Block]:
    """The page, empty where no simulator was set against the unit."""
    found = saved.simulator
    if not found:
        return []
    return [
        Heading(free(f"The simulator {found.get('unit', '')}", 80)),
        Paragraph(free(in_words(" ".join(filter(None, [found.get("summary", ""), _own(found)]))), 600)),
        *([*_shares(saved), *pictures] if found.get("told") and not saved.inconclusive else []),
        *_parameters(saved),
    ]


def _own(found):
    """What the simulator itself has, and how it was read."""
    has = " and ".join(found.get("effects") or []).replace("_", " ")
    said = f"The simulator itself shows {has}." if has and has != "unknown" else ""
    said = "The simulator itself shows structure that no listed effect explains." if has == "unknown" else said
    if shared := " and ".join(found.get("shared_effects") or []).replace("_", " "):
        said += f" Both have {shared}: its size is re-tuned and nothing that is missing."
    same = found.get("same_path") or []
    if all(same):
        return said.strip()
    asked = "none" if not any(same) else f"{sum(same)} of {len(same)}"
    return f"{said} It was asked {asked} of the unit's torque paths; on others its fit answers.".strip()


def _shares(saved):
    found, maps = saved.simulator, {row["part"]: row["summary"] for row in saved.simulator.get("parts") or []}
    rows = [[name, share_text(found[key]), free(in_words(maps.get(part, "–")), 300)] for key, part, name in PARTS]
    rms = found.get("rms_rad") or {}
    sizes = "; ".join(f"{name} {significant(rms[key], 3, ARCMIN_PER_RAD)}" for key, name in STAGES if rms.get(key) is not None)
    note = Note(
        f"Share of the gap above the noise on held-out data [{level_text(saved.level)} interval]; a place is that of the part in "
        f"the fit to all records. Rms of measured minus simulated angle on held-out data [arcmin]: {sizes}."
    )
    return [Table(["The gap", "Share", "Where it lies"], rows, [1.1, 0.9, 2.2]), note]


def _parameters(saved):
    rows = []
    for row in saved.simulator["parameters"]:
        ends = [row["simulated"], row["measured"]["lo"], row["measured"]["hi"]]
        factor, unit = shown_unit(row["unit"], ends)
        own = like_interval(row["simulated"], row.get("simulated_interval"), factor)
        moved = "changed" if row.get("credible") else ""
        name = free(parameter_words(saved, row["name"]), 60)
        rows.append([name, free(unit or "–", 20), own, interval_text(row["measured"], factor), moved])
    if not rows:
        return []
    columns = ["Parameter", "Unit", "Simulator", f"Measured [{level_text(saved.level)} interval]", ""]
    note = Note(
        "Functionals of the fitted reducer, the same for both: what the simulator's own parameters should amount to. "
        "Changed: the interval of the change excludes zero. Compliances and friction are those of a reducer that has crept to "
        "its end: where creep is what the simulator lacks, they hold it, and it is not to be added to them once more."
    )
    return [Table(columns, rows, [1.5, 0.9, 0.9, 1.5, 0.7]), note]
