"""Figures of verdicts and comparisons draw from saved objects, carry units and do not overlap."""

import json
from itertools import combinations

import pytest
from support.decided import evidence
from test_figures import texts

from backdrive_bayes.commands.output import write_json
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.comparison import compare
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.figures import catalogue

SMALL = ((0.01, 0.1), (0.05, 0.1), (0.1, 0.1), (0.05, 0.04))


def saved(tmp_path_factory, result):
    """An object as a reader of its file sees it."""
    path = tmp_path_factory.mktemp("saved") / "x.json"
    write_json(path, result)
    return json.loads(path.read_text())


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    limits = (
        Limit("lost_motion_rad", lo=0.009, hi=0.0099),
        Limit("loop_area_J", hi=3.8e-4, rate=0.05),
        Limit("absorbed_J", lo=1e-4, rate=0.01, amplitude=0.06),
        Limit("dissipation_ratio", hi=0.9),
    )
    verdict = assess([evidence()], Limits(limits))
    long_name = evidence("a unit with quite a long name", loops=SMALL, loop_area_J=1e-3)
    both = saved(tmp_path_factory, compare([evidence("reducer-1", loops=SMALL), long_name]))
    return catalogue.verdict_figures(saved(tmp_path_factory, verdict)) | catalogue.comparison_figures(both)


NAMES = [
    "acceptance", "acceptance-2", "comparison-loops", "comparison-loops-2", "comparison-energy", "comparison-energy-2",
    "comparison-ratios", "comparison-mechanism",
]  # fmt: skip


def test_every_figure_is_there_with_a_caption_of_its_own(figures):
    assert list(figures) == NAMES
    captions = {n: catalogue.caption(n, 0.9) for n in figures}
    assert len(set(captions.values())) == len(figures)
    assert "guard bands" in captions["acceptance"] and captions["acceptance-2"].endswith("continued.")
    assert "Medians with 90 % intervals" in captions["comparison-mechanism"]


@pytest.mark.parametrize("name", NAMES)
def test_no_text_overlaps_is_cut_or_too_small(figures, name):
    shown, frame = texts(figures[name]), figures[name].bbox
    for text, box in shown:
        assert text.get_size() >= 8
        assert box.x0 >= frame.x0 - 1 and box.x1 <= frame.x1 + 1 and box.y0 >= frame.y0 - 1 and box.y1 <= frame.y1 + 1, text
    for (a, box_a), (b, box_b) in combinations(shown, 2):
        wide = min(box_a.x1, box_b.x1) - max(box_a.x0, box_b.x0)
        high = min(box_a.y1, box_b.y1) - max(box_a.y0, box_b.y0)
        assert wide < 1 or high < 1, f"'{a.get_text()}' and '{b.get_text()}' overlap"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("acceptance", ["lost motion δ [arcmin]", "guard band", "limit"]),
        ("comparison-loops", ["angle [arcmin]", "torque [N·m]", "reducer-1"]),
        ("comparison-energy", ["[mJ/(N·m)]"]),
        ("comparison-ratios", ["ratio: reducer-1 over", "dissipated energy S"]),
        ("comparison-mechanism", ["share of S [–]", "given back/absorbed [–]", "friction"]),
    ],
)
def test_axes_carry_units_and_names(figures, name, words):
    labels = " ".join(text.get_text() for text, _ in texts(figures[name]))
    assert all(word in labels for word in words)


def test_limits_are_seen_even_where_the_posterior_is_narrow(figures):
    panel = figures["acceptance"].axes[0]
    left, right = panel.get_xlim()
    assert left < 0.009 * 10800 / 3.14159 and right > 0.0099 * 10800 / 3.14159


def test_many_units_of_strange_names_are_told_apart(tmp_path_factory):
    """Eight units have looks of their own in each figure, and every name stands in its legend: also one that begins with an
    underscore, that no font holds, or whose end alone tells it from another."""
    names = [f"RV-110E-127_SN20261128-00{i}" for i in range(5)] + ["_hidden", "歯車一号機", "歯車二号機"]
    result = saved(tmp_path_factory, compare([evidence(name, loops=SMALL[:1]) for name in names]))
    figures = {n: f for n, f in catalogue.comparison_figures(result).items() if n.startswith("comparison-loops")}
    assert list(figures) == ["comparison-loops", "comparison-loops-2"]
    shown = [t.get_text() for f in figures.values() for legend in f.legends for t in legend.get_texts()]
    assert len(set(shown)) == 8 and any("hidden" in s for s in shown) and any("u{6B6F}" in s for s in shown)
    for figure in figures.values():
        looks = [(line.get_linestyle(), line.get_color()) for line in figure.legends[0].get_lines()]
        assert len(set(looks)) == len(looks) <= 6


def test_a_limit_far_from_the_posterior_is_told_at_the_edge(tmp_path_factory):
    verdict = saved(tmp_path_factory, assess([evidence()], Limits((Limit("peak_angle_rad", hi=0.5),))))
    panel = catalogue.verdict_figures(verdict)["acceptance"].axes[0]
    left, right = panel.get_xlim()
    row = verdict["limits"][0]["histogram"]["edges"]
    seen = (row[-1] - row[0]) * 10800 / 3.14159
    assert right - left < 3.0 * seen, "the posterior is not squeezed to a line"
    assert "limit 1719" in panel.get_xlabel() and any(line.get_marker() == ">" for line in panel.lines)
