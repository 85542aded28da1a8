"""What does not fit its type becomes one clear line that names the place, whatever the keys are called."""

from typing import Annotated

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import Meta, Struct

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.limits_file import LimitsFile
from backdrive_bayes.schemas.template_file import TemplateFile
from backdrive_bayes.schemas.typed import typed
from backdrive_bayes.schemas.unit_file import UnitFile
from backdrive_bayes.schemas.words import Positive


class Inner(Struct, forbid_unknown_fields=True):
    size: Positive
    note: Annotated[str, Meta(max_length=5, title="a short text")] = ""


class Outer(Struct):
    rows: list[Inner] = []
    named: dict[str, dict[str, Positive]] = {}


def line(value, shape=Outer):
    with pytest.raises(BadInput) as caught:
        typed(value, shape, "file")
    return str(caught.value)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ({"rows": [{"size": 1}, {"size": -1}]}, "file, rows 2, key size: expected a positive number, found -1"),
        ({"rows": [{}]}, "file, rows 1, key size: expected a positive number, found no such key"),
        ({"rows": [{"size": 1, "sise": 2}]}, "file, rows 1, key sise: expected one of size, note, found 'sise'"),
        ({"rows": [{"size": 1, "note": "longer"}]}, "file, rows 1, key note: expected a short text, found 6 characters"),
        ({"rows": 3}, "file, key rows: expected array, found 3"),
        ({"rows": [3]}, "file, rows 1: expected a table, found 3"),
        ({"named": {"a": {"x": 1}, "b": {"x": 1, "y": "z"}}}, "file, key named.b.y: expected a positive number, found 'z'"),
        ([], "file: expected a table, found []"),
    ],
)
def test_the_line_names_place_expectation_and_finding(value, expected):
    assert line(value) == expected


def test_finding_the_culprit_leaves_the_data_as_they_were():
    value = {"named": {"a": {"x": 1.0}, "b": {"y": "z", "x": 1.0}}}
    line(value)
    assert value == {"named": {"a": {"x": 1.0}, "b": {"y": "z", "x": 1.0}}}
    assert list(value["named"]["b"]) == ["y", "x"]


@pytest.mark.parametrize("key", ["a` - at `$.nowhere", "x` - at `$.rows[7]", "` - at `$[...]", "\n`$", "`"])
def test_a_key_that_looks_like_a_place_is_still_one_line(key):
    assert "\n" not in line({key: 1, "loop_area_J": {"max": 1}}, LimitsFile)
    assert "\n" not in line({"rows": [{"size": 1, key: 2}]})


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
KEYS = st.sampled_from(["schema", "name", "record", "file", "max", "at", "loop_area_J", "fields", "colours", "k", "risk"])
TREES = st.recursive(LEAVES, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4), max_leaves=12)


@given(TREES, st.sampled_from([UnitFile, LimitsFile, TemplateFile]))
@settings(max_examples=300, deadline=None)
def test_any_data_fit_or_are_refused_in_one_line(value, shape):
    try:
        typed(value, shape, "file")
    except BadInput as error:
        assert "\n" not in str(error) and len(str(error)) < 700
