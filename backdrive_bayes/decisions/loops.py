"""Loops by rate and amplitude: which were measured, which can be predicted, and why others cannot."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.indicators.same_loop import same_amplitude, same_rate
from backdrive_bayes.number_text import plain

SMALLEST = 0.05
"""Smallest amplitude that is predicted, as a share of the measured one."""
ROUNDING = 1e-9
"""Share by which the smallest amplitude, asked for as a share of the largest, may miss it."""


class NotAvailable(Exception):
    """A loop or indicator that neither was measured nor can be predicted; its text says why."""


@dataclass(frozen=True)
class Loop:
    """A settled loop by rate [N·m/s] and amplitude [N·m], and the numbers of the records that tell of it.

    ``predicted`` is true where the amplitude lies within a larger measured one.
    """

    rate: float
    amplitude: float
    records: tuple[int, ...]
    predicted: bool = False

    @property
    def text(self) -> str:
        """In words."""
        return f"{plain(self.rate)} N·m/s, ±{plain(self.amplitude)} N·m{' (predicted)' if self.predicted else ''}"


def measured_loops(rates, amplitudes) -> tuple[Loop, ...]:
    """The loops of records with those rates and amplitudes, (records,) each, in rising order; repeats are one loop."""
    rates, amplitudes = np.asarray(rates, float), np.asarray(amplitudes, float)
    groups: list[list[int]] = []
    for i in np.lexsort((amplitudes, rates)):
        group = next((g for g in groups if _alike(rates, amplitudes, g[0], i)), None)
        if group is None:
            groups.append([int(i)])
        else:
            group.append(int(i))
    return tuple(Loop(float(rates[g].mean()), float(amplitudes[g].mean()), tuple(g)) for g in groups)


def _alike(rates, amplitudes, i, j):
    return same_rate(rates[i], rates[j]) and same_amplitude(amplitudes[i], amplitudes[j])


def largest_loops(measured) -> list[Loop]:
    """The loop of largest amplitude at every rate."""
    best: list[Loop] = []
    for loop in measured:
        alike = [i for i, b in enumerate(best) if same_rate(loop.rate, b.rate)]
        if not alike:
            best.append(loop)
        elif loop.amplitude > best[alike[0]].amplitude:
            best[alike[0]] = loop
    return best


def find_loop(measured, rate: float, amplitude: float | None = None) -> Loop:
    """The loop of that rate and amplitude (the largest measured one by default), predicted where it must be.

    A measured loop counts where its amplitude is about the asked one, at which it is then evaluated. Raises NotAvailable for a
    rate that was not measured, and for an amplitude beyond the measured one or far below it.
    """
    at_rate = [x for x in measured if same_rate(x.rate, rate)]
    if not at_rate:
        shown = ", ".join(f"{plain(x.rate)}" for x in largest_loops(measured))
        raise NotAvailable(f"rate {plain(rate)} N·m/s was not measured (only {shown} N·m/s) and rates cannot be predicted")
    top = max(at_rate, key=lambda x: x.amplitude)
    if amplitude is None:
        return top
    exact = [x for x in at_rate if same_amplitude(x.amplitude, amplitude)]
    if exact:
        return replace(min(exact, key=lambda x: abs(x.amplitude - amplitude)), amplitude=float(amplitude))
    if amplitude > top.amplitude:
        most = f"{plain(top.amplitude)} N·m at {plain(top.rate)} N·m/s"
        raise NotAvailable(f"amplitude {plain(amplitude)} N·m lies beyond the measured {most}")
    lowest = top.amplitude * SMALLEST
    if amplitude < lowest * (1 - ROUNDING):
        raise NotAvailable(f"amplitude {plain(amplitude)} N·m is below {plain(lowest)} N·m, the smallest that is predicted")
    return Loop(top.rate, float(amplitude), top.records, True)
