"""A diagnosis in words: the answer, effects and parameters, safe to draw."""

from __future__ import annotations

from backdrive_bayes.figures.diagnosis_saved import Diagnosed, Hypothesis
from backdrive_bayes.figures.style import words

FAR = 1000.0
"""Standard deviations beyond which a shift is no longer told or drawn: the parameter was as good as fixed."""
WORTH_A_WORD = 0.1
"""Probability from which on it is said that something acts beside what is named."""
_GLOSS = {"unknown": "unknown (not listed)", "none": "none (no gap)"}


def effect_words(effect: str) -> str:
    """An effect's name, or those of a pair, in words."""
    return " + ".join(words(part) for part in effect.split("+"))


def hypothesis_words(hypothesis: Hypothesis) -> str:
    """A line of the probability table or chart."""
    return label_words(hypothesis.effect) if hypothesis.effect else f"{hypothesis.count} others together"


def label_words(effect: str) -> str:
    """An effect, a pair, "unknown" or "none" in words that stand alone."""
    return _GLOSS.get(effect, effect_words(effect))


def parameter_words(saved: Diagnosed, name: str) -> str:
    """A parameter in words; ``name[1]`` is that of the second record."""
    base, bracket, record = name.partition("[")
    if bracket and record[:-1].isdecimal() and int(record[:-1]) < len(saved.records):
        return f"{words(base)}, {saved.labels[int(record[:-1])]}"
    return words(name)


def own_of_a_record(name: str) -> bool:
    """Whether a parameter belongs to a single record, such as ``drift[1]``."""
    return name.endswith("]")


def chance(probability: float) -> str:
    """A probability as per cent that never claims certainty."""
    percent = 100 * probability
    if probability > 0 and percent < 1:
        return "<1 %"
    return ">99 %" if probability < 1 and percent > 99 else f"{percent:.0f} %"


def signed(value: float | None) -> str:
    """A shift with its sign and one decimal; beyond ``FAR`` only that it lies there."""
    if value is None:
        return "–"
    return f"{value:+.1f}".replace("-", "−") if abs(value) <= FAR else f"< −{FAR:g}" if value < 0 else f"> {FAR:g}"


def answer_words(saved: Diagnosed) -> str:
    """The answer in one phrase."""
    if saved.inconclusive:
        return "Inconclusive: no effect is named"
    if not saved.effects and saved.simulator.get("told"):
        return f"Nothing is missing in the simulator, re-tuning will do{_probability(saved, 'none')}"
    if not saved.effects:
        return f"No gap: the baseline explains the data{_probability(saved, 'none')}"
    if saved.effects == ["unknown"]:
        return f"A gap of unknown cause{_probability(saved, 'unknown')}"
    named = effect_words("+".join(saved.effects))
    found = saved.answered()
    chances = f" ({chance(found[0]['probability'])})" if len(found) == 1 else ""
    lead = "Missing in the simulator: " if saved.simulator else ""
    return (lead + named)[:1].upper() + (lead + named)[1:] + chances


def more_words(saved: Diagnosed) -> str:
    """That something unlisted acts beside the modules that are named, where that is likely; else empty."""
    alone = sum(e["probability"] for e in saved.hypotheses if e["effect"] == "unknown")
    beside = (saved.gap.get("unlisted_probability") or 0.0) - alone
    if saved.inconclusive or not saved.effects or beside < WORTH_A_WORD:
        return ""
    return f"Something that is not listed acts beside it ({chance(beside)})."


def _probability(saved, effect):
    found = [e for e in saved.hypotheses if e["effect"] == effect]
    return f" ({chance(found[0]['probability'])})" if found else ""
