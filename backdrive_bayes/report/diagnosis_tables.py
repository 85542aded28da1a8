"""The tables of a diagnosis' chapter, from the saved object alone."""

from __future__ import annotations

from backdrive_bayes.figures.diagnosis_closed import AT_MOST, rows
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import (
    effect_words,
    hypothesis_words,
    own_of_a_record,
    parameter_words,
    signed,
)
from backdrive_bayes.figures.style import shown_unit
from backdrive_bayes.number_text import (
    ARCMIN_PER_RAD,
    ENDS,
    decimals,
    fixed,
    interval_text,
    level_text,
    probability_text,
    share_text,
    significant,
)
from backdrive_bayes.report.blocks import Note, Paragraph, Table
from backdrive_bayes.report.fit_tables import INDICATORS
from backdrive_bayes.report.text import free

TOP = 6
MOST_PARAMETERS = 12
MOVED = 1.0
"""Own standard deviations from which on a shift is worth a line."""


def _arcmin(value):
    return significant(value, 3, ARCMIN_PER_RAD)


def gap_text(saved: Diagnosed) -> str:
    """Probability and size of the gap."""
    gap = saved.gap
    if not gap:
        return "not judged"
    size = f"rms {_arcmin(gap.get('rms_rad'))} arcmin, noise floor {_arcmin(gap.get('noise_floor_rad'))} arcmin"
    if saved.simulator:
        return f"probability {probability_text(gap.get('probability'))}; measured minus simulated angle on held-out data: {size}"
    return f"probability {probability_text(gap.get('probability'))}; fitted to all records, its smooth part: {size}"


def held_out_text(saved: Diagnosed) -> str:
    """What is left out and its rms before and after."""
    found = saved.shrink
    before, after, floor = (_arcmin(found.get(k)) for k in ("before_rad", "after_rad", "noise_floor_rad"))
    return f"{found.get('held_out') or 'not recorded'}: rms {before} arcmin before, {after} after, noise floor {floor} arcmin"


def probabilities(saved: Diagnosed) -> list:
    """The most probable hypotheses, "unknown" and "none", in a sentence."""
    if not saved.result["which"]:
        return []
    told = [f"{free(hypothesis_words(h), 90)} {probability_text(h.probability)}" for h in saved.ranked(TOP)]
    text = "Probabilities of the hypotheses, which sum to 1 (a name with + stands for effects at once)"
    return [Paragraph(f"{text}: {'; '.join(told)}.")]


def effect_parameters(saved: Diagnosed) -> list:
    """Parameters of the effects that are named, each with its interval and unit."""
    blocks: list = []
    for entry in [] if saved.inconclusive else saved.answered():
        found = entry.get("parameters") or {}
        lines = [_parameter(saved, n, about) for n, about in found.items() if not own_of_a_record(n)]
        title = free(f"Parameters of {effect_words(entry['effect'])}", 120)
        blocks += [Table([title, f"Median [{level_text(saved.level)} interval]", "Unit"], lines, [2, 1.4, 0.8])] if lines else []
        own = sum(map(own_of_a_record, found))
        blocks += [Note(f"Left out: {own} of single records, such as phases.")] if own else []
    return blocks


def _parameter(saved, name, about):
    factor, unit = shown_unit(about.get("unit", ""), [about[k] for k in ENDS])
    return [free(parameter_words(saved, name), 60), interval_text(about, factor), free(unit or "–", 20)]


def shrink(saved: Diagnosed) -> list:
    """Rms before and after on held-out data, the noise floor and the closed fraction, beside the control's."""
    if not saved.shrink:
        return []
    shown = rows(saved, list(range(len(saved.records)))[:AT_MOST])
    lines = [
        [
            free(name, 40),
            *(_arcmin(entry.get(k)) for k in ("before_rad", "after_rad", "noise_floor_rad")),
            share_text(entry.get("closed_fraction")),
        ]
        for name, entry in shown
    ]
    control = (saved.shrink.get("gaussian_process") or {}).get("closed_fraction")
    if control:
        lines.append(["Gaussian process (control)", "–", "–", "–", share_text(control)])
    columns = ["Held out", "before [arcmin]", "after [arcmin]", "noise floor [arcmin]", "closed fraction"]
    stages = "of the simulator as it is, and re-tuned with what it lacks" if saved.simulator else "without and with the effect"
    note = Note(
        f"Rms of measured minus predicted angle on held-out data, {stages}. Closed fraction with its "
        f"{level_text(saved.level)} interval."
    )
    return [Table(columns, lines, [1.5, 1, 1, 1.2, 1.3]), note]


def indicators(saved: Diagnosed) -> list:
    """Indicators of the reducer before and after, with the change of the median."""
    found = saved.shrink.get("indicators") or {}
    lines = []
    for key, name, unit, factor in INDICATORS:
        if key in found:
            before, after = (found[key].get(k) or None for k in ("before", "after"))
            texts = (interval_text(before, factor), interval_text(after, factor))
            lines.append([name, unit, *texts, _change(before, after, factor)])
    if not lines:
        return []
    at = saved.shrink.get("indicators_at")
    where = f" at {at['loading_rate_Nm_per_s']:.3g} N·m/s and ±{at['amplitude_Nm']:.3g} N·m" if at else ""
    stages = "in simulator and unit" if saved.simulator else "without and with the effect in the model"
    note = Note(f"Median [{level_text(saved.level)} interval] of the reducer{where}, {stages}.")
    return [Table(["Indicator", "Unit", "Before", "After", "Change"], lines, [1.6, 0.6, 1.3, 1.3, 0.7]), note]


def _change(before, after, factor):
    if not before or not after:
        return "–"
    n = decimals(0.5 * factor * (after["hi"] - after["lo"]), factor * after["median"])
    return f"{factor * (after['median'] - before['median']):+.{n}f}".replace("-", "−")


def parameter_shift(saved: Diagnosed) -> list:
    """The baseline's parameters that move by a standard deviation or more, largest shift first."""
    lines = []
    for shift in [s for s in saved.shifts if abs(s["shift_sd"] or 0.0) >= MOVED][:MOST_PARAMETERS]:
        factor, unit = shown_unit(shift["unit"], [shift[k][end] for k in ("before", "after") if shift[k] for end in ENDS])
        intervals = (interval_text(shift[k], factor) for k in ("before", "after"))
        lines.append(
            [free(parameter_words(saved, shift["parameter"]), 60), free(unit or "–", 20), *intervals, signed(shift["shift_sd"])]
        )
    if not lines:
        still = "No parameter of the reducer moves by as much as its own standard deviation when the effect is added."
        return [Note(still)] if saved.shifts else []
    columns = ["Parameter", "Unit", "Before", "After", "Shift [own sd]"]
    note = Note(
        f"Median [{level_text(saved.level)} interval] without and with the effect in the model, of the parameters that move by "
        "at least one of their own standard deviations (sd)."
    )
    return [Table(columns, lines, [1.5, 0.8, 1.2, 1.2, 0.95]), note]


def convergence(saved: Diagnosed) -> list:
    """Convergence numbers of the enlarged model's posterior."""
    found = saved.result.get("convergence")
    if not found:
        return []
    said = "Converged" if found["converged"] else "NOT converged"
    sizes = ", ".join(f"{n} {fixed(found.get(f'min_{n}_ess'), 0)}" for n in ("bulk", "tail"))
    slowest = free(parameter_words(saved, str(found.get("worst", "–"))), 60)
    rhat = fixed(found.get("max_rhat"), 4)
    return [Note(f"{said}: largest R-hat {rhat}, smallest ESS {sizes}; slowest quantity: {slowest}.")]
