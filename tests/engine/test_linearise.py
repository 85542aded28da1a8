"""The mode: planted offset, lag and jitter are found, knots are refined where loops are steep, a clean unit is left clean."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.planted import MORE, NOISE, SCALE, UNITS, by_hand, joint_mode, planted, smooth_reducer

from backdrive_bayes.engine import knots as knots_module
from backdrive_bayes.engine import linearise as engine
from backdrive_bayes.engine import search
from backdrive_bayes.engine.design import class_groups, class_priors
from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.jitter import learn_jitter
from backdrive_bayes.engine.levels import OFF, levels
from backdrive_bayes.engine.linearise import linearise
from backdrive_bayes.engine.marginal import find_scales, whiten
from backdrive_bayes.engine.reduced import Jitter, reduce_unit
from backdrive_bayes.engine.sample import ABOVE, compress
from backdrive_bayes.engine.search import BENDING, LAW
from backdrive_bayes.engine.start import possible_starts
from backdrive_bayes.engine.traces import trace_levels
from backdrive_bayes.errors import BadInput
from backdrive_bayes.gap.hypotheses import weigh
from backdrive_bayes.mechanics.clearance import HALVINGS
from backdrive_bayes.mechanics.effect import Distortion, TangentEffect
from backdrive_bayes.mechanics.effects import noncongruent_loops
from backdrive_bayes.mechanics.reducer import BASELINE, ReducerClass
from backdrive_bayes.mechanics.registry import LIBRARY, library_terms
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.unit_folder import read_unit

COARSE = 100
"""Blocks a leg, half as many as usual, where whole searches are run: in half the time."""


def mode(**options):
    return joint_mode(reduce_unit(planted(**options)), library_terms())


def test_a_unit_upside_down_is_the_same_unit():
    """Torque and angle both turned around: the reducer is odd, and so is what is said of it. Derivatives by an offset to one side
    alone, the fault that was there, part by a fifth."""
    unit = read_unit(Path(__file__).parents[2] / "data" / "reducer-2")
    turned = tuple(replace(r, torque_nm=-r.torque_nm, angle_rad=-r.angle_rad) for r in unit.records)
    both = reduce_unit(unit), reduce_unit(replace(unit, records=turned))
    found = [search.Search(reduced, library_terms(), BASELINE).first(Distortion()) for reduced in both]
    assert found[0].log_marginal == pytest.approx(found[1].log_marginal, abs=1e-4)
    for name in ("torque_offset", "sensor_lag", "shaft_drag"):
        one, other = (np.concatenate(linear.design.group(name).columns) for linear in found)
        assert min(np.abs(one - other).max(), np.abs(one + other).max()) < 1e-5 * np.abs(one).max()


@pytest.mark.parametrize("modules", [("elastic",), ("elastic", "friction"), ("geometric", "elastic")])
def test_a_class_without_a_module_has_no_thresholds_of_it_that_grow(modules):
    """Of records at several rates; columns of nothing were a traceback."""
    linear = search.Search(reduce_unit(planted()), library_terms(), modules).first(Distortion())
    assert np.isfinite(linear.log_marginal) and ("friction_rate" in linear.design.names) == ("friction" in modules)


@pytest.fixture(scope="module")
def clean():
    return mode()


def test_a_clean_unit_is_explained_to_its_noise(clean):
    for residual in clean.residuals():
        assert 0.3 < np.mean(residual**2) < 1.6
    assert abs(clean.distortion.offset) < 2e-4 and abs(clean.distortion.lag_s) < 1.5e-3
    assert clean.jitter.torque < 1e-3


@pytest.mark.parametrize(("offset_nm", "lag_s"), [(-3e-4, 0.01)])
def test_a_planted_offset_and_lag_are_found(offset_nm, lag_s):
    """The slow record's torque moves by 2e-4 N·m within 10 ms, the fast one's by 1e-3; of two rates alone a drag that grows
    with the rate would do as well."""
    found = mode(offset_nm=offset_nm, lag_s=lag_s, loops=MORE)
    assert found.distortion.offset == pytest.approx(offset_nm / SCALE, abs=3e-4)
    assert found.distortion.lag_s == pytest.approx(lag_s, abs=1e-3)
    sd = {n: np.sqrt(found.solution.variance) * np.linalg.norm(found.solution.root[i]) for n, i in single(found).items()}
    assert abs(found.weights["torque_offset"][0] - offset_nm / SCALE) < 4 * sd["torque_offset"]
    assert abs(found.weights["sensor_lag"][0] - lag_s) < 4 * sd["sensor_lag"] + 1e-3
    assert max(np.mean(r**2) for r in found.residuals()) < 1.6


def single(linear):
    """Numbers of the weights of offset and lag."""
    names, index = linear.design.names, linear.design.index
    return {n: int(np.flatnonzero(index == names.index(n))[0]) for n in ("torque_offset", "sensor_lag")}


@pytest.mark.parametrize("offset_nm", [4e-4, -2e-4])
def test_starts_hold_the_offset_to_the_torque_noise_and_the_mode_more_closely(offset_nm):
    """Four tenths of the torque noise of a sample are what the legs tell before any model; the mode is within a fifth."""
    reduced = reduce_unit(planted(offset_nm=offset_nm))
    within = 0.5 * reduced.context.torque_noise
    assert all(s.offset == pytest.approx(offset_nm / SCALE, abs=within) for s in possible_starts(reduced))
    assert joint_mode(reduced, library_terms()).distortion.offset == pytest.approx(offset_nm / SCALE, abs=2e-4)


def test_a_lag_that_smooths_is_found():
    """All of a first-order lag of 60 ms, 6 % of the torque at the fastest rate, is smoothed; where the derivative is that of a
    delay the search ends at 47 ms. The share is known to be like one from none to all, of a scale that is not inferred;
    without a lag there is a trace of it."""
    reduced = reduce_unit(planted(smooth_s=0.06, loops=MORE))
    alone = search.Search(reduced, library_terms(), BASELINE, only=("sensor_lag",))
    found = alone.learn(Distortion(lag_s=0.05))
    assert found.distortion.lag_s == pytest.approx(0.06, abs=4e-3)
    assert found.weights["lag_spread"][0] == pytest.approx(1.0, abs=0.15)
    on, without, off = (levels(found, *given)["lag_spread"] for given in ((("sensor_lag",),), ((),), ((), ("sensor_lag",))))
    share = np.random.default_rng(0).uniform(size=200_000)
    assert np.exp(on[0]) == pytest.approx(np.sqrt(np.mean(share**2)), rel=3e-3) and on[1] == 0.0
    assert without[1] == 0.0 and np.exp(without[0]) < 0.2 and off == OFF


@pytest.mark.parametrize("lag_s", [8e-6, 9.5e-6])
def test_a_lag_shorter_than_half_the_step_of_its_derivative_changes_nothing(lag_s):
    """Fast clocks and a fine torque resolve microseconds; a quotient to either side of them took a lag that runs backwards."""
    reduced = reduce_unit(planted(noise=replace(NOISE, torque_nm=1e-7)), COARSE)
    alone = search.Search(reduced, library_terms(), BASELINE, only=("sensor_lag",))
    prompt, late = (alone.first(Distortion(lag_s=lag)) for lag in (0.0, lag_s))
    assert all(np.isfinite(column).all() for group in late.design.groups for column in group.columns)
    assert late.log_marginal == pytest.approx(prompt.log_marginal, abs=1.0)


def test_one_start_holds_the_lag():
    starts = possible_starts(reduce_unit(planted(lag_s=0.02)))
    assert min(abs(s.lag_s - 0.02) for s in starts) < 2e-3 and starts[0].lag_s == 0.0


def test_a_record_of_one_leg_starts_from_nothing():
    unit = planted()
    record = unit.records[0]
    first = record.time_s < 4.9
    alone = replace(record, time_s=record.time_s[first], torque_nm=record.torque_nm[first], angle_rad=record.angle_rad[first])
    assert possible_starts(reduce_unit(replace(unit, records=(alone,)))) == [Distortion()]


def test_an_offset_that_is_withheld_costs_likelihood(monkeypatch):
    """A planted fault: held at no offset, the model takes a shifted loop for jitter and noise."""
    monkeypatch.setattr(engine, "possible_starts", lambda reduced: [Distortion()])
    reduced = reduce_unit(planted(offset_nm=8e-4))
    free, held = (joint_mode(reduced, effects) for effects in (LIBRARY["torque_offset"], ()))
    assert free.distortion.offset == pytest.approx(8e-3, abs=8e-4) and held.distortion.offset == 0.0
    assert free.solution.log_marginal + free.data.log_volume > held.solution.log_marginal + held.data.log_volume + 50


@pytest.mark.parametrize("jitter", [(0.005, 0.05)])
def test_a_planted_jitter_is_found_within_a_factor_of_three(jitter):
    # Each crossing tells of the jitter once: four records of two.
    found = mode(jitter=jitter, drag=0.12, engagement=0.35, loops=MORE)
    assert jitter[0] / 3 < found.jitter.torque < 3 * jitter[0]
    assert jitter[1] / 6 < found.jitter.length < 6 * jitter[1]
    assert learn_jitter(found) == found.jitter, "what was learnt must hold at the mode"
    assert max(np.mean(r**2) for r in found.residuals()) < 1.6


def test_jitter_that_is_not_learnt_is_seen_in_the_residual(monkeypatch):
    monkeypatch.setattr(search, "LEARNINGS", 0)
    found = mode(jitter=(0.005, 0.05), drag=0.12, engagement=0.35)
    assert min(np.mean(r**2) for r in found.residuals()) > 3.0


def test_knots_are_dense_where_the_loop_is_steep(clean):
    knots = clean.reducer.knots
    near = np.sum(np.abs(knots - 0.05) < 0.02)
    # A thirtieth of the torques holds a third of the knots.
    assert near > 0.25 * knots.size


def test_knots_are_refined_where_the_residual_asks_for_it(monkeypatch):
    """With few knots to begin with, a steep clearance leaves a residual; refined, it does not."""
    monkeypatch.setattr(knots_module, "KNOTS", 8)
    refined = mode(engagement=0.05)
    monkeypatch.setattr(search, "finer", lambda linear: linear.reducer)
    coarse = mode(engagement=0.05)
    assert coarse.reducer.knots.size <= 10 + HALVINGS < refined.reducer.knots.size
    near, whole = (np.sum(np.abs(m.reducer.knots - 0.05) < 0.03) for m in (refined, coarse)), refined.reducer.knots.size
    assert np.subtract(*near) >= 0.75 * (whole - coarse.reducer.knots.size)
    assert refined.solution.log_marginal + refined.data.log_volume > coarse.solution.log_marginal + coarse.data.log_volume + 10


def test_where_more_is_conspicuous_than_there_is_room_for_the_worst_is_refined_first(monkeypatch, clean):
    """Once, a residual that asked for more knots than there may be got none at all."""
    worst = [np.zeros(r.size) for r in clean.residuals()]
    first = int(np.flatnonzero(clean.reduced.blocks[0].leg == 1)[20])
    worst[0][clean.reduced.blocks[0].leg > 0] = 4.0
    worst[0][first] = 9.0
    monkeypatch.setattr(knots_module, "MOST_KNOTS", clean.reducer.knots.size + 20)
    monkeypatch.setattr(type(clean), "residuals", lambda self: worst)
    refined = knots_module.finer(clean)
    found = refined.knots
    low, high = np.sort(np.abs(clean.reduced.blocks[0].edges_nm()[:, first]) / clean.reduced.torque_scale_nm)
    assert clean.reducer.knots.size < found.size <= knots_module.MOST_KNOTS
    new = np.setdiff1d(found, clean.reducer.knots)
    width = high - low
    assert np.any((new > low - width) & (new < high + width))


def test_nothing_counts_where_the_past_decides(clean):
    """A record from rest counts from its first turning point on, one that begins at its largest torque throughout."""
    for blocks, settled in zip(clean.reduced.blocks, clean.reduced.settled, strict=True):
        assert np.array_equal(settled, blocks.leg > 0)
    first = clean.reduced.blocks[0]
    at_top = replace(first, turning_nm=np.r_[-first.turning_nm[1], first.turning_nm[1:]])
    assert np.all(replace(clean.reduced, blocks=(at_top,)).settled[0])


def test_compressing_a_unit_changes_no_log_marginal_likelihood(clean):
    scales = clean.design.scales(class_priors(clean.reducer) | {e.name: (np.log(1e-3), 0.0) for e in clean.effects})
    at, _ = find_scales(clean.data, scales)
    small, basis = compress(clean.data, scales, at)
    assert small.x.shape[1] < clean.data.x.shape[1] - 30
    rng, away = np.random.default_rng(0), []
    for step in (0.0, *rng.uniform(-1.0, ABOVE, (6, 1))):
        log_scale = at + step * scales.free
        away.append(clean.data.log_marginal(scales.of_weights(log_scale)) - small.log_marginal(np.exp(log_scale)[basis.group]))
    assert np.ptp(away) < 0.01 and np.abs(away).max() < 0.05


def test_the_log_marginal_likelihood_of_a_unit_is_dense_algebra(clean):
    """Two jitters and two sets of scales, with the class's own columns and covariances."""
    from scipy.linalg import block_diag, null_space
    from scipy.stats import multivariate_t

    reduced = clean.reduced
    design = class_groups(reduced, ReducerClass(clean.reducer.knots), clean.distortion)
    basis = null_space(block_diag(*(np.ones((1, a.size)) for a in reduced.angles)))
    x, y = basis.T @ np.vstack(design.records()), basis.T @ np.concatenate(reduced.angles)
    ours, dense = [], []
    for size, level in ((1.5e-4, 0.05), (1e-3, 0.01)):
        covariances = reduced.covariances(reduced.slopes(clean.predicted), Jitter(size, 0.01))
        data = whiten(design.records(), reduced.angles, covariances, reduced.scale_dof)
        scale = np.full(data.x.shape[1], level)
        ours.append(data.log_marginal(scale) + data.log_volume)
        total = basis.T @ block_diag(*covariances) @ basis + (x * scale**2) @ x.T
        dense.append(multivariate_t.logpdf(y, None, total, reduced.scale_dof))
    assert np.diff(ours) == pytest.approx(np.diff(dense), rel=1e-5, abs=0.01)


