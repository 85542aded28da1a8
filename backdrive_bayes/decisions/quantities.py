"""A unit's quantities as a claim asks for them: arrays (draws, series), units paired at random."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.expression import Wrong
from backdrive_bayes.decisions.loops import Loop, NotAvailable
from backdrive_bayes.indicators.draws import CORE, MOVED, POSITIONS, RESPONSES
from backdrive_bayes.number_text import plain

PAIRINGS = 8
_CLASSIC = ("r_squared", "rms_rad", "rms_high_load_over_rest")


class Quantities:
    """Looks quantities up for claims over ``units`` (evidence by letter)."""

    def __init__(self, units: dict[str, Evidence], rng):
        self.units = units
        self.fewest = min(e.kept.size for e in units.values())
        # Each unit's kept draws in the same number of random orders: units are independent, a unit's quantities are not.
        self.order = {
            u: np.concatenate([rng.permutation(e.kept.size)[:self.fewest] for _ in range(PAIRINGS)]) for u, e in units.items()
        }
        self.draws = self.fewest * PAIRINGS

    def within(self, claim, rates):
        """The coordinate of the claim's series (None without one), and the function that looks quantities up for it."""
        first = self.units[min(claim.holds.units)]
        if claim.along == "rate":
            along = np.asarray(rates)
        elif claim.along == "amplitude":
            along = self._positions(first, first.loop(rates[0], claim.amplitude), claim)
        elif claim.along == "torque":
            along = _curve_torques(first, first.loop(rates[0], claim.amplitude))
            along = along[(np.abs(along) >= claim.low) & (np.abs(along) <= claim.high)]
        else:
            along = None

        def look_up(letter, method, arguments, keywords):
            return self._look_up(letter, method, arguments, keywords, claim, rates, along)

        return along, look_up

    def _positions(self, evidence, loop: Loop, claim):
        t = loop.amplitude * np.arange(1, POSITIONS + 1) / POSITIONS
        chosen = t[(t >= claim.low * (1 - 1e-6)) & (t <= claim.high * (1 + 1e-6))]
        if chosen.size < 2:
            raise NotAvailable(f"fewer than two amplitudes between {claim.low:g} and {claim.high:g} N·m")
        return chosen

    def _look_up(self, letter, method, arguments, keywords, claim, rates, along):
        evidence, order = self.units[letter], self.order[letter]
        if method == "parameter":
            return _named(evidence.parameters, arguments, "parameter")[evidence.kept][order][:, None]
        if method == "sensitivity":
            return self._sensitivity(evidence, arguments)
        if method == "least_squares":
            return np.full((self.draws, 1), _classic(evidence, evidence.loop(rates[0]), arguments))
        if method == "effect":
            return np.full((self.draws, 1), _effect(evidence, arguments))
        if method == "amplitude_Nm":
            fixed = np.array([evidence.loop(rates[0], claim.amplitude).amplitude])
            return np.tile(along if claim.along == "amplitude" else fixed, (self.draws, 1))
        if method == "width_rad":
            return self._width(evidence, order, evidence.loop(rates[0], claim.amplitude), keywords, along, claim)
        if claim.along in ("rate", "amplitude") and claim.along not in keywords:
            return self._series(evidence, order, method, claim, rates, along, keywords)
        loop = evidence.loop(keywords.get("rate", rates[0]), keywords.get("amplitude", claim.amplitude))
        return evidence.values(method, loop, kept=True)[order][:, None]

    def _series(self, evidence, order, name, claim, rates, along, keywords):
        if claim.along == "rate":
            loops = [evidence.loop(r, keywords.get("amplitude", claim.amplitude)) for r in rates]
            return np.stack([evidence.values(name, x, kept=True)[order] for x in loops], axis=1)
        if name not in CORE:
            raise NotAvailable(f"{name} is not known along the amplitude")
        # All amplitudes from one record, so that steps between records are no part of the series.
        top = evidence.loop(keywords.get("rate", rates[0]))
        loops = [Loop(top.rate, evidence.loop(top.rate, float(t)).amplitude, top.records, True) for t in along]
        return np.stack([evidence.values(name, x)[order] for x in loops], axis=1)

    def _width(self, evidence, order, loop: Loop, keywords, along, claim):
        if claim.along == "torque":
            loop = evidence.loop(loop.rate, max(loop.amplitude, float(np.abs(along).max())))
        torque = _curve_torques(evidence, loop)
        width = evidence.draws.widths(loop.rate, loop.amplitude)
        if "torque" in keywords or claim.along != "torque":
            if "torque" not in keywords:
                raise Wrong("expected width_rad(torque=…) or along = \"torque\"")
            at = keywords["torque"]
            if abs(at) > torque[-1] * (1 + 1e-6):
                raise NotAvailable(f"torque {at:g} N·m lies beyond the loop's {plain(torque[-1])} N·m")
            ends = [_interpolate(torque, width, t) for t in (-at, at)]
            return np.mean(ends, axis=0)[order][:, None]
        return np.stack([_interpolate(torque, width, t) for t in along], axis=1)[order]

    def _sensitivity(self, evidence, arguments):
        if len(arguments) != 2 or arguments[0] not in RESPONSES:
            raise Wrong(f"expected sensitivity('response', 'parameter') with a response out of {', '.join(RESPONSES)}")
        names = [name for name in MOVED if name in evidence.parameters]
        if arguments[1] not in names:
            raise NotAvailable(f"sensitivities to {arguments[1]} are not known (to {', '.join(names)} they are)")
        values = evidence.draws.sensitivity(arguments[0], arguments[1])
        if not np.isfinite(values).all():
            raise NotAvailable(f"{arguments[0]} vanishes in the model")
        return np.resize(values, self.draws)[:, None]


