"""Every registered effect: shapes, levels, and the symmetry that it claims to break."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter
from support.bench import path_of

from backdrive_bayes.engine.design import class_groups, path_group, tangent_groups
from backdrive_bayes.mechanics import registry
from backdrive_bayes.mechanics.effect import (
    AngleEffect,
    Context,
    Distortion,
    Effect,
    FlankEffect,
    GrowthEffect,
    PathEffect,
    SpreadEffect,
    TangentEffect,
)
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS
from backdrive_bayes.mechanics.effects.bench_hysteresis import SIZE as BENCH_FRICTION
from backdrive_bayes.mechanics.effects.viscoelastic_creep import BEFORE
from backdrive_bayes.mechanics.history import behind, through
from backdrive_bayes.mechanics.part import TOP
from backdrive_bayes.mechanics.reducer import ReducerClass
from backdrive_bayes.records.reduction import Blocks

LISTED = (*registry.LIBRARY.values(), registry.UNEQUAL, (registry.UNKNOWN,))
TERMS = {t.name: t for terms in LISTED for t in terms}
PATHS = [n for n, t in TERMS.items() if isinstance(t, PathEffect)]
TANGENTS = [n for n, t in TERMS.items() if isinstance(t, TangentEffect)]
RATES = (0.2, 1.0, 2.0)
CONTEXT = Context(0.1, 0.02, np.array(RATES), 5.0 / np.array(RATES), 2e-3, 1e-3)
TURNING = np.array([0.0, 1.0, -1.0, 1.0])
LATE = {"lag_spread": Distortion(lag_s=0.02)}
"""A lag smooths only where there is one."""
REDUCER = ReducerClass(np.r_[0.0, np.geomspace(0.01, TOP, 20)])


def cycle(sign=1.0, seconds=25.0, points=60):
    torque = np.concatenate([np.linspace(a, b, points)[:-1] for a, b in zip(TURNING[:-1], TURNING[1:], strict=True)] + [[1.0]])
    return through(np.linspace(0.0, seconds, torque.size), sign * torque, 1.0)


def record(rate, sign=1.0, per_leg=30):
    """Blocks of 0 → +T → −T → +T at ``rate`` torque scales a second."""
    edges = [sign * np.linspace(a, b, per_leg + 1) for a, b in zip(TURNING[:-1], TURNING[1:], strict=True)]
    time = np.r_[0.0, np.cumsum(np.concatenate([np.abs(np.diff(e)) for e in edges]))] / rate
    torque = np.concatenate([0.5 * (e[1:] + e[:-1]) for e in edges])
    small, direction = np.zeros(torque.size), (sign * np.array([1, -1, 1])).astype(int)
    leg = np.repeat([0, 1, 2], per_leg)
    turning = 0.1 * sign * TURNING
    path = path_of(time[:-1], time[1:], leg, 0.1 * torque, turning)
    count = np.full(torque.size, 9)
    return Blocks("r", 0.1 * torque, small, small, time[:-1], time[1:], count, leg, turning, direction, small, **path)


def unit(sign=1.0, rates=RATES):
    """What designs need of a reduced unit."""
    blocks, rates = tuple(record(r, sign) for r in rates), np.array(rates)
    return SimpleNamespace(blocks=blocks, torque_scale_nm=0.1, context=Context(0.1, 0.02, rates, 5.0 / rates, 2e-3, 1e-3))


def weights(seed=3):
    rng = np.random.default_rng(seed)
    found = {p.name: rng.exponential(size=p.cells.count) for p in REDUCER.parts}
    return {n: np.linalg.lstsq(m, w)[0] if (m := REDUCER.part(n).mixing) is not None else w for n, w in found.items()}


def of_path(term):
    """Which columns are not those of a single record among weights that all records share."""
    return term.per_record | term.responses(cycle(), None, CONTEXT)[1].any(axis=0)


def column(name, reduced, distortion=None):
    """The columns that a design holds for one term, by record."""
    distortion = distortion or LATE.get(name, Distortion())
    if isinstance(TERMS[name], PathEffect):
        return [c[:, of_path(TERMS[name])] for c in path_group(reduced, TERMS[name]).columns]
    return tangents(reduced, distortion, weights(), name)[name]


def tangents(reduced, distortion, known, name):
    """Columns by record of every tangent term that belongs with one, by name."""
    terms = next(terms for terms in LISTED if TERMS[name] in terms)
    core = class_groups(reduced, REDUCER, distortion)
    return {g.name: g.columns for g in tangent_groups(reduced, REDUCER, core, distortion, known, terms)}


@pytest.mark.parametrize("name", TERMS)
def test_an_effect_says_what_it_is_and_how_large(name):
    term = TERMS[name]
    assert term.breaks and term.signature and term.source and term.unit
    assert 0 < term.present(CONTEXT)


@pytest.mark.parametrize("name", TERMS)
def test_columns_have_their_shapes_and_vanish_with_their_weights(name):
    for blocks, columns in zip(unit().blocks, column(name, unit()), strict=True):
        assert columns.shape[0] == blocks.count.size and columns.shape[1] >= 1 and np.isfinite(columns).all()
        assert np.abs(columns).max() > 0 and not np.any(columns @ np.zeros(columns.shape[1]))


@pytest.mark.parametrize("name", PATHS)
def test_responses_join_from_segment_to_segment(name):
    begin, end = TERMS[name].responses(cycle(), 0, CONTEXT)
    assert begin.shape == end.shape
    inner = np.ones(begin.shape[0] - 1, bool)
    if name == "unknown":
        inner[[58, 117]] = False
    np.testing.assert_allclose(begin[1:][inner], end[:-1][inner], atol=1e-9)


@pytest.mark.parametrize("name", [n for n in TERMS if TERMS[n].breaks == "oddness"])
def test_what_breaks_oddness_is_even_under_mirrored_torque(name):
    for here, there in zip(column(name, unit()), column(name, unit(-1.0)), strict=True):
        # On the first leg a shifted loop also begins elsewhere.
        np.testing.assert_allclose(there[30:], here[30:], atol=3e-3 * np.abs(here).max())


@pytest.mark.parametrize("name", [n for n in TERMS if TERMS[n].breaks == "rate independence"])
def test_what_breaks_rate_independence_is_odd_and_depends_on_the_rate(name):
    here, there = column(name, unit()), column(name, unit(-1.0))
    np.testing.assert_allclose(there[0], -here[0], atol=2e-5 * np.abs(here[0]).max())
    fast, slow = column(name, unit(rates=(0.2, 1.0, 2.0))), column(name, unit(rates=(0.2, 0.3, 0.4)))
    assert max(np.abs(a - b).max() for a, b in zip(fast, slow, strict=True)) > 0.05 * max(np.abs(c).max() for c in here)


def test_a_wrong_claim_would_be_seen():
    """A planted fault: lag is not even and an offset is not odd under mirrored torque."""
    lag, mirrored = column("sensor_lag", unit())[0], column("sensor_lag", unit(-1.0))[0]
    assert np.abs(mirrored - lag).max() > 0.5 * np.abs(lag).max()
    offset, mirrored = column("torque_offset", unit())[0], column("torque_offset", unit(-1.0))[0]
    assert np.abs(mirrored + offset).max() > 0.5 * np.abs(offset).max()


def test_drift_depends_on_the_time_alone():
    drift = TERMS["thermal_drift"]
    rng = np.random.default_rng(0)
    history = cycle()
    other = through(np.r_[history.t0[:1], history.t1], rng.uniform(-1, 1, history.z1.size + 1), 1.0)
    assert np.array_equal(drift.responses(history, 0, CONTEXT)[1], drift.responses(other, 0, CONTEXT)[1])


def test_creep_vanishes_where_the_torque_is_slow_and_holds_where_it_is_fast():
    creep = TERMS["viscoelastic_creep"]
    slow, fast = (np.abs(creep.responses(cycle(seconds=s), 0, CONTEXT)[1]).max() for s in (2.5e4, 25.0))
    assert slow < 0.02 * fast


def test_a_creep_in_progress_is_held_by_its_record_alone():
    """An element that was loaded before the record relaxes."""
    creep, history = TERMS["viscoelastic_creep"], cycle()
    relaxing = 0.7 * np.exp((history.t0[0] - history.t1) / (3.0 * creep.times_s(CONTEXT)[3]))

    def left(columns):
        return np.std(relaxing - columns @ np.linalg.lstsq(columns, relaxing, rcond=None)[0]) / np.std(relaxing)

    path, own, other = (creep.responses(history, record, CONTEXT)[1] for record in (None, 1, 2))
    assert left(own) < 0.03 < 0.3 < left(path)
    acting, elsewhere, always = (columns.any(axis=0) for columns in (own, other, path))
    assert np.array_equal(acting & elsewhere, always) and acting.sum() > always.sum()
    # Independent weights of these columns give states of one size at all times, alike where the times are.
    decays = np.exp((history.t0[0] - history.t1)[:, None] / creep.times_s(CONTEXT)[::2])
    root = np.linalg.lstsq(decays, own[:, acting & ~always], rcond=None)[0]
    states = root @ root.T
    np.testing.assert_allclose(np.diag(states), BEFORE**2, rtol=1e-6)
    alike = states / BEFORE**2
    assert 0.3 < alike[0, 3] < alike[0, 2] < alike[0, 1] < 0.95


def test_the_lag_grows_with_the_rate_and_exponents_with_its_logarithm():
    here = column("sensor_lag", unit())
    np.testing.assert_allclose(here[2][5:25], 10 * here[0][5:25], rtol=0.05, atol=0.02 * np.abs(here[2]).max())
    for name in ("friction_rate", "drag_rate"):
        slow, fast = column(name, unit(rates=(0.2, 2.0)))
        np.testing.assert_allclose(slow, -fast, atol=0.05 * np.abs(fast).max())


def test_a_drag_at_the_shaft_never_helps_the_motion():
    """One that rises is none at rest, one that falls none at the largest rate, and neither is negative at a larger one."""
    rates = CONTEXT.log_rate.max() + np.log([1e-9, 0.25, 1.0, 2.0])
    rising, falling = (Distortion(shaft_drag=s).growth(rates, 0.0, CONTEXT)[2] for s in (0.02, -0.02))
    np.testing.assert_allclose(rising, 0.02 * np.sqrt([0.0, 0.25, 1.0, 2.0]), atol=1e-6)
    np.testing.assert_allclose(falling, [0.02, 0.01, 0.0, 0.0], atol=1e-6)
    for size in (0.02, -0.02):
        here, more = (Distortion(shaft_drag=s).growth(rates, 0.0, CONTEXT)[2] for s in (size, size + 1e-6))
        np.testing.assert_allclose((more - here) / 1e-6, Distortion(shaft_drag=size).law(rates, 0.0, CONTEXT)[-1], atol=1e-4)


def test_a_law_of_the_rate_needs_two_rates():
    for name in ("friction_rate", "drag_rate", "shaft_drag"):
        one = unit(rates=(0.2, 0.2))
        core = class_groups(one, REDUCER, Distortion())
        assert tangent_groups(one, REDUCER, core, Distortion(), weights(), (TERMS[name],)) == ()
        assert column(name, unit(rates=(0.2, 2.0)))


def test_what_is_unexplained_adds_to_one_on_every_leg():
    for response in registry.UNKNOWN.responses(cycle(), 0, CONTEXT):
        np.testing.assert_allclose(response.sum(axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("name", TERMS)
def test_a_record_has_the_same_columns_alone_and_among_others(name):
    term = TERMS[name]
    if isinstance(term, PathEffect):
        both, alone = unit(), SimpleNamespace(**(vars(unit()) | {"blocks": unit().blocks[1:]}))
        one, other = (path_group(u, term).columns[k][:, of_path(term)] for u, k in ((both, 1), (alone, 0)))
        assert np.array_equal(one, other)
    elif not isinstance(term, GrowthEffect):
        both, alone = column(name, unit()), column(name, unit(rates=RATES[2:]))
        np.testing.assert_allclose(alone[0], both[2], atol=1e-9 * np.abs(both[2]).max())


def test_friction_of_the_bench_has_one_sign():
    """Mean and standard deviation are those of a half-normal prior; a symmetric one would be centred at zero."""
    size = np.abs(BENCH_FRICTION * CONTEXT.torque_noise * np.random.default_rng(3).standard_normal(400_000))
    assert BENCH_HYSTERESIS.usual(CONTEXT) == pytest.approx(size.mean(), rel=5e-3)
    assert BENCH_HYSTERESIS.present(CONTEXT) == pytest.approx(size.std(), rel=5e-3)


def test_tangents_are_derivatives_of_the_prediction():
    """Against a difference quotient ten times as wide; about no drag at the shaft, upwards."""
    for name in TANGENTS:
        term, reduced, by = TERMS[name], unit(), weights()
        step = 0.02 if isinstance(term, GrowthEffect) and term.part < 2 else 2e-4
        ends = (2, 0) if name == "shaft_drag" else (1, -1)
        curves = [class_groups(reduced, REDUCER, Distortion(**{term.parameter: s * step})).predict(by, list(by)) for s in ends]
        for r, columns in enumerate(column(name, reduced)):
            quotient = (curves[0][r] - curves[1][r]) / (2 * step)
            # Both on the settled legs: from the first sample on, a shifted history begins elsewhere.
            away = columns[30:, 0] - quotient[30:]
            assert np.sqrt(np.mean(away**2)) < 0.05 * np.abs(quotient[30:]).max(), name


def test_a_first_order_lag_is_exact():
    """Of a ramp that halts between two segments, in long segments and short ones: it runs behind by the rate times the lag, then
    closes up exponentially."""
    lag = 0.4

    def late(time):
        """Integral of the output up to an instant."""
        running = np.minimum(time, 2.0)
        first = 0.5 * running**2 - lag * running + lag**2 * -np.expm1(-running / lag)
        gap = lag * -np.expm1(-2.0 / lag)
        rest = np.maximum(time - 2.0, 0.0)
        return first + 2.0 * rest - gap * lag * -np.expm1(-rest / lag)

    for time in (np.linspace(0.0, 3.0, 4), np.linspace(0.0, 3.0, 31), np.linspace(0.0, 3.0, 3_001)):
        before, end = np.r_[0.0, time[:-1]], np.minimum(time, 2.0)
        mean = 0.5 * (end + np.minimum(before, 2.0))
        span = np.maximum(time - before, 1e-300)
        np.testing.assert_allclose(behind(mean, end, before, time, lag)[1:], (np.diff(late(time)) / span[1:]), atol=1e-9)


def test_a_lag_knows_of_a_jump_within_a_segment():
    """By the mean: a straight line between the same ends would be far from the exponential."""
    lag, time = 0.4, np.array([0.0, 0.4, 0.8])
    before, end = np.r_[0.0, time[:-1]], np.array([0.0, 1.0, 1.0])
    late = 0.36
    exact = (0.4 - lag * (np.exp(-(0.4 - late) / lag) - np.exp(-(0.8 - late) / lag))) / 0.4
    jumped, straight = (behind(np.array([0.0, mean, 1.0]), end, before, time, lag)[2] for mean in (0.1, 0.5))
    assert abs(jumped - exact) < 0.1 * abs(straight - exact)


def test_the_lag_is_the_derivative_of_what_is_delayed_and_what_is_smoothed():
    """Against a difference quotient of the prediction of which as much is behind a first-order lag and the rest delayed: the
    delay alone, as if nothing were smoothed, would miss it, and so would a share that stays."""
    reduced, share, lag, step = unit(), 0.8, 0.05, 1e-3

    def predicted(at, smooth):
        smoothed = tangents(reduced, at, weights(), "lag_spread")["lag_spread"]
        delayed = class_groups(reduced, REDUCER, at).predict(weights())
        return [d + smooth * s[:, 0] for d, s in zip(delayed, smoothed, strict=True)]

    at = [Distortion(lag_s=lag + sign * step) for sign in (-1.0, 1.0)]
    below, above = (predicted(d, share * lag / d.lag_s) for d in at)
    stays = [predicted(d, share) for d in at]
    known = weights() | {"lag_spread": np.array([share])}
    both, alone = (tangents(reduced, Distortion(lag_s=lag), of, "sensor_lag")["sensor_lag"] for of in (known, weights()))
    for r, (low, high) in enumerate(zip(below, above, strict=True)):
        quotient, other = (high - low) / (2.0 * step), (stays[1][r] - stays[0][r]) / (2.0 * step)
        apart = both[r][:, 0] - quotient, alone[r][:, 0] - quotient, other - quotient
        off, without, wrong = (np.sqrt(np.mean(d[30:] ** 2)) for d in apart)
        assert off < 0.15 * np.abs(quotient[30:]).max() and off < 0.5 * without and off < 0.5 * wrong


def test_what_is_smoothed_is_what_a_filter_makes_of_the_prediction():
    """A first-order filter in small steps of time; nothing of it is there without a lag."""
    reduced, lag = unit(rates=(1.0,)), 0.06
    core = class_groups(reduced, REDUCER, Distortion())
    angle, blocks = core.predict(weights())[0], reduced.blocks[0]
    time = np.linspace(blocks.begin_s[0], blocks.end_s[-1], 200_001)
    share = -np.expm1(-(time[1] - time[0]) / lag)
    middle = 0.5 * (blocks.begin_s + blocks.end_s)
    filtered = lfilter([share], [1.0, share - 1.0], np.interp(time, middle, angle) - angle[0]) + angle[0]
    late = Distortion(lag_s=lag)
    delayed = class_groups(reduced, REDUCER, late).predict(weights())[0]
    found = delayed + tangents(reduced, late, weights(), "lag_spread")["lag_spread"][0][:, 0]
    off = (found - np.interp(middle, time, filtered))[5:]
    assert np.abs(off).max() < 0.01 * np.ptp(angle) < 0.1 * np.abs(found - delayed).max() * 10.0
    assert not tangents(reduced, Distortion(), weights(), "lag_spread")["lag_spread"][0].any()


@pytest.mark.parametrize("name", [n for n in PATHS if n in ("asymmetric_stiffness", "viscoelastic_creep")])
def test_an_effect_of_the_reducer_follows_the_torque_that_the_reducer_felt(name):
    """A torque that was read too high by an offset makes the same columns where the offset is known."""
    shift, right, wrong = 0.2, unit(), unit()
    read = tuple(
        replace(b, torque_nm=b.torque_nm - 0.1 * shift, turning_nm=b.turning_nm - 0.1 * shift, path_nm=b.path_nm - 0.1 * shift)
        for b in right.blocks
    )
    wrong.blocks = read
    cases = ((right, 0.0), (wrong, shift), (wrong, 0.0))
    by_case = (path_group(reduced, TERMS[name], Distortion(at)).columns for reduced, at in cases)
    for here, known, blind in zip(*by_case, strict=True):
        np.testing.assert_allclose(known, here, atol=1e-9)
        assert np.abs(blind - here).max() > 0.01 * np.abs(here).max()


def test_unequal_deflection_draws_what_one_flank_turns_more():
    """In proportion, or the more the further it is turned; but no tooth alone."""
    angle, effect = np.linspace(-1.0, 1.0, 401), TERMS["unequal_deflection"]
    columns = effect.columns(angle)
    np.testing.assert_allclose(effect.columns(-angle), columns)
    size = np.abs(angle)

    def left(part):
        return np.std(part - columns @ (np.linalg.solve(columns.T @ columns + 1e-6 * np.eye(columns.shape[1]), columns.T @ part)))

    assert left(0.5 * size) < 0.02 * np.std(0.5 * size) and left(0.5 * size**1.5) < 0.02 * np.std(0.5 * size**1.5)
    tooth = np.exp(-0.5 * ((size - 0.5) / 0.05) ** 2)
    assert left(tooth) > 0.5 * np.std(tooth)


def test_every_term_is_of_one_known_kind():
    assert all(isinstance(t, PathEffect | TangentEffect | FlankEffect | AngleEffect | SpreadEffect) for t in TERMS.values())
    assert all(t.of_reducer is False for n, t in TERMS.items() if n in ("torque_offset", "sensor_lag", "thermal_drift"))


@pytest.fixture
def fresh_registry():
    registry.all_effects.cache_clear()
    yield
    registry.all_effects.cache_clear()


class Mine(PathEffect):
    """An effect of one's own."""

    def present(self, context):
        return 1e-2

    def responses(self, history, record, context):
        return history.z0[:, None] ** 2, history.z1[:, None] ** 2


@pytest.mark.parametrize("terms", [1, 2])
def test_an_effect_of_ones_own_comes_by_entry_point(terms, monkeypatch, fresh_registry):
    mine = tuple(Mine(name, "oddness", "even", "nobody", "rad") for name in ("mine", "more")[:terms])
    asked = []

    def points(group):
        asked.append(group)
        return [SimpleNamespace(load=lambda: mine if terms > 1 else mine[0])]

    monkeypatch.setattr(registry, "entry_points", points)
    found = registry.all_effects()
    assert found["mine"] == mine and asked == ["backdrive_bayes.effects"] and set(registry.LIBRARY) < set(found)
    assert path_group(unit(), found["mine"][0]).columns[0].shape == (90, 1)


def test_an_effect_without_levels_is_abstract():
    bare = Effect("bare", "oddness", "none", "nobody")
    with pytest.raises(NotImplementedError):
        bare.present(CONTEXT)
