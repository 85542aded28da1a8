"""A simulator set against a unit: the gap is split, what is missing is named, what agrees is said to agree."""

from dataclasses import replace

import numpy as np
import pytest
from support.planted import HERTZ, LOOPS, planted, smooth_reducer

from backdrive_bayes.bench.known_truth import BenchNoise, ramp
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.errors import BadInput
from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.gap.simulated import compared, diagnose_simulated, lacking, summary
from backdrive_bayes.gap.simulator import read_simulator, require_reach, through_bench
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.noise import ChannelRecord, estimate_common_noise
from backdrive_bayes.records.record import Record, Unit

OFFSET_NM = 8e-4


def simulated(loops=LOOPS, hertz=HERTZ, offset_nm=0.0, **factors) -> Unit:
    """A noise-free simulator of the smooth reducer with parts scaled by ``factors``."""
    known = smooth_reducer()
    known = replace(known, weights={n: w * factors.get(n, 1.0) for n, w in known.weights.items()})
    records = []
    for amplitude, rate in loops:
        time, torque = ramp(amplitude, rate, hertz)
        angle = known.angle_rad(time, torque)
        records.append(Record(f"{amplitude}-{rate}.csv", time, torque - offset_nm, angle, rate, amplitude))
    return Unit("simulator", 0.1, tuple(records))


@pytest.fixture(scope="module")
def measured():
    """A unit with a torque offset, diagnosed."""
    return diagnose(planted(known=smooth_reducer(), offset_nm=OFFSET_NM), seed=2)


@pytest.fixture(scope="module")
def against(measured):
    """Sets the unit against a simulator."""

    def set_against(unit):
        return compared(measured, read_simulator(unit, measured.weighed.linear.reduced, 2), 2, 0.03).json

    return set_against


@pytest.fixture(scope="module")
def shifted(against):
    """The simulator has too little clearance, is too soft and lacks the offset."""
    return against(simulated(clearance=0.9, elastic=1.1))


def test_what_the_simulator_lacks_is_named(shifted):
    assert shifted["answer"]["effects"] == ["torque_offset"]
    assert sum(row["probability"] for row in shifted["which"]) == pytest.approx(1.0)
    assert shifted["simulator"]["effects"] == [] and shifted["simulator"]["told"]
    assert shifted["gap"]["probability"] > 0.95


def gap_of(**factors):
    """Root mean square [rad] of what a noise-free simulator with those factors and no offset lacks of the unit without noise."""
    squares = []
    for (amplitude, rate), wrong in zip(LOOPS, simulated(offset_nm=OFFSET_NM, **factors).records, strict=True):
        time, torque = ramp(amplitude, rate, HERTZ)
        known = smooth_reducer()
        known = replace(known, weights={n: w * factors.get(n, 1.0) for n, w in known.weights.items()})
        gap = smooth_reducer().angle_rad(time, torque) - known.angle_rad(time, wrong.torque_nm)
        settled = gap[find_segments(time, torque)[0].stop :]
        squares.append(np.mean((settled - settled.mean()) ** 2))
    return float(np.sqrt(np.mean(squares)))


def test_the_shares_are_whole_and_the_gap_closes(shifted):
    """Re-tuning leaves what the offset alone makes, no less: no trace of what is missing may close a part of it."""
    split = shifted["simulator"]
    shares = [split[key] for key in ("closed_by_retuning", "closed_by_effect", "left")]
    assert sum(share["median"] for share in shares) == pytest.approx(1.0)
    assert all(share["lo"] <= share["median"] <= share["hi"] for share in shares)
    whole, offset, rms = gap_of(clearance=0.9, elastic=1.1), gap_of(), split["rms_rad"]
    # What is measured has the noise in it; a fit weighs steep blocks less, which the offset moves most.
    seen, alone = (float(np.hypot(size, rms["noise_floor"])) for size in (whole, offset))
    assert rms["simulated"] == pytest.approx(seen, rel=0.01) and 0.98 * alone < rms["retuned"] < 1.1 * alone
    assert shares[0]["lo"] <= (seen - alone) / (seen - rms["noise_floor"]) <= shares[0]["hi"] < 0.6
    assert shares[1]["lo"] > 0.4 and split["closed_by_both"]["lo"] > 0.9 and rms["explained"] < 1.6 * rms["noise_floor"]
    assert shifted["shrink"]["before_rad"] == rms["simulated"] and shifted["shrink"]["after_rad"] == rms["explained"]
    assert [part["part"] for part in split["parts"]] == ["retuning", "effect", "left"]
    for part in split["parts"]:
        assert sum(cell["share"] for cell in part["map"]) == pytest.approx(1.0)