def test_a_clean_unit_has_one_mode_and_an_offset_adds_those_without_and_with_it_alone():
    assert len(linearise(reduce_unit(planted()), library_terms())) == 1
    found = linearise(reduce_unit(planted(offset_nm=8e-4)), library_terms())
    trace = [np.log(trace_levels(m.reduced, m.design, m.effects)["torque_offset"]) for m in found]
    assert [m.log_scale["torque_offset"] == pytest.approx(t) for m, t in zip(found, trace, strict=True)] == [False, True, False]
    assert found[2].log_marginal > found[1].log_marginal + 50


def test_two_that_act_together_have_a_mode_of_their_own_which_is_the_likeliest():
    found = linearise(reduce_unit(planted(offset_nm=8e-4, lag_s=0.03, loops=MORE), COARSE), library_terms())[1:]
    traces = [trace_levels(m.reduced, m.design, m.effects) for m in found]
    acts = [{n for n in BENDING if n in t and m.log_scale[n] > np.log(t[n]) + 0.1} for m, t in zip(found, traces, strict=True)]
    assert acts[int(np.argmax([m.log_marginal for m in found]))] >= {"torque_offset", "sensor_lag"}


def test_friction_that_follows_the_rate_is_found_at_its_own_mode():
    found = linearise(reduce_unit(planted(known=_rough_reducer(3.0), exponent=0.4, loops=MORE), COARSE), library_terms())
    # At the joint mode a creep may stand for it; where it may not act, a wander of the reading as well.
    exponents = np.sort([m.distortion.friction_exponent for m in found[1:]])
    assert exponents[[0, -1]] == pytest.approx([0.0, 0.4], abs=0.05) and np.abs(exponents[:-1]).max() < 0.05


