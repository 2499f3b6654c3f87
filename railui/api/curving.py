"""Quasi-static curving of a design over radii."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

from railui.api.design import Design
from railui.api.display import SummaryRow, draw_on
from railui.api.result import DesignResult, input_paths

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

UNITS: Final[Mapping[str, str]] = {
    "radius": "m",
    "displacement": "m",
    "angle_of_attack": "rad",
    "guiding_force": "N",
    "derailment_quotient": "1",
    "wear_number": "N",
}
OF_WHEELSETS: Final = ("displacement", "angle_of_attack", "guiding_force")


@dataclass(frozen=True, eq=False)
class Curve(DesignResult):
    """Equilibria of a design in curves; `Design.curve` computes them.

    Attributes
    ----------
    design : Design
    data : mapping
        The result of `railui.curve`; of several radii `cases`, a list of these, and `notes`.

    Examples
    --------
    >>> curve = Design.load("designs/check_bogie.yaml").curve(600.0)
    >>> [round(1e3 * e, 3) for e in curve.cases[0]["displacement"]]
    [-10.94, -3.289]
    """

    COMMAND: ClassVar[str] = "curve"
    units: ClassVar[Mapping[str, str]] = UNITS

    @property
    def cases(self) -> tuple[Mapping[str, Any], ...]:
        """Results of `railui.curve`, one for each radius."""
        return tuple(self.data["cases"]) if "cases" in self.data else (self.data,)

    @property
    def radii(self) -> tuple[float, ...]:
        """Radii [m]."""
        return tuple(case["radius"] for case in self.cases)

    @property
    def cant_deficiency(self) -> float:
        """Cant deficiency [m]."""
        return float(self.context["cant_deficiency"])

    def to_frame(self) -> pandas.DataFrame:
        """Return the results as a pandas.DataFrame over the radius, those of wheelset i as `name.i`.

        Raises
        ------
        ImportError
            Without pandas.
        """
        from railui.api.frames import frame_of_rows

        rows = [_row(case) for case in self.cases]
        units = {name: UNITS[name.partition(".")[0]] for name in dict.fromkeys(key for row in rows for key in row)}
        return frame_of_rows(rows, units).set_index("radius")

    def plot(self, key: str, ax: Axes | None = None) -> Axes:
        """Draw a result against radius: displacement, angle_of_attack, guiding_force or wear_number.

        Raises
        ------
        ValueError
            For one radius, and another key.
        """
        from railui.report.figures.stability import CURVE_PANELS, draw_curve_panel

        names = [name for name, _, _ in CURVE_PANELS]
        if key not in names:
            raise ValueError(f"no figure of {key!r}: give {', '.join(names)}")
        if len(self.cases) < 2:
            raise ValueError("there is one radius: compute several for a figure")

        def draw(on: Axes) -> None:
            draw_curve_panel(on, self.cases, key)
            on.set_xlabel("radius [m]")
            if on.get_legend_handles_labels()[0]:
                on.legend(frameon=False, fontsize=8)

        return draw_on(ax, draw)

    def plot_displacement(self, ax: Axes | None = None) -> Axes:
        """Draw the displacements of the wheelsets against radius; ValueError as `plot`."""
        return self.plot("displacement", ax)

    def plot_guiding_forces(self, ax: Axes | None = None) -> Axes:
        """Draw the lateral forces of the rails on the wheelsets against radius; ValueError as `plot`."""
        return self.plot("guiding_force", ax)

    def plot_wear(self, ax: Axes | None = None) -> Axes:
        """Draw the wear number against radius; ValueError as `plot`."""
        return self.plot("wear_number", ax)

    def summary_title(self) -> str:
        """Return the vehicle and its curves."""
        radii = f"{self.radii[0]:g} m" if len(self.radii) == 1 else f"{self.radii[0]:g} to {self.radii[-1]:g} m"
        return f"{self.design.name} in curves of {radii}, cant deficiency {1e3 * self.cant_deficiency:g} mm"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the results of one radius, or the wear number of each."""
        if len(self.cases) > 1:
            return [SummaryRow(f"wear number at {c['radius']:g} m", c["wear_number"], "N") for c in self.cases]
        case = self.cases[0]
        return [SummaryRow(key.replace("_", " "), case[key], unit) for key, unit in UNITS.items() if key != "radius"]


def _row(case: Mapping[str, Any]) -> dict[str, Any]:
    """Return a case as a row, the numbers of each wheelset in columns of their own."""
    row: dict[str, Any] = {"radius": case["radius"]}
    for key in OF_WHEELSETS:
        row |= {f"{key}.{i}": value for i, value in enumerate(case[key] or (), 1)}
    return row | {key: case[key] for key in ("derailment_quotient", "wear_number")}


def compute_curve(design: Design, radii: float | Sequence[float], cant_deficiency: float = 0.0) -> Curve:
    """Compute the equilibria of a design at one radius or several; exceptions as `Design.curve`."""
    import numpy as np

    from railui.curving import curves

    is_single = np.ndim(radii) == 0
    cases = curves(design, np.atleast_1d(np.asarray(radii, dtype=float)).tolist(), cant_deficiency)
    notes = list(dict.fromkeys(note for case in cases for note in case["notes"]))
    data = cases[0] if is_single else {"cases": cases, "notes": notes}
    return Curve(design, data, input_paths(design), context={"cant_deficiency": cant_deficiency})
