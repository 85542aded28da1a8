"""The chapter of a diagnosis: its numbers are those of diagnosis.json, and what is missing is left out."""

import json
from types import SimpleNamespace

import pytest
from support.made_up_diagnosis import simulator, write_diagnosis
from support.pdf import Pages
from support_results import write_result

from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.number_text import interval_text, probability_text, significant
from backdrive_bayes.report import diagnosis_text, report

pytestmark = pytest.mark.usefixtures("blank_pictures")

ARCMIN = 10800 / 3.141592653589793
HOSTILE = "#strong[x] $x$ \\u{1F600} <script> *b* _i_ `c` @ref // S_g"


def pages_of(folder):
    return Pages(report.report_bytes([folder]))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("diagnosis")
    return write_diagnosis(folder), pages_of(folder)


def test_the_first_page_is_verdict_place_and_overview(made):
    _, pages = made
    for needed in (
        "GAP FOUND, CAUSES STILL CONFUSABLE",
        "Interface slip (87 %)",
        "78 % of the gap lies on the loading branches",
        "Not ruled out at 90 %: second backlash",
        "closes 91 % [88, 95] of the gap",
        "probability 0.998; fitted to all records, its smooth part: rms 1.24 arcmin, noise floor 0.107 arcmin",
        "records left out in turn: rms 1.24 arcmin before, 0.179 after, noise floor 0.107 arcmin",
        "Signature",
    ):
        assert needed in pages[0], needed
    assert pages.reader.metadata.title == "Backdrivability report: unit-38: diagnosis"


def test_tables_hold_the_numbers_of_the_json(made):
    result, pages = made
    text = pages.text
    for entry in [*result["which"][:3], result["which"][4]]:
        assert probability_text(entry["probability"]) in text
    slip = result["which"][0]["parameters"]
    assert f"slip angle {interval_text(slip['slip_angle'], ARCMIN)} arcmin" in text
    assert f"slip threshold {interval_text(slip['slip_threshold'])} N·m" in text
    for entry in [*result["shrink"]["records"], result["shrink"]]:
        fraction = entry["closed_fraction"]
        numbers = [significant(entry[k], 3, ARCMIN) for k in ("before_rad", "after_rad", "noise_floor_rad")]
        assert f"{' '.join(numbers)} {100 * fraction['median']:.0f} % [" in text
    assert "Gaussian process (control) – – – 71 % [59, 83]" in text
    area = result["shrink"]["indicators"]["loop_area_J"]
    assert f"{interval_text(area['before'], 1e3)} {interval_text(area['after'], 1e3)} −0.54" in text
    shift = result["parameter_shift"][2]
    moved = f"{interval_text(shift['before'], ARCMIN)} {interval_text(shift['after'], ARCMIN)} −6.8"
    assert f"compliance arcmin/(N·m) {moved}" in text
    assert "drag torque mN·m 31 [28, 34] 29.0 [27.0, 31.0] −1.1" in text
    assert "slip vanishes there" in text and "0.34 bit" in text and "1.0060" in text


def test_saved_sentences_are_said_in_words(tmp_path):
    summary = "78% lies above 0.75 T_r on the loop_area_J branch."
    write_diagnosis(tmp_path, 1, where={"summary": summary, "map": []})
    pages = pages_of(tmp_path)
    assert "78 % lies above 0.75 of the rated torque on the dissipated energy S branch." in pages[0]
    assert "T_r" not in pages.text and "loop_area_J" not in pages.text


def test_tables_name_the_level_of_their_intervals(made):
    text = made[1].text
    for words in ("Median [90 % interval] Unit", "Closed fraction with its 90 % interval", "[90 % interval] without and with"):
        assert words in text


def test_a_parameter_that_was_as_good_as_fixed_gives_no_wall_of_digits(tmp_path):
    shifts = write_diagnosis(tmp_path, 1)["parameter_shift"]
    shifts[0]["shift_sd"] = -4829870312410.8
    write_diagnosis(tmp_path, 1, parameter_shift=shifts)
    pages = pages_of(tmp_path)
    assert "< −1000" in pages.text and "48298703" not in pages.text


def test_the_same_result_gives_the_same_bytes(tmp_path):
    write_diagnosis(tmp_path, 1)
    assert report.report_bytes([tmp_path]) == report.report_bytes([tmp_path])


def test_a_gap_that_is_not_there(tmp_path):
    which = [{"effect": "none", "probability": 0.97}, {"effect": "unknown", "probability": 0.03}]
    answer = {"effects": [], "credible_set_90": ["none"]}
    write_diagnosis(tmp_path, answer=answer, which=which, gap=None, shrink=None, next_test=None)
    pages = pages_of(tmp_path)
    assert "NO GAP" in pages[0] and "baseline explains the data (97 %)" in pages[0] and "Not ruled out" not in pages[0]
    assert not any("How far it shrinks" in p or "Next test" in p or "What it changes" in p for p in pages)