def test_a_law_of_the_rate_is_found_though_a_creep_may_stand_for_it():
    """Of two rates, where the law may act and where it may not."""
    found = linearise(reduce_unit(planted(known=_rough_reducer(6.0), exponent=0.4), COARSE), library_terms())
    exponents = [m.distortion.friction_exponent for m in found]
    assert max(exponents) == pytest.approx(0.4, abs=0.1) and min(exponents) < 0.1


def test_a_drag_at_the_shaft_is_found_and_is_no_lag():
    """Both widen the loop with the rate; only behind a lag does the angle overshoot the tips (planted fault: the same width of a
    lag, which is named one)."""

    def weighed(**fault):
        return weigh(linearise(reduce_unit(planted(loops=MORE, known=smooth_reducer(), **fault), COARSE), library_terms()))

    drag, falling, lag = weighed(drag_nm=2e-3), weighed(drag_nm=-2e-3), weighed(lag_s=0.02)
    for found, planted_nm in ((drag, 2e-3), (falling, -2e-3)):
        at = max((linear.distortion.shaft_drag for linear in found.linears), key=abs)
        assert at == pytest.approx(planted_nm / found.linears[0].reduced.torque_scale_nm, rel=0.25)
    for found, right, wrong in ((drag, LAW, "sensor_lag"), (falling, LAW, "sensor_lag"), (lag, "sensor_lag", LAW)):
        assert found.log_factor[(right,)] > found.log_factor[(wrong,)] + 10 and found.log_factor[(right,)] > 10


