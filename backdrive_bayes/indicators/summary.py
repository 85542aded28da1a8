"""From a posterior to indicators.json: intervals of every indicator of every record."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.parameters import PARAMETERS, implied_prior
from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.convergence import convergence_json
from backdrive_bayes.indicators.draws import CORE, IndicatorDraws
from backdrive_bayes.indicators.intervals import LEVEL, bands, interval, over_positions
from backdrive_bayes.indicators.loop import module_loops
from backdrive_bayes.results import INDICATORS

POSITIONS = 10


def indicators_json(draws: IndicatorDraws, level: float = LEVEL) -> dict:
    """The contract's indicators object (least-squares comparison and provenance left to the caller)."""
    posterior = draws.posterior
    return {
        "schema": INDICATORS,
        "unit": posterior.unit_name,
        "k": draws.k,
        "level": level,
        "rated_torque_Nm": posterior.rated_torque_nm,
        "model": {"modules": list(posterior.reducer.modules), "effects": list(posterior.hypothesis or ())},
        "convergence": convergence_json(posterior),
        "jitter": {"torque_Nm": posterior.jitter[0], "length_Nm": posterior.jitter[1]},
        "parameters": _parameters_json(draws, level),
        "records": [_record_json(draws, r, level) for r in range(posterior.records.count)],
    }


def _parameters_json(draws, level):
    prior, out = implied_prior(draws.posterior), {}
    for parameter in PARAMETERS:
        if parameter.name in draws.parameters:
            own = {"unit": parameter.unit, "definition": parameter.definition, "null": parameter.null}
            implied = {"prior": "implied by the class", "prior_interval": interval(prior[parameter.name], level)}
            out[parameter.name] = interval(draws.parameters[parameter.name], level) | own | implied
    return out


def _record_json(draws, record, level):
    records, rate, amplitude = draws.posterior.records, draws.rates[record], draws.amplitudes[record]
    loops, found = draws.loops(rate, amplitude), draws.all(rate, amplitude)
    return {
        "file": records.names[record],
        "loading_rate_Nm_per_s": float(rate),
        "amplitude_Nm": float(amplitude),
        "indicators": {name: interval(found[name], level) for name in CORE},
        "loop": _loop_json(loops, level),
        "mechanism": {n: interval(found[n], level) for n in ("S_g_J", "S_g_over_S", "S_f_J", "S_f_over_S") if _known(found[n])},
        "modules": _modules_json(draws.posterior, loops.torque_nm, rate),
        "torque_energy": _torque_energy_json(loops, found, level),
        "by_amplitude": _by_amplitude_json(draws, rate, amplitude, level),
        "windowed": _windowed_json(loops, level),
        "back_drive": {
            "load_Nm": min(draws.rated_torque_nm, float(amplitude)),
            **{name: interval(found[name], level) for name in ("theta_L_rad", "W_L_J")},
        },
        "noise": _noise_json(records.noise[record]),
    }


def _known(values) -> bool:
    return not np.isnan(values).all()


def _loop_json(loops, level):
    # Where on its scale the encoder reads the loop is no property of the reducer: bands are those of the loop's shape.
    middle = 0.5 * (loops.rising.mean(axis=1) + loops.falling.mean(axis=1))
    shift = np.median(middle) - middle[:, None]
    return {
        "torque_Nm": loops.torque_nm.tolist(),
        **{f"{branch}_rad": bands(getattr(loops, branch) + shift, level) for branch in ("rising", "falling")},
    }


def _modules_json(posterior, torque, rate):
    """Median curves of each module's own loop."""
    return {
        name: {f"{branch}_rad": np.median(getattr(loops, branch), axis=0).tolist() for branch in ("rising", "falling")}
        for name, loops in module_loops(posterior, torque, rate).items()
    }


def _torque_energy_json(loops, found, level):
    torque, energy = ind.torque_energy(loops)
    band = bands(energy, level)
    return {
        "torque_Nm": torque.tolist(),
        "median_J_per_Nm": band.pop("median"),
        **band,
        **{name: interval(found[name], level) for name in ("tau1_Nm", "tau2_Nm")},
    }


def _by_amplitude_json(draws, rate, amplitude, level):
    """S(t) and u(t) of loops of amplitude t, and their extremes."""
    amplitudes = _positions(amplitude)
    return {"amplitude_Nm": amplitudes.tolist(), **_energies([draws.loops(rate, t, True) for t in amplitudes], level)}


def _windowed_json(loops, level):
    """The same of windows |τ| ≤ t cut out of the measured loop; this u(t) may exceed 1, for a window is no closed loop."""
    torque = _positions(loops.torque_nm[-1])
    return {"torque_Nm": torque.tolist(), **_energies([loops.within(t) for t in torque], level)}


def _positions(amplitude):
    return amplitude * np.arange(1, POSITIONS + 1) / POSITIONS


def _energies(loops, level):
    return over_positions(*(np.stack([f(x) for x in loops]) for f in (ind.loop_area_j, ind.dissipation_ratio)), level)


def _noise_json(noise):
    return {
        "white_rad": noise.white_rad,
        "correlated_rad": noise.correlated_rad,
        "correlation_time_s": noise.correlation_time_s,
        "torque_Nm": noise.torque_nm,
    }