def test_parameters_go_from_the_simulator_s_to_the_unit_s(shifted):
    rows = {row["name"]: row for row in shifted["simulator"]["parameters"]}
    clearance = rows["clearance_rad"]
    true = 0.9 * 0.02
    assert clearance["simulated_interval"]["lo"] < 0.9 * true < clearance["simulated_interval"]["hi"]
    assert clearance["measured"]["lo"] < true < clearance["measured"]["hi"]
    assert clearance["change"]["lo"] < 0.1 * true < clearance["change"]["hi"]


def test_a_simulator_that_has_the_effect_and_agrees_lacks_nothing(against):
    found = against(simulated(offset_nm=OFFSET_NM))
    split = found["simulator"]
    assert split["effects"] == split["shared_effects"] == ["torque_offset"] and found["answer"]["effects"] == []
    assert not split["told"] and split["closed_by_retuning"]["median"] is None
    assert found["shrink"]["closed_fraction"] is None and not any(r["closed_fraction"] for r in found["shrink"]["records"])
    assert "agree within the noise" in split["summary"] and split["rms_rad"]["simulated"] < 1.2 * split["rms_rad"]["noise_floor"]


@pytest.fixture(scope="module")
def reduced():
    return reduce_unit(planted(known=smooth_reducer(), offset_nm=OFFSET_NM))


def common_noise(unit):
    channels = [ChannelRecord(r.time_s, r.torque_nm, r.angle_rad, find_segments(r.time_s, r.torque_nm)) for r in unit.records]
    return estimate_common_noise(channels)[0]


def test_noise_free_records_are_read_with_the_bench_s_noise(reduced):
    """As much is estimated as of records of the same reducer that have just that noise, over a dozen draws of each."""
    given, bench, seeds = simulated(hertz=60.0), reduced.noise[0], range(12)
    rough = reduce_unit(given)
    drawn = [through_bench(given, rough, reduced, np.random.default_rng(seed)) for seed in seeds]
    same = BenchNoise(bench.white_rad, bench.correlated_rad, bench.correlation_time_s, bench.torque_nm)
    kinds = [read for read, _ in drawn], [planted(seed, known=smooth_reducer(), noise=same) for seed in seeds]
    found, wanted = ([common_noise(unit) for unit in units] for units in kinds)
    for name, within in (("white_rad", 0.05), ("correlated_rad", 0.15), ("torque_nm", 0.03)):
        ours, theirs = (np.mean([getattr(n, name) for n in kind]) for kind in (found, wanted))
        assert ours == pytest.approx(theirs, rel=within), name
    added = drawn[0][1]
    assert added.white_rad <= bench.white_rad and np.isfinite([*vars(added).values()]).all()
    given = simulated()
    noisy = replace(given, records=tuple(replace(r, angle_rad=r.angle_rad + _noise(r, 1e-3)) for r in given.records))
    assert through_bench(noisy, reduce_unit(noisy), reduced, np.random.default_rng(0))[1].correlated_rad == 0.0


def _noise(record, sd):
    return sd * np.random.default_rng(5).standard_normal(record.time_s.size)


def test_torques_beyond_the_simulated_ones_are_refused(reduced):
    with pytest.raises(BadInput, match="torques up to 0.1.*found 0.08"):
        diagnose_simulated(reduced.unit, simulated(loops=((0.08, 0.05),)))


def test_noise_of_the_torque_reading_reaches_no_further(reduced):
    """The same paths, the unit's torque read with noise of 2 % (planted fault: the largest sample is compared)."""
    rng, unit = np.random.default_rng(0), reduced.unit
    noisy = (replace(r, torque_nm=r.torque_nm + 2e-3 * rng.standard_normal(r.torque_nm.size)) for r in unit.records)
    noisy = replace(unit, records=tuple(noisy))
    assert max(np.abs(r.torque_nm).max() for r in noisy.records) > 1.03 * 0.1
    require_reach(simulated(), noisy)


def test_lacking_is_what_the_unit_alone_has():
    found = lacking({"a+b": 0.6, "unknown": 0.3, "none": 0.1}, {"b": 0.5, "unknown": 0.5})
    assert found == pytest.approx({"a": 0.3, "a+b": 0.3, "unknown": 0.3, "none": 0.1})
    assert lacking({"a": 1.0}, {"a": 0.9, "none": 0.1}) == pytest.approx({"none": 0.9, "a": 0.1, "unknown": 0.0})


def test_the_sentence_abstains_with_the_result():
    shares = {part: {"median": 0.5} for part in ("retuning", "effect", "left")}
    assert "creep a further 50 %" in summary(shares, True, 1.0, "", ("creep",))
    assert "no effect is missing" in summary(shares, True, 1.0, "", ())
    assert "Inconclusive" in summary(shares, True, 1.0, "not converged", ("creep",))
    assert "agree within the noise" in summary(shares, False, 0.2, "", ())
    assert "do not tell for sure" in summary(shares, False, 0.77, "", ())
