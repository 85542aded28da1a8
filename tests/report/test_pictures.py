"""Pictures in the PDF: drawn as text and vectors, on the pages where they belong, and the same bytes again."""

import pytest
from support.made_up_diagnosis import write_diagnosis
from support.pdf import Pages
from support_results import write_result

from backdrive_bayes.report import report


def pages_of(folder):
    return Pages(report.report_bytes([folder]))


def test_figures_stay_text_and_vector_and_the_same_results_give_the_same_bytes(tmp_path):
    write_result(tmp_path, records=2)
    made = report.report_bytes([tmp_path])
    pages = Pages(made)
    assert "residual" in pages.text and "settled loop, rising" in pages.text
    assert not any(page.images for page in pages.reader.pages)
    assert report.report_bytes([tmp_path]) == made


@pytest.mark.parametrize(("records", "where"), [(1, "Where? "), (8, "Where? (")])
def test_the_first_page_of_a_diagnosis_shows_which_and_where(records, where, tmp_path):
    write_diagnosis(tmp_path, records)
    page = pages_of(tmp_path)[0]
    assert "Which effect?" in page and where in page and "Signature" in page


def test_a_property_of_the_class_that_closes_nothing_is_told_in_place_of_what_it_closes(tmp_path):
    result, answer = write_diagnosis(tmp_path, 1), {"effects": ["second_backlash"], "credible_set_90": ["second_backlash"]}
    records = [r | {"closed_fraction": None} for r in result["shrink"]["records"]]
    for closed, told in ((None, True), (result["shrink"]["closed_fraction"], False)):
        write_diagnosis(tmp_path, 1, shrink=result["shrink"] | {"closed_fraction": closed, "records": records}, answer=answer)
        assert ("part of the model class" in pages_of(tmp_path)[0]) == told