def test_no_gap_with_rivals_is_not_called_green(tmp_path):
    """Where the credible set holds causes there is no green light, and no place of a gap that is not said to be there."""
    which = [{"effect": "none", "probability": 0.73}, {"effect": "viscoelastic_creep", "probability": 0.27}]
    answer = {"effects": [], "credible_set_90": ["none", "viscoelastic_creep"]}
    result = write_diagnosis(tmp_path, answer=answer, which=which, shrink=None, next_test=None)
    page = pages_of(tmp_path)[0]
    assert "NO GAP FOUND, NOT RULED OUT" in page and "Not ruled out at 90 %: viscoelastic creep" in page
    tone, _, text = diagnosis_text.verdict(Diagnosed(result))
    assert tone == "caution" and result["where"]["summary"][:20] not in text
    assert "1 rival in the 90 % set" in diagnosis_text.outcome(Diagnosed(result))


def test_a_name_that_closes_nothing_is_said_to_predict_nothing(tmp_path):
    result = write_diagnosis(tmp_path, 1)
    for hi, title in ((-0.1, "THE NAME IN DOUBT"), (0.2, "CAUSE NAMED")):
        shrink = result["shrink"] | {"closed_fraction": {"median": -0.4, "lo": -0.8, "hi": hi}}
        write_diagnosis(tmp_path, 1, shrink=shrink, answer={"effects": ["interface_slip"], "credible_set_90": ["interface_slip"]})
        pages = pages_of(tmp_path)
        assert title in pages[0] and ("predicts nothing of what it is named for" in pages[0]) == (hi < 0)


def test_a_property_of_the_class_closes_nothing_and_is_not_judged_by_it(tmp_path):
    result, answer = write_diagnosis(tmp_path, 1), {"effects": ["second_backlash"], "credible_set_90": ["second_backlash"]}
    records = [r | {"closed_fraction": None} for r in result["shrink"]["records"]]
    for closed, told in ((None, False), (result["shrink"]["closed_fraction"], True)):
        write_diagnosis(tmp_path, 1, shrink=result["shrink"] | {"closed_fraction": closed, "records": records}, answer=answer)
        pages = pages_of(tmp_path)
        assert "CAUSE NAMED" in pages[0] and ("Added to the model" in pages[0]) == told
        assert any("How far it shrinks" in p or "What it changes" in p for p in pages) == told


@pytest.mark.parametrize(("unlisted", "told"), [(0.98, True), (0.06, False)])
def test_what_acts_beside_a_named_module_is_told(tmp_path, unlisted, told):
    which = [{"effect": "geometric", "probability": 0.96}, {"effect": "unknown", "probability": 0.04}]
    answer = {"effects": ["geometric"], "credible_set_90": ["geometric"]}
    gap = write_diagnosis(tmp_path, 1)["gap"] | {"unlisted_probability": unlisted}
    write_diagnosis(tmp_path, 1, which=which, answer=answer, gap=gap)
    pages = pages_of(tmp_path)
    assert ("Something that is not listed acts beside it (94 %)" in pages[0]) == told
    assert ("PART OF THE CAUSE NAMED" in pages[0]) == told


def test_jumps_are_not_judged_by_what_wide_blocks_cannot_show(tmp_path):
    result = write_diagnosis(tmp_path, 1)
    shrink = result["shrink"] | {"closed_fraction": {"median": -0.4, "lo": -0.8, "hi": -0.1}}
    write_diagnosis(tmp_path, 1, shrink=shrink, answer={"effects": ["stick_slip"], "credible_set_90": ["stick_slip"]})
    assert "CAUSE NAMED" in pages_of(tmp_path)[0]


def test_an_unknown_cause_credits_nothing_to_a_name(tmp_path):
    write_diagnosis(tmp_path, answer={"effects": ["unknown"], "credible_set_90": ["unknown"]})
    pages = pages_of(tmp_path)
    assert "GAP OF UNKNOWN CAUSE" in pages[0] and "The best listed candidate closes 91 %" in pages[0]
    assert "predicts nothing" not in pages[0]
    assert "Parameters of" not in pages.text


@pytest.mark.parametrize("changes", [{}, {"which": [], "where": {"summary": "", "map": []}, "records": [], "residual": []}])
def test_inconclusive_gives_the_reason_and_no_name(tmp_path, changes):
    gone = {"gap": None, "shrink": None, "next_test": None}
    write_diagnosis(tmp_path, 1, inconclusive="the record holds less than one cycle", **gone, **changes)
    pages = pages_of(tmp_path)
    assert "INCONCLUSIVE" in pages[0] and "less than one cycle" in pages[0] and "not judged" in pages[0]
    text = pages.text
    assert "CAUSE NAMED" not in text and "Parameters of" not in text and "Interface slip (" not in text


