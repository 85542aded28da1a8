"""Where the gap lies: shares over record, branch, cycle and torque, with sign and credibility, and one sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.engine.design import path_group
from backdrive_bayes.engine.levels import learn_scales, levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.mechanics.registry import UNKNOWN
from backdrive_bayes.records.branches import cycle_numbers, find_segments

BRANCHES = ("load+", "unload+", "load-", "unload-")
BINS = 5
"""Torque bins from zero to the tip on each branch."""
CREDIBLE = 1.645


@dataclass(frozen=True, eq=False)
class Gap:
    """What the clean class leaves at the blocks of each record: posterior mean [rad] and draws of its error, (blocks,) and
    (blocks, draws); ``weight`` the torque that each block spans; ``noise_rad`` the noise of the blocks."""

    mean: tuple[np.ndarray, ...]
    error: tuple[np.ndarray, ...]
    weight: tuple[np.ndarray, ...]
    noise_rad: float

    @property
    def rms_rad(self) -> float:
        """Root mean square of the mean, weighted by torque."""
        return float(
            np.sqrt(sum(w @ m**2 for w, m in zip(self.weight, self.mean, strict=True)) / sum(w.sum() for w in self.weight))
        )


def estimate_gap(linear: Linear, rng, off: tuple[str, ...] = ()) -> Gap:
    """The process along each leg beside the clean class without the modules that are ``off``, all effects at trace level; that of
    each record has a scale of its own, or what one record has would be shared out among all."""
    usual = UNKNOWN.present(linear.reduced.context)
    records = path_group(linear.reduced, UNKNOWN).by_record()
    beside = linear
    for record in records:
        beside = beside.beside(record, usual)
    priors = levels(linear, (), off) | {record.name: (float(np.log(usual)), 2.0) for record in records}
    solution = learn_scales(beside, priors)[2]
    parts = beside.design.split(np.arange(solution.mean.size))
    noise = rng.standard_normal((solution.root.shape[1], 200)) * np.sqrt(solution.variance)
    scale, mean, error = linear.reduced.angle_scale_rad, [], []
    for r, record in enumerate(records):
        own, columns = parts[record.name], record.of_record(r) * scale
        columns = columns - columns.mean(axis=0)
        mean.append(columns @ solution.mean[own])
        error.append(columns @ (solution.root[own] @ noise))
    weight = linear.reduced.spans_nm
    variance = [np.diag(c) for c in linear.covariances]
    floor = sum(w @ v for w, v in zip(weight, variance, strict=True)) / sum(w.sum() for w in weight)
    return Gap(tuple(mean), tuple(error), weight, float(np.sqrt(floor)) * scale)


def gap_map(linear: Linear, gap: Gap) -> list[dict]:
    """The contract's ``where.map``: one entry a record, branch, cycle and torque bin, shares summing to one."""
    cells = []
    total = sum(float(w @ m**2) for w, m in zip(gap.weight, gap.mean, strict=True))
    for r, blocks in enumerate(linear.reduced.blocks):
        record = next(x for x in linear.reduced.unit.records if x.name == blocks.name)
        cycle = np.array(cycle_numbers(record.torque_nm, find_segments(record.time_s, record.torque_nm)))[blocks.leg]
        amplitude = float(np.abs(blocks.edges_nm()).max())
        branch = branch_of(blocks.torque_nm, blocks.direction[blocks.leg])
        place = np.minimum((np.abs(blocks.torque_nm) / amplitude * BINS).astype(int), BINS - 1)
        for key in sorted({*zip(cycle.tolist(), branch.tolist(), place.tolist(), strict=True)}):
            own = (cycle == key[0]) & (branch == key[1]) & (place == key[2])
            if gap.weight[r][own].any():
                cells.append(_cell(blocks.name, key, own, gap, r, total, amplitude))
    return cells


def branch_of(torque_nm, direction) -> np.ndarray:
    """Index into ``BRANCHES`` of each sample, shape (samples,)."""
    positive, rising = np.asarray(torque_nm) > 0, np.asarray(direction) > 0
    return np.where(positive, np.where(rising, 0, 1), np.where(rising, 3, 2))


def _cell(name, key, own, gap, r, total, amplitude):
    cycle, branch, place = key
    part = gap.weight[r][own]
    weight = part / part.sum()
    mean = float(weight @ gap.mean[r][own])
    sd = float((weight @ gap.error[r][own]).std())
    sign = 1.0 if branch in (0, 1) else -1.0
    bounds = sorted(sign * amplitude * np.array([place, place + 1]) / BINS)
    return {
        "record": name, "branch": BRANCHES[branch], "cycle": int(cycle),
        "torque_lo_Nm": float(bounds[0]), "torque_hi_Nm": float(bounds[1]),
        "share": float(part @ gap.mean[r][own] ** 2 / max(total, 1e-300)),
        "signed_rms_rad": float(np.copysign(np.sqrt(weight @ gap.mean[r][own] ** 2), mean)),
        "credible": bool(abs(mean) > CREDIBLE * sd),
    }  # fmt: skip


def summary(cells: list[dict], amplitudes: dict[str, float], left_out: str = "", named: bool = False) -> str:
    """One plain sentence about a map; ``amplitudes`` are those of the records by name [N·m], ``left_out`` a part of the data in
    which the gap stands out once it is left out of the fit, ``named`` says whether something is named all the same."""
    if not any(c["credible"] for c in cells):
        text = "Nowhere does the gap stand out from the noise"
        if left_out:
            text += f" while the model may bend to all records; it does in {left_out}, as predicted from the others"
        elif named:
            text += ": the class, which is fitted to all records, takes up what the evidence is for"
        return text + "."
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
