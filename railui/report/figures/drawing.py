"""Drawing of figures: one style, colours for colour-blind readers, axes with units, atomic files."""

from __future__ import annotations

import base64
import importlib
import io
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.io.atomic import write_bytes

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
DRAWING_MODULES = ("matplotlib.backends.backend_svg", "matplotlib.figure", "jinja2")  # of the pages
Drawing = tuple[str, str, Callable[["Axes"], None]]  # name, alternative text, drawing function
LEFT_MARGIN, RIGHT_MARGIN = 0.66, 0.12  # inch, margins of the axes of a picture
# no date and no program in a file, so that equal figures are equal bytes
FILE_METADATA: dict[str, Any] = {"svg": {"Date": None, "Creator": None}, "pdf": {"CreationDate": None}, "png": None}


@dataclass(frozen=True)
class Picture:
    """Figure as SVG with its alternative text and its natural width [px]."""

    name: str
    alt: str
    svg: bytes
    width: int

    @property
    def source(self) -> str:
        """Figure as a data URI."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


def preload_in_background() -> None:
    """Import the drawing modules on a thread, while something else is computed."""

    def load() -> None:
        for module in DRAWING_MODULES:
            importlib.import_module(module)

    threading.Thread(target=load, daemon=True).start()


def draw_picture(
    name: str,
    alt: str,
    size: tuple[float, float],
    draw: Callable[[Axes], None],
    top: float = 0.24,
    bottom: float = 0.42,
) -> Picture:
    """Draw a figure of one pair of axes; size and margins above and below them [inch]."""
    return next(draw_pictures([(name, alt, draw)], size, top, bottom))


def draw_pictures(
    sketches: Iterable[Drawing], size: tuple[float, float], top: float = 0.24, bottom: float = 0.42
) -> Iterator[Picture]:
    """Draw figures one after another in the same axes, since making ticks takes most of the time."""
    import matplotlib
    from matplotlib.figure import Figure

    ax = None
    for name, alt, draw in sketches:
        with matplotlib.rc_context({**STYLE, "svg.hashsalt": name}):
            if ax is None:
                figure = Figure(figsize=size)
                wide, high = size[0] - LEFT_MARGIN - RIGHT_MARGIN, size[1] - bottom - top
                ax = figure.add_axes((LEFT_MARGIN / size[0], bottom / size[1], wide / size[0], high / size[1]))
                ax.yaxis.set_label_coords(-(LEFT_MARGIN - 0.14) / wide, 0.5)
            else:
                _clear(ax)
            draw(ax)
            out = io.BytesIO()
            figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
        # matplotlib lays text out in its own font; a viewer without it gets a narrower one
        svg = out.getvalue().replace(b"'DejaVu Sans'", b"Helvetica, Arial, 'DejaVu Sans', sans-serif")
        yield Picture(name, alt, svg, round(100 * size[0]))


def _clear(ax: Axes) -> None:
    """Remove curves, areas and texts of axes; reset limits and colour cycle."""
    for artist in (*ax.lines, *ax.patches, *ax.collections, *ax.texts):
        artist.remove()
    ax.set_prop_cycle(None)
    ax.relim()
    ax.autoscale()


def draw_changes(ax: Axes, changes: Sequence[tuple[str, float]], colours: Sequence[str]) -> None:
    """Draw changes as bars below each other, each with the name of what is changed opposite to it."""
    for i, (_, x) in enumerate(changes):
        ax.barh(-i, x, height=0.72, color=colours[i])
    ax.set_yticks([-i for i in range(len(changes))], ["" for _ in changes])
    for i, (name, x) in enumerate(changes):  # next to the zero line
        offset, alignment = ((-4, 0), "right") if x > 0 else ((4, 0), "left")
        text: dict[str, Any] = {"fontsize": 7, "ha": alignment, "va": "center"}
        ax.annotate(name, (0, -i), xytext=offset, textcoords="offset points", **text)
    widest = max((abs(x) for _, x in changes), default=1.0)
    ax.set_xlim(-1.75 * widest, 1.75 * widest)
    ax.axvline(0, color="#444444", lw=0.8)
    ax.grid(axis="y", visible=False)
    ax.spines["left"].set_visible(False)
    ax.tick_params(axis="y", length=0)


def axis_label(name: str, unit: str) -> str:
    """Return the label of an axis."""
    return f"{name} [{unit}]" if unit else name


@contextmanager
def figure_file(path: str | Path, width: float, height: float) -> Iterator[Figure]:
    """Yield a figure [inch] and write it atomically at the end, in the format of the file name.

    Raises ValueError for a format other than svg, png, pdf.
    """
    import matplotlib
    from matplotlib.figure import Figure

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FILE_METADATA:
        raise ValueError(f"a figure is written as .svg, .png or .pdf: {path}")
    with matplotlib.rc_context({**STYLE, "svg.hashsalt": Path(path).name}):
        figure = Figure(figsize=(width, height), layout="constrained")
        yield figure
        out = io.BytesIO()
        figure.savefig(out, format=kind, dpi=150, metadata=FILE_METADATA[kind])
    write_bytes(path, out.getvalue())


@contextmanager
def stacked_axes(path: str | Path, rows: int, high: float) -> Iterator[list[Axes]]:
    """Yield axes below each other with a common abscissa, each of a height [inch]."""
    with figure_file(path, 7.6, rows * high + 0.4) as figure:
        yield list(np.atleast_1d(figure.subplots(rows, 1, sharex=True)))
        figure.align_ylabels()
