"""Figures of a search: the front, designs as lines across their variables, progress, what the result hangs on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.number_format import unit_text
from railui.optimisation.design_space import Ranges
from railui.optimisation.response_keys import RESULTS
from railui.optimisation.study import Study, Variable
from railui.report.figures.drawing import BLUE, ORANGE, Picture, axis, drawn, scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Report = Mapping[str, Any]

BARS: Final = 14  # numbers of the vehicle shown
WIDE: Final = 9.4  # inch


def aim_words(aim: Mapping[str, str]) -> str:
    """An aim in words.

    >>> aim_words({"key": "flange_margin", "over": "worst", "sense": "maximise"})
    'flange margin, worst'
    """
    return f"{aim['key'].replace('_', ' ')}, {aim['over']}"


def aims_of(points: Sequence[Report], which: str = "objectives") -> FloatArray:
    """Aims [design, aim], NaN where a design has none."""
    found = [point[which] if which == "objectives" else point["fresh"][which] for point in points]
    return np.array([[np.nan if x is None else x for x in row] for row in found], dtype=float)


def fronts(report: Report) -> list[Picture]:
    """Every aim against the first, on the seeds of the search and on fresh ones."""
    count = len(report["aims"])
    if not report["pareto"]:
        return []
    return [_front(report, j, near) for j in range(1, count) for near in (False, True)]


def _front(report: Report, j: int, near: bool) -> Picture:
    """The front beside the vehicle as it is, or from near, by itself."""
    first, second = report["aims"][0], report["aims"][j]
    found, fresh, sd = (aims_of(report["pareto"], which) for which in ("objectives", "mean", "sd"))
    base, again = (aims_of([report["baseline"]], which) for which in ("objectives", "mean"))

    def draw(ax: Axes) -> None:
        if np.isfinite(fresh).any():
            spread: dict[str, Any] = {"fmt": "none", "ecolor": "#bcd5e6", "elinewidth": 0.8, "zorder": 1}
            ax.errorbar(fresh[:, 0], fresh[:, j], xerr=sd[:, 0], yerr=sd[:, j], label="fresh seeds, ± 1 sd", **spread)
            if not near:
                ax.plot(again[:, 0], again[:, j], "s", mfc="none", mec=ORANGE, ms=6, label="as it is, fresh seeds")
        ax.plot(found[:, 0], found[:, j], "o", color=BLUE, ms=4, label="front")
        if report["knee"] is not None:
            at = found[report["knee"]]
            ax.plot(at[0], at[j], "*", color="#000000", ms=13, mec="white", mew=0.7, label="knee", zorder=5)
        if not near:
            ax.plot(base[:, 0], base[:, j], "s", color=ORANGE, ms=6, label="vehicle as it is")
            ax.legend(frameon=False, fontsize=8, loc="best")
        ax.set_xlabel(_label(first))
        ax.set_ylabel(_label(second))
        ax.locator_params(axis="x", nbins=5)

    beside = "the front by itself" if near else "the front, its knee and the vehicle as it is"
    words = f"{aim_words(second)} against {aim_words(first)}: {beside}"
    return drawn(f"front{j}{'near' if near else ''}", words, (WIDE / 2, 3.4), draw, bottom=0.5)


def _label(aim: Mapping[str, str]) -> str:
    arrow = "less is better" if aim["sense"] == "minimise" else "more is better"
    return f"{axis(aim_words(aim), unit_text(RESULTS[aim['key']].unit))}, {arrow}"


def parallel(study: Study, report: Report) -> Picture | None:
    """Every design of the front as a line across its variables and aims."""
    if not report["pareto"]:
        return None
    points = [report["baseline"], *report["pareto"]]
    aims = aims_of(points)
    low, high = np.nanmin(aims, axis=0), np.nanmax(aims, axis=0)
    columns = [(_path_words(v), *_ends(v)) for v in study.variables]
    for a, b, aim in zip(low, high, report["aims"], strict=True):
        unit = unit_text(RESULTS[aim["key"]].unit)
        columns.append((aim_words(aim).replace(", ", ",\n"), f"{a:.3g} {unit}", f"{b:.3g} {unit}"))
    lines = np.hstack([_unit(study, points), (aims - low) / np.where(high > low, high - low, 1.0)])

    def draw(ax: Axes) -> None:
        import matplotlib

        colours = matplotlib.colormaps["viridis"]
        for line in lines[1:]:
            ax.plot(line, color=colours(0.05 + 0.85 * line[len(study.variables)]), lw=0.9, alpha=0.8)
        ax.plot(lines[0], color=ORANGE, lw=1.8, ls=(0, (4, 2)), label="vehicle as it is")
        if report["knee"] is not None:
            ax.plot(lines[1 + report["knee"]], color="#000000", lw=2.2, label="knee")
        ax.axvline(len(study.variables) - 0.5, color="#666666", lw=0.7, ls=":")
        for i, (_, bottom, top) in enumerate(columns):
            ax.annotate(bottom, (i, -0.05), ha="center", va="top", fontsize=7.5, annotation_clip=False)
            ax.annotate(top, (i, 1.05), ha="center", va="bottom", fontsize=7.5, annotation_clip=False)
        ax.set_xticks(range(len(columns)), [name for name, *_ in columns], fontsize=8)
        ax.tick_params(axis="x", pad=16, length=0)
        ax.set_ylim(-0.04, 1.04)
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.09), ncols=2)

    words = "designs of the front as lines across variables (their ranges) and aims, coloured by the first aim"
    return drawn("parallel", words, (WIDE, 3.9), draw, top=0.62, bottom=0.85)


def _unit(study: Study, points: Sequence[Report]) -> FloatArray:
    """Variables [design, variable] as shares of their ranges, by the logarithm as the search has them."""
    values = np.array([[point["variables"][v.path] for v in study.variables] for point in points])
    return Ranges(study.variables).unit(values)


def _path_words(variable: Variable) -> str:
    return "\n".join(variable.path.split(".")[-2:]).replace("_", " ")


def _ends(variable: Variable) -> tuple[str, str]:
    factor, unit = scale([variable.lowest, variable.highest], variable.unit)
    low, high = (f"{factor * end:.3g} {unit}".strip() for end in (variable.lowest, variable.highest))
    return low, high


def progress(report: Report) -> Picture | None:
    """The share of the aims' space that is dominated, against evaluations."""
    rows = report["hypervolume"]
    if len(rows) < 2:
        return None

    def draw(ax: Axes) -> None:
        ax.step([r["evaluations"] for r in rows], [r["hypervolume"] for r in rows], where="post", color=BLUE)
        ax.set_xlabel("designs evaluated")
        ax.set_ylabel("hypervolume")
        ax.set_ylim(0, 1.02)
        ax.set_xlim(0, None)

    return drawn("progress", "hypervolume of the front against designs evaluated", (4.6, 2.6), draw)


