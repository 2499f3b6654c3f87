"""Track noise from the residual: its level, what bounds it, and the residuals that it cannot explain."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from railui.campaign.noise.model import ColumnNoise, NoiseModel
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.identification.context import Context
from railui.identification.estimation.noise_floor import NoiseFloor, estimate_noise_floor
from railui.identification.estimation.validation import Validation, validate
from railui.identification.residual import track_noise
from railui.identification.residual.track_noise import with_level_of_residual, with_track_noise
from tests.blind.simulated import simulated_campaign

TRUE_YW = 2e-5  # m, of the generator
TRACK = ("yw", "phiw", "gauge")


def with_levels(context: Context, factor: float | None, log_sd: float) -> Context:
    """The context with the true track noise times a factor, or without any, known so closely."""
    columns = {c: n for c, n in context.noise.columns.items() if c not in TRACK}
    if factor is not None:
        levels = {"yw": TRUE_YW, "phiw": TRUE_YW / 0.75, "gauge": 2 * TRUE_YW}
        columns |= {c: ColumnNoise(factor * x, NoiseSpectrum(factor * x), log_sd=log_sd) for c, x in levels.items()}
    return replace(context, dataset=replace(context.dataset, noise=NoiseModel(columns)))


@pytest.fixture(scope="module")
def residual() -> tuple[Context, Validation]:
    """The context of a campaign without a missing effect, and the validation of its true model."""
    simulated = simulated_campaign()
    context = replace(simulated.context, nominal=simulated.true_model)
    return context, validate(context, context.nominal, context.dataset.selection)


def level_found(context: Context, validation: Validation) -> float | None:
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    found = with_track_noise(context, context.nominal, validation, floor)
    return None if found is None else found.noise["yw"]


def test_the_level_is_found_from_one_that_is_too_small(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    found = level_found(with_levels(context, 0.5, np.log(2.0)), validation)
    assert found == pytest.approx(TRUE_YW, rel=0.15)


@pytest.mark.parametrize(("log_sd", "level"), [(np.log(2.0), TRUE_YW), (np.log(1.02), 0.5 * TRUE_YW)])
def test_the_estimates_take_the_level_of_the_residual_unless_it_is_known_closely(
    residual: tuple[Context, Validation], log_sd: float, level: float
) -> None:
    context, validation = residual
    context = with_levels(context, 0.5, log_sd)
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    found = with_level_of_residual(context, context.nominal, validation, floor)
    assert found.noise["yw"] == pytest.approx(level, rel=0.15)


def test_the_level_is_found_where_none_is_stated(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    found = level_found(with_levels(context, None, 0.0), validation)
    assert found == pytest.approx(TRUE_YW, rel=0.3)  # with another share of gauge and cross-level noise


def test_the_floor_with_the_level_found_is_the_error(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    context = with_levels(context, 0.5, np.log(2.0))
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    found = with_track_noise(context, context.nominal, validation, floor)
    assert found is not None
    floor = estimate_noise_floor(found, context.nominal, context.dataset.selection)
    assert floor.nrmse == pytest.approx(validation.nrmse, rel=0.02)


def test_a_level_that_is_known_closely_stays(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    assert level_found(with_levels(context, 0.5, np.log(1.2)), validation) is None


def test_what_is_left_bounds_a_level_that_was_stated_closely(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    assert level_found(with_levels(context, 2.0, np.log(1.02)), validation) == pytest.approx(TRUE_YW, rel=0.15)


def test_the_level_found_has_the_scatter_of_a_realisation(
    residual: tuple[Context, Validation], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A floor that scatters by half of itself widens the limit: twice the stated level is believed then."""
    context, validation = residual
    context = with_levels(context, 0.5, np.log(1.2))
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    assert with_track_noise(context, context.nominal, validation, floor) is None

    def scattered(*arguments: Any) -> NoiseFloor:
        found = estimate_noise_floor(*arguments)
        share = (found.nrmse**2 - found.sensors_only**2) / found.nrmse**2  # d ln(level) = share^-1 d ln(error)
        return replace(found, sd=0.5 * share * found.nrmse)

    monkeypatch.setattr(track_noise, "estimate_noise_floor", scattered)
    found = with_track_noise(context, context.nominal, validation, floor)
    assert found is not None
    assert found.noise.log_sd("yw") == pytest.approx(np.hypot(np.log(1.3), 0.5), rel=1e-6)


