"""Figures of a diagnosis draw from diagnosis.json alone, say what it says and cope with what it lacks."""

import json
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from support.made_up_diagnosis import diagnosis, interval, simulator, write_diagnosis
from support.told import told

from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures import catalogue
from backdrive_bayes.figures.diagnosis import figures_of
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import answer_words, chance
from backdrive_bayes.figures.fonts import drawable
from backdrive_bayes.figures.style import styled
from backdrive_bayes.number_text import share_text

NAMES = ["diagnosis", "gap-map", "gap-residual", "closed-fraction", "parameter-shift"]
NO_GAP = {
    "answer": {"effects": [], "credible_set_90": ["none"]},
    "which": [{"effect": "none", "probability": 0.97}, {"effect": "unknown", "probability": 0.03}],
    "gap": None,
    "shrink": None,
    "next_test": None,
}
NOTHING = NO_GAP | {
    "inconclusive": "too few samples",
    "answer": {"effects": [], "credible_set_90": []},
    "which": [],
    "where": {"summary": "", "map": []},
    "residual": [],
    "parameter_shift": [],
    "convergence": None,
}


def saved(count=3, **changes):
    return Diagnosed(told(diagnosis(count) | changes))


def one_of(name, result):
    """One figure of a diagnosis object."""
    return figures_of(Diagnosed(told(result)), name.__eq__)[name]


@pytest.fixture(scope="module")
def figures():
    return figures_of(saved())


@cache
def boxes(figure):
    """Texts that are drawn, with their boxes in pixels."""
    with styled():
        figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    parts = [figure, *figure.subfigs]
    found = [t for p in parts for t in (*p.texts, *(t for legend in p.legends for t in legend.get_texts()))]
    for axes in figure.axes:
        found += axes.get_legend().get_texts() if axes.get_legend() else []
        found += [axes._left_title, axes.title, *axes.texts]
        if axes.axison:
            found += [axes.xaxis.label, axes.yaxis.label, *tick_labels(axes)]
    drawn = [(t, t.get_window_extent(renderer)) for t in found if t.get_visible() and t.get_text().strip()]
    return [(t, b) for t, b in drawn if b.width > 0]


def tick_labels(axes):
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        yield from (t.label1 for t in axis.get_major_ticks() if min(limits) <= t.get_loc() <= max(limits))


def words_of(figure):
    return " ".join(t.get_text() for t, _ in boxes(figure))


@pytest.mark.parametrize("name", NAMES)
def test_figures_hold_ink_and_legible_text_that_does_not_overlap(figures, name):
    shown = boxes(figures[name])
    assert min(t.get_size() for t, _ in shown) >= 8
    pixels = np.asarray(figures[name].canvas.buffer_rgba())[..., :3]
    assert (pixels < 200).any(axis=-1).mean() > 0.01
    for t, box in shown:
        frame = figures[name].bbox
        assert box.x0 >= -1 and box.x1 <= frame.x1 + 1 and box.y0 >= -1 and box.y1 <= frame.y1 + 1, t.get_text()
    for (a, one), (b, other) in combinations(shown, 2):
        wide, high = min(one.x1, other.x1) - max(one.x0, other.x0), min(one.y1, other.y1) - max(one.y0, other.y0)
        assert wide < 1 or high < 1.5, f"'{a.get_text()}' and '{b.get_text()}' overlap"


def test_names_and_captions(figures):
    assert list(figures) == NAMES and all(catalogue.caption(name) for name in NAMES)


@pytest.mark.parametrize("count", [1, 2, 8])
def test_any_number_of_records_is_drawn(count):
    made = figures_of(saved(count))
    assert set(NAMES) <= set(made)
    assert ("gap-residual-3" in made) == (count == 8)
    for figure in made.values():
        boxes(figure)


def test_the_overview_says_what_the_json_says(figures):
    text = words_of(figures["diagnosis"])
    for needed in ("Interface slip (87 %)", "87 %", "78 % of the gap", "93 %", "91 %", "[arcmin]", "[N·m]", "11 others together"):
        assert needed in text
    bold = [t.get_text() for t, _ in boxes(figures["diagnosis"]) if t.get_weight() == "bold"]
    assert "second backlash" in bold and "unknown (not listed)" not in bold


def test_the_map_holds_every_cell_and_hatches_the_doubtful_ones(figures):
    cells = diagnosis()["where"]["map"]
    patches = [p for p in figures["gap-map"].axes[0].patches if p.get_width() > 0]
    assert len(patches) == len(cells)
    assert sum(bool(p.get_hatch()) for p in patches) == sum(not c["credible"] for c in cells) > 0
    strongest = max(cells, key=lambda c: c["share"])
    assert f"+{100 * strongest['share']:.0f}" in words_of(figures["gap-map"])


def test_amplitudes_that_differ_share_an_axis_of_shares():
    result = diagnosis()
    result["records"][1]["amplitude_Nm"] = 1.0
    assert "torque / amplitude" in words_of(one_of("gap-map", result))


def test_closed_fractions_stand_beside_the_control(figures):
    text = words_of(figures["closed-fraction"])
    assert "93 % [90, 96]" in text and "Gaussian process (control)" in text and "71 % [59, 83]" in text


def test_legs_left_out_of_a_single_record_are_named():
    result = diagnosis(1)
    result["shrink"]["records"] = [result["shrink"]["records"][0] | {"record": f"leg {i}"} for i in (2, 3)]
    assert "leg 3" in words_of(one_of("closed-fraction", result))


def test_the_shifted_median_stands_at_its_shift(figures):
    axes = figures["parameter-shift"].axes[0]
    medians = [line.get_xdata()[0] for line in axes.lines if line.get_label() == "after"]
    expected = sorted((s["shift_sd"] for s in diagnosis()["parameter_shift"]), key=lambda s: -abs(s))
    assert medians == pytest.approx(expected, abs=0.02)


