"""Figure of a map: extent of its axes, and why vehicles have no value."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.figure import Figure

from railui.report.figures.response_map import draw_map_panel

KEY = "linear_critical_speed"


def small_map(beyond: int) -> dict[str, Any]:
    """Return a map of two by three vehicles, two of which have no value."""
    x = {"name": "contact.conicity", "unit": "1", "values": [0.05, 0.2, 0.35], "baseline": 0.05}
    y = {"name": "vehicle.secondary.yaw_damping", "unit": "N*m*s/rad", "values": [1e4, 9e4], "baseline": 1e4}
    one = {"unit": "m/s", "values": [[None, 70.0, 50.0], [None, 80.0, 60.0]], "baseline": None, "beyond": beyond}
    return {"x": x, "y": y, "of": {KEY: one}}


@pytest.mark.parametrize(
    ("beyond", "text"),
    [(0, "grey: no value"), (1, "grey: none up to 90 m/s, or no value"), (2, "grey: none up to 90 m/s")],
)
def test_the_best_vehicles_are_not_called_missing(beyond: int, text: str) -> None:
    ax = Figure().subplots()
    draw_map_panel(ax, small_map(beyond), KEY)
    assert ax.get_title() == text


def test_the_axes_end_at_the_first_and_the_last_value() -> None:
    ax = Figure().subplots()
    draw_map_panel(ax, small_map(2), KEY)
    assert ax.get_xlim() == pytest.approx((0.05, 0.35))
    assert ax.get_ylim() == pytest.approx((10.0, 90.0))
