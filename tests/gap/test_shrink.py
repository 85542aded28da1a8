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

LEVEL = 0.9
RATES = make_plan(rates=(0.1, 0.5, 1.0), amplitudes=(1.0,), cycles=1, sampling_hz=500.0)


def fits_of(effect, severity, seed=4):
    """A unit with an effect: its setting, baseline, effect and the torque that each block spans."""
    unit = draw_unit(np.random.default_rng(seed), {effect: severity}, plan=RATES).unit
    rng = np.random.default_rng(0)
    setting = Setting.of(unit, rng, BASELINE)
    whitening = setting.whitening(REFERENCE)
    none = fit_none(setting, whitening)
    found = polished(fit_screened(screen(setting, none, effect, whitening, rng), (effect,), rng), rng)
    weight = np.concatenate([np.abs(np.diff(d.blocks.edges_nm(), axis=0))[0] for d in setting.problem.records])
    return setting, none, found, weight


@pytest.fixture(scope="module")
def fits():
    return fits_of("rate_dependent_friction", 3.0)


def closed(found, part="after"):
    return found.closed(part, np.random.default_rng(0), LEVEL)


def test_an_effect_closes_the_gap_on_rates_that_were_left_out(fits):
    found = shrink(*fits)
    assert closed(found)["median"] > 0.5 and closed(found)["lo"] > 0.2
    assert closed(found, "control")["median"] < closed(found)["median"]


@pytest.mark.parametrize("effect", ["encoder_error", "torque_offset"])
def test_what_belongs_to_the_left_out_record_is_fitted_to_it(effect, monkeypatch):
    """The planted fault: a phase or an offset of the record's own stays where its prior has its middle."""
    fits = fits_of(effect, 4.0, seed=6)
    told, climbed = closed(shrink(*fits))["median"], shrink_module._climbed

    def forgotten(setting, problem, z, free, rows):
        if all(problem.coordinates[i].record is not None for i in free):
            return np.where(np.isin(np.arange(z.size), free), 0.0, z)
        return climbed(setting, problem, z, free, rows)

    monkeypatch.setattr(shrink_module, "_climbed", forgotten)
    assert told > 0.5 > 0.0 > closed(shrink(*fits))["median"]


def test_what_is_left_out_is_not_fitted(fits, monkeypatch):
    """Without steps towards the rest the joint fit itself would be judged: its residual is smaller."""
    told = shrink(*fits).mean_square("before")
    monkeypatch.setattr(shrink_module, "MOST_STEPS", 0)
    assert shrink(*fits).mean_square("before") < 0.8 * told


def pieces(before, after, floor=1.0, folds=1):
    n = len(before)
    share = np.full(n, folds / n)
    parts = (np.asarray(v) * share for v in (before, after, before, np.full(n, floor)))
    return Shrink(tuple("abc"[:folds]), np.arange(n) % folds, share, *parts)


def test_the_interval_tells_how_unlike_the_pieces_are():
    rng = np.random.default_rng(3)
    alike = pieces([100.0] * 12, [4.0] * 12).closed("after", rng, LEVEL)
    unlike = pieces([100.0] * 12, [1.0, 20.0] * 6).closed("after", rng, LEVEL)
    assert alike["hi"] - alike["lo"] < 1e-9 < 0.1 < unlike["hi"] - unlike["lo"]
    assert alike["median"] == pytest.approx((10 - 2) / (10 - 1))
    assert unlike["lo"] <= unlike["median"] <= unlike["hi"]


def test_folds_that_are_unlike_widen_the_interval_more_than_their_pieces():
    def width(folds):
        found = pieces([100.0] * 30, [1.0, 10.0, 30.0] * 10, folds=folds).closed("after", np.random.default_rng(3), LEVEL)
        return found["hi"] - found["lo"]

    assert width(3) > 2 * width(1)


def test_a_few_pieces_give_no_interval():
    found = pieces([100.0, 100.0], [1.0, 80.0]).closed("after", np.random.default_rng(3), LEVEL)
    assert found["lo"] == found["median"] == found["hi"]


def test_a_closed_fraction_of_no_gap_is_no_large_number():
    floor = np.array([1.0])
    assert closed_fraction(np.array([9.0]), np.array([1.0]), floor) == pytest.approx(1.0)
    assert closed_fraction(np.array([9.0]), np.array([4.0]), floor) == pytest.approx(0.5)
    assert abs(closed_fraction(np.array([1.0 + 1e-9]), np.array([1.01]), floor)[0]) < 0.05
    assert closed_fraction(np.array([1.1]), np.array([100.0]), floor) == -1.0
