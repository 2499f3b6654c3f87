"""Settings of the loop: their declarations, and how a campaign changes them."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.settings.declaration import Setting
from railui.campaign.settings.loop_settings import SETTINGS, LoopSettings, SettingsConflict
from railui.documents.saving import save_campaign
from railui.documents.schema import json_schema
from railui.io.problems import FileProblems
from railui.io.units import quantity

KINDS_OF_PROVENANCE = ("derived: ", "trial: ", "conventional: ", "chosen by hand")


def campaign_with(settings: str, directory: Path) -> Path:
    """Append a settings block to the campaign of a directory."""
    file = directory / "campaign.yaml"
    file.write_text(file.read_text() + settings)
    return file


@pytest.mark.parametrize("setting", SETTINGS.values(), ids=list(SETTINGS))
def test_each_setting_has_a_unit_a_meaning_and_a_provenance(setting: Setting) -> None:
    assert quantity(f"2 {setting.unit}", setting.unit) == 2.0 if setting.unit != "1" else setting.default is not None
    assert setting.meaning[0].isupper() and setting.meaning.endswith(".") and len(setting.meaning.split()) > 3
    assert setting.provenance.startswith(KINDS_OF_PROVENANCE)
    assert setting.minimum is None or setting.minimum <= setting.default
    assert setting.maximum is None or setting.default <= setting.maximum


def test_setting_names_are_unique_over_all_stages() -> None:
    assert list(LoopSettings().values()) == list(SETTINGS)
    assert LoopSettings().changed() == {}


def test_a_campaign_gives_settings_with_units(campaign_folder: Path) -> None:
    file = campaign_with("settings:\n  window_duration: 4000 ms\n  max_effects: 2\n", campaign_folder)
    settings = load_campaign(file).settings
    assert settings.changed() == {"window_duration": 4.0, "max_effects": 2}
    assert settings.windows.window_duration == 4.0


def test_an_empty_settings_block_keeps_the_defaults(campaign_folder: Path) -> None:
    assert load_campaign(campaign_with("settings:\n", campaign_folder)).settings == LoopSettings()


@pytest.mark.parametrize(
    ("line", "message", "remedy"),
    [
        ("conicty_step: 0.7", "unknown key", "did you mean 'conicity_step'?"),
        ("max_effects: 2.5", "2.5 is not an integer from 1 on", "write for example 1"),
        ("conicity_step: 1.5", "1.5 is too large", "give at most 0.99"),
        ("window_duration: 4 kg", "'4 kg' has the unit kg, a unit like s is expected", "write for example '2 s'"),
    ],
)
def test_a_faulty_setting_is_reported_at_its_line(line: str, message: str, remedy: str, campaign_folder: Path) -> None:
    file = campaign_with(f"settings:\n  {line}\n", campaign_folder)
    with pytest.raises(FileProblems) as raised:
        load_campaign(file)
    problem = raised.value.problems[0]
    assert (problem.message, problem.remedy) == (message, remedy)
    assert problem.line == len(file.read_text().splitlines())


@pytest.mark.parametrize("name", ["significance_level", "run_dependence_level"])
def test_a_level_that_the_draws_do_not_resolve_is_refused(name: str) -> None:
    """Sixteen draws beyond the quantile are required; at a level of 1e-4 even the least p of 2000 draws is higher."""
    assert LoopSettings().with_values({name: 0.0081}).changed() == {name: 0.0081}
    remedy = "give bootstrap_draws of at least 159999, or a level of at least 0.008"
    with pytest.raises(SettingsConflict, match=f"{name}: 2000 bootstrap_draws .* level of 0.0001, {remedy}"):
        LoopSettings().with_values({name: 1e-4})
    assert LoopSettings().with_values({name: 1e-4, "bootstrap_draws": 159999}).changed()[name] == 1e-4


def test_too_few_draws_for_the_levels_are_refused() -> None:
    with pytest.raises(SettingsConflict, match=r"100 bootstrap_draws do not resolve a level of 0\.01"):
        LoopSettings().with_values({"bootstrap_draws": 100})


def test_settings_that_do_not_go_together_are_reported_at_the_line_of_the_level(campaign_folder: Path) -> None:
    file = campaign_with("settings:\n  bootstrap_draws: 200\n  significance_level: 0.05\n", campaign_folder)
    with pytest.raises(FileProblems) as raised:
        load_campaign(file)
    problem = raised.value.problems[0]
    assert (problem.key, problem.message) == (
        "settings.significance_level",
        "200 bootstrap_draws do not resolve a level of 0.05",
    )
    assert problem.line == len(file.read_text().splitlines())


def test_saving_a_campaign_keeps_its_settings(campaign_folder: Path) -> None:
    campaign = load_campaign(campaign_with("settings: {adequate_ratio: 1.2}\n", campaign_folder))
    saved = load_campaign(save_campaign(campaign, campaign_folder / "saved.yaml"))
    assert saved.settings == campaign.settings
    assert saved.settings.changed() == {"adequate_ratio": 1.2}


def test_the_json_schema_lists_every_setting() -> None:
    properties = json_schema("campaign")["$defs"]["SettingsModel"]["properties"]
    assert list(properties) == list(SETTINGS)
    assert properties["max_effects"] == {
        "default": 3,
        "minimum": 1,
        "title": "Effects that may be added",
        "type": "integer",
    }