def test_shifts_of_hundreds_of_deviations_stay_legible():
    result = diagnosis()
    result["parameter_shift"][0]["shift_sd"] = -800.0
    assert "logarithmic" in words_of(one_of("parameter-shift", result))


def test_a_parameter_that_was_as_good_as_fixed_leaves_the_ticks_apart():
    result = diagnosis()
    result["parameter_shift"][0]["shift_sd"] = -4829870312410.8
    figure = one_of("parameter-shift", result)
    axes = figure.axes[0]
    assert [t.get_text() for t in axes.get_xticklabels()] == ["−1000", "−100", "−10", "0", "10", "100", "1000"]
    assert "< −1000" in words_of(figure) and min(min(line.get_xdata()) for line in axes.lines) >= -1000


def test_no_gap_draws_what_there_is():
    made = figures_of(saved(**NO_GAP))
    assert list(made) == ["diagnosis", "gap-map", "gap-residual"]
    text = words_of(made["diagnosis"])
    assert "No gap: the baseline explains the data (97 %)" in text and "no effect was added" in text


def test_an_inconclusive_result_names_nothing():
    doubtful = saved(inconclusive="only one half cycle")
    text = words_of(figures_of(doubtful, "diagnosis".__eq__)["diagnosis"])
    assert answer_words(doubtful) in text and "only one half cycle" in text and "90 % credible set" not in text
    assert figures_of(saved(**NOTHING)) == {}
    unconverged = diagnosis()["convergence"] | {"converged": False, "advice": "sample longer"}
    assert saved(convergence=unconverged).inconclusive == "sample longer"


def test_keys_that_are_absent_do_no_harm():
    bare = {k: v for k, v in diagnosis().items() if k in ("schema", "unit", "records", "which", "answer")}
    bare["outcome"] = {"word": "diagnosed", "reason": "", "exit_code": 0, "caveat": ""}
    assert list(figures_of(Diagnosed(bare))) == ["diagnosis"]


def test_a_pair_named_in_two_orders_is_one_hypothesis():
    which = [{"effect": "a+b", "probability": 0.7}, {"effect": "b+a", "probability": 0.2}, {"effect": "none", "probability": 0.1}]
    pair = saved(which=which, answer={"effects": ["b", "a"], "credible_set_90": ["a+b"]})
    assert [(h.effect, h.in_set) for h in pair.ranked()] == [("a+b", True), ("none", False)]
    assert answer_words(pair) == "B + a (90 %)"


@pytest.mark.parametrize("text", ["$x$ #a \\u{1} <b>", "減速機", "a\x00b\u202e", "w" * 400])
def test_free_text_is_drawn_letter_by_letter(text):
    hostile = diagnosis(1)
    hostile["where"]["summary"] = text
    hostile["which"][0]["effect"] = text
    hostile["parameter_shift"][0]["parameter"] = text
    hostile["shrink"]["records"][0]["record"] = text
    for figure in figures_of(Diagnosed(told(hostile))).values():
        boxes(figure)
    assert drawable("$x$ #a", 20) == "$x$ #a" and drawable("a\x00", 20) == r"a\u{0}"


def test_files_are_written_and_the_same_again(tmp_path):
    write_diagnosis(tmp_path / "r", 1)
    first = [p.read_bytes() for p in catalogue.save_figures(tmp_path / "r", tmp_path / "a")]
    assert len(first) == 2 * len(NAMES) and all(len(b) > 1000 for b in first)
    assert first == [p.read_bytes() for p in catalogue.save_figures(tmp_path / "r", tmp_path / "b")]


@pytest.mark.parametrize("content", ["{", '{"schema": "other/1"}', json.dumps({"schema": "backdrive-bayes/diagnosis/1"})])
def test_a_bad_file_is_one_clear_line(tmp_path, content):
    (tmp_path / "diagnosis.json").write_text(content)
    with pytest.raises(BadInput, match="diagnosis.json.*: expected"):
        catalogue.all_figures(tmp_path)


def test_numbers_in_words():
    assert [chance(p) for p in (0.0, 0.003, 0.5, 0.996, 1.0)] == ["0 %", "<1 %", "50 %", ">99 %", "100 %"]
    assert share_text(interval(-0.2, 0.1)) == "−20 % [−30, −10]"
    assert share_text({"median": -1.0, "lo": -1.0, "hi": 0.1}) == "≤ −100 % [≤ −100, 10]"
    assert share_text(interval(0.11, 0.0)) == "11 %" and share_text(None) == "not defined"


@pytest.mark.parametrize(("count", "rows"), [(1, 1), (3, 4)])
def test_the_gap_to_a_simulator_is_drawn_by_its_shares_and_stages(count, rows):
    figure = one_of("simulator", diagnosis(count) | simulator(count))
    bars = next(axes for axes in figure.axes if axes.patches)
    assert len(bars.get_yticks()) == rows and "62 / 30 / 8 %" in {t.get_text() for t in bars.texts}
    assert sum(p.get_width() for p in bars.patches[:3]) == pytest.approx(100.0)
    names = [axes.get_ylabel() for axes in figure.axes if "[arcmin]" in axes.get_ylabel()]
    assert len(names) == 3 and names[1].startswith("re-tuned")
    texts = boxes(figure)
    assert not [(a.get_text(), b.get_text()) for (a, x), (b, y) in combinations(texts, 2) if x.overlaps(y)]


def test_nothing_is_drawn_of_a_simulator_that_agrees():
    for agreeing in (saved(1, **simulator(1, told=False)), saved()):
        assert figures_of(agreeing, "simulator".__eq__) == {}