def test_friction_that_follows_the_rate_at_the_moment_is_found_in_records_of_one_mean_rate():
    """Of none there is next to none."""
    units = (reduce_unit(by_hand(exponent, _rough_reducer(3.0))) for exponent in (0.4, 0.0))
    found, none = (joint_mode(unit, library_terms()).distortion.friction_exponent for unit in units)
    assert found == pytest.approx(0.4, abs=0.1) and abs(none) < 0.03


def test_a_law_of_the_rate_is_told_from_one_of_the_amplitude_by_two_rates_of_one_amplitude():
    """Where the small loop is the fast one, friction may follow either (planted fault): all that tells is how rare a law of the
    amplitude is that would do instead."""

    def factor(*loops, seed=0):
        unit = planted(seed, known=_rough_reducer(4.0), exponent=0.2, loops=loops)
        return weigh(linearise(reduce_unit(unit, COARSE), library_terms())).log_factor[(LAW,)]

    confounded = [factor((0.1, 0.02), (0.05, 0.1), seed=seed) for seed in range(3)]
    rare = 0.5 * (0.2 * np.log(5.0) / np.log(2.0) / noncongruent_loops.USUAL) ** 2
    assert np.median(confounded) < 6.0 and max(confounded) < rare + 2.0
    assert factor((0.1, 0.02), (0.1, 0.1), (0.05, 0.1)) > 2.0 * (rare + 2.0)


