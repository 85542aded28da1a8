"""A new fit takes away what rests on an older one, and nothing else."""

import pytest
from support_results import write_result

from backdrive_bayes.commands.results import retire, retire_figures
from backdrive_bayes.results import INDICATORS, read_result


@pytest.fixture
def folder(tmp_path):
    write_result(tmp_path, records=1)
    (tmp_path / "figures").mkdir(exist_ok=True)
    (tmp_path / "figures" / "acceptance.svg").write_text("<svg/>")
    (tmp_path / "verdict.json").write_text("{}")
    return tmp_path


def test_a_verdict_its_figure_and_the_empty_folder_go(folder):
    (folder / "mine.txt").write_text("kept")
    retire(folder, read_result(folder / "indicators.json", INDICATORS))
    assert not (folder / "verdict.json").exists() and not (folder / "figures").exists()
    assert (folder / "mine.txt").read_text() == "kept" and (folder / "posterior.nc").exists()


def test_a_figure_of_somebody_elses_stays(folder):
    (folder / "figures" / "photo.jpg").write_bytes(b"x")
    retire(folder, read_result(folder / "indicators.json", INDICATORS))
    assert [p.name for p in (folder / "figures").iterdir()] == ["photo.jpg"]


def test_a_later_result_leaves_no_figure_and_no_report_of_an_earlier_one(folder):
    for name in ("acceptance-2.svg", "acceptance-2.png", "comparison-loops.svg", "loop.svg", "acceptance.pdf"):
        (folder / "figures" / name).write_text("old")
    (folder / "report.pdf").write_text("old")
    retire_figures(folder, ("acceptance",))
    left = sorted(p.name for p in (folder / "figures").iterdir())
    assert left == ["acceptance.pdf", "comparison-loops.svg", "loop.svg"] and not (folder / "report.pdf").exists()


def test_a_folder_that_is_not_there_is_none(tmp_path, folder):
    retire(tmp_path / "new", read_result(folder / "indicators.json", INDICATORS))
    assert not (tmp_path / "new").exists()
