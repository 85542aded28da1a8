"""The chapter of an acceptance: a verdict that can be signed, and the risks behind it."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.catalogue import caption, verdict_figures
from backdrive_bayes.figures.style import display_unit, indicator_words, words
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Paragraph, Picture, Signature, Table
from backdrive_bayes.report.numbers import fixed, interval_text, level_text, like_interval, probability_text, significant
from backdrive_bayes.report.sentences import sentence
from backdrive_bayes.report.text import digests, free
from backdrive_bayes.results import VERDICT, read_result

ON_SUMMARY = 6
"""Limits on the summary page; more follow on the next pages."""
_TONES = {"accepted": "good", "rejected": "bad", "inconclusive": "caution"}
_RULE = (
    "JCGM 106:2012. The conformance probability p_c (clause 7) is the posterior probability that the indicator keeps its limit. "
    "An accepted unit has the specific consumer's risk 1 − p_c of being out of limits, a rejected one the specific "
    "producer's risk p_c of being within. The unit is accepted where the first risk, for all limits together, is at most the "
    "agreed one, rejected where the second is, and otherwise the verdict is inconclusive. The guard band (clause 8.3) is how "
    "far the median must stay from a limit for that. What no model at hand holds counts against both decisions."
)
_GLOBAL = (
    "Global risks (clause 9.5) hold for units of the process that are measured and judged like this one: consumer's, out of "
    "limits and accepted; producer's, within limits and rejected. The measurement is taken as normal with the posterior's "
    "standard deviation."
)


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``accept`` and lay out its pages."""
    verdict = read_result(Path(folder) / "verdict.json", VERDICT)
    figures = verdict_figures(verdict)
    name, first = free(verdict["unit"], 80), next(iter(figures))
    pictures = [Picture(n, caption(n)) for n in figures if n != first]
    return Chapter(
        free(f"{name}: acceptance", 90),
        [
            Heading(free(f"{name}: acceptance", 90), 1),
            _banner(verdict),
            _identity(verdict),
            Heading("Limits"),
            *_limits(verdict, ON_SUMMARY),
            Picture(first, caption(first)),
            Signature(["Decided by", "Date", "Signature"]),
        ],
        [Picture(first, caption(first), spilt=True), *_more(verdict), *pictures, *_risks(verdict), *_structure(verdict)],
        figures,
    )


def _banner(verdict):
    reason = verdict["reason"][:1].upper() + verdict["reason"][1:].rstrip(".")
    text = f"{sentence(reason, 400)}."
    if verdict["next"]:
        text += f" Next: {sentence(verdict['next']['do'], 500)}"
    return Banner(_TONES[verdict["verdict"]], verdict["verdict"].upper(), text)


def _identity(verdict):
    identity, fit = dict(verdict["identity"]), verdict["reproduction"]
    rows = [
        ("Unit", free(verdict["unit"])),
        *((free(words(k).capitalize(), 20), free(v)) for k, v in identity.items()),
        ("Rated torque", f"{significant(verdict['rated_torque_Nm'])} N·m"),
        ("Agreed risks", ", ".join(f"{who}'s {_percent(verdict['risk'][who])}" for who in ("consumer", "producer"))),
        ("All limits kept", f"with probability {probability_text(verdict['conformance_probability'])}"),
        ("Limiting", _limiting(verdict)),
    ]
    return Facts([*rows, *([("Data, SHA-256", digests(fit["data_sha256"]))] if fit.get("data_sha256") else [])])


def _limiting(verdict):
    at = verdict["limiting"]
    return f"{indicator_words(at['indicator'])} at {_at(at)}"


def _at(row):
    predicted = ", predicted" if row.get("predicted") else ""
    return f"{row['loading_rate_Nm_per_s']:.2g} N·m/s, ±{row['amplitude_Nm']:.2g} N·m{predicted}"


def _percent(share):
    return f"{100 * share:.3g} %"


def _limits(verdict, at_most=None):
    rows = verdict["limits"][:at_most]
    columns = ["Indicator", "Unit", "Limit", f"Posterior, {level_text(verdict['level'])}", "p_c", "Verdict", "Least squares"]
    left = len(verdict["limits"]) - len(rows)
    more = f" {left} further limits follow on the next pages." if left > 0 else ""
    lost = any(r["indicator"] == "lost_motion_rad" for r in rows)
    at_k = f" δ is taken at ±kT_r with k = {verdict['k']:g}." if lost else ""
    return [
        Table(columns, [_limit_cells(r) for r in rows], [1.5, 0, 0.95, 1.4, 0.6, 0.8, 0.85]),
        Note(
            f"Median [{level_text(verdict['level'])} interval] of the reducer's own settled loop; p_c: conformance "
            f"probability.{at_k} Least squares: the classic evaluation's point estimate and where it lies; its branches do not "
            f"close at ±T and friction hides in its offset, so that it may differ by more than the interval.{more}"
        ),
    ]


