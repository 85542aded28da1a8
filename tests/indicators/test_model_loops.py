"""Loops of the model on the grid that indicators use."""

import numpy as np
import pytest
from support.known import RATED, prior_values, reducer, settled_loops

from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators import loop
from backdrive_bayes.indicators.loop import model_loops, module_loops, torque_grid

DRAWS = 300


class Prior:
    """Stands where a problem stands: the values of its draws are prior draws."""

    def __init__(self, seed=0):
        self.model = reducer()
        self.all = prior_values(self.model, np.random.default_rng(seed), DRAWS)

    def values(self, z, record):
        rows = z[:, 0].astype(int)
        return {k: v[rows] for k, v in self.all.items()}

    def loading_rate_nm_per_s(self, record):
        return 1.0


Z = np.arange(DRAWS, dtype=float)[:, None]


@pytest.mark.parametrize("exact", [(), (0.003,), (0.003, 0.2, -0.05)])
def test_grid_is_odd_and_holds_what_is_asked(exact):
    grid = torque_grid(RATED, exact)
    assert (np.diff(grid) > 0).all() and grid[-1] == RATED
    np.testing.assert_array_equal(grid, -grid[::-1])
    for t in [0.0, *[abs(x) for x in exact if abs(x) < RATED]]:
        assert t in grid and -t in grid


def test_model_loops_are_the_models_angles():
    problem, grid = Prior(), torque_grid(RATED)
    found = model_loops(problem, Z, 0, grid)
    expected = settled_loops(problem.model, problem.all, grid, loops=2)
    np.testing.assert_allclose(found.rising, expected.rising, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.falling, expected.falling, rtol=1e-12, atol=1e-15)


def test_chunks_do_not_matter(monkeypatch):
    problem, grid = Prior(), torque_grid(RATED)
    whole = model_loops(problem, Z, 0, grid)
    monkeypatch.setattr(loop, "CHUNK", 7)
    parts = model_loops(problem, Z, 0, grid)
    np.testing.assert_allclose(parts.rising, whole.rising, rtol=1e-11, atol=1e-16)


def test_module_loops_add_up_and_split_the_area():
    problem, grid = Prior(), torque_grid(RATED)
    whole, parts = model_loops(problem, Z, 0, grid), module_loops(problem, Z, 0, grid)
    assert set(parts) == {"geometric", "elastic", "friction"}
    size = np.ptp(whole.rising, axis=1)[:, None]
    assert (np.abs(sum(p.rising for p in parts.values()) - whole.rising) < 1e-12 * size).all()
    area = {name: ind.loop_area_j(p) for name, p in parts.items()}
    np.testing.assert_allclose(area["elastic"], 0, atol=1e-16)
    np.testing.assert_allclose(
        area["geometric"] + area["friction"], ind.loop_area_j(whole), rtol=1e-9, atol=1e-16
    )
    assert (area["geometric"] >= -1e-16).all() and (area["friction"] >= -1e-12 * size[:, 0] * RATED).all()
    assert (area["geometric"] < 0.999 * ind.loop_area_j(whole)).any(), "friction must have its part"


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_dissipation_ratio_of_settled_loops_is_a_ratio(share):
    problem = Prior()
    ratio = ind.dissipation_ratio(settled_loops(problem.model, problem.all, torque_grid(share * RATED)))
    assert ((ratio >= 0) & (ratio <= 1)).all()


@pytest.mark.parametrize("share", [0.05, 0.1])
def test_dissipation_ratio_that_is_reported_is_a_ratio(share):
    ratio = ind.dissipation_ratio(model_loops(Prior(), Z, 0, torque_grid(share * RATED)))
    assert ((ratio >= 0) & (ratio <= 1)).all()


@pytest.mark.parametrize(
    "name", ["loop_area_j", "absorbed_j", "dissipation_ratio", "zero_torque_width_rad", "peak_angle_rad"]
)
def test_grid_is_fine_enough(name, monkeypatch):
    problem, indicator = Prior(), getattr(ind, name)
    coarse = indicator(settled_loops(problem.model, problem.all, torque_grid(RATED)))
    monkeypatch.setattr(loop, "POINTS", 3001)
    fine = indicator(settled_loops(problem.model, problem.all, torque_grid(RATED)))
    error = np.abs(coarse / fine - 1)
    assert error.max() < 0.015 and np.median(error) < 0.002
    monkeypatch.setattr(loop, "POINTS", 15)
    if name == "loop_area_j":
        crude = indicator(settled_loops(problem.model, problem.all, torque_grid(RATED)))
        assert np.abs(crude / fine - 1).max() > 0.015, "a grid that is too coarse must fail this check"
