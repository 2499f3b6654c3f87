"""Noise of sensors above the residual of a model that follows the data: lowered to it, unless it was stated."""

from __future__ import annotations

from dataclasses import replace

import pytest

from railui.campaign.noise.model import ESTIMATED, STATED, ColumnNoise, NoiseModel
from railui.identification.context import Context
from railui.identification.estimation.noise_floor import estimate_noise_floor, sensor_noise_errors
from railui.identification.estimation.validation import Validation, validate
from railui.identification.loop import calibrate_only
from railui.identification.residual.sensor_noise_bound import with_noise_within_residual
from railui.report.loop.noise import noise_notes
from tests.blind.simulated import simulated_campaign


@pytest.fixture(scope="module")
def residual() -> tuple[Context, Validation]:
    """The context of a campaign without a missing effect, and the validation of its true model."""
    simulated = simulated_campaign()
    context = replace(simulated.context, nominal=simulated.true_model)
    return context, validate(context, context.nominal, context.dataset.selection)


def with_factor(context: Context, factor: float, source: str, *channels: str) -> Context:
    """The context with the noise of channels times a factor, known from one source."""

    def scaled(c: ColumnNoise, x: float) -> ColumnNoise:
        return replace(c, used=x * c.used, spectrum=c.spectrum.scaled(x), source=source)

    columns = {name: scaled(c, factor if name in channels else 1.0) for name, c in context.noise.columns.items()}
    return replace(context, dataset=replace(context.dataset, noise=NoiseModel(columns)))


def test_noise_far_above_the_residual_is_lowered_to_it(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    found = with_noise_within_residual(with_factor(context, 30.0, ESTIMATED, "e1", "ayf"), validation)
    errors = sensor_noise_errors(found, context.dataset.selection)
    assert [errors[c] for c in ("e1", "ayf")] == pytest.approx([validation.channels[c] for c in ("e1", "ayf")])
    assert {c for c, n in found.noise.columns.items() if n.excess is not None} == {"e1", "ayf"}
    assert found.noise["e2"] == context.noise["e2"]
    floor = estimate_noise_floor(found, context.nominal, context.dataset.selection, 2)
    assert 0.8 * validation.nrmse < floor.nrmse < 1.4 * validation.nrmse
    assert sum("upper bound" in note for note in noise_notes(found.noise)) == 2


def test_a_calibration_alone_lowers_them_as_the_loop_does() -> None:
    dataset = with_factor(simulated_campaign().context, 30.0, ESTIMATED, "e1", "ayf").dataset
    assert 0.8 < calibrate_only(dataset).error_to_noise < 1.2


@pytest.mark.parametrize(("factor", "source"), [(1.0, ESTIMATED), (1.2, ESTIMATED), (30.0, STATED)])
def test_sound_and_stated_levels_are_not_changed(
    residual: tuple[Context, Validation], factor: float, source: str
) -> None:
    context, validation = residual
    given = with_factor(context, factor, source, "e1")
    assert with_noise_within_residual(given, validation) is given
