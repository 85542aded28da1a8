"""The chapter of a fleet: how many units came out how, drift, batches, and the units to look at."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.fleet import CAPTIONS, chart_unit, fleet_figures, order_words
from backdrive_bayes.figures.style import in_words, indicator_words, words
from backdrive_bayes.number_text import probability_text, significant
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Links, Note, Paragraph, Picture, Table
from backdrive_bayes.report.text import Address, free
from backdrive_bayes.results import FLEET, read_result

TITLE = "Fleet"
MOST_FAILURES = 15
ONE_IN = 370
"""Units of a normal process of which one lies beyond three sigma."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``fleet`` and lay out its pages."""
    result = read_result(Path(folder) / "fleet.json", FLEET)
    figures = fleet_figures(result)
    first = next((name for name in ("fleet-shares", "fleet-distributions") if name in figures), None)
    shown, others = [name for name in figures if name == first], [name for name in figures if name != first]
    pictures = [Picture(name, CAPTIONS[name]) for name in shown]
    summary = [Heading(TITLE, 1), _banner(result), _facts(result), *_charts(result), *_worst(result), *pictures]
    details = [*(Picture(name, CAPTIONS[name], spilt=True) for name in shown), *_batches(result), *_failures(result)]
    pages = [Picture(name, CAPTIONS[name]) for name in others]
    return Chapter(TITLE, summary, details, figures, pages, outcome=_told(result))


def _alarms(result):
    return [c for c in result["charts"] if c["drift"] and c["drift"]["alarm"]]


def _told(result):
    counts, alarms = result["counts"], _alarms(result)
    names = ", ".join(indicator_words(c["indicator"]) for c in alarms)
    examined = any(c["drift"] for c in result["charts"])
    drift = f"drift of {names}" if alarms else "no drift found" if examined else "too few units to find drift"
    return f"{counts['done']} of {counts['units']} units have a result; {drift}"


def _banner(result):
    counts = result["counts"]
    tone = "bad" if _alarms(result) else "caution" if result["outcome"]["exit_code"] else "good"
    text = (
        f"{counts['failed']} failed, {counts['set_aside']} set aside after they took their worker down, "
        f"{counts['done'] - counts['converged']} did not converge, {counts['forced']} forced."
    )
    return Banner(tone, _told(result), text)


def _facts(result):
    loop, rows = result["loop"], []
    for key, name in (("verdicts", "Verdicts"), ("effects", "Diagnosed effects")):
        if result[key]:
            rows.append((name, ", ".join(f"{words(n).replace('+', ' + ')} {count}" for n, count in result[key].items())))
    if loop:
        why = "not converged, forced, of another T_r, or without this loop"
        left_out = f"; {loop['left_out']} left out ({why})" if loop["left_out"] else ""
        rows.append((
            "Charts",
            f"{loop['units']} units in order of {order_words(result)}, at {loop['loading_rate_Nm_per_s']:.3g} N·m/s, "
            f"±{loop['amplitude_Nm']:.3g} N·m{left_out}",
        ))  # fmt: skip
    return Facts([*rows, ("Software", f"backdrive-bayes {result['version']}, seed {result['seed']}")])


def _charts(result):
    if not result["charts"]:
        return
    yield Heading("Indicators and drift")
    rows = []
    for chart in result["charts"]:
        factor, unit = chart_unit(chart)
        limits = chart["sigma"] > 0
        rows.append([
            f"{indicator_words(chart['indicator'])}{f' [{unit}]' if unit else ''}",
            " → ".join(significant(c, 3, factor) for c in dict.fromkeys(chart["centre"])),
            significant(chart["sigma"], 2, factor) if limits else "–",
            str(len(chart["outside"])) if limits else "–",
            _drift(chart["drift"]),
        ])  # fmt: skip
    yield Table(["Indicator", "Centre", "Sigma", "Outside", "Drift"], rows, [1.8, 0.8, 0.8, 0.7, 2.0])
    expected = result["loop"]["units"] / ONE_IN
    yield Note(
        f"Outside: beyond {result['sigmas']:g} sigma of the moving ranges; a normal process has {expected:.2g} units there. "
        "Drift: largest difference between the units before and from one on, against shuffled orders of the same units. "
        f"Of fleets without drift at most {100 * result['false_alarm']:g} % get an alarm in any of the charts."
    )


def _drift(drift):
    if drift is None:
        return "too few units"
    told = f"from about {free(drift['first'], 40)} on" if drift["alarm"] else "none"
    return [told, f"by chance {probability_text(drift['probability'])}"]


def _worst(result):
    if result["worst"]:
        yield Heading("Units to look at")
        yield Links([(row["unit"], Address(row["result"]), free(in_words(row["why"]), 120)) for row in result["worst"]])
        yield Note("A unit's name leads to its result file, in the fleet's folder.")


def _batches(result):
    batches = result["batches"]
    if not batches:
        return
    yield Heading("Batches")
    names = [c["indicator"] for c in result["charts"]]
    units = {c["indicator"]: chart_unit(c) for c in result["charts"]}
    rows = [
        [free(row["batch"] or "(none)", 40), str(row["units"]), *(_quartiles(row["indicators"][n], units[n][0]) for n in names)]
        for row in batches["rows"]
    ]
    columns = [f"{indicator_words(n)}{f' [{units[n][1]}]' if units[n][1] else ''}" for n in names]
    yield Table(["Batch", "Units", *columns], rows, [1.4, 0.5, *[1.4] * len(names)])
    chance = [f"{indicator_words(n)} {probability_text(p)}" for n, p in batches["probability"].items() if p is not None]
    tested = f" Probability of such differences by chance (Kruskal and Wallis): {', '.join(chance)}." if chance else ""
    yield Note(f"Median of the units, with the middle half of them beneath.{tested}")


def _quartiles(parts, factor):
    ends = (significant(parts[key], 3, factor) for key in ("quarter", "three_quarters"))
    return [significant(parts["median"], 3, factor), " – ".join(ends)]


def _failures(result):
    failures = result["failures"]
    if failures:
        yield Heading("Units without a result")
        yield Table(["Unit", "Why"], [[free(f["unit"], 60), free(f["error"], 200)] for f in failures[:MOST_FAILURES]], [1.0, 2.4])
        if len(failures) > MOST_FAILURES:
            yield Note(f"And {len(failures) - MOST_FAILURES} more in fleet.json.")
    for name, where in result["same_names"].items():
        many = f"{len(where)} units are named {free(name, 40)}"
        yield Paragraph(free(f"{many}: {free(', '.join(where), 160)}. The table lists them by folder.", 300))