def _rough_reducer(times):
    """One with so many times the friction."""
    known = smooth_reducer()
    return replace(known, weights=known.weights | {"friction": times * known.weights["friction"]})


def test_an_offset_of_a_fifth_of_the_range_is_a_start():
    """Far beyond a zero error: legs are compared about every offset."""
    for offset_nm in (0.02, -0.02):
        starts = possible_starts(reduce_unit(planted(offset_nm=offset_nm)))
        assert starts[0].offset == pytest.approx(offset_nm / 0.12, abs=3e-3)


@pytest.mark.parametrize("loops", [((0.1, 0.02), (0.04, 0.1)), ((0.1, 0.02), (0.065, 0.05), (0.04, 0.1))])
def test_an_offset_is_a_start_where_no_two_loops_reach_as_far(loops):
    """Legs are compared within a record: those of all, averaged, would differ by where they turned."""
    for offset_nm in (0.01, -0.004, 0.0):
        reduced = reduce_unit(planted(offset_nm=offset_nm, loops=loops))
        assert possible_starts(reduced)[0].offset * reduced.torque_scale_nm == pytest.approx(offset_nm, abs=2e-4)


def test_an_offset_is_a_start_where_every_record_is_one_leg():
    whole = planted(offset_nm=-0.004)
    records = []
    for r in whole.records:
        turns = [round(share * (r.time_s.size - 1)) for share in (0.2, 0.6, 1.0)]
        for name, begin, end in (("falling", *turns[:2]), ("rising", *turns[1:])):
            cut = {k: getattr(r, k)[begin + 1 : end] for k in ("time_s", "torque_nm", "angle_rad")}
            records.append(replace(r, name=f"{name}-{r.name}", **cut))
    reduced = reduce_unit(replace(whole, records=tuple(records)))
    assert possible_starts(reduced)[0].offset * reduced.torque_scale_nm == pytest.approx(-0.004, abs=5e-4)


