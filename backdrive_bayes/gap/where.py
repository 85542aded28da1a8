"""Where the gap lies: shares over record, branch, cycle and torque, with sign and credibility, and one sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from backdrive_bayes.gap.candidates import Weighed
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.inference.discrepancy import amplitude_nm
from backdrive_bayes.records.branches import cycle_numbers, find_segments

BRANCHES = ("load+", "unload+", "load-", "unload-")
BINS = 5
"""Torque bins from zero to the tip on each branch."""
CREDIBLE = 1.645
KERNELS = (("loop", 0.06), ("own_loop", 0.06), ("time_smooth", 0.1))


@dataclass(frozen=True, eq=False)
class Gap:
    """The baseline's gap at the blocks: posterior mean [rad] (blocks,), its covariance, and the torque each block spans."""

    mean: np.ndarray
    covariance: np.ndarray
    weight: np.ndarray


def estimate_gap(setting: Setting, none: Weighed) -> Gap:
    """The smooth part of the baseline's residual, offsets taken out, given the noise."""
    fitted, level = none.fitted, max(_level(setting, none), 0.3)
    prior = sum((level * setting.noise_rad) ** 2 * setting.kernel(k, length) / len(KERNELS) for k, length in KERNELS)
    factor = cho_factor(prior + setting.noise, lower=True)
    ones = (setting.places.record[:, None] == np.arange(setting.places.record.max() + 1)).astype(float)
    inverse_ones = cho_solve(factor, ones)
    offset = np.linalg.solve(ones.T @ inverse_ones, inverse_ones.T @ fitted.residual)
    residual = fitted.residual - ones @ offset
    solved = cho_solve(factor, prior)
    span = np.concatenate([np.abs(np.diff(d.blocks.edges_nm(), axis=0))[0] for d in setting.problem.records])
    return Gap(solved.T @ residual, prior - prior @ solved, span)


def _level(setting, none):
    """Size of the residual in noise units."""
    excess = np.var(none.fitted.residual) - np.mean(np.diag(setting.noise))
    return float(np.sqrt(max(excess, 0.0)) / setting.noise_rad)


def gap_map(setting: Setting, gap: Gap) -> list[dict]:
    """The contract's ``where.map``: one entry a record, branch, cycle and torque bin, shares summing to one."""
    cells, energy = [], gap.weight * gap.mean**2
    start = 0
    for r, data in enumerate(setting.problem.records):
        n = data.blocks.count.size
        torque, direction, cycle = data.blocks.torque_nm, data.path.direction, _cycles(setting.unit.records[r], data.blocks)
        amplitude = amplitude_nm(setting.problem, r)
        branch = branch_of(torque, direction)
        place = np.minimum((np.abs(torque) / amplitude * BINS).astype(int), BINS - 1)
        for key in sorted({*zip(cycle, branch, place, strict=True)}):
            own = np.flatnonzero((cycle == key[0]) & (branch == key[1]) & (place == key[2])) + start
            cells.append(_cell(data.blocks.name, key, own, gap, energy, amplitude))
        start += n
    return cells


def branch_of(torque_nm, direction) -> np.ndarray:
    """Index into ``BRANCHES`` of each sample, shape (samples,)."""
    positive, rising = np.asarray(torque_nm) > 0, np.asarray(direction) > 0
    return np.where(positive, np.where(rising, 0, 1), np.where(rising, 3, 2))


def _cell(name, key, own, gap, energy, amplitude):
    cycle, branch, place = key
    weight = gap.weight[own] / gap.weight[own].sum()
    mean = float(weight @ gap.mean[own])
    sd = float(np.sqrt(max(weight @ gap.covariance[np.ix_(own, own)] @ weight, 0.0)))
    sign = 1.0 if branch in (0, 1) else -1.0
    bounds = sorted(sign * amplitude * np.array([place, place + 1]) / BINS)
    return {
        "record": name, "branch": BRANCHES[branch], "cycle": int(cycle),
        "torque_lo_Nm": float(bounds[0]), "torque_hi_Nm": float(bounds[1]),
        "share": float(energy[own].sum() / max(energy.sum(), 1e-300)),
        "signed_rms_rad": float(np.copysign(np.sqrt(weight @ gap.mean[own] ** 2), mean)),
        "credible": bool(abs(mean) > CREDIBLE * sd),
    }  # fmt: skip


def _cycles(record, blocks):
    segments = find_segments(record.time_s, record.torque_nm)
    return np.array(cycle_numbers(record.torque_nm, segments))[blocks.leg]


def summary(cells: list[dict], amplitudes: dict[str, float]) -> str:
    """One plain sentence about a map; ``amplitudes`` are those of the records by name [N·m]."""
    if not any(c["credible"] for c in cells):
        return "Nowhere does the gap stand out from the noise."
    share = _shares(cells)
    high = sum(c["share"] for c in cells if max(abs(c["torque_lo_Nm"]), abs(c["torque_hi_Nm"])) > 0.61 * amplitudes[c["record"]])
    low = sum(c["share"] for c in cells if max(abs(c["torque_lo_Nm"]), abs(c["torque_hi_Nm"])) < 0.41 * amplitudes[c["record"]])
    text = f"{max(share['loading'], 1 - share['loading']):.0%} of the gap lies on the " + (
        "loading branches" if share["loading"] >= 0.5 else "unloading branches"
    )
    if high > 0.55:
        text += f", {high:.0%} of it above 0.6 of the amplitude"
    elif low > 0.55:
        text += f", {low:.0%} of it below 0.4 of the amplitude"
    positive = share["positive"]
    if abs(positive - 0.5) > 0.15:
        text += f", {max(positive, 1 - positive):.0%} at {'positive' if positive > 0.5 else 'negative'} torque"
    return text + _by_record(cells, amplitudes) + "."


def _shares(cells):
    return {
        "loading": sum(c["share"] for c in cells if c["branch"].startswith("load")),
        "positive": sum(c["share"] for c in cells if c["branch"].endswith("+")),
    }


def _by_record(cells, amplitudes):
    if len(amplitudes) < 2:
        return ""
    share = {name: sum(c["share"] for c in cells if c["record"] == name) for name in amplitudes}
    top = max(share, key=share.get)
    if share[top] > 1.6 / len(share):
        return f"; {share[top]:.0%} of it in {top}"
    return ", about the same in all records"
