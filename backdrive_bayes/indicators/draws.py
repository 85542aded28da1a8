"""Draws of the indicators of any loop of one unit: what summaries, decisions and claims are made from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from backdrive_bayes.engine.parameters import posterior_parameters
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.loop import Loops, cut_loops, loop_grid, settled_history, settled_loops
from backdrive_bayes.mechanics.friction import FRICTION

KEPT_A_CHAIN = 100
"""Draws of each chain that are used where many loops are wanted."""
POSITIONS = 20
WIDTH_POINTS = 81
STEP = 0.02
"""Change of a parameter's logarithm by which sensitivities are taken."""
UNITS = {
    "lost_motion_rad": "rad",
    "zero_torque_width_rad": "rad",
    "peak_angle_rad": "rad",
    "loop_area_J": "J",
    "absorbed_J": "J",
    "dissipation_ratio": "1",
    "tau1_Nm": "N·m",
    "tau2_Nm": "N·m",
    "hump_torque_Nm": "N·m",
    "S_g_J": "J",
    "S_f_J": "J",
    "S_g_over_S": "1",
    "S_f_over_S": "1",
    "elastic_share": "1",
    "theta_L_rad": "rad",
    "W_L_J": "J",
}
"""Every indicator on which a limit, a comparison or a claim may rest, with its unit."""
CORE = ("lost_motion_rad", "zero_torque_width_rad", "peak_angle_rad", "loop_area_J", "absorbed_J", "dissipation_ratio")
LOADED = ("theta_L_rad", "W_L_J")
"""Of a load that arrives at zero torque, as large as the amplitude but no larger than the rated torque."""
RESPONSES = ("theta_L_rad", "W_L_J", "loop_area_J", "S_g_J", "S_f_J")
MOVED = {
    "clearance_rad": ("clearance", "free_play"),
    "compliance_rated_rad_per_Nm": ("compliance", "elastic", *FRICTION),
    "drag_torque_Nm": (),
    "friction_torque_Nm": (),
}
"""Parameters that have sensitivities, with the parts whose weights grow with them; the torques widen thresholds instead."""


@dataclass(frozen=True, eq=False)
class IndicatorDraws:
    """Indicators of settled loops of any amplitude and rate of one posterior, lost motion at ±``k`` T_r.

    ``kept`` are the numbers of the draws, out of the flat list, that are used where many loops are wanted.
    """

    posterior: Posterior
    k: float
    _known: dict = field(default_factory=dict, repr=False)

    @property
    def rates(self) -> np.ndarray:
        """Loading rates of the records [N·m/s], (records,)."""
        return self.posterior.records.rate_nm_per_s

    @property
    def amplitudes(self) -> np.ndarray:
        """Amplitudes of the records [N·m], (records,)."""
        return self.posterior.records.amplitude_nm

    @property
    def rated_torque_nm(self) -> float:
        """T_r [N·m]."""
        return self.posterior.rated_torque_nm

    @property
    def travelled_nm(self) -> float:
        """Torque that all records travel, up and down [N·m]."""
        return float(sum(np.abs(np.diff(b.path_nm)).sum() for b in self.posterior.records.blocks))

    @property
    def kept(self) -> np.ndarray:
        """Numbers of the kept draws in the flat list."""
        chains, draws = self.posterior.shape
        inner = np.linspace(0, draws - 1, min(KEPT_A_CHAIN, draws)).astype(int)
        return (np.arange(chains)[:, None] * draws + inner).ravel()

    @property
    def parameters(self) -> dict[str, np.ndarray]:
        """The user's parameters by name, (draws,) each."""
        return self._once("parameters", lambda: posterior_parameters(self.posterior))

    def loops(self, rate: float, amplitude: float, kept: bool = False) -> Loops:
        """Settled loops of that rate [N·m/s] and amplitude [N·m], of all or the kept draws."""
        grid = loop_grid(self.posterior, amplitude, (self.k * self.rated_torque_nm, self.rated_torque_nm))
        key = ("loops", float(rate), float(amplitude), kept)
        return self._once(key, lambda: settled_loops(self._some(kept), grid, rate))

    def all(self, rate: float, amplitude: float, kept: bool = False) -> dict[str, np.ndarray]:
        """Every indicator of UNITS for that loop, (draws,) each; NaN where one is not defined."""
        key = ("all", float(rate), float(amplitude), kept)
        return self._once(key, lambda: self._indicators(rate, amplitude, kept))

    def values(self, name: str, rate: float, amplitude: float, kept: bool = False) -> np.ndarray:
        """One of them."""
        if name not in CORE:
            return self.all(rate, amplitude, kept)[name]
        key, torque = ("core", float(rate), float(amplitude), kept), self.k * self.rated_torque_nm
        return self._once(key, lambda: core_indicators(self.loops(rate, amplitude, kept), torque))[name]

    def width_torques(self, amplitude: float) -> np.ndarray:
        """Torques at which a loop's width is given [N·m], dense around zero."""
        return amplitude * np.linspace(-1, 1, WIDTH_POINTS) ** 3

    def widths(self, rate: float, amplitude: float) -> np.ndarray:
        """Width of the kept draws' loops at those torques [rad], (kept, points)."""
        loops = self.loops(rate, amplitude, True)
        return np.stack([loops.at(loops.width, t) for t in self.width_torques(amplitude)], axis=1)

    def sensitivity(self, response: str, parameter: str) -> np.ndarray:
        """d ln(response) / d ln(parameter) of the largest loop of the kept draws, without effects."""
        up, down = (self._moved(parameter, np.exp(0.5 * sign * STEP))[response] for sign in (1, -1))
        with np.errstate(divide="ignore", invalid="ignore"):
            return 2 * (up - down) / (up + down) / STEP

    def _some(self, kept):
        return self._once("kept", lambda: self.posterior.thinned(KEPT_A_CHAIN)) if kept else self.posterior

    def _once(self, key, make):
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]

    def _indicators(self, rate, amplitude, kept):
        loops = self.loops(rate, amplitude, kept)
        areas = {}
        for module in ("geometric", "friction"):
            if module in self.posterior.reducer.modules:
                areas[module] = ind.loop_area_j(settled_loops(self._some(kept), loops.torque_nm, rate, (module,)))
        return indicators_of(loops, areas, self.k * self.rated_torque_nm, self.rated_torque_nm)

    def _moved(self, parameter, factor):
        key = ("moved", parameter, float(factor))
        return self._once(key, lambda: self._moved_indicators(parameter, factor))

    def _moved_indicators(self, parameter, factor):
        posterior = self._some(True)
        weights = {n: w * (factor if n in MOVED[parameter] else 1.0) for n, w in posterior.weights.items()}
        largest = int(np.argmax(self.amplitudes))
        rate, amplitude = self.rates[largest], self.amplitudes[largest]
        torque = loop_grid(posterior, amplitude, (self.rated_torque_nm,))
        wider = [np.log(factor) * (parameter == name) for name in ("friction_torque_Nm", "drag_torque_Nm")]
        history = settled_history(torque, rate, posterior.context.torque_scale_nm)
        columns = posterior.reducer.ends(history, (float(wider[0]), float(wider[1]), 0.0))
        flat = replace(posterior, weights=weights).flat
        parts = {n: cut_loops(torque, flat[n] @ c.T * posterior.context.angle_scale_rad) for n, c in columns.items()}
        by_module = {m: _sum(parts, posterior.reducer, m) for m in posterior.reducer.modules}
        areas = {m: ind.loop_area_j(loops) for m, loops in by_module.items() if m != "elastic"}
        return indicators_of(_sum(parts, posterior.reducer), areas, self.k * self.rated_torque_nm, self.rated_torque_nm)


