"""The chapter of an acceptance: a verdict that can be signed, and the risks behind it."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.catalogue import caption, verdict_figures
from backdrive_bayes.figures.style import display_unit, indicator_words, loop_words, words
from backdrive_bayes.number_text import interval_text, level_text, like_interval, marked, probability_text, significant
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Paragraph, Picture, Signature, Table
from backdrive_bayes.report.findings import PROVISIONAL, findings_blocks, warned
from backdrive_bayes.report.sentences import sentence
from backdrive_bayes.report.text import digests, free
from backdrive_bayes.results import VERDICT, read_result

ON_SUMMARY = 6
"""Limits on the summary page; more follow on the next pages."""
MOST_NAMES = 3
"""Effects in no model at hand that the summary names."""
_TONES = {"accepted": "good", "rejected": "bad", "inconclusive": "caution"}
_RULE = (
    "JCGM 106:2012. The conformance probability p_c (clause 7) is the posterior probability that the indicator keeps its limit. "
    "An accepted unit has the specific consumer's risk 1 − p_c of being out of limits, a rejected one the specific "
    "producer's risk p_c of being within. The unit is accepted where the first risk, for all limits together, is at most the "
    "agreed one, rejected where the second is, and otherwise the verdict is inconclusive. The guard band (clause 8.3) is how "
    "far the median must stay from a limit for that. What no model at hand holds counts against both decisions, but where the "
    "measured loop itself breaks an energy's limit by more than the gap can enclose."
)
_GLOBAL = (
    "Global risks (clause 9.5) hold for units of the process that are measured and judged like this one: consumer's, out of "
    "limits and accepted; producer's, within limits and rejected. The measurement is taken as normal with the posterior's "
    "standard deviation."
)


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``accept`` and lay out its pages."""
    verdict = read_result(Path(folder) / "verdict.json", VERDICT)
    figures, fitted = verdict_figures(verdict), (Path(folder) / "posterior.nc").exists()
    name, first = free(verdict["unit"], 80), next(iter(figures))
    pictures = [Picture(n, caption(n)) for n in figures if n != first]
    return Chapter(
        free(f"{name}: acceptance", 90),
        [
            Heading(free(f"{name}: acceptance", 90), 1),
            _banner(verdict),
            *findings_blocks(verdict),
            _identity(verdict),
            Heading("Limits"),
            *_limits(verdict, ON_SUMMARY),
            Picture(first, caption(first)),
            Signature(["Decided by", "Date", "Signature"]),
        ],
        [Picture(first, caption(first), spilt=True), *_more(verdict), *pictures],
        figures,
        terms=[
            Heading("Acceptance"),
            Paragraph(_RULE),
            *([Paragraph(_GLOBAL)] if _global(verdict) else []),
            _basis(verdict, in_full=not fitted),
        ],
        outcome=", ".join(filter(None, [_outcome(verdict), warned(verdict)])),
        provisional=_provisional(verdict),
    )


def _provisional(verdict):
    return not verdict["convergence"]["converged"] or bool(verdict.get("forced"))


def _outcome(verdict):
    outcome = verdict["outcome"]
    examined = "" if verdict["structure"]["diagnosed"] else ", structure not examined"
    kept = probability_text(verdict["conformance_probability"])
    return f"{outcome['word'].upper()}{examined}; all limits kept with probability {kept}"


def _banner(verdict):
    outcome = verdict["outcome"]
    text = " ".join(f"{sentence(told[:1].upper() + told[1:].rstrip('.'), 400)}." for told in _told(outcome))
    if verdict["next"]:
        text += f" Next: {sentence(verdict['next']['do'], 500)}"
    # Green is for a verdict that stands as it is.
    tone = "caution" if outcome["caveat"] and outcome["word"] == "accepted" else _TONES[outcome["word"]]
    return Banner(tone, outcome["word"].upper(), text)


def _told(outcome):
    return [text for text in (outcome["caveat"], outcome["reason"]) if text]


def _identity(verdict):
    identity, fit = dict(verdict["identity"]), verdict["reproduction"]
    rows = [
        ("Unit", free(verdict["unit"])),
        *((free(words(k).capitalize(), 20), free(v)) for k, v in identity.items()),
        ("Rated torque", f"{significant(verdict['rated_torque_Nm'])} N·m"),
        ("Agreed risks", ", ".join(f"{who}'s {_percent(verdict['risk'][who])}" for who in ("consumer", "producer"))),
        ("All limits kept", f"with probability {probability_text(verdict['conformance_probability'])}"),
        ("Limiting", _limiting(verdict)),
        ("Structure", _examined(verdict["structure"])),
        *_global(verdict),
    ]
    return Facts([*rows, *([("Data, SHA-256", digests(fit["data_sha256"]))] if fit.get("data_sha256") else [])])


def _examined(structure):
    """What a diagnosis says of the model behind the verdict."""
    if not structure["diagnosed"]:
        return "not examined: no diagnosis was given, so that an effect that acts beside the model may hide"
    left = structure["unknown_probability"]
    if not left:
        return "examined by a diagnosis; the models at hand hold what it answers with"
    names = sorted(structure["uncovered"].items(), key=lambda item: -item[1])[:MOST_NAMES]
    told = ", ".join(f"{free(words(n), 60)} {probability_text(p)}" for n, p in names)
    more = ", …" if len(structure["uncovered"]) > MOST_NAMES else ""
    return f"examined by a diagnosis; in no model at hand with probability {probability_text(left)}: {told}{more}"


