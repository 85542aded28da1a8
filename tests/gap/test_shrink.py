"""How far the gap shrinks on records left out, on a virtual bench whose records differ in rate."""

import numpy as np
import pytest

from backdrive_bayes.bench.plan import make_plan
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.gap import shrink as shrink_module
from backdrive_bayes.gap.candidates import REFERENCE
from backdrive_bayes.gap.hypotheses import fit_none, fit_screened, polished, screen
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.gap.shrink import Shrink, closed_fraction, shrink
from backdrive_bayes.model.registry import BASELINE

EFFECT = "rate_dependent_friction"
LEVEL = 0.9


@pytest.fixture(scope="module")
def fits():
    """A unit whose friction depends on the rate: baseline, effect and the torque that each block spans."""
    plan = make_plan(rates=(0.1, 0.5, 1.0), amplitudes=(1.0,), cycles=1, sampling_hz=500.0)
    unit = draw_unit(np.random.default_rng(4), {EFFECT: 3.0}, plan=plan).unit
    rng = np.random.default_rng(0)
    setting = Setting.of(unit, rng, BASELINE)
    whitening = setting.whitening(REFERENCE)
    none = fit_none(setting, whitening)
    effect = polished(fit_screened(screen(setting, none, EFFECT, whitening, rng), (EFFECT,), rng), rng)
    weight = np.concatenate([np.abs(np.diff(d.blocks.edges_nm(), axis=0))[0] for d in setting.problem.records])
    return setting, none, effect, weight


def test_an_effect_closes_the_gap_on_rates_that_were_left_out(fits):
    found = shrink(*fits)
    closed = found.closed("after", np.random.default_rng(0), LEVEL)
    assert closed["median"] > 0.5 and closed["lo"] > 0.3
    assert found.closed("control", np.random.default_rng(0), LEVEL)["median"] < closed["median"]


def test_what_is_left_out_is_not_fitted(fits, monkeypatch):
    """Without steps towards the rest the joint fit itself would be judged: its residual is smaller."""
    told = shrink(*fits).mean_square("before")
    monkeypatch.setattr(shrink_module, "STEPS", 0)
    assert shrink(*fits).mean_square("before") < 0.8 * told


def pieces(before, after, floor=1.0):
    n = len(before)
    share = np.full(n, 1 / n)
    parts = (np.asarray(v) * share for v in (before, after, before, np.full(n, floor)))
    return Shrink(("all",), np.zeros(n), share, *parts)


def test_the_interval_tells_how_unlike_the_pieces_are():
    rng = np.random.default_rng(3)
    alike = pieces([100.0] * 12, [4.0] * 12).closed("after", rng, LEVEL)
    unlike = pieces([100.0] * 12, [1.0, 20.0] * 6).closed("after", rng, LEVEL)
    assert alike["hi"] - alike["lo"] < 1e-9 < 0.1 < unlike["hi"] - unlike["lo"]
    assert alike["median"] == pytest.approx((10 - 2) / (10 - 1))
    assert unlike["lo"] <= unlike["median"] <= unlike["hi"]


def test_a_closed_fraction_of_no_gap_is_no_large_number():
    floor = np.array([1.0])
    assert closed_fraction(np.array([9.0]), np.array([1.0]), floor) == pytest.approx(1.0)
    assert closed_fraction(np.array([9.0]), np.array([4.0]), floor) == pytest.approx(0.5)
    assert abs(closed_fraction(np.array([1.0 + 1e-9]), np.array([1.01]), floor)[0]) < 0.05
    assert closed_fraction(np.array([1.1]), np.array([100.0]), floor) == -1.0
