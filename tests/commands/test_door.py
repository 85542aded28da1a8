"""What fit and the other verbs think of a unit is what check says of it."""

import numpy as np
import pytest
from conftest import answer, ramps

from backdrive_bayes.commands.door import judged
from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.check import check_unit
from backdrive_bayes.records.record import Record, Unit


def dropped(share):
    """A unit of whose angles that share are zeros far off."""
    time, torque = ramps(noise=0.002)
    angle = answer(torque) + 1.0
    angle[np.random.default_rng(1).choice(np.arange(5, len(time), 7), int(share * len(time)), replace=False)] = 0.0
    return Unit("u", 1.0, (Record("r.csv", time, torque, angle),))


def test_too_many_isolated_samples_stop_a_fit_as_they_fail_a_check():
    unit = dropped(0.03)
    assert not check_unit(unit)["may_infer"]
    with pytest.raises(BadInput, match="isolated angle samples"):
        judged(unit)
    assert judged(unit, force=True).forced


def test_few_isolated_samples_are_said_once_and_left_out():
    unit = dropped(0.01)
    ready = judged(unit)
    assert ready.checked == check_unit(unit) and not ready.forced
    assert sum("isolated" in line for line in ready.lines) == 1
    (record,) = ready.unit.records
    assert len(record.time_s) == len(unit.records[0].time_s) - 10
    assert record.notes == ("10 isolated samples far from the neighbours left out",)


def test_a_unit_made_in_memory_is_refused_where_a_reader_would_refuse_it():
    time, torque = ramps(noise=0.002)
    with pytest.raises(BadInput, match="24 samples or more"):
        judged(Unit("u", 1.0, (Record("r.csv", time[:20], torque[:20], answer(torque[:20])),)))
    with pytest.raises(BadInput, match="angle that answers the torque"):
        judged(Unit("u", 1.0, (Record("r.csv", time, torque, np.full(time.size, 0.1)),)), force=True)


def test_what_is_overruled_of_a_simulator_is_said_of_the_result():
    """The gap to a simulator of unfit data was told as if nothing had been overruled."""
    ready = judged(dropped(0.01))
    simulator = judged(dropped(0.03), force=True)
    both = ready.beside(simulator)
    assert both.forced and not ready.forced and ready.beside(None) is ready
    told = [row for row in both.checked["findings"] if row["record"] == "u: r.csv"]
    assert [row["text"] for row in told] == [row["text"] for row in simulator.checked["findings"] if row["record"]]
