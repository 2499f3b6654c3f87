"""Settings of a campaign in the loop."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.settings.loop_settings import SETTINGS, LoopSettings
from railui.identification.context import create_context
from railui.identification.estimation.noise_floor import estimate_noise_floor
from railui.identification.loop import calibrate_only
from railui.identification.result import LoopResult
from railui.report.loop.data import loop_report
from tests.blind.simulated import simulated_campaign
from tests.truth.campaign import write


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """A simulated campaign whose file gives settings."""
    directory = tmp_path_factory.mktemp("settings")
    write(simulated_campaign().truth, directory)
    file: Path = directory / "campaign.yaml"
    file.write_text(file.read_text() + "settings: {noise_floor_draws: 3, min_block_duration: 2 s}\n")
    return read_dataset(load_campaign(directory))


@pytest.fixture(scope="module")
def result(dataset: Dataset) -> LoopResult:
    return calibrate_only(dataset, jobs=2)


def test_the_loop_uses_the_settings_of_the_campaign(result: LoopResult):
    assert result.context.settings.changed() == {"noise_floor_draws": 3, "min_block_duration": 2.0}
    assert result.after.block >= 2.0


def test_the_number_of_draws_changes_the_noise_floor(result: LoopResult, dataset: Dataset):
    context = create_context(dataset, jobs=2)
    assert estimate_noise_floor(context, result.after.model, dataset.validation) == result.noise_floor
    default = replace(context, settings=LoopSettings())
    assert estimate_noise_floor(default, result.after.model, dataset.validation) != result.noise_floor


def test_the_report_records_the_value_of_every_setting(result: LoopResult):
    settings = loop_report(result)["settings"]
    assert list(settings) == list(SETTINGS)
    assert settings["noise_floor_draws"] == 3 and settings["window_duration"] == 3.0
