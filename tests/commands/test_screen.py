"""Tables on the screen: nothing clipped at 80 columns, provisional numbers marked, names shown and not obeyed."""

import io
import sys

import pytest
from support.decided import evidence
from support_results import indicators

from backdrive_bayes.commands import tables
from backdrive_bayes.commands.screen import Column, show_table
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.claims import read_claims
from backdrive_bayes.decisions.comparison import compare
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.number_text import interval_text

CONVERGED, NOT = {"word": "converged", "exit_code": 0}, {"word": "inconclusive", "exit_code": 4}


def shown(capsys):
    return capsys.readouterr().out


def fitted(**changes):
    return indicators(2) | {"outcome": CONVERGED} | changes


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_every_indicator_stands_in_a_row_of_its_record(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    result = fitted()
    tables.show_indicators(result)
    text = shown(capsys)
    assert [text.count(record["file"].partition(".csv")[0]) for record in result["records"]] == [1, 1]
    for record in result["records"]:
        median, _, rest = interval_text(record["indicators"]["dissipation_ratio"]).partition(" ")
        assert median in text and rest in text
    assert all(symbol in text for symbol in ("δ [′]", "w(0) [′]", "S [", "u"))
    if columns == 80:
        assert max(map(len, text.splitlines())) <= 80


def test_what_is_not_to_be_used_is_marked_number_by_number(capsys):
    result = fitted()
    tables.show_indicators(result)
    assert "?" not in shown(capsys)
    defined = sum(record["indicators"][name] is not None for record in result["records"] for name in tables._SHOWN)
    for changes in ({"outcome": NOT}, {"forced": True}):
        tables.show_indicators(fitted(**changes))
        text = shown(capsys)
        assert text.count("? [") == defined > 0 and "provisional: not to be used" in text


def test_a_lost_motion_that_is_not_defined_is_said(capsys):
    result = fitted()
    result["records"][1]["indicators"]["lost_motion_rad"] = None
    tables.show_indicators(result)
    assert f"δ is not defined where the loop is smaller than ±0.03 T_r: {result['records'][1]['file']}" in shown(capsys)


def test_names_are_shown_not_obeyed(capsys):
    result = fitted()
    result["records"][0]["file"] = "[red]a\x1b[31mb.csv"
    tables.show_indicators(result)
    assert "[red]a\\x1b[31mb" in shown(capsys)


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_stream_without_the_signs_gets_words(encoding, monkeypatch):
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    tables.show_indicators(fitted())
    stream.flush()
    text = stream.buffer.getvalue().decode(encoding)
    assert "delta [arcmin]" in text and "\\u" not in text and "\\x" not in text


def test_limits_stand_in_readable_units_with_their_verdicts(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    verdict = assess([evidence("u")], Limits((Limit("peak_angle_rad", hi=1.0), Limit("loop_area_J", lo=1e-9, hi=2.0))))
    tables.show_limits(verdict)
    text = shown(capsys)
    assert "peak ≤ 1 rad" in text and "S 1e-09 to 2 J" in text and max(map(len, text.splitlines())) <= 80
    assert sum(text.count(word) for word in ("accepted", "rejected", "inconclusive")) == len(verdict["limits"])


def test_a_small_limit_is_told_with_a_prefix(capsys):
    verdict = assess([evidence("u")], Limits((Limit("loop_area_J", hi=4e-4),)))
    verdict["limits"][0] |= {"median": 3.6e-4, "lo": 3.5e-4, "hi": 3.7e-4}
    tables.show_limits(verdict)
    text = shown(capsys)
    assert "S ≤ 400 µJ" in text and "360 [350, 370]" in text


def test_a_comparison_has_a_row_a_condition_and_every_claim(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    result = compare([evidence("a"), evidence("b")], read_claims("paper"))
    tables.show_pair(result["pairs"][0], result["level"])
    tables.show_claims(result["claims"]["claims"])
    text = shown(capsys)
    assert "a / b: ratio [90 % interval]" in text and max(map(len, text.splitlines())) <= 80
    flat = " ".join(text.split())
    assert all(claim["claim"].split()[0] in flat for claim in result["claims"]["claims"])
    assert "unit U was not given" in flat


def test_a_table_wider_than_the_terminal_keeps_all_columns(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "20")
    show_table([Column(f"column {i}") for i in range(9)], [[f"{i}" * 9 for i in range(9)]])
    text = shown(capsys)
    assert all(f"column {i}" in text and f"{i}" * 9 in text for i in range(9))
