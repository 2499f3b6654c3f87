"""Linear critical speed against formulas and published values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from railui.core import Batch, Vehicles
from railui.running_stability.critical_speed import critical_speeds, linear_stability_many
from railui.running_stability.summary import stability
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.linear import eigenvalues, linear_effects, linearisation_notes
from railui.vehicle.model import Model

HOME = Path(__file__).parents[2]


CHECK = load_design(HOME / "designs/check_bogie.yaml")


SLIPPERY = PlacedEffect("creep_saturation", "contact", None, {"friction": 0.15})


def with_effects(*effects: PlacedEffect, base: Design = CHECK) -> Model:
    return Model(base.with_effects(effects))


def test_the_constant_root_of_a_law_with_memory_does_not_decide_on_the_damping() -> None:
    """Hysteresis below its yield force is a spring, but for one more root, which is zero."""
    kinds = ("hysteresis", {"stiffness": 4e5, "yield": 1e5}), ("spring", {"stiffness": 4e5})
    models = [with_effects(PlacedEffect(kind, "secondary_lateral", None, numbers)) for kind, numbers in kinds]
    search = [linear_stability_many(m, m.row[None], [20.0, 40.0])["linear_damping"][0] for m in models]
    single = [stability(m, [20.0, 40.0])["linear_damping"] for m in models]
    assert search[0] == pytest.approx(search[1], rel=1e-6) and search[1] > 0.01
    assert single == pytest.approx(search, rel=1e-9)


def wheelset_on_springs(
    m: float, i: float, f11: float, f22: float, b: float, lam: float, r: float, s_y: float, s_psi: float
) -> tuple[float, float]:
    """V_c [m/s] and w [rad/s] at neutral stability: the exact solution of one wheelset on springs."""
    w2 = (f22 * s_psi + f11 * b**2 * s_y) / (f22 * i + f11 * b**2 * m)
    bottom = 4 * f11 * f22 * lam * b / r + (s_y - m * w2) * (s_psi - i * w2)
    return float(np.sqrt(4 * f11 * f22 * b**2 * w2 / bottom)) if bottom > 0 else np.nan, float(np.sqrt(w2))


def roots_of_wheelset(v: float, m: float, i: float, f11: float, f22: float, b: float, lam: float, r: float,
                      s_y: float, s_psi: float) -> np.ndarray:  # fmt: skip
    numbers = [m, i, 0.0, b, r, 1.0, s_y, s_psi, lam, f11, f22, 0.0, 0.0, 0.0, 0.0]
    return Vehicles("wheelset").eigenvalues(Batch.from_arrays(np.array([numbers])), v)[0]


PUBLISHED = (1022.0, 678.0, 6.563e6 / 0.60252, 6.563e6 / 0.54219, 0.7163, 0.05, 0.4572, 1.823e5, 768800.0)


def test_the_published_wheelset_is_neutral_at_its_critical_speed() -> None:
    v, w = wheelset_on_springs(*PUBLISHED)
    assert v == pytest.approx(69.83360931998, abs=1e-9)
    assert w / (2 * np.pi) == pytest.approx(4.334738642, abs=1e-9)
    root = roots_of_wheelset(v, *PUBLISHED)[0]
    assert abs(root.real) < 1e-8 and abs(root.imag) == pytest.approx(w, rel=1e-9)


@settings(deadline=None, max_examples=60)
@given(st.tuples(*(st.floats(0.5, 2.0) for _ in PUBLISHED)))
def test_any_wheelset_is_neutral_where_the_formula_says(factors: tuple[float, ...]) -> None:
    numbers = tuple(float(f * x) for f, x in zip(factors, PUBLISHED, strict=True))
    v, w = wheelset_on_springs(*numbers)
    assume(np.isfinite(v) and 5 < v < 300)
    roots = roots_of_wheelset(v, *numbers)
    nearest = roots[np.argmin(np.abs(roots - 1j * w))]
    assert abs(nearest - 1j * w) < 1e-6 * w


def test_the_critical_speed_of_the_bogie() -> None:
    result = stability(CHECK)
    assert result["linear_critical_speed"] == pytest.approx(61.64024, abs=5e-6)
    assert result["klingel_wavelength"] == pytest.approx(2 * np.pi * np.sqrt(0.75 * 0.46 / 0.18), rel=1e-12)
    assert result["rest_critical_speed"] == result["linear_critical_speed"]
    assert result["fold_speed"] is None and result["practical_critical_speed"] is None
    assert stability(CHECK, [20.0, 40.0])["linear_critical_speed"] is None


def test_many_designs_have_the_results_of_each_alone() -> None:
    model = Model(CHECK)
    rows = np.repeat(model.row[None], 5, axis=0)
    rows[:, model.columns["vehicle.primary.longitudinal_stiffness"]] *= np.linspace(0.5, 1.5, 5)
    together = linear_stability_many(model, rows, [30.0, 90.0])
    for i, row in enumerate(rows):
        alone = linear_stability_many(model, row[None], [30.0, 90.0])
        for key, values in together.items():
            assert values[i] == alone[key][0], key
    assert np.all(np.diff(together["linear_critical_speed"]) > 0)  # a stiffer primary hunts later


def test_linear_effects_are_recognised_by_their_response() -> None:
    model = with_effects(
        PlacedEffect("spring", "secondary_lateral", None, {"stiffness": 1e5}),
        PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4}),
        PlacedEffect("maxwell_damper", "secondary_yaw", None, {"stiffness": 1e6, "damping": 1e5}),
        PlacedEffect("dry_friction", "secondary_yaw", None, {"force": 1e3}),
        PlacedEffect("rail_flexibility", "track", None, {}),
        SLIPPERY,
    )
    assert linear_effects(model) == (True, False, True, False, True, False)


def test_a_friction_spring_is_linearised_at_rest_and_a_damper_in_series_with_a_spring_is_linear() -> None:
    hysteresis = PlacedEffect("hysteresis", "primary_lateral", None, {"stiffness": 1e6, "yield": 2e3})
    damper = PlacedEffect("maxwell_damper", "secondary_yaw", None, {"stiffness": 1e6, "damping": 1e5})
    friction = PlacedEffect("dry_friction", "secondary_yaw", None, {"force": 1e3})
    assert linearisation_notes(with_effects(damper)) == []
    assert linearisation_notes(with_effects(friction, damper, hysteresis)) == [
        "linear: without dry_friction",
        "linear: hysteresis with the slope at rest, as of small motions",
    ]


def test_a_spring_as_an_effect_equals_the_spring_of_the_vehicle() -> None:
    declared = Model(CHECK.with_values({"vehicle.secondary.lateral_stiffness": 4e5}))
    added = with_effects(PlacedEffect("spring", "secondary_lateral", None, {"stiffness": 4e5}))
    one, other = (critical_speeds(m, m.row[None], 120.0)[0] for m in (declared, added))
    assert one is not None and other is not None
    assert one.speed == pytest.approx(other.speed, abs=1e-6)


def test_a_clearance_has_no_stiffness_at_rest() -> None:
    model = with_effects(PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4}))
    loose = Model(CHECK.with_values({"vehicle.primary.lateral_stiffness": 1e-6}))
    v = np.array([40.0])
    at_rest = eigenvalues(model, model.row[None], v, at_rest=True)[0]
    assert at_rest == pytest.approx(eigenvalues(loose, loose.row[None], v)[0], abs=1e-5)
    assert eigenvalues(model, model.row[None], v)[0] == pytest.approx(
        eigenvalues(Model(CHECK), Model(CHECK).row[None], v)[0], abs=1e-6
    )
