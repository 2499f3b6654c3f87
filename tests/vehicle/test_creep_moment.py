"""Size of the creep moment f_23 u_y of the contacts, which the model leaves out as the thesis does."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from railui.vehicle.linear import state_matrices
from railui.vehicle.resolve import resolve_model

WITHOUT = 61.64024  # m/s, linear critical speed of the check bogie


def critical_speed(*, with_moment: bool) -> float:
    """Linear critical speed [m/s] of the check bogie, with the moment 2 f_23 (y'/V - psi) on every wheelset.

    Kalker's linear theory: the moment on the wheel is +f_23 u_y - f_33 u_n where the force on it is
    -f_22 u_y - f_23 u_n; f_23 = kappa_s N. f_33 u_n is left out here.
    """
    model = resolve_model("designs/check_bogie.yaml")
    value = model.design.values
    f_23 = value["contact.spin_creep"] * value["vehicle.wheel_load"]
    inertia = value["vehicle.wheelset.yaw_inertia"]
    dofs = list(model.vehicles().degrees_of_freedom(model.single_batch()))

    def growth(speed: float) -> float:
        matrix = state_matrices(model, model.row[None], np.array([speed]))[0].copy()
        for y, psi in (("y1", "psi1"), ("y2", "psi2")) if with_moment else ():
            row = len(dofs) + dofs.index(psi)
            matrix[row, dofs.index(psi)] -= 2.0 * f_23 / inertia
            matrix[row, len(dofs) + dofs.index(y)] += 2.0 * f_23 / (speed * inertia)
        return float(np.linalg.eigvals(matrix).real.max())

    return float(brentq(growth, 55.0, 70.0, xtol=1e-6))


def test_without_the_moment_the_critical_speed_is_that_of_the_check_value() -> None:
    assert critical_speed(with_moment=False) == pytest.approx(WITHOUT, abs=1e-5)


def test_the_moment_raises_the_critical_speed_by_0_07_percent() -> None:
    assert critical_speed(with_moment=True) / WITHOUT - 1.0 == pytest.approx(7.2e-4, abs=1e-5)


def test_on_the_roller_rig_it_is_2_5_percent_of_the_yaw_stiffness() -> None:
    value = resolve_model("designs/roller_rig.yaml").design.values
    spring, base = (value[f"vehicle.elements.box_spring.{key}"] for key in ("longitudinal_stiffness", "y"))
    moment = 2.0 * value["contact.spin_creep"] * value["vehicle.elements.wheelset.wheel_load"]  # of both wheels
    assert moment / (2.0 * base**2 * spring) == pytest.approx(0.025)
