"""The contract that every member of the registry keeps."""

from dataclasses import replace

import numpy as np
import pytest
from support.known import (
    RATED,
    SCALE,
    as_arrays,
    cycles,
    prior_values,
    random_torques,
    reducer,
    typical_values,
)

from backdrive_bayes.errors import BadInput
from backdrive_bayes.model.member import Drive, Stage
from backdrive_bayes.model.parameter import Scale
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.model.registry import BASELINE, MEMBERS, members_named

NAMES = tuple(MEMBERS)
ODD = {
    "initial_gap_position", "initial_friction_state", "initial_second_gap_position", "initial_creep", "initial_slip",
    "torque_offset", "second_unevenness",
}  # fmt: skip
"""Parameters that change sign with the torque: those of the past, an offset, a difference between the two ways."""
ONE_SIDED = {"asymmetric_stiffness", "encoder_error", "thermal_drift"}
"""Effects that single out a direction of the torque or of the angle, or heed neither."""


def own_model(name):
    """The smallest model in which the member shows in the angle."""
    return reducer({name} if MEMBERS[name].stage is Stage.COMPLIANCE else {name, "elastic", "friction"})


def zigzag(seed=0):
    torque = random_torques(np.random.default_rng(seed))
    return TorquePath.from_samples(torque, 0.05 * np.arange(torque.size))


def null_gap(member, path, nulls):
    """How far from absent the member is with ``nulls`` put in, relative to what it normally does."""
    names = {*BASELINE, member.name}
    model, others = reducer(names), reducer(names - {member.name})
    values = as_arrays(typical_values(model))
    absent = others.angle(values, path)
    normal = np.abs(model.angle(values, path) - absent).max()
    return np.abs(model.angle(values | as_arrays(nulls), path) - absent).max() / normal


def nulls_of(member):
    return {p.name: p.null for p in member.parameters if p.null is not None}


@pytest.mark.parametrize("name", NAMES)
def test_member_describes_itself(name):
    member = MEMBERS[name]
    assert member.name == name and member.source and isinstance(member.stage, Stage)
    assert nulls_of(member), "some parameter must have a null value"
    for p in member.parameters:
        assert p.name and p.unit and p.source
        assert p.scaled_prior(SCALE).describe()


def test_parameter_names_are_unique_over_the_registry():
    names = [p.name for m in MEMBERS.values() for p in m.parameters]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", NAMES)
def test_member_is_absent_at_its_null_value(name):
    member = MEMBERS[name]
    assert null_gap(member, zigzag(), nulls_of(member)) < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_member_vanishes_continuously_towards_its_null_value(name):
    member, path = MEMBERS[name], zigzag()
    typical = typical_values(reducer({*BASELINE, name}))
    near = [{k: n + e * (typical[k] - n) for k, n in nulls_of(member).items()} for e in (1e-2, 1e-6)]
    far, close = (null_gap(member, path, values) for values in near)
    assert close < 1e-4 < far < 0.5


@pytest.mark.parametrize("name", NAMES)
def test_batch_of_draws_is_the_single_draws(name):
    model, path = own_model(name), zigzag()
    values = prior_values(model, np.random.default_rng(1), 5)
    batch = model.angle(values, path)
    assert batch.shape == (5, path.torque_nm.size)
    for k in range(5):
        single = model.angle({n: v[k] for n, v in values.items()}, path)
        assert single.shape == path.torque_nm.shape
        np.testing.assert_allclose(batch[k], single, rtol=1e-11, atol=1e-14 * SCALE.angle_rad)
    cube = model.angle({n: np.stack([v[:3], v[2:]]) for n, v in values.items()}, path)
    np.testing.assert_allclose(cube[1, 2], batch[4], rtol=1e-11, atol=1e-14 * SCALE.angle_rad)


@pytest.mark.parametrize("name", NAMES)
def test_prior_draws_give_finite_angles(name):
    model = own_model(name)
    values = prior_values(model, np.random.default_rng(2), 400)
    for path in (zigzag(), cycles(RATED, 1, 40), cycles(1e-6 * RATED, 1, 40), cycles(1.2 * RATED, 1, 40)):
        assert np.isfinite(model.angle(values, path)).all()


@pytest.mark.parametrize("name", NAMES)
def test_member_does_not_change_its_inputs(name):
    model, path = own_model(name), zigzag()
    values = prior_values(model, np.random.default_rng(3), 3)
    before = {k: v.copy() for k, v in values.items()}, path.torque_nm.copy()
    first = model.angle(values, path).copy()
    assert np.array_equal(model.angle(values, path), first)
    assert np.array_equal(path.torque_nm, before[1])
    assert all(np.array_equal(values[k], before[0][k]) for k in values)