def _limiting(verdict):
    at = verdict["limiting"]
    return f"{indicator_words(at['indicator'])} at {_at(at)}"


def _at(row):
    predicted = ", predicted" if row.get("predicted") else ""
    return f"{loop_words(row)}{predicted}"


def _percent(share):
    return f"{100 * share:.3g} %"


def _limits(verdict, at_most=None):
    rows = verdict["limits"][:at_most]
    columns = ["Indicator", "Unit", "Limit", f"Posterior, {level_text(verdict['level'])}", "p_c", "Verdict", "Least squares"]
    left = len(verdict["limits"]) - len(rows)
    more = f" {left} further limits follow on the next pages." if left > 0 else ""
    lost = any(r["indicator"] == "lost_motion_rad" for r in rows)
    marks = f" {PROVISIONAL}" * _provisional(verdict)
    unheld = verdict["structure"]["unknown_probability"]
    counted = f" p_c counts as not kept what no model at hand holds ({probability_text(unheld)})." if unheld else ""
    at_k = f" δ is taken at ±kT_r with k = {verdict['k']:g}." if lost else ""
    return [
        Table(columns, [_limit_cells(r, _provisional(verdict)) for r in rows], [1.3, 0, 1.05, 1.3, 1.25, 0.85, 0.9]),
        Note(
            f"Median [{level_text(verdict['level'])} interval] of the reducer's own settled loop; p_c: conformance "
            f"probability, with the specific risks (consumer's if accepted / producer's if rejected).{counted}{at_k} "
            "Least squares: the classic evaluation's point estimate and where it lies; its branches do not "
            f"close at ±T and friction hides in its offset, so that it may differ by more than the interval.{marks}{more}"
        ),
    ]


def _limit_cells(row, provisional):
    factor, unit = display_unit(row["unit"])
    return [
        [indicator_words(row["indicator"]), _at(row)],
        unit or "–",
        [_limit_text(row, factor), f"guard band {_guard(row, factor)}"],
        marked(interval_text(row, factor), provisional),
        [probability_text(row["conformance_probability"]), _risk_text(row)],
        row["verdict"],
        _classic(row, factor),
    ]


def _risk_text(row):
    return f"risks {probability_text(row['specific_consumer_risk'])} / {probability_text(row['specific_producer_risk'])}"


def _classic(row, factor):
    value = row["naive"]["value"]
    return "–" if value is None else [like_interval(value, row, factor), "inside" if row["naive"]["inside"] else "outside"]


def _limit_text(row, factor):
    """The limit with its own digits."""
    shown = [None if row[k] is None else f"{factor * row[k]:.5g}".replace("-", "−") for k in ("min", "max")]
    if None not in shown:
        return f"{shown[0]} to {shown[1]}"
    return f"at least {shown[0]}" if shown[1] is None else f"at most {shown[1]}"


def _more(verdict):
    return [Heading("All limits"), *_limits(verdict)] if len(verdict["limits"]) > ON_SUMMARY else []


def _guard(row, factor):
    """The guard band of each limit that the row has."""
    bands = [("below_max", "max"), ("above_min", "min")]
    return " / ".join(significant(row["guard_band"][k], 2, factor) for k, limit in bands if row[limit] is not None)


def _global(verdict):
    """A fact for each limit that has global risks."""
    return [("Global risks", _global_text(r)) for r in verdict["limits"] if r["global"]]


def _global_text(row):
    factor, unit = display_unit(row["unit"])
    found = row["global"]
    origin = f"{found['batch_units']} other units" if found["batch_units"] else f"stated, {found['process']['shape']}"
    if found["process"]["shape"] == "pooled":
        origin = f"a pooled batch of {found['batch_units']} units"
    risks = ", ".join(f"{who}'s {probability_text(found[who])}" for who in ("consumer", "producer"))
    outside = probability_text(found["nonconforming"])
    process = f"process {_process(found['process'], factor)} {unit} ({origin})"
    return f"{indicator_words(row['indicator'])} at {_at(row)}: {risks}; {process}, {outside} out of limits"


def _process(process, factor):
    """Mean ± standard deviation with the same decimals."""
    spread = {"median": process["mean"], "lo": process["mean"] - process["sd"], "hi": process["mean"] + process["sd"]}
    return f"{like_interval(process['mean'], spread, factor)} ± {like_interval(process['sd'], spread, factor)}"


def _basis(verdict, in_full):
    """Models, convergence and reproduction of a verdict in a note, digests ``in_full`` where no fit's chapter holds them."""
    found, fit = verdict["convergence"], verdict["reproduction"]
    models = "; ".join(f"{_model(m)} {probability_text(m['probability'])}" for m in verdict["structure"]["models"])
    sampling = "converged" if found["converged"] else "NOT converged"
    numbers = f"largest R-hat {significant(found['max_rhat'], 4)}, smallest tail ESS {significant(found['min_tail_ess'], 4)}"
    made = f" Seed: {fit['seed']}." if fit.get("seed") is not None else ""
    if in_full and fit.get("data_sha256"):
        made += f" Data, SHA-256: {', '.join(fit['data_sha256'])}."
    return Note(f"{free(verdict['unit'], 80)}. Model: {models}; {sampling}: {numbers}.{made}")


def _model(model):
    return " + ".join(free(words(m)) for m in [*model["modules"], *model["effects"]])
