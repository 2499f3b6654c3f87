"""All settings of the loop, by stage and by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from railui.campaign.settings.declaration import Setting, declared
from railui.campaign.settings.detection import RefitSettings, ScoreTestSettings, SelectionSettings
from railui.campaign.settings.discrepancy import (
    CoefficientSettings,
    DiscrepancySettings,
    DriftSettings,
    RunDependenceSettings,
)
from railui.campaign.settings.estimation import (
    CalibrationSettings,
    IdentifiabilitySettings,
    InitialStateSettings,
    ValidationSettings,
    WindowSettings,
)
from railui.campaign.settings.faults import FaultSettings
from railui.campaign.settings.noise import NoiseSettings
from railui.campaign.settings.notes import NoteSettings
from railui.campaign.settings.planning import PlanningSettings
from railui.campaign.settings.verdict import VerdictSettings


@dataclass(frozen=True)
class LoopSettings:
    """Thresholds that steer the verdict of the loop, grouped by stage.

    Names are unique over all stages: a campaign sets them by name alone. Numbers of the methods themselves, such as
    windows of spectra, steps of differences and grids of lags, are constants of their modules.
    """

    faults: FaultSettings = field(default_factory=FaultSettings)
    calibration: CalibrationSettings = field(default_factory=CalibrationSettings)
    initial_state: InitialStateSettings = field(default_factory=InitialStateSettings)
    windows: WindowSettings = field(default_factory=WindowSettings)
    validation: ValidationSettings = field(default_factory=ValidationSettings)
    identifiability: IdentifiabilitySettings = field(default_factory=IdentifiabilitySettings)
    score_test: ScoreTestSettings = field(default_factory=ScoreTestSettings)
    refit: RefitSettings = field(default_factory=RefitSettings)
    selection: SelectionSettings = field(default_factory=SelectionSettings)
    verdict: VerdictSettings = field(default_factory=VerdictSettings)
    drift: DriftSettings = field(default_factory=DriftSettings)
    discrepancy: DiscrepancySettings = field(default_factory=DiscrepancySettings)
    run_dependence: RunDependenceSettings = field(default_factory=RunDependenceSettings)
    coefficients: CoefficientSettings = field(default_factory=CoefficientSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    planning: PlanningSettings = field(default_factory=PlanningSettings)
    notes: NoteSettings = field(default_factory=NoteSettings)

    def values(self) -> dict[str, float | int]:
        """Value of every setting by its name."""
        return {s.name: getattr(getattr(self, s.group), s.name) for s in SETTINGS.values()}

    def changed(self) -> dict[str, float | int]:
        """Values that differ from their defaults."""
        return {name: value for name, value in self.values().items() if value != SETTINGS[name].default}

    def with_values(self, values: Mapping[str, float | int]) -> LoopSettings:
        """Settings with other values.

        Raises
        ------
        KeyError
            For a name that is no setting.

        Examples
        --------
        >>> LoopSettings().with_values({"conicity_step": 0.7}).changed()
        {'conicity_step': 0.7}
        """
        stages: dict[str, dict[str, float | int]] = {}
        for name, value in values.items():
            stages.setdefault(SETTINGS[name].group, {})[name] = value
        replaced: dict[str, Any] = {
            group: dataclasses.replace(getattr(self, group), **some) for group, some in stages.items()
        }
        return dataclasses.replace(self, **replaced)


SETTINGS: dict[str, Setting] = {
    s.name: s
    for f in dataclasses.fields(LoopSettings)
    for s in declared(f.name, f.default_factory)  # type: ignore[arg-type]
}
