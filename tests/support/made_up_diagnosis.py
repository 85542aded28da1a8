"""A diagnosis.json written by hand: what `diagnose` saves, without a diagnosis."""

import json

import numpy as np

from support.told import told

RATES = (0.05, 0.01, 0.1)
NOISE = 3.1e-5
EFFECTS = (
    ("interface_slip", 0.871),
    ("second_backlash", 0.062),
    ("interface_slip+torque_offset", 0.031),
    ("viscoelastic_creep", 0.004),
    ("unknown", 0.019),
    ("rate_dependent_friction+viscoelastic_creep", 0.003),
    ("stick_slip", 0.002),
    ("encoder_error", 0.0015),
    ("sensor_lag", 0.0015),
    ("thermal_drift", 0.001),
    ("torque_offset", 0.001),
    ("asymmetric_stiffness", 0.001),
    ("rate_dependent_friction", 0.001),
    ("hardening_stiffness", 0.0006),
    ("load_dependent_friction", 0.0004),
    ("none", 0.0),
)


def write_diagnosis(folder, count=3, **changes):
    """Write diagnosis.json into ``folder`` and return its object."""
    folder.mkdir(parents=True, exist_ok=True)
    result = told(diagnosis(count) | changes)
    (folder / "diagnosis.json").write_text(json.dumps(result), encoding="utf-8")
    return result


def interval(median, half):
    return {"median": median, "lo": median - half, "hi": median + half}


