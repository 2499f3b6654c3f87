"""Settings of the next run: which models are rivals, and when a run separates them."""

from __future__ import annotations

from dataclasses import dataclass

from railui.campaign.settings.declaration import setting


@dataclass(frozen=True)
class PlanningSettings:
    """Rival models of a loop and the run that separates them."""

    separation_level: float = setting(
        0.05,
        minimum=1e-6,
        maximum=0.5,
        meaning="One-sided level of Vuong's test at which a run separates two models.",
        provenance="conventional: 5 %",
    )
    max_rivals: int = setting(3, minimum=1, meaning="Models that are compared with the final one.")
    equivalent_difference: float = setting(
        0.2,
        minimum=0.0,
        meaning="Difference of the motions that two rivals predict, as a share of what their effects change, below "
        "which they are equivalent where no run separates them.",
        provenance="conventional: a stop without clearance and a spring, one law, differ by 0.03 to 0.1",
    )
    equivalent_chance: float = setting(
        0.8,
        minimum=0.0,
        maximum=1.0,
        meaning="Chance of the best run to separate two rivals below which they may be equivalent.",
        provenance="conventional: a run that decides in four cases of five is worth its proposal",
    )
    weak_effect_score: float = setting(
        1.0, meaning="Score in standard deviations from which a weak effect is a rival of the model without it."
    )

    @property
    def critical_z(self) -> float:
        """Normal quantile of the separation level."""
        from scipy import special  # imported here: every command reads the settings

        return float(-special.ndtri(self.separation_level))