@pytest.mark.parametrize("low", [0.0, 0.5, -0.3])
def test_no_offset_is_a_start_where_no_legs_overlap(low):
    """Loops on one side: the least unevenness over offsets that cannot be compared (planted fault) is anything."""
    known, rng, records = smooth_reducer(), np.random.default_rng(1), []
    for k in range(2):
        time = np.arange(12001) / 100.0
        torque = SCALE * np.interp(time % 40.0, [0.0, 20.0, 40.0], [low, 1.0, low])
        angle = known.angle_rad(time, torque) + 1e-6 * rng.standard_normal(time.size)
        records.append(Record(f"{k}.csv", time, torque + 1e-5 * rng.standard_normal(time.size), angle, SCALE / 20.0, SCALE))
    assert possible_starts(reduce_unit(Unit("one side", SCALE, tuple(records))))[0].offset == 0.0


def test_a_wave_has_modes_with_and_without_it():
    waved = linearise(reduce_unit(UNITS["encoder_error"]()), library_terms())
    marginal = np.array([m.log_marginal for m in waved])
    explained = marginal > marginal.max() - 30.0
    assert explained[0] and not explained.all() and marginal[~explained].max() < marginal.max() - 200.0
    assert all("wave" not in m.design.names for m in waved)
    assert all(abs(m.distortion.offset) < 2e-3 for m in waved)


def test_an_angle_that_stands_still_is_one_clear_line():
    unit = planted()
    frozen = replace(unit, records=tuple(replace(r, angle_rad=np.zeros(r.angle_rad.size)) for r in unit.records))
    with pytest.raises(BadInput, match="an angle that moves"):
        prepare(frozen)


@pytest.fixture(scope="module")
def searching():
    """The search of a unit with an offset and what was learnt of its class and noise."""
    free = search.Search(reduce_unit(planted(offset_nm=-3e-4)), library_terms(), BASELINE)
    return free, free.learn(Distortion())


@pytest.mark.parametrize("offset", [-6e-3, -5e-3, 0.0, 4e-3])
def test_the_mode_is_reached_from_afar(searching, offset):
    """From two to seven times the torque noise of a sample; starts hold an offset to half of it."""
    free, like = searching
    best = free.find_mode(like, like.distortion)
    ended = free.find_mode(like, Distortion(offset=offset))
    assert free._log_density(ended, best.log_scale) > free._log_density(best, best.log_scale) - 2.0
    assert free._log_density(ended, best.log_scale) > free._log_density(like, best.log_scale) - 2.0


def test_a_line_that_breaks_its_promise_is_trusted_less_far(searching, monkeypatch):
    """Steps go ten times as far as they lead; where all are taken (planted fault), the mode is not found."""
    free, like = searching
    right, density = search.tangent_groups, search.Search._log_density

    def weak(*given):
        groups = right(*given)
        return tuple(replace(g, columns=tuple(0.1 * c for c in g.columns)) if g.name == "torque_offset" else g for g in groups)

    monkeypatch.setattr(search, "tangent_groups", weak)
    start = replace(like.distortion, offset=like.distortion.offset + 6e-4)
    best = free.find_mode(like, start)
    assert best.distortion.offset == pytest.approx(-3e-4 / SCALE, abs=3e-4)
    tick = itertools.count()
    monkeypatch.setattr(search.Search, "_log_density", lambda *given, **named: float(next(tick)))
    wild = free.find_mode(like, start)
    assert density(free, wild, best.log_scale) < density(free, best, best.log_scale) - 10.0


def test_a_damped_step_is_the_mode_beside_one_more_prior(searching):
    """Against the product of the two normal densities, which other units of the exponents (planted fault) miss."""
    free, like = searching
    start = replace(like.distortion, offset=2e-3, friction_exponent=0.1)
    linear = free._linear(like.reducer, start, like.covariances, like.log_scale, like.jitter, set(), like.weights)
    effects = [e for e in free.effects if isinstance(e, TangentEffect) and e.name in linear.design.names]
    rows = np.concatenate([np.flatnonzero(linear.design.index == linear.design.names.index(e.name)) for e in effects])
    root, at = linear.solution.root[rows], np.array([getattr(start, e.parameter) for e in effects])
    known = np.linalg.inv(linear.solution.variance * root @ root.T)
    units = {"offset": 1.0, "shaft_drag": 1.0, "lag_s": 1.0 / free.reduced.context.rate.max()}

    def far(spread, exponents):
        prior = np.diag([(spread * units.get(e.parameter, exponents)) ** -2.0 for e in effects])
        mode = np.linalg.solve(known + prior, known @ linear.solution.mean[rows] + prior @ at)
        moved = np.array([getattr(free._moved(linear, spread), e.parameter) for e in effects])
        return float(np.max(np.abs(moved - mode) / np.abs(mode - at)))

    assert all(far(spread, 50.0) < 1e-4 for spread in (1e-5, 1e-4, 1e-2)) and far(1e-5, 10.0) > 0.1


