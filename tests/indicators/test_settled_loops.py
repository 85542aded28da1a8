"""Settled loops of a known reducer: closed forms, modules that add up, a grid that is fine enough, and what effects add."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_posterior import known, made_posterior

from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators import loop
from backdrive_bayes.indicators.draws import core_indicators
from backdrive_bayes.indicators.loop import loop_grid, module_loops, settled_loops, torque_grid
from backdrive_bayes.mechanics.registry import LIBRARY, UNSEEN

T, RATE = 0.1, 0.05


@pytest.fixture(scope="module")
def posterior():
    return made_posterior(spread=0.02)


def whole(posterior, amplitude=T, rate=RATE):
    return settled_loops(posterior, loop_grid(posterior, amplitude), rate)


@pytest.mark.parametrize("exact", [(), (0.003,), (0.003, 0.2, -0.05)])
def test_grid_is_odd_and_holds_what_is_asked(exact):
    grid = torque_grid(T, exact)
    assert (np.diff(grid) > 0).all() and grid[-1] == T
    np.testing.assert_array_equal(grid, -grid[::-1])
    for t in [0.0, *[abs(x) for x in exact if abs(x) < T]]:
        assert t in grid and -t in grid


def test_a_clearance_alone_dissipates_twice_its_angle_times_its_drag():
    posterior = made_posterior(known(compliance=0.0, friction=0.0, clearance=0.7, drag=0.08), spread=0.0)
    area = ind.loop_area_j(whole(posterior))
    np.testing.assert_allclose(area, 2 * 0.7 * 0.02 * 0.08 * T, rtol=2e-3)


def test_elasticity_alone_dissipates_nothing_and_peaks_at_its_compliance():
    loops = whole(made_posterior(known(friction=0.0, clearance=0.0, compliance=0.5), spread=0.0))
    np.testing.assert_allclose(loops.width, 0.0, atol=1e-15)
    np.testing.assert_allclose(ind.peak_angle_rad(loops), 0.5 * 0.02, rtol=1e-9)


def test_loops_close_and_are_odd(posterior):
    loops = whole(posterior)
    np.testing.assert_allclose(loops.width[:, [0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(loops.rising, loops.mirrored.rising, atol=1e-12)


def test_modules_add_up_and_split_the_area(posterior):
    full, parts = whole(posterior), module_loops(posterior, loop_grid(posterior, T), RATE)
    assert set(parts) == {"geometric", "elastic", "friction"}
    np.testing.assert_allclose(sum(p.rising for p in parts.values()), full.rising, atol=1e-14)
    area = {name: ind.loop_area_j(p) for name, p in parts.items()}
    np.testing.assert_allclose(area["geometric"] + area["friction"], ind.loop_area_j(full), rtol=1e-9)
    np.testing.assert_allclose(area["elastic"], 0, atol=1e-16)
    assert (area["geometric"] > 0).all() and (area["friction"] > 0).all()
    alone = settled_loops(posterior, loop_grid(posterior, T), RATE, ("friction",))
    np.testing.assert_allclose(parts["friction"].width, alone.width, atol=1e-14)
    np.testing.assert_allclose(parts["friction"].rising, -parts["friction"].falling, atol=1e-14)
    assert np.abs(alone.rising + alone.falling).max() > 0.1 * alone.rising.max(), "slipping elements turn with the torque"


@pytest.mark.parametrize("share", [0.05, 0.3, 1.0])
def test_dissipation_ratio_is_a_ratio(posterior, share):
    ratio = ind.dissipation_ratio(whole(posterior, share * T))
    assert ((ratio >= -1e-9) & (ratio <= 1)).all()


@pytest.mark.parametrize("name", ["loop_area_j", "absorbed_j", "dissipation_ratio", "zero_torque_width_rad", "peak_angle_rad"])
def test_the_grid_is_fine_enough(posterior, name, monkeypatch):
    indicator = getattr(ind, name)
    coarse = indicator(whole(posterior))
    monkeypatch.setattr(loop, "POINTS", 3001)
    np.testing.assert_allclose(coarse, indicator(whole(posterior)), rtol=2e-3)


def test_a_late_channel_widens_the_loop_by_rate_times_slope():
    torque = np.linspace(-1, 1, 2001)
    straight = loop.Loops(torque, 0.3 * torque[None], 0.3 * torque[None])
    late = straight.late(0.01)
    inner = np.abs(torque) < 0.98
    np.testing.assert_allclose(late.width[0, inner], 2 * 0.3 * 0.01, rtol=1e-9)


def test_effects_of_the_reducer_are_part_of_its_loop_and_those_of_the_channel_are_not(posterior):
    (creep,) = LIBRARY["viscoelastic_creep"]
    count = creep.responses(_short(posterior), 0, posterior.context)[0].shape[1]
    weights = posterior.weights | {creep.name: np.full((*posterior.shape, count), 0.02)}
    creeping = replace(posterior, weights=weights, effects=(*posterior.effects, creep))
    slow, fast = (ind.peak_angle_rad(whole(creeping, rate=r)) for r in (1e-3, 10.0))
    assert (slow > 1.003 * fast).all()
    bare = replace(posterior, weights=posterior.weights | {"torque_offset": np.ones((*posterior.shape, 1))})
    np.testing.assert_array_equal(whole(bare).rising, whole(posterior).rising)


def test_modules_have_the_growths_of_the_draws_as_the_whole_loop_has():
    """At other amplitudes thresholds follow these; with those of the mode alone, the planted fault, the areas are too certain."""
    posterior = made_posterior(loops=((RATE, T), (RATE, 0.5 * T)))
    exponent = 0.3 * np.linspace(-1, 1, posterior.log_density.size).reshape(*posterior.shape, 1)
    drawn = {e.name: exponent for e in UNSEEN}
    growing = replace(posterior, weights=posterior.weights | drawn, effects=(*posterior.effects, *UNSEEN))
    grid = loop_grid(posterior, 0.2 * T)
    full, parts = settled_loops(growing, grid, RATE), module_loops(growing, grid, RATE)
    np.testing.assert_allclose(sum(p.rising for p in parts.values()), full.rising, atol=1e-9 * np.abs(full.rising).max())
    still = settled_loops(posterior, grid, RATE)
    assert np.abs(full.rising - still.rising).max() > 0.01 * np.abs(still.rising).max()


def _short(posterior):
    return loop.settled_history(torque_grid(T), RATE, posterior.context.torque_scale_nm)


def test_the_dissipation_ratio_lies_in_its_range():
    """S beyond the absorbed energy, or below nothing, is noise: u = S / W_abs is neither above 1 nor below 0."""
    torque = np.linspace(-1.0, 1.0, 5)
    rising = np.array([[-1.0, -0.5, 0.0, 0.5, 1.0]])
    for width, expected in ((3.0, 1.0), (-0.5, 0.0)):
        falling = rising + width * np.array([0.0, 1.0, 1.0, 1.0, 0.0])
        assert core_indicators(loop.Loops(torque, rising, falling), 0.5)["dissipation_ratio"] == expected
