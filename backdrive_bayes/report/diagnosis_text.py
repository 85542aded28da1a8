"""The sentences of a diagnosis: verdict, next test, terms."""

from __future__ import annotations

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import answer_words, label_words, more_words
from backdrive_bayes.figures.style import in_words
from backdrive_bayes.number_text import share_text, significant
from backdrive_bayes.report.blocks import Facts, Paragraph
from backdrive_bayes.report.sentences import proposal
from backdrive_bayes.report.text import Free, free

LEAST_BITS = 0.005
"""A test that is expected to tell less is not proposed."""
TERMS = [
    ("Gap", "what the baseline leaves of the measured angle beyond the noise"),
    ("Noise floor", "rms that the noise of the measured angle and torque alone would leave"),
    ("Probability", "posterior probability of each hypothesis; how it is found stands above"),
    ("unknown", "something is missing that no effect in the list explains; modules left out of the baseline keep their name"),
    ("none", "the baseline explains the data to the noise"),
    ("90 % credible set", "the most probable hypotheses that together hold at least 90 %"),
    ("Closed fraction", "share of the gap above the noise that vanishes on held-out data; 100 %: down to the noise"),
    ("Gaussian process", "a residual curve free to bend anywhere, as a control: it closes a gap without naming a cause"),
]
"""What the words of this chapter mean."""
RIVALS = 5
"""Other answers of the credible set that the banner names at most: more would push the figure, which shows all, off the page."""


def verdict(saved: Diagnosed) -> tuple[str, str, str]:
    """Tone, title and text of the banner."""
    if saved.inconclusive:
        reason = free(saved.inconclusive, 400).rstrip(".")
        text = Free(f"Reason: {reason}. Do not name a cause from this result.")
        return "bad", f"{saved.result['outcome']['word'].upper()}: no effect is named", text
    where = free(saved.summary, 400)
    if saved.simulator:
        return _against_simulator(saved, where)
    rivals = _rivals(saved)
    if not saved.effects:
        title = ("caution", "NO GAP FOUND, NOT RULED OUT") if rivals else ("good", "NO GAP")
        return *title, Free(_join(answer_words(saved), rivals))
    found = "GAP FOUND" if "none" not in saved.credible_set else "GAP PROBABLE"
    text = Free(_join(answer_words(saved), more_words(saved), where, rivals, _closed(saved)))
    if saved.effects == ["unknown"]:
        return "caution", "GAP OF UNKNOWN CAUSE", text
    return "caution", f"{found}, {_standing(saved, rivals)}", text


def _against_simulator(saved, where):
    split = free(in_words(saved.simulator.get("summary", "")), 300)
    if not saved.simulator.get("told"):
        likely = saved.result["gap"]["probability"] >= 0.5
        title = ("caution", "A GAP TO THE SIMULATOR NOT RULED OUT") if likely else ("good", "NO GAP TO THE SIMULATOR")
        return *title, Free(_join(split, _rivals(saved)))
    text = Free(_join(answer_words(saved), split, where, _rivals(saved)))
    if not saved.effects:
        return "caution", "GAP TO THE SIMULATOR, CLOSED BY RE-TUNING", text
    if saved.effects == ["unknown"]:
        return "caution", "GAP TO THE SIMULATOR, OF UNKNOWN CAUSE IN PART", text
    return "caution", f"GAP TO THE SIMULATOR, {_standing(saved, _rivals(saved))}", text


def outcome(saved: Diagnosed) -> str:
    """One line for an overview."""
    if saved.inconclusive:
        return answer_words(saved)
    closed, named = saved.shrink.get("closed_fraction"), saved.effects and saved.effects != ["unknown"]
    share = f"; closes {share_text(closed)} of the gap on held-out data" if closed and named else ""
    rivals = len(saved.credible_set) - 1
    more = f"; {rivals} rival{'s'[: rivals > 1]} in the 90 % set" if rivals > 0 else ""
    return f"{answer_words(saved)}{share}{more}"


def _standing(saved, rivals):
    if rivals:
        return "CAUSES STILL CONFUSABLE"
    if not _closes(saved):
        return "THE NAME IN DOUBT"
    return "PART OF THE CAUSE NAMED" if more_words(saved) else "CAUSE NAMED"


def _closes(saved):
    """Whether what is named takes anything off the gap on held-out data, as far as that was judged.

    Jumps show in finer blocks than those that are held out.
    """
    closed = saved.shrink.get("closed_fraction")
    return not closed or closed["hi"] >= 0 or "stick_slip" in saved.effects


def _join(*sentences):
    return " ".join(s if s.endswith(".") else f"{s}." for s in sentences if s)


def _rivals(saved):
    named = frozenset(saved.effects or ["none"])
    rivals = [label_words(e) for e in saved.credible_set if frozenset(e.split("+")) != named]
    more = f" and {len(rivals) - RIVALS} more" if len(rivals) > RIVALS else ""
    return f"Not ruled out at 90 %: {', '.join(rivals[:RIVALS])}{more}." if rivals else ""


def _closed(saved):
    if not saved.added or not saved.shrink.get("closed_fraction"):
        return ""
    share = share_text(saved.shrink["closed_fraction"])
    if saved.effects == ["unknown"]:
        return f"The best listed candidate closes {share} of the gap on held-out data."
    doubt = "" if _closes(saved) else ", so it predicts nothing of what it is named for"
    return f"Added to the model, it closes {share} of the gap on held-out data{doubt}."


def next_test(saved: Diagnosed) -> list:
    """The measurement that would best tell what is still confusable; empty where none is proposed."""
    test = saved.result.get("next_test")
    if not test or test.get("expected_entropy_drop_bits", LEAST_BITS) < LEAST_BITS:
        return []
    separates = ", ".join(label_words(e) for e in test.get("separates") or []) or "not recorded"
    rows: list[tuple[str, str]] = [("Separates", free(separates))]
    if test.get("expected_entropy_drop_bits") is not None:
        drop = significant(test["expected_entropy_drop_bits"], 2)
        rows.append(("Expected gain", f"{drop} bit less uncertainty about the cause"))
    todo = in_words(proposal(str(test.get("do") or "").strip()))
    return [Paragraph(free(todo[:1].upper() + todo[1:], 600)), Facts(rows)]
