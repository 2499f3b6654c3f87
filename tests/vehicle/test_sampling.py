"""Parameterised models: kernel rows from values at paths, samples of a covariance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model
from railui.vehicle.sampling import ParameterisedModel, covariance_root, draw_deviations

BOGIE = Path(__file__).parents[2] / "designs/test_bogie.yaml"


def test_rows_equal_those_of_the_design_with_the_values_and_defaults_of_effects() -> None:
    text = BOGIE.read_text("utf-8") + (
        "effects:\n  - {kind: flange_contact}\n"
        "  - {kind: cubic_stiffness, at: primary_lateral}\n"
        "  - {kind: free_play, at: primary_lateral, wheelset: 2, half_width: 0.3 mm}\n"
    )
    design = load_design(text)
    paths = ("vehicle.primary.lateral_stiffness", "contact.flange_clearance", "effects.2.half_width")
    x = np.array([[2e6, 5e-3, 1e-4], [7e6, 9e-3, 5e-4]])
    expected = [Model(design.with_values(dict(zip(paths, values, strict=True)))).row for values in x]
    np.testing.assert_array_equal(ParameterisedModel(Model(design), paths).rows(x), expected)


def test_samples_follow_the_covariance_of_the_calibrated_parameters() -> None:
    names = "[contact.leading.conicity, vehicle.secondary.yaw_damping]"
    text = f"adjustment: {{campaign: c, names: {names}, covariance: [[1.0e-4, 0], [0, 1.0e+6]]}}\n"
    design = load_design(BOGIE.read_text("utf-8") + text)
    samples = draw_deviations(design, 200, [1])
    sd = np.std([list(sample.values()) for sample in samples], axis=0)
    assert sd == pytest.approx([0.01, 1e3], rel=0.2)
    assert samples[:5] == draw_deviations(design, 5, [1]) != draw_deviations(design, 5, [2])


def test_a_deviation_is_added_to_the_value_and_limited_to_the_permitted_range() -> None:
    design = load_design(BOGIE)
    conicity, mass = "contact.leading.conicity", "vehicle.frame.mass"
    model = ParameterisedModel(Model(design), (conicity,), {conicity: 0.02, mass: -1e6})
    rows, columns = model.rows(np.array([[0.1], [0.3]])), model.model.columns
    assert rows[:, columns[conicity]] == pytest.approx([0.12, 0.32])
    assert rows[:, columns[mass]] == pytest.approx(0.01 * design.value(mass))


def test_a_deviation_cannot_make_a_length_negative() -> None:
    wheelbase = "vehicle.geometry.half_wheelbase"
    model = ParameterisedModel(Model(load_design(BOGIE)), (), {wheelbase: -9.0})
    assert model.rows(np.zeros((1, 0)))[0, model.model.columns[wheelbase]] > 0


def test_draws_of_parameters_of_very_different_size_have_their_covariance() -> None:
    """Random correlations of 17 parameters, standard deviations from 1e-4 to 1e7."""
    random = np.random.default_rng(3)
    factors = random.normal(size=(17, 20))
    correlation = np.corrcoef(factors + 2.0 * random.normal(size=20))
    sd = 10.0 ** np.linspace(-4, 7, 17)
    root = covariance_root(correlation * np.outer(sd, sd))
    draws = root @ random.standard_normal((17, 20_000))
    assert draws.std(axis=1) / sd == pytest.approx(np.ones(17), abs=0.02)
    assert np.max(np.abs(np.corrcoef(draws) - correlation)) < 0.03


def test_samples_of_a_calibrated_design_are_drawn_in_the_order_of_the_seed() -> None:
    names, rows = "[contact.leading.conicity, vehicle.secondary.yaw_damping]", [[0.001 * i, 10.0 * i] for i in range(8)]
    text = f"adjustment: {{campaign: c, names: {names}, covariance: [[1.0, 0], [0, 1.0]], samples: {rows}}}\n"
    design = load_design(BOGIE.read_text("utf-8") + text)
    drawn = draw_deviations(design, 8, [1])
    assert sorted(list(one.values()) for one in drawn) == rows
    assert drawn[:3] == draw_deviations(design, 3, [1]) != draw_deviations(design, 3, [2])
    with pytest.raises(ValueError, match="9 samples of a design that has 8"):
        draw_deviations(design, 9, [1])
