"""All hypotheses of one unit: the baseline, every effect, and the pairs that earn it, fitted and weighed.

Pairs are searched exhaustively in a linear approximation (what both effects together could take out of the residual); the best
of them are then fitted in full.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from backdrive_bayes.gap.evidence import log_evidence
from backdrive_bayes.gap.hypotheses import Fitted, Flexible, fit_none, fit_screened, polished, rebased, screen, simplified
from backdrive_bayes.gap.setting import MISFIT_LENGTH, Setting
from backdrive_bayes.model.registry import BASELINE, candidates_beside

REFERENCE = ("misfit", MISFIT_LENGTH, 0.5)
"""Misfit under which modes are searched."""
MISFIT_LEVELS = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Standard deviations of the misfit along the loop, in those of the noise, under which hypotheses are weighed."""
UNKNOWN_KINDS = (("loop", 0.02), ("own_loop", 0.06), ("time_smooth", 0.1), ("time_rough", 0.05))
UNKNOWN_LEVELS = (1.0, 3.0, 10.0, 40.0)
DOUBTED = 4
"""Best hypotheses beside which unexplained structure is looked for, the baseline being one more."""
PAIRS_FITTED = 4
COMPLETED = 3
"""Best hypotheses without a module that every reducer has that are tried with it as well."""
POLISHED = 3
SEARCHES = 5
SETTLED = 6.0
"""Log posterior by which a fresh search may find a better mode before another is due: what shifts log odds by about one."""
WORTHWHILE = 4.0
"""Log-likelihood by which a pair must beat its better half in the linear search to be fitted."""


