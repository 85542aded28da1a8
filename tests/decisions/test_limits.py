"""limits.toml: what may stand in it, and one clear line for every mistake."""

import math

import pytest

from backdrive_bayes.decisions.limits import CONSUMER, PRODUCER, read_limits
from backdrive_bayes.errors import BadInput

CONTRACT = """
[lost_motion_rad]
max = 0.0029
[loop_area_J]
at = {loading_rate_Nm_per_s = 0.05}
max = 4.0e-4
[risk]
consumer = 0.02
producer = 0.20
"""


def read(tmp_path, text):
    path = tmp_path / "limits.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_limits(path)


def test_the_contracts_example(tmp_path):
    limits = read(tmp_path, CONTRACT)
    one, other = limits.limits
    assert (one.indicator, one.lo, one.hi, one.rate) == ("lost_motion_rad", -math.inf, 0.0029, None)
    assert (other.indicator, other.hi, other.rate, other.amplitude) == ("loop_area_J", 4e-4, 0.05, None)
    assert (limits.consumer, limits.producer) == (0.02, 0.20)


def test_risks_have_defaults_and_an_indicator_may_have_several_limits(tmp_path):
    text = "[[peak_angle_rad]]\nmin = 1e-3\nmax = 1\n[[peak_angle_rad]]\nmax = 0.5\nat = {amplitude_Nm = 0.04}\n"
    limits = read(tmp_path, text)
    assert (limits.consumer, limits.producer) == (CONSUMER, PRODUCER)
    assert [(x.lo, x.hi, x.amplitude) for x in limits.limits] == [(1e-3, 1.0, None), (-math.inf, 0.5, 0.04)]


def test_a_process_and_k_are_read(tmp_path):
    (limit,) = read(tmp_path, '[lost_motion_rad]\nmax = 1\nk = 0.04\nprocess = {mean = 0.5, sd = 0.1, shape = "gamma"}').limits
    assert limit.k == 0.04
    assert (limit.process.mean, limit.process.sd, limit.process.shape) == (0.5, 0.1, "gamma")


WRONG = {
    "unknown indicator": ("[lost_motion]\nmax = 1", "did you mean lost_motion_rad"),
    "max below min": ("[loop_area_J]\nmin = 2\nmax = 1", "max above min"),
    "max equal to min": ("[loop_area_J]\nmin = 1\nmax = 1", "max above min"),
    "neither": ("[loop_area_J]\nat = {loading_rate_Nm_per_s = 0.05}", "max, min or both"),
    "nan": ("[loop_area_J]\nmax = nan", "a finite number"),
    "infinity": ("[loop_area_J]\nmax = inf", "a finite number"),
    "text": ('[loop_area_J]\nmax = "4e-4"', "a finite number"),
    "boolean": ("[loop_area_J]\nmax = true", "a finite number"),
    "no table": ("loop_area_J = 4e-4", "a table"),
    "impossible": ("[loop_area_J]\nmax = -1.0", "loop_area_J.max: expected a limit of 0 or more"),
    "impossible second": ("[[W_L_J]]\nmax = 1\n[[W_L_J]]\nmin = -2\nmax = -1", "cannot be negative, found -1"),
    "absurd integer": (f"[loop_area_J]\nmax = {'9' * 5000}", "numbers of at most 300 digits, found a larger one"),
    "unknown key": ("[loop_area_J]\nmaximum = 4e-4", "one of min, max"),
    "missing rate": ("[loop_area_J]\nmax = 1\nat = {}", "loading_rate_Nm_per_s or amplitude_Nm"),
    "misspelt rate": ("[loop_area_J]\nmax = 1\nat = {rate = 0.05}", "one of loading_rate_Nm_per_s"),
    "rate no number": ('[loop_area_J]\nmax = 1\nat = {loading_rate_Nm_per_s = "fast"}', "a positive number"),
    "negative rate": ("[loop_area_J]\nmax = 1\nat = {loading_rate_Nm_per_s = -0.05}", "a positive number"),
    "at no table": ("[loop_area_J]\nmax = 1\nat = 0.05", "a table"),
    "risk of nothing": ("[loop_area_J]\nmax = 1\n[risk]\nconsumer = 0", "above 0 and below 0.5"),
    "risk of a half": ("[loop_area_J]\nmax = 1\n[risk]\nproducer = 0.5", "above 0 and below 0.5"),
    "risk nan": ("[loop_area_J]\nmax = 1\n[risk]\nconsumer = nan", "above 0 and below 0.5"),
    "unknown risk": ("[loop_area_J]\nmax = 1\n[risk]\ncostumer = 0.1", "did you mean consumer"),
    "k of another": ("[loop_area_J]\nmax = 1\nk = 0.03", "with lost_motion_rad only"),
    "process without sd": ("[loop_area_J]\nmax = 1\nprocess = {mean = 1}", "process.sd: expected a positive number"),
    "process of odd shape": ('[loop_area_J]\nmax = 1\nprocess = {mean = 1, sd = 1, shape = "box"}', "'gamma', 'lognormal'"),
    "nothing": ("[risk]\nconsumer = 0.05", "at least one limit"),
    "no toml": ("[loop_area_J\nmax = 1", "valid TOML"),
    "no text": (b"\xff\xfe[\x00", "UTF-8"),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_every_mistake_is_one_clear_line(tmp_path, mistake):
    text, expected = WRONG[mistake]
    with pytest.raises(BadInput) as error:
        read(tmp_path, text)
    assert expected in str(error.value) and "\n" not in str(error.value) and "limits.toml" in str(error.value)


def test_no_file_and_a_folder(tmp_path):
    for path, found in ((tmp_path / "none.toml", "nothing there"), (tmp_path, "a folder")):
        with pytest.raises(BadInput, match=found):
            read_limits(path)
