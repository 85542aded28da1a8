"""What a MuJoCo model of a geared joint lacks: run it along a unit's torque paths, set it against the records, make the PDF.

    python examples/mujoco_joint.py [UNIT] [--out OUT]

Without a UNIT the records come from a virtual bench of other mechanics, with an effect in the reducer that is not told here. The
model is a textbook's: two coincident hinges, one that is free between two stops (the backlash), one with a spring and dry
friction, with numbers as a data sheet might give them. Needs the extras bench, figures and report.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np

from backdrive_bayes import Unit, diagnose, report

BACKLASH_RAD, DRAG_NM = 0.047, 0.002
STIFFNESS_NM_PER_RAD, FRICTION_NM = 4.4, 0.006
NATURAL_RAD_PER_S = 40.0
"""Slow against the engine's step and fast against a test of seconds: the inertia is only there for the engine."""
STEP_S, WRITTEN_S = 5e-4, 5e-3
INERTIA = STIFFNESS_NM_PER_RAD / NATURAL_RAD_PER_S**2
HARD = 'solref{0}="0.001 1" solimp{0}="0.9999 0.9999 0.001"'
SEED, EFFECTS = 3, ("rate_dependent_friction", "viscoelastic_creep", "asymmetric_stiffness")

JOINT = f"""
<mujoco model="geared joint">
  <compiler angle="radian"/>
  <option timestep="{STEP_S}" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody>
    <body name="gear">
      <inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {0.5 * INERTIA}"/>
      <joint name="gear" axis="0 0 1" stiffness="{STIFFNESS_NM_PER_RAD}" frictionloss="{FRICTION_NM}"
             damping="{0.6 * INERTIA * NATURAL_RAD_PER_S}" {HARD.format("friction")}/>
      <body name="output">
        <inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {0.5 * INERTIA}"/>
        <joint name="backlash" axis="0 0 1" limited="true" range="{-0.5 * BACKLASH_RAD} {0.5 * BACKLASH_RAD}"
               frictionloss="{DRAG_NM}" damping="{0.03 * INERTIA * NATURAL_RAD_PER_S}"
               {HARD.format("limit")} {HARD.format("friction")}/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def answer(time_s, torque_nm):
    """Angle of the output [rad] at every time, for a torque on the output while the input is locked."""
    model = mujoco.MjModel.from_xml_string(JOINT)
    data, angle = mujoco.MjData(model), np.empty(time_s.size)
    output = model.body("output").id
    for i, torque in enumerate(torque_nm):
        data.xfrc_applied[output, 5] = torque
        mujoco.mj_step(model, data)
        angle[i] = data.qpos.sum()
    return angle


def same_path(record):
    """Time [s] and torque [N·m] of the loop that a record went through, from rest at the engine's steps."""
    turns = (record.amplitude_nm or np.abs(record.torque_nm).max()) * np.array([0.0, 1.0, -1.0, 1.0])
    travel = np.r_[0.0, np.cumsum(np.abs(np.diff(turns)))]
    corner = travel / (record.loading_rate_nm_per_s or travel[-1] / np.ptp(record.time_s))
    time = np.arange(0.0, corner[-1], STEP_S)
    return time, np.interp(time, corner, turns)


def write_simulated(unit: Unit, folder: Path) -> None:
    """The model's answers to the unit's torque paths, as a unit folder."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['schema = "backdrive-bayes/unit/1"', 'name = "mujoco-joint"', f"rated_torque_Nm = {unit.rated_torque_nm}"]
    every = round(WRITTEN_S / STEP_S)
    for number, record in enumerate(unit.records, 1):
        time, torque = same_path(record)
        table = np.column_stack([time, torque, np.degrees(answer(time, torque)) * 60.0])[::every]
        np.savetxt(folder / f"{number}.csv", table, "%.6f,%.9f,%.9f", header="time_s,torque_Nm,angle_arcmin", comments="")
        lines += ["[[record]]", f'file = "{number}.csv"']
    (folder / "unit.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def make_real(folder: Path) -> Path:
    """A unit of the contact bench with an effect that only its seed knows."""
    effect = np.random.default_rng(SEED).choice(EFFECTS)
    words = f"simulate --bench contact --effect {effect} --rates 0.05,0.2,0.5 --hertz 200 --seed {SEED}".split()
    subprocess.run([sys.executable, "-m", "backdrive_bayes", *words, "-o", str(folder)], check=True)
    return folder


def main() -> None:
    """From the records to report.pdf."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("unit", nargs="?", type=Path, help="unit folder (default: one is made)")
    parser.add_argument("--out", type=Path, default=Path("mujoco-joint"))
    given = parser.parse_args()
    unit = Unit.read(given.unit or make_real(given.out / "real"))
    write_simulated(unit, given.out / "simulated")
    found = diagnose(unit, simulated=given.out / "simulated", seed=1)
    print(found.result["simulator"]["summary"])
    print("missing in the model:", " + ".join(found.effects) or "nothing")
    print(report(found, out=given.out))


if __name__ == "__main__":
    main()