def hanging(report: Report, j: int) -> Picture | None:
    """How an aim changes as each number of the vehicle rises by 10 %, the strongest first."""
    aim = report["aims"][j]
    rows = [(r["path"], r["objectives"][j]) for r in report["sensitivities"]["one_at_a_time"]]
    strong = sorted([(p, x) for p, x in rows if x], key=lambda row: -abs(row[1]))[:BARS]
    if not strong:
        return None
    better = -1.0 if aim["sense"] == "minimise" else 1.0

    def draw(ax: Axes) -> None:
        for i, (_, x) in enumerate(strong):
            ax.barh(-i, x, height=0.72, color=BLUE if x * better > 0 else ORANGE)
        ax.set_yticks([-i for i in range(len(strong))], ["" for _ in strong])
        for i, (path, x) in enumerate(strong):  # beside the zero line, on the side where there is no bar
            ax.annotate(
                path, (0, -i), xytext=(-4 if x > 0 else 4, 0), textcoords="offset points", fontsize=7,
                ha="right" if x > 0 else "left", va="center",
            )  # fmt: skip
        widest = max(abs(x) for _, x in strong)
        ax.set_xlim(-1.75 * widest, 1.75 * widest)
        ax.axvline(0, color="#444444", lw=0.8)
        ax.grid(axis="y", visible=False)
        ax.spines["left"].set_visible(False)
        ax.tick_params(axis="y", length=0)
        ax.set_xlabel(axis(f"change of {aim_words(aim)}", unit_text(RESULTS[aim["key"]].unit)))

    words = f"change of {aim_words(aim)} for a rise of 10 % in each number; blue is better"
    return drawn(f"hanging{j}", words, (WIDE / 2, 0.95 + 0.2 * len(strong)), draw)


def shares(study: Study, report: Report, j: int) -> Picture | None:
    """Sobol's indices of an aim over the variables."""
    sobol = report["sensitivities"]["sobol"]
    if sobol is None:
        return None
    rows = sobol["variables"]

    def draw(ax: Axes) -> None:
        for i, row in enumerate(rows):
            first, total = (0.0 if row[key][j] is None else row[key][j] for key in ("first", "total"))
            ax.barh(-i + 0.18, first, height=0.34, color=BLUE, label="alone" if i == 0 else None)
            ax.barh(-i - 0.18, total, height=0.34, color="#9ecae1", label="with all it acts with" if i == 0 else None)
        for i, v in enumerate(study.variables):
            ax.annotate(_path_words(v).replace("\n", " "), (0.005, -i + 0.39), fontsize=7.5, va="bottom")
        ax.set_yticks([])
        ax.set_ylim(0.75 - len(rows), 0.75)
        ax.grid(axis="y", visible=False)
        ax.set_xlim(0, 1)
        ax.set_xlabel(f"share of the variance of {aim_words(report['aims'][j])}")
        ax.legend(frameon=False, fontsize=7.5, loc="lower right")

    words = f"Sobol's indices of {aim_words(report['aims'][j])} over the variables"
    return drawn(f"shares{j}", words, (WIDE / 2, 0.8 + 0.55 * len(rows)), draw)