def by_what_acts(free):
    """Searches by what may act, in the noise of a mode."""
    return lambda some, like: replace(free, reduced=like.reduced, only=some)


def test_modes_are_compared_in_one_class(searching):
    """A mode in a class of few knots (planted fault) is lower by its class, not by what acts."""
    free, like = searching
    few = replace(like.reducer, knots=like.reducer.knots[[0, -30, -1]])
    poor = free.find_mode(free._anew(like, reducer=few), like.distortion)
    none = replace(free, only=()).find_mode(like, Distortion())
    assert poor.log_marginal < min(like.log_marginal, none.log_marginal) - 20.0
    joint, still = engine._in_one_class(poor, none, by_what_acts(free))
    assert joint.reducer is still.reducer
    assert joint.log_marginal > like.log_marginal - 5.0 and still.log_marginal < joint.log_marginal - 20.0


def test_one_class_has_the_knots_that_either_mode_wants(monkeypatch, searching):
    """One class has knots at small torques only, one at larger ones only; where nothing is taken of the other (planted fault)
    both modes are lower."""
    free, like = searching
    knots, still = like.reducer.knots, replace(free, only=())

    def mode_with(kept, search, start):
        reducer = replace(like.reducer, knots=knots[kept | (knots == 0.0) | (knots == knots[-1])])
        return search.find_mode(search._anew(like, reducer=reducer), start)

    pair = mode_with(knots > 0.05, free, like.distortion), mode_with(knots <= 0.05, still, Distortion())
    monkeypatch.setattr(search.Search, "_refined", lambda self, linear: linear)
    joint, none = engine._in_one_class(*pair, by_what_acts(free))
    assert joint.reducer is none.reducer and joint.reducer.knots.size > pair[0].reducer.knots.size + 10
    assert np.diff(joint.reducer.knots).min() >= knots_module.least_distance(free.reduced)
    monkeypatch.setattr(search.Search, "widened", lambda self, linear, other: linear)
    alone = engine._in_one_class(*pair, by_what_acts(free))
    assert joint.log_marginal > alone[0].log_marginal + 20.0 and none.log_marginal > alone[1].log_marginal + 20.0


def test_none_may_have_a_noise_of_its_own():
    """Without the lag crossings scatter more than beside it; in the noise of the joint mode (planted fault) none is lower."""
    free = search.Search(reduce_unit(planted(lag_s=0.03)), library_terms(), BASELINE)
    still = replace(free, only=())
    pair = free.learn(Distortion(lag_s=0.03)), still.learn(Distortion())
    joint, none = engine._in_one_class(*pair, by_what_acts(free))
    held = still.find_mode(joint, none.distortion)
    assert none.jitter.torque > 2.0 * joint.jitter.torque
    assert joint.log_marginal - 20.0 > none.log_marginal > held.log_marginal + 20.0


def test_a_class_takes_of_another_what_is_denser_there():
    """Of another class only knots closer together than its own are taken (planted fault: all that differ), no flank twice."""
    own = np.linspace(0.0, 1.2, 25)
    dense = np.linspace(0.4, 0.5, 21)
    other = np.r_[0.0, own[1:7] + 0.02, dense, 0.6, 1.2]
    free = search.Search(reduce_unit(planted()), library_terms(), BASELINE)
    linear = free.first(Distortion())
    linear = free._anew(linear, reducer=replace(linear.reducer, knots=own, ratios=np.array([0.3])))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search.Search, "_refined", lambda self, one: one)
        wide = free.widened(linear, replace(linear.reducer, knots=other, ratios=np.array([0.32, 0.6]))).reducer
    taken = np.setdiff1d(wide.knots, own)
    assert np.isin(own, wide.knots).all() and np.isin(taken, dense).all() and taken.size > 12
    assert np.setdiff1d(other, own).size > taken.size + 5
    assert wide.ratios.tolist() == [0.3, 0.6]


