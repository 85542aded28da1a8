"""A fleet's run: every unit once, whatever happens to workers, and where it stands."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.store import SET_ASIDE, CannotKeep, write_result
from backdrive_bayes.fleet.task import Done, Job, carry_out
from backdrive_bayes.fleet.units import FleetUnit


@dataclass
class Tally:
    """Where a run stands: units by what became of them, and the seconds of those that were worked on."""

    units: int
    began: float = field(default_factory=time.monotonic)
    counts: Counter = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)

    def add(self, done: Done) -> None:
        """Count a unit."""
        self.counts[done.status] += 1
        if done.status != "kept":
            self.seconds.append(done.seconds)

    @property
    def finished(self) -> int:
        """Units that have a result."""
        return self.counts.total()

    @property
    def share(self) -> float:
        """Share of the work that is done; units that had their result already are no work."""
        work = self.units - self.counts["kept"]
        return len(self.seconds) / work if work else 1.0

    @property
    def per_minute(self) -> float:
        """Units worked on a minute of this run."""
        return 60.0 * len(self.seconds) / max(time.monotonic() - self.began, 1e-9)

    def line(self) -> str:
        """The state in words: how many, what failed, how fast."""
        counts = [f"{n} {status.replace('_', ' ')}" for status, n in sorted(self.counts.items()) if status != "done"]
        told = [f"{self.finished} of {self.units} units", *counts]
        if self.seconds:
            told.append(f"{self.per_minute:.3g} units/min")
        return ", ".join(told)


def run_fleet(job: Job, units: list[FleetUnit], client, note: Callable[[str, float], None] = lambda text, share: None) -> Tally:
    """Carry out a job for every unit on a cluster and return the tally; results lie in ``job.out``, which the caller has locked.

    Raises BadInput where results cannot be written or the scheduler goes away; what was kept until then stays.
    """
    tally, named = Tally(len(units)), {unit.key: unit for unit in units}

    def finished(key, done, error):
        if error is not None:
            if not (deaths := cluster.deaths(error)):
                raise _named(error)
            text = f"killed its worker {deaths} times"
            write_result(job.out, named[key], job.stamp(named[key]) | {"files_sha256": None}, SET_ASIDE, text, [])
            done = Done(SET_ASIDE, text, 0.0)
        tally.add(done)
        note(tally.line(), tally.share)

    try:
        cluster.run_all(client, carry_out, {key: (job, unit) for key, unit in named.items()}, finished)
    except CannotKeep as error:
        raise BadInput(job.out, "a folder that takes every result", f"{error}; {_kept(tally)}") from None
    except ConnectionError as error:
        raise BadInput("--scheduler", "a scheduler that stays", f"{error}; {_kept(tally)}") from None
    return tally


def _named(error: Exception) -> Exception:
    if isinstance(error, ImportError):
        return BadInput("--scheduler", "a scheduler and workers with this package and its extra 'fleet'", str(error))
    return error


def _kept(tally: Tally) -> str:
    return f"{tally.finished} of {tally.units} units are kept and the same command goes on from there"
