"""The chapter of a pooled batch: mean and spread of each quantity, the next unit, and what was not pooled and why."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.pool import caption, pool_figures, quantity_words, unit_of
from backdrive_bayes.number_text import interval_text, level_text, significant
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Paragraph, Picture, Table
from backdrive_bayes.report.text import free
from backdrive_bayes.results import POOL, read_result

MOST_ROWS = 30
_METHOD = (
    "Partial pooling. The units' true values are taken as normal, for positive quantities in their logarithm, about a batch mean "
    "with a batch spread, both unknown with flat densities (Gelman 2006, doi:10.1214/06-BA117A). Each unit enters by its stored "
    "draws: its own prior is divided out and what remains is compressed to a mixture of normal distributions, so that no unit is "
    "fitted again. The loss is the Kullback-Leibler divergence of the stated posterior from that of the re-weighted draws."
)


def chapter(folder: Path) -> Chapter:
    """Read a folder of a pooled batch and lay out its pages."""
    result = read_result(Path(folder) / "pool.json", POOL)
    figures = pool_figures(result)
    title = free(f"Batch {result['batch']}" if result["batch"] else "Batch", 90)
    first = [Picture(n, caption(n, result)) for n in figures][:1]
    summary = [Heading(title, 1), _banner(result), _facts(result), *first]
    pages = [*_quantities(result), *[Picture(n, caption(n, result)) for n in list(figures)[1:]], *_refused(result)]
    return Chapter(
        title, summary, [*_units(result), *_left_out(result)], figures, pages, outcome=result["outcome"]["reason"],
        terms=[Heading("Pooled batches"), Paragraph(_METHOD)],
    )  # fmt: skip


def _banner(result):
    refused = [q for q in result["quantities"] if q["refused"]]
    text = f"Results that lose more than {result['most_bits']:g} bit of information are refused."
    return Banner("caution" if refused else "good", result["outcome"]["reason"], text)


def _facts(result):
    rows = [
        ("Units", f"{len(result['units'])} pooled, {len(result['left_out'])} left out"),
        ("Loops", ", ".join(f"{rate:.3g} N·m/s ±{amplitude:.3g} N·m" for rate, amplitude in _loops(result))),
        ("Lost motion", f"at ±kT_r, k = {result['k']:g}, T_r = {significant(result['rated_torque_Nm'])} N·m"),
        ("Software", f"backdrive-bayes {result['version']}, seed {result['seed']}"),
    ]
    return Facts(rows)


def _loops(result):
    """Rates and amplitudes of the loops whose indicators were pooled."""
    at = [(q["loading_rate_Nm_per_s"], q["amplitude_Nm"]) for q in result["quantities"]]
    return sorted({loop for loop in at if None not in loop})


def _name(quantity, result):
    unit = unit_of(quantity)[1]
    return f"{quantity_words(quantity, len(_loops(result)))}{f' [{unit}]' if unit else ''}"


def _quantities(result):
    told = [q for q in result["quantities"] if not q["refused"]]
    if not told:
        return
    yield Heading("Mean, spread and the next unit")
    rows = [
        [_name(q, result), str(q["units"]), interval_text(q["mean"], unit_of(q)[0]), _spread(q),
         interval_text(q["next_unit"], unit_of(q)[0]), significant(q["loss_bits"], 2)]
        for q in told
    ]  # fmt: skip
    yield Table(["Quantity", "Units", "Mean", "Spread", "Next unit", "Loss [bit]"], rows, [1.7, 0.5, 1.5, 1.3, 1.5, 0.7])
    level = level_text(result["level"])
    yield Note(
        f"Median [{level} interval]. Mean: of positive quantities the geometric mean. Spread: in per cent the standard deviation "
        "of the logarithm, otherwise that of the quantity in its unit; its interval is the shortest and begins at zero where the "
        f"units need not differ. Next unit: the true value of a further unit, with probability {level} in the interval."
    )


def _spread(quantity):
    if quantity["scale"] == "log":
        return f"{interval_text(quantity['spread'], 100.0)} %"
    return interval_text(quantity["spread"], unit_of(quantity)[0])


def _refused(result):
    refused = [q for q in result["quantities"] if q["refused"]]
    if refused:
        yield Heading("Refused")
        rows = [[_name(q, result), free(q["refused"], 300)] for q in refused]
        yield Table(["Quantity", "Why, and what to do instead"], rows, [1.0, 3.0])


def _units(result):
    rows = [(q, r) for q in result["quantities"] if not q["refused"] for r in q["of_units"] if r["refused"]]
    if rows:
        yield Heading("Units without a pooled interval")
        table = [[free(r["unit"], 40), _name(q, result), free(r["refused"], 200)] for q, r in rows[:MOST_ROWS]]
        yield Table(["Unit", "Quantity", "Why, and what to do instead"], table, [1.0, 1.4, 2.6])
        if len(rows) > MOST_ROWS:
            yield Note(f"And {len(rows) - MOST_ROWS} more in pool.json.")


def _left_out(result):
    left = result["left_out"]
    if left:
        yield Heading("Units left out")
        yield Table(["Unit", "Why"], [[free(r["unit"], 60), free(r["why"], 200)] for r in left[:MOST_ROWS]], [1.0, 2.4])
        if len(left) > MOST_ROWS:
            yield Note(f"And {len(left) - MOST_ROWS} more in pool.json.")