@pytest.mark.parametrize("name", [n for n in NAMES if n not in ONE_SIDED])
def test_negated_torque_and_past_give_the_negated_angle(name):
    model, torque = own_model(name), random_torques(np.random.default_rng(4))
    values = prior_values(model, np.random.default_rng(5), 20)
    mirrored = {k: -v if k in ODD else v for k, v in values.items()}
    there = model.angle(values, TorquePath.from_samples(torque))
    back = model.angle(mirrored, TorquePath.from_samples(-torque))
    np.testing.assert_allclose(back, -there, rtol=0, atol=1e-12 * np.abs(there).max())
    if ODD & set(values):
        unflipped = model.angle(values, TorquePath.from_samples(-torque))
        assert np.abs(unflipped + there).max() > 1e-3 * np.abs(there).max(), (
            "the past must matter for this test to see it"
        )


@pytest.mark.parametrize("name", NAMES)
def test_scaling_torque_and_angle_scales_the_result(name):
    model, torque = own_model(name), random_torques(np.random.default_rng(6))
    big = ReducerModel(model.members, Scale(37.0 * SCALE.torque_nm, 5.0 * SCALE.angle_rad))
    small_angle = model.angle(
        prior_values(model, np.random.default_rng(7), 20), TorquePath.from_samples(torque)
    )
    big_angle = big.angle(
        prior_values(big, np.random.default_rng(7), 20), TorquePath.from_samples(37.0 * torque)
    )
    np.testing.assert_allclose(big_angle, 5.0 * small_angle, rtol=0, atol=1e-11 * np.abs(big_angle).max())


@pytest.mark.parametrize("name", NAMES)
def test_parts_add_up_to_the_angle(name):
    model, path = reducer({*BASELINE, name}), zigzag()
    values = prior_values(model, np.random.default_rng(8), 20)
    parts = model.parts(values, path)
    assert set(parts) == {*BASELINE, name}
    np.testing.assert_allclose(sum(parts.values()), model.angle(values, path), atol=1e-15)


@pytest.mark.parametrize(("holding", "levels"), [
    ("friction", {"friction_torque": 1.0, "friction_ratio": 1.0, "drag_torque": 0.5}),
    ("load_dependent_friction", {"load_friction_ratio": 1.0, "drag_torque": 0.5}),
])  # fmt: skip
def test_friction_that_follows_the_rate_is_friction_at_another_level(holding, levels):
    path, names = cycles(RATED, 1, 200), {"geometric", "elastic", holding}
    model, plain = reducer({*names, "rate_dependent_friction"}), reducer(names)
    values = as_arrays(typical_values(model) | {"friction_rate_exponent": 0.3, "friction_rate_bend": 0.0, "drag_follows": 0.5})
    factor = (float(np.median(path.rate_nm_per_s)) / (0.5 * RATED)) ** 0.3
    assert abs(factor - 1) > 0.1
    at_level = {k: values[k] * factor**power for k, power in levels.items()}
    expected, unchanged = plain.angle(values | at_level, path), plain.angle(values, path)
    np.testing.assert_allclose(model.angle(values, path), expected, atol=1e-12 * np.abs(expected).max())
    assert np.abs(expected - unchanged).max() > 1e-3 * np.abs(expected).max()
    parts = model.parts(values, path)
    np.testing.assert_allclose(parts["geometric"], plain.parts(values | at_level, path)["geometric"], atol=1e-15)


def test_the_order_in_which_members_are_named_does_not_matter():
    assert members_named(["friction", "geometric"]) == members_named(["geometric", "friction"])
    model, path = reducer(), zigzag()
    values = prior_values(model, np.random.default_rng(9), 3)
    shuffled = ReducerModel(model.members[::-1], SCALE)
    np.testing.assert_allclose(shuffled.angle(values, path), model.angle(values, path), atol=1e-15)


@pytest.mark.parametrize("names", [[], ["elastic", "elastic"], ["elastic", "warp_drive"]])
def test_unknown_repeated_or_no_members_are_refused(names):
    with pytest.raises(BadInput):
        members_named(names)


@pytest.mark.parametrize("name", [n for n in NAMES if getattr(MEMBERS[n], "of_time", False)])
def test_what_is_of_the_time_alone_does_not_heed_the_torque(name):
    path = zigzag()
    values = as_arrays(typical_values(reducer({name, "elastic"})))
    drives = [Drive(replace(path, torque_nm=t), RATED, angle_rad=t) for t in (path.torque_nm, -0.3 * path.torque_nm)]
    one, other = (MEMBERS[name].respond(values, drive) for drive in drives)
    np.testing.assert_array_equal(one, other)
    assert np.ptp(one) > 0


@pytest.mark.parametrize("name", [n for n in NAMES if hasattr(MEMBERS[n], "guesses")])
def test_guesses_are_of_the_members_own_parameters(name):
    angle, record = np.tile(np.linspace(0, 0.02, 50), 2), np.repeat([0, 1], 50)
    rng = np.random.default_rng(0)
    found = MEMBERS[name].guesses(angle, record, lambda columns: (rng.normal(size=columns.shape[:2]), rng.random(len(columns))))
    own = {p.name: p.per_record for p in MEMBERS[name].parameters}
    assert found and all(np.shape(v) == ((2,) if own[k] else ()) for guess in found for k, v in guess.items())
