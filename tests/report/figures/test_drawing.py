"""Figures drawn one after another in the same axes equal those drawn alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from matplotlib.axes import Axes

from railui.report.figures.drawing import draw_picture, draw_pictures


def linear(ax: Axes, height: float) -> None:
    ax.plot(np.linspace(0.0, 5.0, 50), height * np.sin(np.arange(50.0)))
    ax.margins(x=0)
    ax.set_ylabel(f"times {height:g}")


def logarithmic(ax: Axes, height: float) -> None:
    ax.set(xscale="log", yscale="log")
    ax.plot(np.geomspace(0.1, 20.0, 50), height * np.geomspace(1.0, 1e-6, 50))
    ax.set_ylim(bottom=1e-7 * height)
    ax.axvspan(0.1, 0.5, color="#f1f1f1")
    ax.set_xlim(0.1, 20.0)


@pytest.mark.parametrize("draw", [linear, logarithmic])
def test_nothing_of_one_figure_remains_in_the_next(draw: Callable[[Axes, float], None]) -> None:
    def sketch(height: float) -> tuple[str, str, Callable[[Axes], None]]:
        return f"of {height:g}", "a curve", lambda ax: draw(ax, height)

    heights = (100.0, 0.02, 3.0)
    alike = list(draw_pictures(map(sketch, heights), (4.0, 2.0)))
    assert alike == [draw_picture(*sketch(h)[:2], (4.0, 2.0), sketch(h)[2]) for h in heights]
