"""What is to be known of every hypothesis about one mode, in the contrasts that the class cannot hold."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from backdrive_bayes.engine.contrasts import SIZES, Contrasts, averaged, effect_groups, make_contrasts, nothing_barred
from backdrive_bayes.engine.design import Group, path_group
from backdrive_bayes.engine.jumps import Jumps
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.engine.periodic import AMPLITUDE, coarse_bank, fine_bank, log_prior, phases, turns_back, wave_group
from backdrive_bayes.engine.traces import trace_levels, usual_level, wave_trace
from backdrive_bayes.engine.unlisted import bump_groups, module_group, ratchet_group, step_group, uneven_group
from backdrive_bayes.mechanics.effect import Effect, TangentEffect
from backdrive_bayes.mechanics.registry import UNKNOWN, all_effects

ENCODER, STICK_SLIP, UNEXPLAINED = "encoder_error", "stick_slip", "unknown"
WAVES = "waves"
MODULE_CHANGE = 0.05
"""Usual change of a module in shares of itself."""
TOGETHER = (UNEXPLAINED, "module_change", "uneven", "ratchet", "shape")
"""What something unlisted may be, of many weights together: a process on each leg, a module that changes in time, legs of two
directions that part, a set that grows with the way, a shape in the angle."""
ALONE = ("step", "bump")
"""The same of one weight among many: a step in time, a bump in the angle."""
KINDS = len(TOGETHER) + len(ALONE)
"""Number of kinds of what is unlisted in the contrasts; a disturbance in the samples is one more, and each is as likely."""


@dataclass(frozen=True, eq=False)
class Row:
    """Log marginal likelihood of a hypothesis about a mode, of which ``leaps`` is what the samples say of teeth, the variance in
    noise units that it leaves (none beside something unlisted), and the frequency of its wave, if it has one."""

    log_marginal: float
    leaps: float
    left: float | None
    frequency: float | None


@dataclass(frozen=True, eq=False)
class _Wave:
    """The number of the coarse bank's wave that it is about, its columns among contrasts and their usual sizes, its frequency,
    what it costs not to know that, and the log prior probability of it."""

    at: int
    columns: np.ndarray
    sizes: np.ndarray
    frequency: float
    price: float
    log_prior: float


class Table:
    """Scales of the contrasts' weights by hypothesis, and their log marginal likelihoods.

    The many weights of a process on each leg are integrated once for each of its levels, as those of the class are.
    """

    def __init__(self, linear: Linear, jumps: Jumps):
        self.phases = phases(linear)
        self.coarse = coarse_bank(self.phases)
        self.linear = linear
        makers = (module_group, uneven_group, ratchet_group, step_group)
        unlisted = (path_group(linear.reduced, UNKNOWN), *(make(linear) for make in makers), *bump_groups(linear))
        self.contrasts = make_contrasts(linear, (*effect_groups(linear), *unlisted, self._waves(self.coarse)))
        apart = [self.contrasts.names.index(n) for n in (UNEXPLAINED, WAVES)]
        # Beside the process on each leg; waves, of the coarse bank or about one of them, follow.
        self.index = self.contrasts.index[~np.isin(self.contrasts.index, apart)]
        effects, context = {e.name: e for e in linear.effects} | {UNEXPLAINED: UNKNOWN}, linear.reduced.context
        self.names = self.contrasts.names
        traces = trace_levels(linear.reduced, linear.design.joined(unlisted[0]), effects.values())
        self.trace = np.array([traces.get(n, 0.0) for n in self.names])
        usual = {e.name: usual_level(e, context, traces.get(e.name, 0.0)) for e in linear.effects}
        usual |= {UNEXPLAINED: UNKNOWN.present(context), "module_change": MODULE_CHANGE}
        usual |= {"uneven": AMPLITUDE, "ratchet": AMPLITUDE, "shape": AMPLITUDE}
        self.present = np.array([usual.get(n, 0.0) for n in self.names])
        self.known = np.array([n in effects and effects[n].known for n in self.names])
        # What these records cannot tell (one rate tells nothing of its law) has no column and is as likely as none.
        self.forms = {n: _forms(terms) for n, terms in all_effects().items()}
        one_way = [n for n, e in effects.items() if isinstance(e, TangentEffect) and e.one_way and n in self.names]
        self.one_way = {n: np.flatnonzero(self.index == self.names.index(n)).tolist() for n in one_way}
        self.jumps = jumps
        self.trace_wave = wave_trace(linear) / AMPLITUDE
        self.on: dict[tuple[str, ...], set[str]] = {}
        self.frequency: dict[tuple[str, ...], float] = {}
        self.price: dict[tuple[str, ...], float] = {}
        self.singles: dict[tuple[str, ...], float] = {}
        self._clear: dict[frozenset[str], _Wave] = {}
        self._near: dict[int, Contrasts] = {}
        self._integrated: dict[float, Contrasts] = {}
        self._nearby: dict[tuple[int, float], Contrasts] = {}

    def _waves(self, bank) -> Group:
        return replace(wave_group(self.linear, bank.waves), name=WAVES)

    def _unlisted(self, on, size: float = 1.0) -> float:
        """Standard deviation of the process on each leg where the terms ``on`` are present."""
        at = self.names.index(UNEXPLAINED)
        return float(size * self.present[at] if UNEXPLAINED in on else self.trace[at])

    def _beside(self, level: float) -> Contrasts:
        """The other contrasts beside the process on each leg at a level."""
        if level not in self._integrated:
            self._integrated[level] = self.contrasts.beside(UNEXPLAINED, level)
        return self._integrated[level]

    def scale(self, on, size: float = 1.0) -> np.ndarray:
        """Standard deviations of all other weights where the terms ``on`` are present at ``size`` times their usual level, or the
        known one."""
        level = np.where(np.isin(self.names, list(on)), np.where(self.known, 1.0, size) * self.present, self.trace)
        return level[self.index]

    def weigh(self, hypothesis, lift: float) -> Row:
        """What is to be known of a set of names; ``lift`` makes log marginal likelihoods comparable between modes."""
        leaps = self.jumps.log_factor if STICK_SLIP in hypothesis else 0.0
        log = self.log_marginal(hypothesis) + lift + leaps
        return Row(log, leaps, None if UNEXPLAINED in hypothesis else self.left(hypothesis), self.frequency.get(hypothesis))

    def log_marginal(self, hypothesis) -> float:
        """Log marginal likelihood of the contrasts under a set of names, averaged over forms of the effects,
        sizes, frequencies and kinds of what is unlisted. Teeth that were found scatter the block means as a process on each leg,
        or no more than a trace of it does."""
        scattered = (set(), {UNEXPLAINED}) if STICK_SLIP in hypothesis and self.jumps.log_factor > 0.0 else (set(),)
        chosen = itertools.product(*(self.forms.get(n, [set()]) for n in hypothesis), scattered)
        forms = [set().union(*form) for form in chosen]
        found = [self._of_kinds(hypothesis, form) for form in forms]
        # Beside something unlisted, the first kind is the one whose columns a fit takes.
        on = forms[int(np.argmax(found))] | {UNEXPLAINED}.intersection(hypothesis)
        self.on[hypothesis] = on
        if len(hypothesis) == 1 and UNEXPLAINED not in hypothesis:
            self.singles[hypothesis] = max(f for f, form in zip(found, forms, strict=True) if UNEXPLAINED not in form)
        if ENCODER in hypothesis:
            wave = self._clearest(on)
            self.frequency[hypothesis], self.price[hypothesis] = wave.frequency, wave.price
        return float(log_mean(found))

    def _of_kinds(self, hypothesis, on) -> float:
        """Log marginal likelihood beside the terms ``on``, averaged over kinds of what is unlisted if that is of the set."""
        if UNEXPLAINED not in hypothesis:
            return self._of_terms(hypothesis, on)
        kinds = [self._of_terms(hypothesis, on | {k}) for k in TOGETHER]
        if ENCODER not in hypothesis:
            kinds += [self._with_one(name, on) for name in ALONE]
        return float(log_mean(kinds))

    def _of_terms(self, hypothesis, on) -> float:
        if ENCODER in hypothesis:
            wave = self._clearest(on)
            return self._averaged(on, wave.at, wave.columns, wave.sizes) - wave.price
        # Every bench has a trace of a wave, most likely where a wave is clearest beside one effect.
        beside = max((h for h in self.singles if set(h) <= set(hypothesis)), key=self.singles.__getitem__, default=())
        wave = self._clearest(self.on.get(beside, set()) - {UNEXPLAINED})
        without, with_trace = self._sized(on, wave.at, wave.columns, (0.0, self.trace_wave) * wave.sizes[:, None])
        return float(np.logaddexp(without, with_trace + wave.log_prior))

    def _sized(self, on, at, columns, sizes) -> list[float]:
        """Log marginal likelihoods beside the terms ``on``, averaged over their size, for each of ``sizes`` (width, n) of further
        ``columns``, of the waves about one of the coarse bank where ``at`` says which."""
        found, barred = [], nothing_barred if at is None else partial(turns_back, frequency=self.coarse.members[at])
        for size in SIZES if on else (1.0,):
            contrasts = self._about(at, self._unlisted(on, size))
            scale, one_way = self.scale(on, size), self._one_way(on)
            found.append(contrasts.log_marginals(scale, columns, np.transpose(sizes), one_way, barred))
        return [averaged(log) for log in np.transpose(found)] if on else found[0].tolist()

    def _one_way(self, on) -> list[int]:
        """Numbers of the weights that cannot be negative."""
        return [w for n in on for w in self.one_way.get(n, ())]

    def left(self, hypothesis) -> float:
        """Variance of the contrasts in noise units that a hypothesis leaves."""
        on, at = self.on[hypothesis], None
        if hypothesis in self.frequency:
            at = int(np.argmin(np.abs(self.coarse.members - self.frequency[hypothesis])))
        contrasts = self._about(at, self._unlisted(on, SIZES[-1]))
        scale = self.scale(on, SIZES[-1])
        if at is not None:
            fine = fine_bank(self.coarse.members[at], self.phases)
            member = int(np.argmin(np.abs(fine.members - self.frequency[hypothesis])))
            scale = np.r_[scale, np.zeros(contrasts.index.size - scale.size)]
            scale[self.index.size + fine.columns[member]] = SIZES[-1] * fine.sizes[member]
        return contrasts.chi2(scale)

    def _about(self, at: int | None, level: float) -> Contrasts:
        """Contrasts beside the process on each leg at a level, with the waves closely about one of the coarse bank, or none."""
        if at is None:
            return self._beside(level)
        if at not in self._near:
            self._near[at] = make_contrasts(self.linear, (self._waves(fine_bank(self.coarse.members[at], self.phases)),))
        if (at, level) not in self._nearby:
            self._nearby[at, level] = self._beside(level).joined(self.index.size, self._near[at])
        return self._nearby[at, level]

    def _with_one(self, name, on) -> float:
        """Log marginal likelihood averaged over which one of a group's weights is there."""
        contrasts = self._beside(self._unlisted(on))
        columns = np.flatnonzero(self.index == self.names.index(name))[:, None]
        gains = contrasts.gains(self.scale(on), columns, np.full(columns.shape, AMPLITUDE))
        at = int(np.argmax(gains))
        price = gains[at] - log_mean(gains)
        return self._averaged(on, None, columns[at], np.full(1, AMPLITUDE)) - price

    def _clearest(self, on) -> _Wave:
        """The clearest wave beside the terms ``on``, and what it costs not to know its frequency."""
        key, level, scale = frozenset(on), self._unlisted(on), self.scale(on)
        if key in self._clear:
            return self._clear[key]
        coarse, barred = self.coarse, partial(turns_back, frequency=self.coarse.members)
        gains = self._beside(level).gains(scale, self.index.size + coarse.columns, coarse.sizes, barred)
        weight, fine = log_prior(self.coarse.members), {}
        for at in _alike(gains + weight, self.coarse.members):
            near, bank = self._about(at, level), fine_bank(self.coarse.members[at], self.phases)
            columns = self.index.size + bank.columns
            closely = near.gains(scale, columns, bank.sizes, partial(turns_back, frequency=bank.members))
            gains[at], fine[at] = log_mean(closely), (bank, columns, closely)
        at = max(fine, key=lambda at: gains[at] + weight[at])
        bank, columns, closely = fine[at]
        member = int(np.argmax(closely))
        price = closely[member] - logsumexp(gains + weight)
        chance = weight[at] - np.log(closely.size)
        wave = _Wave(at, columns[member], bank.sizes[member], float(bank.members[member]), float(price), float(chance))
        return self._clear.setdefault(key, wave)

    def _averaged(self, on, at, columns, sizes) -> float:
        """Log marginal likelihood beside the terms ``on`` averaged over their size and over that of further columns."""
        return averaged(self._sized(on, at, columns, SIZES * sizes[..., None]))


def _forms(terms: Iterable[Effect]) -> list[set[str]]:
    """Names of the terms that act together, and of each that acts instead of them."""
    together = {e.name for e in terms if not e.instead}
    return [*([together] if together else []), *({e.name} for e in terms if e.instead)]


def _alike(gains, frequencies) -> list[int]:
    """The best member and those with at least half of its gain that it may be a harmonic of, or they of it."""
    best = int(np.argmax(gains))
    found = {best}
    for ratio in (1 / 3, 1 / 2, 2.0, 3.0):
        at = int(np.argmin(np.abs(frequencies - ratio * frequencies[best])))
        near = range(max(at - 1, 0), min(at + 2, gains.size))
        found |= {max(near, key=gains.__getitem__)} if max(gains[k] for k in near) > 0.5 * gains[best] else set()
    return sorted(found)