def _sum(parts, reducer, module=None) -> Loops:
    own = [loops for name, loops in parts.items() if module in (None, reducer.part(name).module)]
    return Loops(own[0].torque_nm, sum(x.rising for x in own), sum(x.falling for x in own))


def indicators_of(loops: Loops, areas: dict, lost_motion_torque_nm: float, rated_nm: float) -> dict[str, np.ndarray]:
    """Every indicator of UNITS of loops, with the areas of the modules alone; NaN where one is not defined."""
    found = core_indicators(loops, lost_motion_torque_nm)
    torque, curve = ind.torque_energy(loops)
    found["tau1_Nm"], found["tau2_Nm"] = ind.hump_torques_nm(torque, curve)
    found["hump_torque_Nm"] = torque[np.argmax(curve, axis=1)]
    area, nothing = found["loop_area_J"], np.full(len(loops.rising), np.nan)
    for letter, module in (("g", "geometric"), ("f", "friction")):
        found[f"S_{letter}_J"] = areas.get(module, nothing)
        found[f"S_{letter}_over_S"] = found[f"S_{letter}_J"] / area
    # What a settled loop absorbs and does not dissipate was stored elastically and is given back.
    found["elastic_share"] = 1 - area / found["absorbed_J"]
    found["theta_L_rad"], found["W_L_J"] = ind.back_drive(loops, min(rated_nm, float(loops.torque_nm[-1])))
    return found


def core_indicators(loops: Loops, lost_motion_torque_nm: float) -> dict[str, np.ndarray]:
    """The six indicators of the contract by name, each of shape (draws,).

    The dissipation ratio of a whole loop lies in [0, 1]: a draw that noise carries beyond counts as the bound, one that absorbs
    nothing as 1.
    """
    absorbed = ind.absorbed_j(loops)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = ind.dissipation_ratio(loops)
    return {
        "lost_motion_rad": ind.lost_motion_rad(loops, lost_motion_torque_nm),
        "zero_torque_width_rad": ind.zero_torque_width_rad(loops),
        "peak_angle_rad": ind.peak_angle_rad(loops),
        "loop_area_J": ind.loop_area_j(loops),
        "absorbed_J": absorbed,
        "dissipation_ratio": np.clip(np.where(absorbed > 0.0, ratio, 1.0), 0.0, 1.0),
    }