def _curve_torques(evidence, loop):
    return evidence.draws.width_torques(loop.amplitude)


def _interpolate(torque, curves, at):
    i = int(np.clip(np.searchsorted(torque, at), 1, torque.size - 1))
    part = np.clip((at - torque[i - 1]) / (torque[i] - torque[i - 1]), 0.0, 1.0)
    return (1 - part) * curves[:, i - 1] + part * curves[:, i]


def _named(values, arguments, kind):
    if len(arguments) != 1:
        raise Wrong(f"expected {kind}('name')")
    if arguments[0] not in values:
        raise NotAvailable(f"{kind} {arguments[0]} is not in the model (it has {', '.join(values)})")
    return values[arguments[0]]


def _classic(evidence, loop, arguments) -> float:
    if len(arguments) != 2 or arguments[0] not in ("ascending", "descending") or arguments[1] not in _CLASSIC:
        raise Wrong(f"expected least_squares('ascending' or 'descending', one of {', '.join(_CLASSIC)})")
    branches = (evidence.record_json(loop).get("least_squares") or {}).get("branches") or {}
    value = (branches.get(arguments[0]) or {}).get(arguments[1])
    if value is None:
        raise NotAvailable(f"the classic fit has no {arguments[1]} of the {arguments[0]} branch")
    return float(value)


def _effect(evidence, arguments) -> float:
    if len(arguments) != 1:
        raise Wrong("expected effect('name')")
    if evidence.diagnosis is None:
        raise NotAvailable(f"no diagnosis.json beside the fit of {evidence.name}: diagnose it first")
    if evidence.diagnosis.get("simulator"):
        raise NotAvailable(f"the diagnosis of {evidence.name} tells what a simulator lacks: diagnose it without one")
    # Of a name alone and beside others.
    found = [w["probability"] for w in evidence.diagnosis.get("which", []) if arguments[0] in w["effect"].split("+")]
    if not found:
        raise NotAvailable(f"the diagnosis of {evidence.name} does not speak of {arguments[0]}")
    return float(sum(found))