@dataclass(frozen=True, eq=False)
class Weighed:
    """A fitted hypothesis with its log evidence under each misfit level and formula error, shape (levels, errors)."""

    fitted: Fitted
    log_evidence: np.ndarray

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects."""
        return self.fitted.effects

    @property
    def height(self) -> float:
        """Log evidence over the formula errors under the misfit that suits it best, by which hypotheses are ranked."""
        return float(logsumexp(self.log_evidence, axis=1).max())


@dataclass(frozen=True, eq=False)
class Candidates:
    """Every hypothesis weighed.

    ``unexplained`` holds the log evidences (kinds, levels, errors) of structure beside the baseline and the best hypotheses.
    ``regained`` is the log posterior by which the last fresh search still beat the mode of ``sought``, the best one then.
    """

    weighed: tuple[Weighed, ...]
    unexplained: dict[tuple[str, ...], np.ndarray]
    regained: float = 0.0
    sought: tuple[str, ...] = ()

    @property
    def best(self) -> Weighed:
        """The hypothesis of the highest evidence under any misfit."""
        return max(self.weighed, key=lambda w: w.height)

    def without(self, effect: str) -> Candidates:
        """The same less all hypotheses that hold an effect."""
        unexplained = {effects: values for effects, values in self.unexplained.items() if effect not in effects}
        return replace(self, weighed=tuple(w for w in self.weighed if effect not in w.effects), unexplained=unexplained)

    @property
    def none(self) -> Weighed:
        """The baseline alone."""
        return self.weighed[0]


def weigh_all(setting: Setting, rng, note=lambda text: None, allowed=None) -> Candidates:
    """Fit and weigh the baseline, single effects and pairs; ``allowed`` names the effects of the library (default: all)."""
    reference = setting.whitening(REFERENCE)
    none = fit_none(setting, reference)
    names = [n for n in candidates_beside(setting.problem.model.names) if allowed is None or n in allowed]
    screens, singles = {}, {}
    for name in names:
        note(f"effect {name}")
        screens[name] = screen(setting, none, name, reference, rng)
        singles[name] = fit_screened(screens[name], (name,), rng)
    weighed = [_weigh(setting, f) for f in (none, *singles.values())]
    alone = {w.effects[0]: w.height for w in weighed[1:]}
    for pair in _promising_pairs(none, singles, screens, reference):
        note(f"effects {' + '.join(pair)}")
        known, other = sorted(pair, key=lambda n: -alone[n])
        found = screen(setting, singles[known], other, reference, rng, 128)
        weighed.append(_weigh(setting, fit_screened(found, pair, rng)))
    for module in (n for n in names if n in BASELINE):
        note(f"{module} beside the best without it")
        weighed = _completed(setting, weighed, module, rng)
    weighed, *search = _settle(setting, _polish_best(setting, weighed, rng), rng)
    note("what nothing explains")
    doubted = [weighed[0], *sorted(weighed[1:], key=lambda w: -w.height)[:DOUBTED]]
    return Candidates(tuple(weighed), {w.effects: _unexplained(setting, w.fitted) for w in doubted}, *search)


def _completed(setting, weighed, module, rng):
    """The same, the best hypotheses without a module that every reducer has also with it."""
    reference, table = setting.whitening(REFERENCE), {frozenset(w.effects): w for w in weighed}
    without = sorted((w for w in weighed if module not in w.effects), key=lambda w: -w.height)
    for w in without[:COMPLETED]:
        effects = (*w.effects, module)
        if frozenset(effects) not in table:
            found = screen(setting, w.fitted, module, reference, rng, 128)
            weighed = [*weighed, _weigh(setting, fit_screened(found, effects, rng))]
    return weighed


def _polish_best(setting, weighed, rng):
    """The few most probable hypotheses, and the baseline, climbed to the end; what they hold begun anew from their modes."""
    table = {w.effects: w for w in weighed}
    order = sorted(table, key=lambda e: -table[e].height)
    # A module that the baseline was left without is hard to find from there.
    held_back = [effects for effects in table if effects and set(effects) <= set(BASELINE)]
    for effects in {(): None, **dict.fromkeys([*held_back, *order[:POLISHED]])}:
        table[effects] = _better(table[effects], _weigh(setting, polished(table[effects].fitted, rng)))
    best = max(table.values(), key=lambda w: w.height)
    done = {(), best.effects, *held_back, *order[:POLISHED]}
    for effects in (e for e in table if e not in done):
        table[effects] = _better(table[effects], _weigh(setting, rebased(table[effects].fitted, best.fitted)))
    best = max(table.values(), key=lambda w: w.height)
    parts = [effects for effects in table if len(effects) < len(best.effects) and set(effects) <= set(best.effects)]
    for effects in parts:
        simpler = polished(simplified(setting, best.fitted, effects, setting.whitening(REFERENCE)), rng)
        table[effects] = _better(table[effects], _weigh(setting, simpler))
    return [table[w.effects] for w in weighed]


def _settle(setting, weighed, rng):
    """The best hypothesis searched anew until that finds nothing that could matter; what the last search gained, and of which.

    What a search still gains might be gained for the next best as well: half the lead is enough. Where the best one gained, the
    next best are searched anew too.
    """
    table, searched = {w.effects: w for w in weighed}, False
    for _ in range(SEARCHES):
        best, *others = sorted(table.values(), key=lambda w: -w.height)
        lead = best.height - others[0].height if others else 0.0
        again = polished(best.fitted, rng)
        before, after = best.fitted.problem.log_posterior(np.array([best.fitted.z, again.z]))
        table[best.effects] = _better(best, _weigh(setting, again))
        if after <= before + max(SETTLED, 0.5 * lead):
            break
        searched = True
    sought = best.effects
    if searched:
        best, *others = sorted(table.values(), key=lambda w: -w.height)
        for other in (w for w in others[:POLISHED] if w.effects):
            for again in (rebased(other.fitted, best.fitted), polished(other.fitted, rng)):
                table[other.effects] = _better(table[other.effects], _weigh(setting, again))
    return [table[w.effects] for w in weighed], max(float(after - before), 0.0), sought


def _better(one, other):
    return max(one, other, key=lambda w: w.height)


def _weigh(setting, fitted):
    return Weighed(fitted, np.array([log_evidence(setting, fitted, ("misfit", MISFIT_LENGTH, level)) for level in MISFIT_LEVELS]))


def _unexplained(setting, fitted):
    small = ("misfit", MISFIT_LENGTH, 0.3)
    return np.array([
        [log_evidence(setting, fitted, small, (kind, length, level)) for level in UNKNOWN_LEVELS]
        for kind, length in UNKNOWN_KINDS
    ])  # fmt: skip


def _promising_pairs(none, singles, screens, whitening):
    """The pairs that together could take the most out of the baseline's residual, in linear approximation."""
    flexible = Flexible.of(none, whitening)
    total = flexible.residual @ flexible.residual
    columns = {}
    for name, fitted in singles.items():
        change = whitening.matrix @ (none.residual - fitted.residual)
        columns[name] = np.concatenate([flexible.left(change)[None], screens[name].change])
    alone = {name: total - _left(flexible.residual, c) for name, c in columns.items()}
    gains = {
        pair: total - _left(flexible.residual, np.concatenate([columns[n] for n in pair])) - max(alone[n] for n in pair)
        for pair in itertools.combinations(singles, 2)
    }
    # Each further column fits noise worth one unit of chi-square.
    reach = {pair: 0.5 * (gain - len(columns[pair[0]])) for pair, gain in gains.items()}
    combined = {pair: 0.5 * gains[pair] + 0.5 * max(alone[n] for n in pair) for pair in gains}
    good = [pair for pair in sorted(combined, key=lambda p: -combined[p]) if reach[pair] > WORTHWHILE]
    return good[:PAIRS_FITTED]


def _left(residual, columns):
    """Chi-square left by a ridge fit of unit prior deviations around the fitted amplitudes' size."""
    gram = columns @ columns.T
    load = columns @ residual
    return residual @ residual - load @ np.linalg.solve(gram + np.eye(len(load)), load)
