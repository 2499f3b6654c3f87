"""How figures are drawn: one style, colours that everybody tells apart, axes with units, files written whole."""

from __future__ import annotations

import base64
import importlib
import io
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.io.atomic import write_bytes
from railui.io.number_format import suited, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#888888"  # of Okabe and Ito
STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#666666",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.titlesize": 9,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-6, 7),
    "axes.titlelocation": "left",
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "path.simplify_threshold": 0.3,
}
DRAWS = ("matplotlib.backends.backend_svg", "matplotlib.figure", "jinja2")  # what a page needs to be loaded
Sketch = tuple[str, str, Callable[["Axes"], None]]  # name, words, and what draws it
LEFT, RIGHT = 0.66, 0.12  # inch beside the axes of a picture
# what a file would tell of its making, left out so that the same figure is the same bytes
UNDATED: dict[str, Any] = {"svg": {"Date": None, "Creator": None}, "pdf": {"CreationDate": None}, "png": None}


@dataclass(frozen=True)
class Picture:
    """One figure: what it shows, in words for those who do not see it, its SVG, its natural width [px]."""

    name: str
    alt: str
    svg: bytes
    width: int

    @property
    def source(self) -> str:
        """The figure as an address that holds it whole."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


def load_beside() -> None:
    """Load what draws while something else is computed."""

    def load() -> None:
        for module in DRAWS:
            importlib.import_module(module)

    threading.Thread(target=load, daemon=True).start()


def drawn(
    name: str,
    alt: str,
    size: tuple[float, float],
    draw: Callable[[Axes], None],
    top: float = 0.24,
    bottom: float = 0.42,
) -> Picture:
    """A figure of one pair of axes, size [inch], with so much above and below them."""
    return next(drawn_alike([(name, alt, draw)], size, top, bottom))


def drawn_alike(
    sketches: Iterable[Sketch], size: tuple[float, float], top: float = 0.24, bottom: float = 0.42
) -> Iterator[Picture]:
    """Figures that differ by their curves alone, one after another in the same axes: ticks are what takes time."""
    import matplotlib
    from matplotlib.figure import Figure

    ax = None
    for name, alt, draw in sketches:
        with matplotlib.rc_context({**STYLE, "svg.hashsalt": name}):
            if ax is None:
                figure = Figure(figsize=size)
                wide, high = size[0] - LEFT - RIGHT, size[1] - bottom - top
                ax = figure.add_axes((LEFT / size[0], bottom / size[1], wide / size[0], high / size[1]))
                ax.yaxis.set_label_coords(-(LEFT - 0.14) / wide, 0.5)
            else:
                _empty(ax)
            draw(ax)
            out = io.BytesIO()
            figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
        # matplotlib measures with its own font; a reader without it gets a narrower one
        svg = out.getvalue().replace(b"'DejaVu Sans'", b"Helvetica, Arial, 'DejaVu Sans', sans-serif")
        yield Picture(name, alt, svg, round(100 * size[0]))


def _empty(ax: Axes) -> None:
    """Takes the curves and areas out of axes, their limits and the turn of their colours."""
    for artist in (*ax.lines, *ax.patches):
        artist.remove()
    ax.set_prop_cycle(None)
    ax.relim()
    ax.autoscale()


def scale(values: Any, unit: str) -> tuple[float, str]:
    """What SI values are multiplied by to be read, and the unit they then have."""
    given = np.abs(np.asarray([v for v in np.ravel(values) if v is not None], dtype=float))
    largest = float(given[np.isfinite(given)].max(initial=0.0))
    if largest == 0:
        return 1.0, unit_text(unit)
    if unit in ("m", "m/s") and 1e-4 <= largest < 10.0:  # the trade speaks of millimetres
        return (1e3, "mm" + unit[1:]) if largest < 0.1 else (1.0, unit)
    number, name = suited(largest, unit)
    return number / largest, unit_text(name)


def axis(name: str, unit: str) -> str:
    """The label of an axis."""
    return f"{name} [{unit}]" if unit else name


@contextmanager
def sheet(path: str | Path, width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches, written at the end as its name says, whole or not at all.

    ValueError for a kind that is none of svg, png, pdf.
    """
    import matplotlib
    from matplotlib.figure import Figure

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in UNDATED:
        raise ValueError(f"a figure is written as .svg, .png or .pdf: {path}")
    with matplotlib.rc_context({**STYLE, "svg.hashsalt": Path(path).name}):
        figure = Figure(figsize=(width, height), layout="constrained")
        yield figure
        out = io.BytesIO()
        figure.savefig(out, format=kind, dpi=150, metadata=UNDATED[kind])
    write_bytes(path, out.getvalue())


@contextmanager
def stacked(path: str | Path, rows: int, high: float) -> Iterator[list[Axes]]:
    """A sheet of axes below each other over one abscissa, each so high [inch]."""
    with sheet(path, 7.6, rows * high + 0.4) as figure:
        yield list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))
        figure.align_ylabels()