def test_a_level_next_to_sensor_noise_is_as_uncertain_as_a_stated_one(residual: tuple[Context, Validation]) -> None:
    """The interval of the floor stays of its size, where hardly anything is left for noise of the track."""
    context, validation = residual
    context = with_levels(context, None, 0.0)
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    ratio = 1.01 * floor.sensors_only / validation.nrmse
    small = replace(
        validation,
        nrmse=ratio * validation.nrmse,
        channels={c: 1.01 * e for c, e in floor.channels.items()},
    )
    found = with_track_noise(context, context.nominal, small, floor)
    assert found is not None
    assert found.noise.log_sd("yw") == pytest.approx(np.hypot(np.log(1.3), np.log(2.0)))
    assert estimate_noise_floor(found, context.nominal, context.dataset.selection).interval[1] < 1.5 * floor.nrmse


@pytest.mark.parametrize("share", [0.1, 0.02])
def test_a_tiny_level_that_is_known_closely_stays(residual: tuple[Context, Validation], share: float) -> None:
    """However uncertain the noise of the sensors leaves it, where the floor is hardly above theirs."""
    context, validation = residual
    assert level_found(with_levels(context, share, np.log(1.02)), validation) is None


def test_a_track_stated_without_noise_has_none(
    residual: tuple[Context, Validation], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No noise is simulated to find this."""
    context, validation = residual
    context = with_levels(context, 0.0, 0.0)
    floor = estimate_noise_floor(context, context.nominal, context.dataset.selection)
    monkeypatch.setattr(track_noise, "estimate_noise_floor", None)
    assert with_track_noise(context, context.nominal, validation, floor) is None


def test_an_error_of_one_channel_alone_is_no_track_noise(residual: tuple[Context, Validation]) -> None:
    context, validation = residual
    context = with_levels(context, 1.0, np.log(2.0))
    channels = {**validation.channels, "ayf": 10.0 * validation.channels["ayf"]}
    larger = replace(validation, channels=channels, nrmse=float(np.sqrt(np.mean(np.square(list(channels.values()))))))
    assert level_found(context, larger) is None


def test_a_channel_with_less_error_than_such_noise_leaves_speaks_against_it(
    residual: tuple[Context, Validation],
) -> None:
    context, validation = residual
    context = with_levels(context, 0.5, np.log(2.0))
    assert level_found(context, validation) is not None
    channels = dict(validation.channels)
    small = min(channels, key=lambda c: channels[c])
    channels[small] *= 0.5
    rest = validation.nrmse**2 * len(channels) - channels[small] ** 2
    other = max(channels, key=lambda c: channels[c])
    others = sum(e**2 for c, e in channels.items() if c not in (small, other))
    channels[other] = float(np.sqrt(rest - others))  # the same error in all
    assert level_found(context, replace(validation, channels=channels)) is None


@pytest.mark.parametrize(("factor", "is_noise"), [(10.0, True), (100.0, False)])
def test_without_a_stated_level_noise_of_the_track_is_at_most_a_share_of_the_alignment(
    residual: tuple[Context, Validation], factor: float, is_noise: bool
) -> None:
    """A residual in the proportions of track noise, of 0.2 mm and of 2 mm on an alignment of 2.2 mm."""
    context = with_levels(residual[0], None, 0.0)
    assumed = track_noise._with(context, track_noise._assumed(context))
    channels = estimate_noise_floor(assumed, context.nominal, context.dataset.selection).channels
    errors = {c: factor * e for c, e in channels.items()}
    validation = replace(residual[1], channels=errors, nrmse=float(np.sqrt(np.mean(np.square(list(errors.values()))))))
    found = level_found(context, validation)
    assert (found is not None) is is_noise
