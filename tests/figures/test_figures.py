"""Figures draw from saved results alone, carry units and do not overlap."""

import hashlib
import json
import re
import subprocess
import sys
from functools import cache
from itertools import combinations

import numpy as np
import pytest
import xarray
from support_results import write_result

from backdrive_bayes.engine.parameters import PARAMETERS
from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures import catalogue, loop
from backdrive_bayes.figures.saved import Saved, record_blocks
from backdrive_bayes.figures.style import drawn_words, in_words, numbers, parts, record_labels, styled, words

NAMES = ["loop", "modules", "torque-energy", "amplitude", "energy", "corner", "trace", "predictive"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("result")
    write_result(path, records=3)
    return path


@pytest.fixture(scope="module")
def figures(folder):
    return catalogue.all_figures(folder)


@cache
def texts(figure):
    """Texts that are drawn, with their boxes in pixels."""
    with styled():
        figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    found = [*figure.texts, *(t for legend in figure.legends for t in legend.get_texts())]
    found += [figure._suptitle] if figure._suptitle and figure._suptitle not in found else []
    for axes in (a for a in figure.axes if a.get_visible()):
        legend = axes.get_legend()
        found += legend.get_texts() if legend else []
        if axes.axison:
            found += [axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts, *_tick_labels(axes)]
    found = [t for t in found if t.get_visible() and t.get_text().strip()]
    return [(t, t.get_window_extent(renderer)) for t in found]


def _tick_labels(axes):
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        lo, hi = sorted(limits)
        for tick in axis.get_major_ticks():
            if lo <= tick.get_loc() <= hi:
                yield tick.label1


def test_every_figure_is_drawn_and_has_a_caption(figures):
    assert list(figures) == NAMES
    assert all(catalogue.caption(name) for name in figures)


@pytest.mark.parametrize("name", NAMES)
def test_no_text_overlaps_or_leaves_the_figure(figures, name):
    assert_readable(figures[name])


def assert_readable(figure):
    """No text is cut, overlaps another or is set below eight points."""
    shown, frame = texts(figure), figure.bbox
    assert min(text.get_size() for text, _ in shown) >= 8
    for text, box in shown:
        inside = (
            box.x0 >= frame.x0 - 1
            and box.x1 <= frame.x1 + 1
            and box.y0 >= frame.y0 - 1
            and box.y1 <= frame.y1 + 1
        )
        assert inside, f"'{text.get_text()}' is cut"
    for (a, box_a), (b, box_b) in combinations(shown, 2):
        wide = min(box_a.x1, box_b.x1) - max(box_a.x0, box_b.x0)
        high = min(box_a.y1, box_b.y1) - max(box_a.y0, box_b.y0)
        assert wide < 1 or high < 1, f"'{a.get_text()}' and '{b.get_text()}' overlap"


@pytest.mark.parametrize(
    ("name", "units"),
    [
        ("loop", ["torque [N·m]", "angle [arcmin]"]),
        ("modules", ["torque [N·m]", "angle [arcmin]"]),
        ("torque-energy", ["|torque| [N·m]", "[mJ/(N·m)]"]),
        ("amplitude", ["amplitude t [N·m]", "S(t) [mJ]", "u(t) [–]"]),
        ("corner", ["[arcmin]", "[mN·m]"]),
        ("predictive", ["angle range [arcmin]", "rms step [arcmin]"]),
    ],
)
def test_axes_carry_units(figures, name, units):
    labels = " ".join(text.get_text() for text, _ in texts(figures[name]))
    assert all(unit in labels for unit in units)


SIZES = {"rad": 3.1e-8, "rad/(N·m)": 2.21234567, "N·m": 0.0045, "1": 0.4998765, "s": 1234.5678}
"""A value for every unit of a parameter: tiny, huge, or close to a round number."""


@pytest.fixture(scope="module")
def crowded(tmp_path_factory):
    """All that a diagnosed model may hold: every parameter and module there is, in six records of one rate."""
    path = tmp_path_factory.mktemp("crowded")
    shared = {p.name: (p.unit, SIZES[p.unit]) for p in PARAMETERS}
    shared |= {f"parameter_{i}_of_{words}": ("1", 0.4) for i, words in enumerate(["thermal_drift", "friction", "elastic"] * 3)}
    result = write_result(path, records=6, shared=shared)
    for i, record in enumerate(result["records"]):
        record["loading_rate_Nm_per_s"] = 0.05
        elastic = record["modules"]["elastic"]
        small = {k: [1e-3 * v for v in values] for k, values in elastic.items()}
        names = [f"module_{j}" for j in range(13 if i == 0 else 4)]
        record["modules"] = {name: elastic if j < 2 else small for j, name in enumerate(names)}
    (path / "indicators.json").write_text(json.dumps(result))
    return path, list(shared), catalogue.all_figures(path)


def test_every_parameter_and_module_is_shown_readably(crowded):
    _, names, drawn = crowded
    assert {"corner", "corner-2", "modules-2", "loop-2"} <= set(drawn)
    for figure in drawn.values():
        assert_readable(figure)
    corners = [t.get_text() for n, f in drawn.items() if n.startswith("corner") for t, _ in texts(f)]
    for name in names:
        labels = [text for text in corners if text.replace("\n", " ").startswith(f"{words(name)} [")]
        assert len(labels) == 1, f"{name} is named above its column, with its unit"


def test_traces_are_of_the_scales_that_were_sampled(figures):
    traced = " ".join(t.get_text() for t, _ in texts(figures["trace"]))
    assert "log scale of elastic" in traced and "log posterior density" in traced and "ensemble 3" in traced
    assert "sensor lag" not in traced, "held at trace level"


def test_the_main_record_is_the_largest_loop_near_the_default_rate(folder, tmp_path):
    assert Saved.read(folder).main_record == 1
    result = write_result(tmp_path, records=3)
    result["records"][1]["amplitude_Nm"] = 0.05
    (tmp_path / "indicators.json").write_text(json.dumps(result))
    assert Saved.read(tmp_path).main_record == 2


def test_a_corner_plot_of_narrow_posteriors_is_readable(tmp_path):
    """Tick labels of many digits stay beside the names."""
    shared = {f"parameter_{i}": ("rad/(N·m)", 2.21234567 * 10**i) for i in range(-3, 4)}
    write_result(tmp_path, records=1, shared=shared)
    with xarray.open_dataset(tmp_path / "posterior.nc", group="posterior", engine="h5netcdf") as data:
        narrow = {n: data[n].mean() * (data[n] / data[n].mean()) ** 1e-4 for n in shared}
        data = data.load().assign(narrow)
    data.to_netcdf(tmp_path / "posterior.nc", mode="a", group="posterior", engine="h5netcdf")
    figure = catalogue.figures_of(Saved.read(tmp_path), lambda name: name == "corner")["corner"]
    assert_readable(figure)
    ticks = [t.get_text() for t, _ in texts(figure) if re.fullmatch(r"[\d.]+", t.get_text())]
    assert max(map(len, ticks)) >= 7


def test_ticks_are_alike_in_their_decimals():
    assert numbers([0.11, 0.115]) == ["0.110", "0.115"] and numbers([20.0, 40.0]) == ["20", "40"]
    assert numbers([-3e-5, 3e-5]) == ["−3e−05", "3e−05"]


def test_loop_shows_first_loading_apart_from_the_settled_loop(figures):
    names = [t.get_text() for t in figures["loop"].legends[0].get_texts()]
    assert "measured, first loading" in names and len(set(names)) == 5


def test_the_residual_is_free_of_the_offset(folder):
    blocks = record_blocks(Saved.read(folder), 1)
    assert np.abs(blocks.residual_rad).max() < 2e-3
    assert blocks.first.sum() == 30 and set(blocks.direction) == {-1.0, 1.0}


def test_records_are_spread_evenly_over_figures_and_captions_are_told_once():
    assert parts([1, 2, 3, 4], 3) == [[1, 2], [3, 4]] and parts([1, 2, 3], 3) == [[1, 2, 3]] and parts([], 3) == []
    assert catalogue.caption("predictive-2") == "Posterior predictive check, continued."
    assert "median and 80 % interval" in catalogue.caption("amplitude", 0.8)


def test_a_figure_spells_out_what_it_cannot_set_low():
    assert [drawn_words(n) for n in ("absorbed_J", "elastic_share")] == ["absorbed energy", "elastic share of absorbed energy"]
    assert in_words("0.5 T_r, loop_area_J 7%") == "0.5 of the rated torque, dissipated energy S 7 %"
    assert in_words("sensitivity('W_L_J') of k·T_r") == "sensitivity('W_L_J') of k·T_r"


def test_many_records_make_several_figures_with_distinct_labels(tmp_path):
    result = write_result(tmp_path, records=7)
    for record in result["records"]:
        record["loading_rate_Nm_per_s"] = 0.05
    assert len(set(record_labels(result["records"]))) == 7
    made = catalogue.figures_of(Saved.read(tmp_path), lambda name: name.startswith(("loop", "amplitude")))
    assert {"loop", "loop-2", "loop-3", "amplitude-2"} <= set(made)


def test_the_json_alone_gives_the_figures_that_need_no_draws(tmp_path):
    write_result(tmp_path, records=1)
    (tmp_path / "posterior.nc").unlink()
    assert list(catalogue.all_figures(tmp_path)) == NAMES[:5]


def test_files_are_the_same_bytes_again(folder, tmp_path):
    def digest(out):
        saved = Saved.read(folder)
        figure = loop.draw(saved, [0])
        paths = [
            catalogue.save_svg(figure, out.with_suffix(".svg")),
            catalogue._save_png(figure, out.with_suffix(".png")),
        ]
        return [hashlib.sha256(p.read_bytes()).hexdigest() for p in paths]

    assert digest(tmp_path / "a") == digest(tmp_path / "b")
    assert b"<dc:date>" not in (tmp_path / "a.svg").read_bytes()


def test_save_figures_writes_vector_and_pixels(tmp_path):
    write_result(tmp_path / "r", records=1)
    written = catalogue.save_figures(tmp_path / "r", tmp_path / "figures")
    assert len(written) == 16 and all(p.stat().st_size > 1000 for p in written)


@pytest.mark.parametrize("content", [None, "{", "[]", '{"schema": "other/1"}'])
def test_a_bad_result_file_is_one_clear_line(tmp_path, content):
    if content is not None:
        (tmp_path / "indicators.json").write_text(content)
    with pytest.raises(BadInput, match="indicators.json: expected"):
        Saved.read(tmp_path)


def test_without_matplotlib_the_message_names_the_extra():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from backdrive_bayes.errors import MissingExtra\n"
        "try:\n    import backdrive_bayes.figures.catalogue\n"
        "except MissingExtra as e:\n    print(e)\n"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "backdrive-bayes[figures]" in shown