def diagnosis(count=3):
    """A clamp that slips near full load, found with a rival, on ``count`` records."""
    entries = [
        {"file": f"rate-{i}.csv.gz", "loading_rate_Nm_per_s": RATES[i % 3] * 10 ** (i // 3), "amplitude_Nm": 3.0}
        for i in range(count)
    ]
    files = [e["file"] for e in entries]
    which = [{"effect": e, "probability": p} for e, p in EFFECTS]
    which[0]["parameters"] = {
        "slip_angle": interval(1.92e-3, 1.4e-4) | {"unit": "rad"},
        "slip_threshold": interval(2.31, 0.06) | {"unit": "N·m"},
        "slip_exponent": interval(1.42, 0.31) | {"unit": "1"},
    }
    return {
        "schema": "backdrive-bayes/diagnosis/1",
        "unit": "unit-38",
        "baseline": ["geometric", "elastic", "friction"],
        "level": 0.9,
        "inconclusive": "",
        "records": entries,
        "gap": {"probability": 0.998, "unlisted_probability": 0.01, "rms_rad": 3.6e-4, "noise_floor_rad": NOISE},
        "where": {
            "summary": "78 % of the gap lies on the loading branches above 0.75 T_r (2.3 N·m), the same at all rates; "
            "unloading branches above 0.5 T_r hold 15 %.",
            "map": _map(files),
        },
        "which": which,
        "answer": {"effects": ["interface_slip"], "credible_set_90": ["interface_slip", "second_backlash"]},
        "shrink": _shrink(files),
        "next_test": {
            "do": "Repeat one record at 0.05 N·m/s to half the amplitude (1.5 N·m): slip vanishes there, a second "
            "clearance does not.",
            "separates": ["interface_slip", "second_backlash"],
            "expected_entropy_drop_bits": 0.34,
        },
        "parameter_shift": _shifts(),
        "residual": [_residual(f, i) for i, f in enumerate(files)],
        "convergence": {
            "converged": True,
            "max_rhat": 1.006,
            "min_bulk_ess": 1640.0,
            "min_tail_ess": 1310.0,
            "seconds": 6.2,
            "worst": "drag_torque",
            "advice": "",
        },
    }


def _map(files):
    cells = []
    for i, file in enumerate(files):
        for branch, sign in (("load+", 1), ("unload+", 1), ("load-", -1), ("unload-", -1)):
            for k, cycle in ((k, c) for k in range(8) for c in ((1, 2) if branch == "load+" else (1,))):
                lo, hi = sorted((sign * 0.375 * k, sign * 0.375 * (k + 1)))
                rms = _gap(0.375 * (k + 0.5), branch.startswith("load")) * sign * (1 - 0.03 * i)
                rms += 4e-6 * np.sin(7 * k + i + 3 * sign)
                cells.append(
                    {"record": file, "branch": branch, "cycle": cycle, "torque_lo_Nm": lo, "torque_hi_Nm": hi}
                    | {"signed_rms_rad": rms, "credible": bool(abs(rms) > 0.6 * NOISE)}
                )
    whole = sum(c["signed_rms_rad"] ** 2 for c in cells)
    return [c | {"share": c["signed_rms_rad"] ** 2 / whole} for c in cells]


def _gap(torque, loading):
    if loading:
        return 9e-4 * np.clip((torque - 2.1) / 0.9, 0, None) ** 1.4 - 6e-5 * (torque < 1.2)
    return 3.5e-4 * np.clip((torque - 1.4) / 1.6, 0, None)


def _shrink(files):
    fractions = [interval(0.93 - 0.04 * i, 0.03 + 0.01 * i) for i in range(len(files))]
    return {
        "held_out": "records left out in turn",
        "before_rad": 3.6e-4,
        "after_rad": 5.2e-5,
        "noise_floor_rad": NOISE,
        "closed_fraction": interval(0.912, 0.035),
        "records": [
            {"record": f, "before_rad": 3.8e-4 - 2e-5 * i, "after_rad": 4.4e-5 + 7e-6 * i, "noise_floor_rad": NOISE}
            | {"closed_fraction": fractions[i]}
            for i, f in enumerate(files)
        ],
        "gaussian_process": {"closed_fraction": interval(0.71, 0.12)},
        "indicators_at": {"file": files[0], "loading_rate_Nm_per_s": 0.05, "amplitude_Nm": 3.0},
        "indicators": {
            "lost_motion_rad": {"before": interval(2.61e-3, 7e-5), "after": interval(2.48e-3, 3e-5)},
            "loop_area_J": {"before": interval(4.91e-3, 9e-5), "after": interval(4.37e-3, 4e-5)},
            "dissipation_ratio": {"before": interval(0.1832, 0.004), "after": interval(0.1641, 0.0019)},
        },
    }


def simulator(count=3, **changes):
    """What a simulator of the same clamp lacks, to be merged into :func:`diagnosis`, its residuals included."""
    made = diagnosis(count)
    files = [row["file"] for row in made["records"]]
    shares = {"retuning": interval(0.62, 0.05), "effect": interval(0.3, 0.06), "left": interval(0.08, 0.03)}
    found = {
        "unit": "joint.xml",
        "told": True,
        "summary": "Re-tuning closes 62 % of the gap, interface slip a further 30 %; 8 % is left.",
        "closed_by_retuning": shares["retuning"],
        "closed_by_effect": shares["effect"],
        "left": shares["left"],
        "closed_by_both": interval(0.92, 0.03),
        "effects": ["sensor_lag"],
        "shared_effects": [],
        "same_path": [True] * (count - 1) + [False],
        "rms_rad": {"simulated": 9e-4, "retuned": 3.6e-4, "explained": 5.2e-5, "noise_floor": NOISE},
        "parts": [{"part": part, **made["where"]} for part in shares],
        "records": [{"record": f, **shares} for f in files],
        "parameters": [
            {"name": "clearance_rad", "unit": "rad", "simulated": 1.5e-3, "simulated_interval": interval(1.5e-3, 4e-5),
             "measured": interval(2.05e-3, 4e-5), "change": interval(5.5e-4, 6e-5), "credible": True},
            {"name": "friction_torque_Nm", "unit": "N·m", "simulated": 0.11, "simulated_interval": interval(0.11, 0.005),
             "measured": interval(0.109, 0.005), "change": interval(-0.001, 0.007), "credible": False},
        ],
    }  # fmt: skip
    residual = [row | {"retuned_rad": [0.4 * v for v in row["before_rad"]]} for row in made["residual"]]
    return {"simulator": found | changes, "residual": residual}


def _shifts():
    rows = (
        ("clearance", "rad", 2.1e-3, 2.05e-3, 6e-5, 4e-5, -1.4),
        ("drag_torque", "N·m", 0.031, 0.029, 0.003, 0.002, -1.1),
        ("compliance", "rad/(N·m)", 4.61e-3, 4.28e-3, 8e-5, 5e-5, -6.8),
        ("hardening_ratio", "1", 0.71, 1.04, 0.11, 0.08, 4.9),
        ("friction_torque", "N·m", 0.112, 0.109, 0.006, 0.005, -0.8),
        ("friction_ratio", "1", 0.061, 0.048, 0.007, 0.005, -3.1),
        ("free_share", "1", 0.31, 0.31, 0.1, 0.1, 0.0),
        ("initial_gap_position[1]", "1", 0.12, 0.20, 0.5, 0.48, 0.3),
    )
    return [
        {"parameter": name, "unit": unit, "before": interval(a, ha), "after": interval(b, hb), "shift_sd": shift}
        for name, unit, a, b, ha, hb, shift in rows
    ]


def _residual(file, i):
    rng = np.random.default_rng(i)
    legs = ((0, 3), (3, 0), (0, -3), (-3, 0), (0, 3))
    torque = np.concatenate([np.linspace(a, b, 40) for a, b in legs])
    loading = np.repeat([abs(b) > abs(a) for a, b in legs], 40)
    before = np.sign(torque) * np.where(loading, _gap(np.abs(torque), True), _gap(np.abs(torque), False))
    noise = NOISE * rng.standard_normal((2, torque.size))
    return {
        "record": file,
        "torque_Nm": torque.tolist(),
        "direction": np.repeat([1, -1, -1, 1, 1], 40).tolist(),
        "before_rad": (before + noise[0]).tolist(),
        "after_rad": (0.06 * before + noise[1]).tolist(),
        "noise_rad": NOISE,
    }
