"""Figures of a blind check, from blind.json alone: confusion, power, calibration, credible sets."""

from __future__ import annotations

from backdrive_bayes.figures.style import BLUE, GREY, SERIES, Figure, legend_below, new_figure, settled, styled, words

CAPTIONS = {
    "confusion": "True effects (rows) and answers of the diagnosis (columns), in units; shade is the share of the row.",
    "power": "Listed single effects by severity: share in which a gap was seen, the right effect named and another named, "
    "with 95 % binomial intervals. Severity 1 stands 8 to 15 noise standard deviations out.",
    "reliability": "Share of cases in which a probability came true against that probability, with 95 % binomial intervals "
    "and the number of cases; on the diagonal probabilities mean what they say.",
    "sets": "90 % credible sets: coverage of the truth by severity with 95 % binomial intervals, and how many labels they hold.",
}


def blind_figures(result: dict) -> dict[str, Figure]:
    """Every figure of the object of blind.json, by the names of ``CAPTIONS``."""
    draw = {"confusion": _confusion, "power": _power, "reliability": _reliability, "sets": _sets}
    with styled():
        return settled({name: draw[name](result) for name in CAPTIONS})


def _confusion(result):
    table = result["confusion"]
    figure = new_figure(5.0)
    axes = figure.subplots()
    totals = [max(sum(row), 1) for row in table["counts"]]
    shares = [[n / total for n in row] for row, total in zip(table["counts"], totals, strict=True)]
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, row in enumerate(table["counts"]):
        for j, count in enumerate(row):
            if count:
                axes.text(j, i, str(count), ha="center", va="center", color="white" if shares[i][j] > 0.55 else "black")
    axes.set_xticks(
        range(len(table["answer"])), [words(n) for n in table["answer"]], rotation=60, ha="right", rotation_mode="anchor"
    )
    axes.set_yticks(range(len(table["truth"])), [words(n) for n in table["truth"]])
    axes.set_xlabel("answer")
    axes.set_ylabel("truth")
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    axes.set_xticks([k - 0.5 for k in range(1, len(table["answer"]))], minor=True)
    axes.set_yticks([k - 0.5 for k in range(1, len(table["truth"]))], minor=True)
    axes.grid(which="minor", color="0.85", linewidth=0.5)
    axes.tick_params(which="minor", length=0)
    return figure


def _power(result):
    figure = new_figure(2.9)
    axes = figure.subplots()
    names = (("gap_seen", "a gap seen"), ("named", "right effect named"), ("misnamed", "another effect named"))
    rows = result["power"][::-1]
    for k, (key, label) in enumerate(names):
        at = [i + 0.08 * (k - 1) for i in range(len(rows))]
        _points(axes, at, [row[key] for row in rows], SERIES[k], label)
    _severities(axes, rows, "named")
    axes.set_ylabel("share of units")
    axes.set_ylim(-0.03, 1.03)
    legend_below(figure, axes, columns=3)
    return figure


def _reliability(result):
    figure = new_figure(3.7)
    panels = (("top", "most probable label"), ("all_classes", "all labels"))
    for axes, (key, title) in zip(figure.subplots(1, 2, sharey=True), panels, strict=True):
        curve = result["calibration"][key]
        axes.plot([0, 1], [0, 1], color=GREY, linewidth=0.8)
        _points(axes, [b["mean_probability"] for b in curve["bins"]], curve["bins"], SERIES[0], None)
        for b in curve["bins"]:
            _count_label(axes, b)
        axes.set_title("\n".join((title, *_errors(curve))))
        axes.set_xlabel("probability given")
        axes.set_xlim(-0.03, 1.03)
        axes.set_ylim(-0.14, 1.05)
        axes.set_yticks([0, 0.2, 0.4, 0.6, 0.8, 1.0])
        axes.set_aspect("equal")
    figure.axes[0].set_ylabel("share that came true")
    return figure


def _errors(curve):
    if curve["expected_error"] is not None:
        yield f"calibration error {curve['expected_error']:.3f}"
        yield f"95 % of calibrated ones: below {curve['error_if_calibrated']['q95']:.3f}"


def _count_label(axes, b):
    """Number of cases of a bin along the bottom, in the middle of the bin."""
    axes.text(0.5 * (b["from"] + b["to"]), -0.1, str(b["of"]), ha="center", va="center", fontsize=7, color="0.3")


def _sets(result):
    sets = result["credible_sets"]
    figure = new_figure(2.9)
    left, right = figure.subplots(1, 2)
    rows = sets["by_severity"][::-1]
    left.axhline(0.9, color=GREY, linewidth=0.8)
    _points(left, range(len(rows)), [row["coverage"] for row in rows], SERIES[0], None)
    _severities(left, rows, "coverage")
    left.set_ylabel("share of sets that hold the truth")
    left.set_ylim(-0.03, 1.03)
    right.bar([str(size) for size in sets["sizes"]], list(sets["sizes"].values()), color=BLUE, width=0.6)
    right.set_xlabel("labels in the set")
    right.set_ylabel("units")
    mean = sets["size"]["mean"]
    right.set_title("" if mean is None else f"mean size {mean:.2f}")
    return figure


def _points(axes, at, shares, look, label):
    """Shares with their intervals; those of nothing are left out."""
    kept = [(x, s) for x, s in zip(at, shares, strict=True) if s["of"]]
    if kept:
        x, y = [x for x, _ in kept], [s["share"] for _, s in kept]
        bars = [[max(s["share"] - s["lo"], 0.0) for _, s in kept], [max(s["hi"] - s["share"], 0.0) for _, s in kept]]
        axes.errorbar(x, y, yerr=bars, **look, markersize=4, linewidth=1, capsize=2, elinewidth=0.8, label=label)


def _severities(axes, rows, key):
    axes.set_xticks(range(len(rows)), [f"{row['severity']:g}\n({row[key]['of']} units)" for row in rows])
    axes.set_xlim(-0.5, max(len(rows), 1) - 0.5)
    axes.set_xlabel("severity")
