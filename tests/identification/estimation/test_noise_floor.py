"""Noise floor of models that diverge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.campaign.noise.model import ColumnNoise, NoiseModel
from railui.campaign.noise.spectrum import NoiseSpectrum
from railui.identification.estimation.noise_floor import _interval, estimate_noise_floor, noise_weights
from railui.progress import Progress
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.model import Model
from tests.blind.simulated import simulated_campaign
from tests.blind.true_floor import true_noise_floor


class Lines(Progress):
    """Messages of an estimation."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def message(self, text: str) -> None:
        """Collect a message."""
        self.texts.append(text)


def unstable(model: Model) -> Model:
    return model.with_path_values(["contact.leading.conicity", "contact.trailing.conicity"], np.array([3.0, 3.0]))


def test_a_model_that_diverges_has_no_noise_floor() -> None:
    case = simulated_campaign()
    hunting = unstable(case.context.nominal)
    lines = Lines()
    context = replace(case.context, progress=lines)
    floor = estimate_noise_floor(context, hunting, context.dataset.selection, 3)
    assert np.isnan(floor.nrmse) and all(np.isnan(x) for x in floor.channels.values())
    assert lines.texts == ["the model diverges in 3 of 3 realisations of the noise"]


def test_a_model_that_is_too_stiff_has_no_noise_floor() -> None:
    case = simulated_campaign()
    lines = Lines()
    context = replace(case.context, progress=lines)
    stiff = case.context.nominal.with_effect(PlacedEffect("spring", "primary_lateral", None, {"stiffness": 1e13}))
    floor = estimate_noise_floor(context, stiff, context.dataset.selection, 2)
    assert np.isnan(floor.nrmse)
    assert lines.texts[0].startswith("no noise floor on run_b") and "steps" in lines.texts[0]


def test_its_channels_are_weighted_by_noise_of_the_sensors() -> None:
    case = simulated_campaign()
    hunting = unstable(case.context.nominal)
    segment = case.dataset.estimation[0]
    of_sensors, of_both = (noise_weights(case.context, m, segment) for m in (hunting, case.context.nominal))
    assert np.all(np.isfinite(of_sensors)) and np.all(of_sensors >= of_both)


def test_the_interval_of_a_rig_has_the_uncertainty_of_its_input() -> None:
    """Half of the squared floor comes from the input, whose level is known to a factor of exp(0.5)."""
    noise = NoiseModel({c: ColumnNoise(1.0, NoiseSpectrum(1.0), log_sd=x) for c, x in (("z", 0.0), ("u", 0.5))})
    low, high = _interval(noise, ["u"], [{"z": 0.2}], [{"z": 0.2 / np.sqrt(2.0)}], 0.0, 10)
    ends = 0.2 * np.sqrt(0.5 * (1.0 + np.exp(2.0 * 0.5 * 1.645 * np.array([-1.0, 1.0]))))
    np.testing.assert_allclose([low, high], ends, rtol=0.03)


@pytest.mark.parametrize("draws", [5, 10])
def test_the_interval_contains_nine_of_ten_further_realisations(draws: int) -> None:
    noise = NoiseModel({"z": ColumnNoise(1.0, NoiseSpectrum(1.0), log_sd=0.0)})
    rng, inside = np.random.default_rng(2), []
    for _ in range(400):
        *known, further = 1.0 + 0.01 * rng.standard_normal(draws + 1)
        mean, sd = float(np.mean(known)), float(np.std(known, ddof=1))
        low, high = _interval(noise, [], [{"z": mean}], [{"z": mean}], sd, draws)
        inside.append(low <= further <= high)
    assert np.mean(inside) == pytest.approx(0.9, abs=0.035)


def test_the_floor_from_the_noise_that_the_generator_added_is_the_estimated_one() -> None:
    simulated = simulated_campaign()
    estimated = estimate_noise_floor(simulated.context, simulated.true_model, simulated.dataset.validation)
    added = true_noise_floor(simulated.context, simulated.true_model, simulated.truth.clean)
    assert added == pytest.approx(estimated.nrmse, rel=0.1)
