"""The published branch model, eq. (20) as reconstructed, with closed-form area and absorbed work.

θ±(τ) = G + a₁τ + a₃τ³ + a₅τ⁵ + A tanh(Bτ ∓ D) ∓ d₀ (source: doi:10.1177/00202940261442382; the formula itself is a
reconstruction from the prose). Known faults: the branches do not close at ±T, and it knows no first loading, no minor loops
and no rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PublishedLoop:
    """Parameters of eq. (20), reconstructed, in SI units; fields are floats or arrays that broadcast."""

    offset_rad: float
    a1: float
    a3: float
    a5: float
    step_rad: float
    steepness_per_nm: float
    shift: float
    d0_rad: float = 0.0

    def angle_rad(self, torque_nm, direction):
        """Angle on the ascending (direction +1) or descending (-1) branch, shape of ``torque_nm``."""
        t = np.asarray(torque_nm, float)
        elastic = self.a1 * t + self.a3 * t**3 + self.a5 * t**5
        step = self.step_rad * np.tanh(self.steepness_per_nm * t - direction * self.shift)
        return self.offset_rad + elastic + step - direction * self.d0_rad

    def area_j(self, amplitude_nm):
        """S between the branches from -T to T [J]; closed form of eq. (21), reconstructed."""
        b, d, t = self.steepness_per_nm, self.shift, amplitude_nm
        return 2 * self.step_rad / b * (_log_cosh(b * t + d) - _log_cosh(b * t - d)) + 4 * self.d0_rad * t

    def absorbed_j(self, amplitude_nm):
        """W_abs of both loading quadrants [J]; closed form of eq. (22), reconstructed."""
        b, d, t = self.steepness_per_nm, self.shift, amplitude_nm
        elastic = self.a1 * t**2 / 2 + 3 * self.a3 * t**4 / 4 + 5 * self.a5 * t**6 / 6
        step = self.step_rad * (t * np.tanh(b * t - d) - (_log_cosh(b * t - d) - _log_cosh(d)) / b)
        return 2 * (elastic + step)


def _log_cosh(x):
    return np.logaddexp(x, -x) - np.log(2.0)
