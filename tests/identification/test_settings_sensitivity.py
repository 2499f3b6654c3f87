"""Sensitivity of the verdict to the settings: each is varied by 20 % to either side on every campaign at hand.

pytest -m slow tests/identification/test_settings_sensitivity.py -k worn_axle_box -s

Prints the settings on which a verdict or an effect depends and writes all outcomes to
target/settings_sensitivity.json. A setting that the reference run does not read cannot change it and is not varied;
one that is read after the calibration only leaves the calibrated model as it is, which is then not fitted again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.settings.declaration import Setting
from railui.campaign.settings.loop_settings import SETTINGS, LoopSettings
from railui.identification import base_model
from railui.identification.events import ModelValidated
from railui.identification.loop import close_loop
from railui.identification.result import LoopResult
from railui.progress import Progress

ROOT = Path(__file__).parents[2]
SHARED = ROOT.parent / "shared" / "runs"
REPORT = ROOT / "target" / "settings_sensitivity.json"
VARIATIONS = (0.8, 1.2)
# verdict and effects of each campaign with the default settings
REFERENCES = {
    "bundled_worn_axle_box": ("effect", ["free_play primary_lateral"]),
    "blind_a": ("effect", ["gauge_conicity contact"]),
    "blind_b": ("effect", ["maxwell_damper secondary_yaw"]),
    "low_adhesion": ("effect", ["creep_saturation contact"]),
    "nothing_missing": ("none", []),
    "stiff_friction": ("effect", ["dry_friction secondary_lateral"]),
    "worn_axle_box": ("effect", ["free_play primary_lateral"]),
}


@dataclass(frozen=True)
class Outcome:
    """Conclusion of the loop: verdict, effects, location of a discrepancy; and its errors."""

    verdict: str
    effects: tuple[str, ...]
    location: str
    nrmse: float
    error_to_noise: float

    def agrees_with(self, other: Outcome) -> bool:
        """True for the same verdict, effects and location."""
        mine, theirs = ((o.verdict, o.effects, o.location) for o in (self, other))
        return mine == theirs


class ReadRecorder:
    """Settings of one stage that record which of them are read."""

    def __init__(self, stage: Any, read: set[str]) -> None:
        self._stage = stage
        self._read = read

    def __getattr__(self, name: str) -> Any:
        self._read.add(name)
        return getattr(self._stage, name)


def recording(settings: LoopSettings, read: set[str]) -> LoopSettings:
    """Return settings that record in `read` which of them are read."""
    groups = {setting.group for setting in SETTINGS.values()}
    recorded = LoopSettings(**{group: ReadRecorder(getattr(settings, group), read) for group in groups})  # type: ignore[arg-type]
    read.clear()  # of the check of the settings themselves
    return recorded


def campaign_directories() -> Iterator[tuple[str, Path]]:
    """List the bundled campaigns and those next to the repository by name."""
    for parent, prefix in ((ROOT / "designs" / "campaigns", "bundled_"), (SHARED, "")):
        for file in sorted(parent.glob("*/campaign.yaml")):
            yield prefix + file.parent.name, file.parent


def varied_value(setting: Setting, factor: float) -> float | int:
    """Vary a setting by a factor, a count by at least 1, within its bounds."""
    value: float = setting.default * factor
    if setting.is_whole:
        value = math.ceil(value) if factor > 1.0 else math.floor(value)
    low = -math.inf if setting.minimum is None else setting.minimum
    high = math.inf if setting.maximum is None else setting.maximum
    limited = min(max(value, low), high)
    return int(limited) if setting.is_whole else limited


def with_settings(dataset: Dataset, settings: LoopSettings) -> Dataset:
    return replace(dataset, campaign=replace(dataset.campaign, settings=settings))


def outcome(result: LoopResult) -> Outcome:
    """Summarise the result of a loop."""
    effects = [e for e in result.after.model.effects if e.kind != "measured_force"]
    found = result.discrepancy
    return Outcome(
        result.verdict,
        tuple(f"{e.kind} {e.at}" + (f" {e.wheelset}" if e.wheelset else "") for e in effects),
        "" if found is None else f"{found.at} {found.wheelset or ''}".strip(),
        result.validations["after"].nrmse,
        result.error_to_noise,
    )


class CalibrationReads(Progress):
    """Settings that have been read when the calibrated model has been validated."""

    def __init__(self, read: set[str]) -> None:
        self._read = read
        self.names: frozenset[str] = frozenset()

    def event(self, event: object) -> None:
        """Keep what has been read up to the end of the calibration."""
        if isinstance(event, ModelValidated) and event.stage == "before":
            self.names = frozenset(self._read)


@dataclass(frozen=True)
class Reference:
    """Result of the loop with default settings, and which of them are read, in all and by the calibration."""

    result: LoopResult
    read: frozenset[str]
    read_by_calibration: frozenset[str]


def run_reference(dataset: Dataset) -> Reference:
    """Run the loop with default settings."""
    read: set[str] = set()
    progress = CalibrationReads(read)
    result = close_loop(with_settings(dataset, recording(LoopSettings(), read)), jobs=2, progress=progress)
    return Reference(result, frozenset(read), progress.names)


def run_with(dataset: Dataset, reference: Reference, setting: Setting, value: float | int) -> Outcome:
    """Run the loop with one setting changed; an exception is an outcome as well."""
    settings = LoopSettings().with_values({setting.name: value})
    result = reference.result
    with pytest.MonkeyPatch.context() as patch:
        if setting.name not in reference.read_by_calibration:
            patch.setattr(base_model, "calibrate", lambda context: result.before)
            patch.setattr(base_model, "refit_hunting", lambda context, before: (before, result.windowed))
        return _run(with_settings(dataset, settings))


def _run(dataset: Dataset) -> Outcome:
    try:
        return outcome(close_loop(dataset, jobs=2))
    except (ValueError, ArithmeticError) as error:
        return Outcome(f"{type(error).__name__}: {error}", (), "", math.nan, math.nan)


def vary_settings(dataset: Dataset, reference: Reference) -> Iterator[dict[str, Any]]:
    """Vary every setting that the reference run reads; one row per setting and variation."""
    concluded = outcome(reference.result)
    for setting in SETTINGS.values():
        for factor in VARIATIONS if setting.name in reference.read else ():
            value = varied_value(setting, factor)
            row: dict[str, Any] = {"setting": setting.name, "default": setting.default, "value": value}
            if value == setting.default:
                yield row | {"note": "at its bound"}
                continue
            changed = run_with(dataset, reference, setting, value)
            yield row | asdict(changed) | {"decisive": not changed.agrees_with(concluded)}


def table(name: str, reference: Outcome, rows: list[dict[str, Any]], unread: list[str]) -> str:
    """Format the settings on which the conclusion depends."""
    decisive = [row for row in rows if row.get("decisive")]
    lines = [
        f"\n{name}: {reference.verdict} {', '.join(reference.effects)} {reference.location}".rstrip(),
        f"  {len(rows)} variations, {len(decisive)} decisive; {len(unread)} settings not read",
    ]
    for row in decisive:
        conclusion = f"{row['verdict']} {', '.join(row['effects'])} {row['location']}".rstrip()
        lines.append(
            f"  {row['setting']:28s} {row['default']:10.4g} -> {row['value']:10.4g}  {conclusion}"
            f"  ({row['error_to_noise']:.2f} of the floor)"
        )
    return "\n".join(lines)


def write_report(name: str, entry: dict[str, Any]) -> None:
    """Add the entry of a campaign to the report."""
    report = json.loads(REPORT.read_text()) if REPORT.exists() else {}
    REPORT.parent.mkdir(parents=True, exist_ok=True)
    REPORT.write_text(json.dumps(report | {name: entry}, indent=1) + "\n")


CAMPAIGNS = list(campaign_directories())


@pytest.mark.slow
@pytest.mark.timeout(6 * 3600)
@pytest.mark.parametrize(
    ("name", "directory"), list(campaign_directories()), ids=[n for n, _ in campaign_directories()]
)
def test_each_setting_is_varied_by_a_fifth(name: str, directory: Path):
    dataset = read_dataset(load_campaign(directory))
    reference = run_reference(dataset)
    concluded = outcome(reference.result)
    assert concluded.verdict in ("effect", "partial", "none", "outside")
    if name in REFERENCES:
        assert (concluded.verdict, list(concluded.effects)) == REFERENCES[name]
    unread = [setting for setting in SETTINGS if setting not in reference.read]
    rows: list[dict[str, Any]] = []
    for row in vary_settings(dataset, reference):
        rows.append(row)
        write_report(name, {"reference": asdict(concluded), "rows": rows, "not_read": unread})
    print(table(name, concluded, rows, unread))
    assert {row["setting"] for row in rows} | set(unread) == set(SETTINGS)
    assert len(rows) == len(VARIATIONS) * len(reference.read)
    assert all("note" in row or "decisive" in row for row in rows)


def test_reading_a_setting_is_recorded():
    read: set[str] = set()
    settings = recording(LoopSettings(), read)
    assert settings.windows.window_duration == 3.0
    assert read == {"window_duration"}


def test_a_variation_changes_a_count_by_one_at_least_and_keeps_the_bounds():
    assert [varied_value(SETTINGS["max_effects"], f) for f in VARIATIONS] == [2, 4]
    assert [varied_value(SETTINGS["adequate_ratio"], f) for f in VARIATIONS] == [1.0, pytest.approx(1.32)]
    assert varied_value(SETTINGS["max_drift"], 1.2) == SETTINGS["max_drift"].maximum
