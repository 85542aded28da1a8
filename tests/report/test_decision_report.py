"""The PDF holds the numbers of verdict.json and comparison.json, with their levels and units."""

import json
import re

import pytest
from matplotlib.figure import Figure
from support.decided import diagnosis, evidence
from support.pdf import Pages
from support.told import told

from backdrive_bayes.commands.output import write_json
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.claims import read_claims
from backdrive_bayes.decisions.comparison import compare
from backdrive_bayes.decisions.global_risk import Process
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.errors import BadInput
from backdrive_bayes.number_text import interval_text, probability_text
from backdrive_bayes.report import report, sections
from backdrive_bayes.report.blocks import Chapter, Heading, Paragraph, Picture
from backdrive_bayes.report.claims_section import _count, _number
from backdrive_bayes.results import COMPARISON, read_result

pytestmark = pytest.mark.usefixtures("blank_pictures")

ARCMIN = 10800 / 3.141592653589793
HOSTILE = "#strong[x] $y$ *b* @ref"


def pages(folder):
    return Pages(report.report_bytes([folder]))


@pytest.fixture(scope="module")
def verdict(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verdict")
    limits = (
        Limit("lost_motion_rad", hi=0.0096, rate=0.05),
        Limit("loop_area_J", lo=3e-4, hi=4e-4, process=Process(3.7e-4, 1e-5)),
        Limit("absorbed_J", hi=5.6e-4, rate=0.05, amplitude=0.06),
    )
    write_json(folder / "verdict.json", told(assess([evidence(HOSTILE)], Limits(limits))))
    return json.loads((folder / "verdict.json").read_text()), pages(folder)


def test_the_first_page_can_be_signed(verdict):
    result, text = verdict
    first = text[0]
    assert "INCONCLUSIVE" in first and "Signature" in first and "Next:" in first
    (digest,) = result["reproduction"]["data_sha256"]
    assert HOSTILE in first and f"{digest[:12]}…" in first and digest not in first
    assert digest in " ".join(text[1:])
    assert "k = 0.03" in first and "90 %" in first and "consumer's 5 %, producer's 10 %" in first
    assert "predicted" in first


def test_the_banner_says_indicators_in_words(verdict):
    result, text = verdict
    assert "absorbed_J" in result["next"]["do"]
    assert "the verdict on absorbed energy Wabs rests on a prediction" in text[0].replace("W abs", "Wabs")
    assert "absorbed_J" not in text.text


def test_every_limit_stands_with_its_numbers(verdict):
    result, text = verdict
    whole = text.text
    for row in result["limits"]:
        factor = ARCMIN if row["unit"] == "rad" else 1e3
        assert interval_text(row, factor) in whole
        assert probability_text(row["conformance_probability"]) in whole
        assert probability_text(row["specific_consumer_risk"]) in whole
    for row in (r for r in result["limits"] if r["global"]):
        assert probability_text(row["global"]["consumer"]) in whole
    assert "JCGM 106:2012" in whole and "Global risks" in whole and "0.3 to 0.4" in whole


def test_what_is_uncovered_is_named(tmp_path):
    found = diagnosis(["sensor_lag"], sensor_lag=0.8, none=0.2)
    write_json(tmp_path / "verdict.json", told(assess([evidence(diagnosis=found)], Limits((Limit("peak_angle_rad", hi=1.0),)))))
    text = pages(tmp_path)
    assert "sensor lag (80 %)" in text[0] and "in no model at hand with probability 0.80: sensor lag 0.80" in text[0]


@pytest.fixture(scope="module")
def comparison(tmp_path_factory):
    folder = tmp_path_factory.mktemp("comparison")
    a, b = evidence("metal"), evidence("plastic", seed=1, loop_area_J=1.9e-3, loops=((0.05, 0.1), (0.5, 0.1)))
    write_json(folder / "comparison.json", told(compare([a, b], read_claims("paper"))))
    return json.loads((folder / "comparison.json").read_text()), pages(folder)


def test_a_comparison_holds_its_numbers(comparison):
    result, text = comparison
    whole = text.text
    (condition,) = result["pairs"][0]["conditions"]
    for name in ("loop_area_J", "peak_angle_rad"):
        row = condition["indicators"][name]
        assert interval_text(row["ratio"]) in text[0]
        assert interval_text(row["first"], ARCMIN if row["unit"] == "rad" else 1e3) in text[0]
    assert "rates cannot be predicted" in whole and "Not compared" in whole
    assert "90 % interval" in text[0] and "±5 %" in text[0]


def test_a_unit_that_has_not_converged_is_named_and_the_others_stand(tmp_path):
    units = [evidence("a"), evidence("b", seed=1), evidence("c", seed=2, converged=False)]
    write_json(tmp_path / "comparison.json", told(compare(units)))
    text = pages(tmp_path)
    assert "INCONCLUSIVE IN PART" in text[0] and "The fits of c are not to be used" in text[0]
    assert "a and b at" in text[0]


def test_a_difference_is_not_called_a_ratio(tmp_path):
    units = [evidence("a"), evidence("b", seed=1, loop_area_J=[1e-9] * 3, spread=2.0)]
    write_json(tmp_path / "comparison.json", told(compare(units)))
    row = read_result(tmp_path / "comparison.json", COMPARISON)["pairs"][0]["conditions"][0]["indicators"]["loop_area_J"]
    text = pages(tmp_path)
    assert row["ratio"] is None and f"{interval_text(row['difference'], 1e3)} difference [mJ]" in text[0]


def test_claims_stand_with_probability_and_verdict(comparison):
    result, text = comparison
    whole = text.text
    for claim in result["claims"]["claims"]:
        start = re.escape(claim["claim"][:24])
        assert re.search(start, whole), claim["claim"]
    assert "✓" in whole and "✗" in whole and ".parameter(" not in whole and "_J" not in whole
    assert "does not hold" in whole and "not answered" in whole and "unit U was not given" in whole


def test_claims_are_counted_in_a_sentence():
    verdicts = ["holds", "open", "open", "does not hold", "not answered"]
    found = {"claims": [{"verdict": v} for v in verdicts]}
    assert _count(found) == "Of 5 claims, 1 holds, 1 does not hold, 2 are open, 1 was not answered."
    assert _count({"claims": found["claims"][1:3]}) == "Of 2 claims, 2 are open."


def test_a_value_stays_on_one_line_with_its_interval(comparison):
    lines = [line for page in comparison[1].reader.pages for line in page.extract_text().splitlines()]
    broken = [line for line in lines if re.search(r"\[[−\d.]*,?( [−\d.]+)?$|^[−\d., ]*\]", line.strip())]
    assert sum("]" in line for line in lines) > 30 and not broken


def test_a_series_that_is_nothing_at_its_ends_is_not_a_wall_of_digits():
    curve = {"unit": "rad", "median": [1e-249, 0.03, 1e-200], "at": ""}
    assert _number(curve) == "0 to 0, at most 103 arcmin"
    assert _number({"unit": "N·m", "median": 0.0957757, "lo": 0.09577, "hi": 0.095783}) == "95.776 [95.770, 95.783] mN·m"


def test_a_summary_bears_as_many_pictures_as_have_room(monkeypatch, tmp_path):
    names = ("first", "second", "third")
    summary = [Heading("c", 1), *(Picture(n, f"caption of the {n}") for n in names)]
    details = [Picture(n, f"caption of the {n}", spilt=True) for n in names]
    made = [Chapter("c", summary, details, {n: Figure(figsize=(6.7, 3.6)) for n in names})]
    monkeypatch.setattr(sections, "chapters", lambda folder: made)
    text = pages(tmp_path)
    assert re.findall(r"caption of the (\w+)", text[0]) == ["first", "second"]
    assert re.findall(r"caption of the (\w+)", " ".join(text[1:])) == ["third"]


def test_a_chapter_does_not_begin_at_the_foot_of_a_page(monkeypatch, tmp_path):
    made = [Chapter(f"c{i}", [Heading(f"c{i}", 1)], [Paragraph("text")] * (3 + i), {}) for i in range(20)]
    monkeypatch.setattr(sections, "chapters", lambda folder: made)
    reader = pages(tmp_path).reader
    heights = chapter_heights(reader)
    assert len(heights) == 2 * len(made) + 2
    assert min(heights) > (20 + 60) / 25.4 * 72
    assert len(reader.pages) < 2 * len(made)


def chapter_heights(reader):
    """Height above the paper's edge [pt] of every heading of a chapter."""
    found = []

    def see(text, cm, tm, font, size):
        if text.strip() and round(abs(size * tm[3] * cm[3])) == 17:
            found.append((page.page_number, round(tm[5] * cm[3] + cm[5])))

    for page in reader.pages:
        page.extract_text(visitor_text=see)
    return [height for _, height in dict.fromkeys(found)]


def test_tags_and_outline(comparison, verdict):
    for _, text in (comparison, verdict):
        assert text.reader.trailer["/Root"]["/MarkInfo"]["/Marked"]
    titles = [i.title for i in comparison[1].reader.outline if not isinstance(i, list)]
    assert titles[0] == "Comparison: metal, plastic"


def test_all_results_of_a_folder_make_chapters(tmp_path):
    from support_results import write_result

    write_result(tmp_path, records=1)
    (tmp_path / "posterior.nc").unlink()
    write_json(tmp_path / "verdict.json", told(assess([evidence("u")], Limits((Limit("peak_angle_rad", hi=1.0),)))))
    text = pages(tmp_path)
    overview = text[0]
    assert "ACCEPTED" in overview and "CONVERGED; 1 record" in overview and "structure not examined" in overview
    assert "Contents" in overview and "Key indicators" in overview
    assert "ACCEPTED" in text[1] and "no diagnosis was given" in text[1] and "CONVERGED" in text[2]


def test_an_incomplete_verdict_is_one_clear_line(tmp_path):
    write_json(tmp_path / "verdict.json", {"schema": "backdrive-bayes/verdict/1"})
    with pytest.raises(BadInput, match="verdict.json, key data_sha256: expected .*found no such key"):
        report.report_bytes([tmp_path])


def test_probabilities_are_never_rounded_to_certainty():
    shown = [probability_text(p) for p in (0.99999, 0.9999, 0.995, 0.5, 0.004, 1e-5, None)]
    assert shown == ["> 0.999", "> 0.999", "0.995", "0.50", "0.004", "< 0.001", "–"]