def test_sampling_that_has_not_converged_is_inconclusive(tmp_path):
    folder = tmp_path / "r"
    result = write_diagnosis(folder, 1)
    convergence = result["convergence"] | {"converged": False, "advice": "give it more time"}
    write_diagnosis(folder, 1, convergence=convergence)
    pages = pages_of(folder)
    assert "INCONCLUSIVE" in pages[0] and "give it more time" in pages[0]


def test_free_text_prints_as_it_stands(tmp_path):
    result = write_diagnosis(tmp_path, 1)
    result["where"]["summary"] = result["next_test"]["do"] = HOSTILE
    result["which"][0]["parameters"] = {HOSTILE: {"median": 1, "lo": 0, "hi": 2, "unit": "#x"}}
    write_diagnosis(tmp_path, 1, **{k: result[k] for k in ("where", "next_test", "which")}, unit=HOSTILE)
    pages = pages_of(tmp_path)
    assert pages[0].count(HOSTILE) >= 3 and HOSTILE in pages.reader.metadata.title
    assert " ".join(HOSTILE.replace("_", " ").split())[:40] in " ".join(pages[1:]) and "#x" in pages.text


def test_many_records_and_a_pair_keep_the_summary_on_one_page(tmp_path):
    pair = "rate_dependent_friction+viscoelastic_creep"
    answer = {"effects": pair.split("+"), "credible_set_90": [pair, "interface_slip"]}
    write_diagnosis(tmp_path, 8, answer=answer)
    pages = pages_of(tmp_path)
    assert "Signature" in pages[0] and "Rate dependent friction + viscoelastic creep" in pages[0]


def test_a_fit_and_a_diagnosis_in_one_folder_make_two_chapters(tmp_path):
    write_diagnosis(tmp_path, 1, unit="u")
    write_result(tmp_path, records=1)
    (tmp_path / "posterior.nc").unlink()
    pages = pages_of(tmp_path)
    assert "CONVERGED; 1 record" in pages[0] and "CONVERGED" in pages[1] and "CAUSE" in pages[2]


def test_a_broken_result_is_one_clear_line(tmp_path):
    result = write_diagnosis(tmp_path, 1)
    del result["where"]["map"][0]["branch"]
    (tmp_path / "diagnosis.json").write_text(json.dumps(result))
    with pytest.raises(BadInput, match="diagnosis.json, where.map 1, key branch: expected one of"):
        report.report_bytes([tmp_path])


def test_a_simulator_has_a_page_of_its_own(tmp_path):
    write_diagnosis(tmp_path, 3, **simulator(3))
    pages = pages_of(tmp_path)
    assert "GAP TO THE SIMULATOR, CAUSES STILL CONFUSABLE" in pages[0] and "Missing in the simulator: interface slip" in pages[0]
    for needed in (
        "The simulator joint.xml",
        "Re-tuning closes 62 % of the gap, interface slip a further 30 %",
        "The simulator itself shows sensor lag",
        "asked 2 of 3 of the unit's torque paths",
        "closed by re-tuning 62 % [57, 67]",
        "closed by what is missing 30 % [24, 36]",
        f"as it is {significant(9e-4, 3, ARCMIN)}; re-tuned {significant(3.6e-4, 3, ARCMIN)}",
        "clearance arcmin 5.16 7.05 [6.91, 7.18] changed",
    ):
        assert needed in pages[1], needed
    assert "friction torque N·m 0.110 0.109 [0.104, 0.114]" in pages[1]


def probable(probability):
    """A gap of that probability."""
    return {"probability": probability, "unlisted_probability": 0.01, "rms_rad": 1e-5, "noise_floor_rad": 5e-6}


@pytest.mark.parametrize(("told", "title"), [(True, "CLOSED BY RE-TUNING"), (False, "NO GAP TO THE SIMULATOR")])
def test_a_simulator_that_lacks_nothing(tmp_path, told, title):
    answer = {"effects": [], "credible_set_90": ["none"]}
    write_diagnosis(tmp_path, 1, **simulator(1, told=told), answer=answer, gap=probable(0.99 if told else 0.2))
    pages = pages_of(tmp_path)
    assert title in pages[0] and ("closed by re-tuning" in pages[1]) == told


def test_a_gap_that_is_likely_but_not_told_is_not_called_none(tmp_path):
    answer = {"effects": [], "credible_set_90": ["none"]}
    write_diagnosis(tmp_path, 1, **simulator(1, told=False), answer=answer, gap=probable(0.77))
    page = pages_of(tmp_path)[0]
    assert "A GAP TO THE SIMULATOR NOT RULED OUT" in page and "NO GAP" not in page


def test_the_banner_names_five_rivals_and_counts_the_rest():
    rivals = [f"effect_{k}" for k in range(7)]
    several = SimpleNamespace(effects=["slip"], credible_set=["slip", *rivals])
    assert diagnosis_text._rivals(several).endswith("effect 4 and 2 more.") and "effect 5" not in diagnosis_text._rivals(several)
    few = SimpleNamespace(effects=["slip"], credible_set=["slip", *rivals[:5]])
    assert diagnosis_text._rivals(few).endswith("effect 4.")