def test_a_law_that_another_search_came_upon_speaks_for_no_effect(searching):
    """None ended far off along the law of the amplitude (planted fault), a lag that is nothing on the right one."""
    free, like = searching
    offset = replace(free, only=("torque_offset",)).find_mode(like, like.distortion)
    still = replace(free, only=())
    lost = still._linear(like.reducer, Distortion(friction_amplitude=3.0), like.covariances, {}, like.jitter, set())
    late = replace(free, only=("sensor_lag",)).find_mode(like, Distortion())
    found = engine._with_none({(): lost, ("sensor_lag",): late, ("torque_offset",): offset}, by_what_acts(free))
    assert lost.log_marginal < late.log_marginal - 20.0
    assert abs(found.log_marginal - late.log_marginal) < 5.0
    assert found.log_marginal < offset.log_marginal - 20.0


def test_a_search_ends_at_derivatives_of_its_own(monkeypatch):
    """From where it ended no more is found. One step away from nothing the line of the model before promises little; where that
    line is never made anew (planted fault), it ends there."""
    free = search.Search(reduce_unit(planted(2, offset_nm=2e-3)), library_terms(), BASELINE)
    like = free.first(Distortion())
    ended = free.find_mode(like, Distortion())
    assert free.find_mode(like, ended.distortion).log_marginal < ended.log_marginal + 2.0
    right, made = search.Search._linear, [like]

    def stale(self, reducer, at, *given):
        here = len(made) > 1 and at == made[-1].distortion
        made.append(made[-1] if here else right(self, reducer, at, *given))
        return made[-1]

    monkeypatch.setattr(search.Search, "_linear", stale)
    assert free.find_mode(like, Distortion()).log_marginal < ended.log_marginal - 50.0


def test_a_lag_that_wanted_to_be_early_on_the_way_is_tried_once_more(monkeypatch):
    """Beside a drag at the shaft. A planted fault: it stays a trace for good."""
    free = search.Search(reduce_unit(planted(4, lag_s=0.02, drag_nm=2e-3)), library_terms(), BASELINE)
    like, right, once = free.first(Distortion()), search.Search._backward, set()
    ended = free.find_mode(like, Distortion())
    assert ended.distortion.lag_s > 1e-3
    monkeypatch.setattr(search.Search, "_backward", lambda self, linear: (once.update(right(self, linear)), {*once})[1])
    assert free.find_mode(like, Distortion()).log_marginal < ended.log_marginal - 50.0 and once == {"sensor_lag"}


def test_the_likelier_end_of_a_search_counts(monkeypatch):
    """Where an effect is tried once more that may end lower, if only by the wider prior of what acts: half a nat, beside
    a friction that falls with the rate."""
    free = search.Search(reduce_unit(planted(1, exponent=-0.3)), library_terms(), BASELINE)
    like, right, once = free.first(Distortion()), search.Search._backward, set()
    ended = free.find_mode(like, Distortion())
    monkeypatch.setattr(search.Search, "_backward", lambda self, linear: (once.update(right(self, linear)), {*once})[1])
    assert ended.log_marginal > free.find_mode(like, Distortion()).log_marginal - 1e-6 and once


@pytest.mark.parametrize("options", [{"offset_nm": 8e-4}, {"lag_s": 0.03, "loops": MORE}])
def test_a_search_ends_where_its_own_straight_line_leads_nowhere(options):
    """Of a mode without what distorts, which misfits: there the prior scales with the noise, or good steps are refused."""
    free = search.Search(reduce_unit(planted(**options)), library_terms(), BASELINE)
    ended = replace(free, only=()).find_mode(free.learn(Distortion()), Distortion())
    offset, wanted = ended.distortion.offset, ended.weights["torque_offset"][0]
    assert abs(wanted - offset) < 2e-4 + 0.1 * abs(offset)


@pytest.mark.parametrize(("offset_nm", "other"), [(-3e-4, 0.095), (8e-4, 0.0951)])
def test_amplitudes_that_are_hardly_two_are_so_at_every_offset(offset_nm, other):
    linears = linearise(reduce_unit(planted(offset_nm=offset_nm, loops=((0.1, 0.02), (other, 0.1)))), library_terms())
    assert len({linear.design.names for linear in linears}) == 1
    assert all(linear.reducer is linears[0].reducer for linear in linears)
    # None may have a noise of its own.
    assert len({tuple(c.tobytes() for c in linear.covariances) for linear in linears}) <= 2