def _limit_cells(row):
    factor, unit = display_unit(row["unit"])
    return [
        [indicator_words(row["indicator"]), _at(row)],
        unit or "–",
        _limit_text(row, factor),
        interval_text(row, factor),
        probability_text(row["conformance_probability"]),
        row["verdict"],
        _classic(row, factor),
    ]


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


def _risks(verdict):
    columns = ["Indicator", "Unit", "Consumer's risk if accepted", "Producer's risk if rejected", "Guard band"]
    return [
        Heading("Risks"),
        Paragraph(_RULE),
        Table(columns, [_risk_cells(r) for r in verdict["limits"]], [1.5, 0, 1.0, 1.0, 1.0]),
        Note("Of n effective draws, probabilities near a half are known to about ±0.5/√n, and none is known below 1/n."),
        *_global(verdict),
    ]


def _risk_cells(row):
    factor, unit = display_unit(row["unit"])
    bands = [("below_max", "max"), ("above_min", "min")]
    guard = " / ".join(significant(row["guard_band"][k], 2, factor) for k, limit in bands if row[limit] is not None)
    return [
        [indicator_words(row["indicator"]), _at(row)],
        unit or "–",
        probability_text(row["specific_consumer_risk"]),
        probability_text(row["specific_producer_risk"]),
        guard,
    ]


def _global(verdict):
    rows = [r for r in verdict["limits"] if r["global"]]
    if not rows:
        return []
    shares = "Accepted / rejected / inconclusive [%]"
    columns = ["Indicator", "Process (mean ± sd)", "Out of limits", "Consumer's", "Producer's", shares]
    return [
        Heading("Global risks of the process"),
        Paragraph(_GLOBAL),
        Table(columns, [_global_cells(r) for r in rows], [1.5, 1.2, 0.7, 0.8, 0.8, 1.3]),
    ]


def _global_cells(row):
    factor, unit = display_unit(row["unit"])
    found = row["global"]
    process = found["process"]
    origin = f"{found['batch_units']} other units" if found["batch_units"] else f"stated, {process['shape']}"
    shares = " / ".join(fixed(100 * found[k], 1) for k in ("accepted", "rejected", "inconclusive"))
    return [
        [indicator_words(row["indicator"]), _at(row)],
        [f"{_process(process, factor)} {unit}", origin],
        *(probability_text(found[k]) for k in ("nonconforming", "consumer", "producer")),
        shares,
    ]


def _process(process, factor):
    """Mean ± standard deviation with the same decimals."""
    spread = {"median": process["mean"], "lo": process["mean"] - process["sd"], "hi": process["mean"] + process["sd"]}
    return f"{like_interval(process['mean'], spread, factor)} ± {like_interval(process['sd'], spread, factor)}"


def _structure(verdict):
    structure = verdict["structure"]
    rows = [[_model(m), probability_text(m["probability"])] for m in structure["models"]]
    rows += [[f"in no model at hand: {free(words(n))}", probability_text(p)] for n, p in structure["uncovered"].items()]
    weighed = structure["diagnosed"] or len(rows) > 1
    told = (
        "Probabilities of the models that were averaged, with those of effects that a gap diagnosis found and no model holds."
        if weighed
        else f"One model only: {rows[0][0]}. No gap diagnosis was given, so nothing here tells how probable it is: "
        "an effect that acts beside it may hide."
    )
    found = verdict["convergence"]
    sampling = "The sampling converged" if found["converged"] else "The sampling has NOT converged"
    return [
        Heading("Models"),
        Paragraph(told),
        *([Table(["Model", "Probability"], rows, [3, 1])] if weighed else []),
        Note(
            f"{sampling}: largest R-hat {significant(found['max_rhat'], 4)}, smallest tail ESS "
            f"{significant(found['min_tail_ess'], 4)}."
        ),
        *_reproduction(verdict["reproduction"]),
    ]


def _model(model):
    return " + ".join(free(words(m)) for m in [*model["modules"], *model["effects"]])


def _reproduction(fit):
    rows = [(name, _text(fit[key])) for name, key in _REPRODUCTION if fit.get(key) is not None]
    return [Heading("Reproduction"), Facts(rows)] if rows else []


def _text(value):
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


_REPRODUCTION = (("Seed", "seed"), ("Software", "versions"), ("Data, SHA-256", "data_sha256"))
