"""All settings of the loop, by stage and by name."""

from __future__ import annotations

import dataclasses
import math
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

# Draws of a null hypothesis beyond its quantile. Derived: n of them give the probability of the quantile with a
# relative standard error of 1/sqrt(n), 25 %.
MIN_TAIL_DRAWS = 16.0


class SettingsConflict(ValueError):
    """Settings that do not go together: the name of one of them, and a remedy."""

    def __init__(self, name: str, message: str, remedy: str) -> None:
        self.name, self.message, self.remedy = name, message, remedy
        super().__init__(f"{name}: {message}, {remedy}")

    def __reduce__(self) -> tuple[type[SettingsConflict], tuple[str, str, str]]:
        return SettingsConflict, (self.name, self.message, self.remedy)


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

    def __post_init__(self) -> None:
        """Refuse a level that the Monte-Carlo draws of its test do not resolve.

        Raises
        ------
        SettingsConflict
            For fewer than `MIN_TAIL_DRAWS` draws beyond the quantile of a level.
        """
        _check_draws("significance_level", self.score_test.significance_level, self.score_test.bootstrap_draws)
        _check_draws("run_dependence_level", self.run_dependence.run_dependence_level, self.score_test.bootstrap_draws)

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
        SettingsConflict
            For values that do not go together.

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


def _check_draws(name: str, level: float, draws: int) -> None:
    """Refuse a level at which fewer than `MIN_TAIL_DRAWS` of the draws of its test lie beyond the quantile."""
    if (1 + draws) * level >= MIN_TAIL_DRAWS:
        return
    least_draws = math.ceil(MIN_TAIL_DRAWS / level - 1.0)
    least_level = math.ceil(1e4 * MIN_TAIL_DRAWS / (1 + draws)) / 1e4
    remedy = f"give bootstrap_draws of at least {least_draws}, or a level of at least {least_level:g}"
    raise SettingsConflict(name, f"{draws} bootstrap_draws do not resolve a level of {level:g}", remedy)


SETTINGS: dict[str, Setting] = {
    s.name: s
    for f in dataclasses.fields(LoopSettings)
    for s in declared(f.name, f.default_factory)  # type: ignore[arg-type]
}
