"""An effect of one's own: a class with a name, a stage, parameters and one function, diagnosed like the package's own.

In a package of yours, register it in pyproject.toml:

    [project.entry-points."backdrive_bayes.effects"]
    loose_plate = "my_package.loose_plate:LoosePlate"
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Drive, Stage
from backdrive_bayes.model.parameter import LogUniform, Normal, Parameter
from backdrive_bayes.model.path import TorquePath


class LoosePlate:
    """A plate that yields a little at small torque and then seats: a step of the angle without hysteresis."""

    name = "loose_plate"
    stage = Stage.COMPLIANCE
    signature = "a single-valued step at zero torque"
    source = "this example"
    parameters = (
        Parameter("plate_angle", "rad", "angle", Normal(0.02), 0.0, "some per cent of the peak angle"),
        Parameter("plate_torque", "N·m", "torque", LogUniform(0.01, 0.1), None, "seats well below the rated torque"),
    )

    def respond(self, values, drive: Drive):
        """Angle [rad], shape (…, samples), for parameters of shape (…, 1)."""
        return values["plate_angle"] * np.tanh(drive.transmitted_nm / values["plate_torque"])


def main():
    """Show what the effect adds to a loop."""
    path = TorquePath.from_turning_points([0.0, 0.1, -0.1, 0.1])
    values = {"plate_angle": np.array([1e-3]), "plate_torque": np.array([0.005])}
    angle = LoosePlate().respond(values, Drive(path, 0.1, path.torque_nm))
    print(f"{LoosePlate.name}: {1e3 * angle.min():.2f} to {1e3 * angle.max():.2f} mrad")


if __name__ == "__main__":
    main()
