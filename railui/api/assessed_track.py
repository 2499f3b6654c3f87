"""Track assessed by the ride of a reference vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design
from railui.api.display import SummaryRow, draw_on, shown_value
from railui.api.result import DesignResult, input_paths
from railui.ride_quality.track_assessment import SECTION_LENGTH, assess
from railui.ride_quality.track_assessment import check_section_length as check_section_length

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.ride_quality.evaluation import TrackLike
    from railui.track import Track

UNITS: Final[Mapping[str, str]] = {
    "from": "m",
    "to": "m",
    "score": "1",
    "weighted_acceleration": "m/s^2",
    "flange_fraction": "1",
    "largest_e": "m",
    "sum_of_guiding_forces": "N",
    "derailment_quotient": "1",
    "sd_yw": "m",
}
SHOWN: Final = 3  # worst sections of a summary


@dataclass(frozen=True, eq=False)
class Assessment(DesignResult):
    """Sections of a track ranked by the ride of a design; `Design.assess` computes them.

    Attributes
    ----------
    design : Design
        Reference vehicle.
    data : mapping
        The result of `railui.assess`.
    geometry : Track
        The assessed track.

    Examples
    --------
    >>> assessment = Design.load("designs/test_bogie.yaml").assess("erri_b176_high length=1000", 40.0)
    >>> len(assessment.sections), assessment.sections[0]["score"] <= assessment.sections[-1]["score"]
    (5, True)
    """

    COMMAND: ClassVar[str] = "assess"
    units: ClassVar[Mapping[str, str]] = UNITS

    geometry: Track = field(repr=False, kw_only=True)

    @property
    def track(self) -> str:
        """Name of the track."""
        return str(self.data["track"])

    @property
    def speed(self) -> float:
        """Speed [m/s]."""
        return float(self.data["speed"])

    @property
    def sections(self) -> tuple[Mapping[str, Any], ...]:
        """Track sections, worst first."""
        return tuple(self.data["stretches"])

    @property
    def agreement(self) -> float | None:
        """Rank correlation of the order by geometry with that by ride quality."""
        return shown_value(self.data, "agreement")

    def to_frame(self) -> pandas.DataFrame:
        """Return the sections, worst first, as a pandas.DataFrame; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        return frame_of_rows(self.sections, UNITS)

    def plot_score(self, ax: Axes | None = None) -> Axes:
        """Draw the score of the sections along the track, the worst marked."""
        return self._draw("score", ax)

    def plot_geometry(self, ax: Axes | None = None) -> Axes:
        """Draw the standard deviation of the lateral deviation of the sections."""
        return self._draw("sd_yw", ax)

    def plot_flange_contact(self, ax: Axes | None = None) -> Axes:
        """Draw the proportion of flange contact of the sections."""
        return self._draw("flange_fraction", ax)

    def _draw(self, key: str, ax: Axes | None) -> Axes:
        from railui.report.figures.assess import draw_sections

        def draw(on: Axes) -> None:
            draw_sections(on, self.data, key)
            on.set_xlabel("s [m]")

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return track, vehicle and speed."""
        return f"{self.track}, assessed by {self.design.name} at {self.speed:.4g} m/s"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the worst sections and the agreement with the geometry."""
        rows = [
            SummaryRow(f"worst {rank}", f"{one['from']:.0f} to {one['to']:.0f} m, {one['class']}, {one['score']:.1f}")
            for rank, one in enumerate(self.sections[:SHOWN], 1)
        ]
        return [*rows, SummaryRow("rank correlation with geometry", self.agreement, "1")]


def compute_assessment(
    design: Design,
    track: TrackLike,
    speed: float | str,
    *,
    section_length: float | None = None,
    seed: int | None = None,
    jobs: int | None = None,
) -> Assessment:
    """Assess a track by a design; parameters and exceptions as `railui.assess`."""
    from railui.ride_quality.evaluation import excitation_of

    excitation = excitation_of(track, speed, seed)
    source, length = excitation.source, SECTION_LENGTH if section_length is None else section_length
    data = assess(source, design, excitation.speed, section_length=length, jobs=jobs)
    return Assessment(design, data, input_paths(design, source.file), source.seed, geometry=excitation.track)
