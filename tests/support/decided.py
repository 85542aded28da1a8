"""Evidence made by hand: draws of the indicators of small known units, in memory and as result folders."""

import json
from dataclasses import dataclass
from hashlib import sha256

import numpy as np
from support_results import indicators

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.indicators.same_loop import same_amplitude, same_rate
from support.made_posterior import made_fit
from support.told import told

TYPICAL = {
    "lost_motion_rad": 0.0095,
    "zero_torque_width_rad": 0.029,
    "peak_angle_rad": 0.0325,
    "loop_area_J": 3.7e-4,
    "absorbed_J": 1.55e-3,
    "dissipation_ratio": 0.238,
    "tau1_Nm": 0.002,
    "tau2_Nm": 0.008,
    "hump_torque_Nm": 0.004,
    "S_g_J": 2.7e-4,
    "S_f_J": 0.9e-4,
    "S_g_over_S": 0.73,
    "S_f_over_S": 0.26,
    "elastic_share": 0.76,
    "theta_L_rad": 0.047,
    "W_L_J": 7.7e-4,
}
LOOPS = ((0.01, 0.1), (0.05, 0.1), (0.1, 0.1))
CHAINS, DRAWS, KEPT = 4, 500, 400


@dataclass(frozen=True, eq=False)
class Invented:
    """Draws of indicators by name, (draws, records) each; smaller loops are scaled from the largest of their rate."""

    rates: np.ndarray
    amplitudes: np.ndarray
    own: dict
    parameters: dict
    small: float = 1.0
    rated_torque_nm: float = 0.1

    @property
    def travelled_nm(self):
        """A cycle and a quarter each."""
        return 5.0 * float(self.amplitudes.sum())

    @property
    def kept(self):
        return np.linspace(0, CHAINS * DRAWS - 1, KEPT).astype(int)

    def values(self, name, rate, amplitude, kept=False):
        """Measured loops as they are, others grown from the largest of the rate."""
        at_rate = [i for i, r in enumerate(self.rates) if same_rate(r, rate)]
        records = [i for i in at_rate if same_amplitude(self.amplitudes[i], amplitude)]
        factor = 1.0
        if not records:
            records = [max(at_rate, key=lambda i: self.amplitudes[i])]
            share = amplitude / self.amplitudes[records[0]]
            factor = self.small * (share if name == "peak_angle_rad" else share**2 if name.endswith("_J") else 1.0)
        found = factor * self.own[name][:, records].mean(axis=1)
        return found[self.kept] if kept else found

    def width_torques(self, amplitude):
        """Dense around zero."""
        return amplitude * np.linspace(-1, 1, 81) ** 3

    def widths(self, rate, amplitude):
        """A hump at 4 mN·m."""
        torque = self.width_torques(amplitude)
        scatter = 1 + 0.01 * np.random.default_rng(3).standard_normal((KEPT, 1))
        return 0.03 * np.exp(-((np.abs(torque) / 0.004 - 1) ** 2)) * scatter

    def sensitivity(self, response, parameter):
        """One half."""
        return np.full(KEPT, 0.5)


def evidence(name="u", loops=LOOPS, spread=0.01, seed=0, converged=True, diagnosis=None, k=0.03, effects=(), small=1.0, **means):
    """Evidence with normal draws about ``means`` (typical values by default); a list of means is one a record.

    ``small`` scales what loops of smaller amplitude are predicted as; S and absorbed energy grow with the square of it.
    """
    rng, n = np.random.default_rng(seed), len(loops)
    rates, amplitudes = (np.array(x) for x in zip(*loops, strict=True))
    own = {}
    for key, typical in (TYPICAL | means).items():
        own[key] = np.broadcast_to(typical, n) * (1 + spread * rng.standard_normal((CHAINS * DRAWS, n)))
    draws = Invented(rates, amplitudes, own, _parameters(seed), small)
    return Evidence(_about(name, loops, converged, k, effects), draws, diagnosis, name)


def write_evidence(folder, name="u", loops=LOOPS, diagnosis=None, converged=True, effects=(), seed=0, size=1.0, **more):
    """A result folder of a made fit, ``size`` times as large in angle, with ``more`` keys of its indicators object."""
    from backdrive_bayes.commands.results import keep_fit

    folder.mkdir(parents=True, exist_ok=True)
    posterior, about = made_fit(name, tuple(loops), seed, size)
    about |= more
    about["model"]["effects"] = list(effects)
    about["convergence"] |= {"converged": converged, "advice": "" if converged else "not converged within the budget"}
    keep_fit(posterior, told(about), folder, figures=False)
    if diagnosis:
        of_unit = {key: about[key] for key in ("unit", "data_sha256", "unit_sha256", "version")}
        (folder / "diagnosis.json").write_text(json.dumps(told(diagnosis | of_unit)), encoding="utf-8")
    return folder


def diagnosis(answer=(), **which):
    """A diagnosis object with those probabilities by effect."""
    found = [{"effect": n, "probability": p} for n, p in which.items()]
    return {
        "schema": "backdrive-bayes/diagnosis/1",
        "unit": "u",
        "baseline": ["geometric", "elastic", "friction"],
        "inconclusive": "",
        "convergence": {"converged": True},
        "which": found,
        "answer": {"effects": list(answer)},
        "where": {"summary": "", "map": []},
        "gap": {"probability": 0.9, "unlisted_probability": 0.0},
        "shrink": None,
        "next_test": {"do": "Measure at another rate.", "separates": [], "expected_entropy_drop_bits": 0.1},
    }


def _about(name, loops, converged, k, effects):
    about = indicators(len(loops)) | {"unit": name, "k": k, "data_sha256": [sha256(name.encode()).hexdigest()]}
    about["model"] = {"modules": ["geometric", "elastic", "friction"], "effects": list(effects)}
    advice = "" if converged else "not converged within the budget of evaluations: check the records"
    about["convergence"] |= {"converged": converged, "advice": advice}
    for record, (rate, amplitude) in zip(about["records"], loops, strict=True):
        record |= {"loading_rate_Nm_per_s": rate, "amplitude_Nm": amplitude}
        quality = {"r_squared": 0.999, "rms_rad": 3e-4, "rms_high_load_over_rest": 2.0}
        record["least_squares"] = {"branches": {"ascending": quality, "descending": quality}, "indicators": {"loop_area_J": 3e-4}}
    return about


def _parameters(seed):
    rng = np.random.default_rng(seed + 1)
    scatter = np.exp(0.02 * rng.standard_normal((3, CHAINS * DRAWS)))
    typical = {"clearance_rad": 0.03, "compliance_rated_rad_per_Nm": 0.1, "friction_torque_Nm": 0.003}
    return {n: v * s for (n, v), s in zip(typical.items(), scatter, strict=True)}
