"""Figures of an optimisation: Pareto front, parallel coordinates, hypervolume, sensitivities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.number_format import typeset_unit
from railui.optimisation.design_space import DesignSpace
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study, Variable
from railui.report.figures.drawing import BLUE, ORANGE, Picture, axis_label, draw_changes, draw_picture
from railui.report.numbers import display_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Report = Mapping[str, Any]

MAX_BARS: Final = 14  # parameters shown
PAGE_WIDTH: Final = 9.4  # inch
BLACK: Final = "#000000"
PALE_BLUE: Final = "#9ecae1"
ERROR_BARS: Final[dict[str, Any]] = {"fmt": "none", "ecolor": "#bcd5e6", "elinewidth": 0.8, "zorder": 1}


def objective_text(aim: Mapping[str, str]) -> str:
    """Return an objective in words.

    >>> objective_text({"key": "flange_margin", "over": "worst", "sense": "maximise"})
    'flange margin, worst'
    """
    return f"{aim['key'].replace('_', ' ')}, {aim['over']}"


def objective_values(points: Sequence[Report], which: str = "objectives") -> FloatArray:
    """Return objectives [design, objective], NaN where a design has none; `mean` or `sd`: on fresh seeds."""
    return _number_rows([point[which] if which == "objectives" else point["fresh"][which] for point in points])


def _number_rows(rows: Sequence[Sequence[float | None]]) -> FloatArray:
    return np.array([[np.nan if x is None else x for x in row] for row in rows], dtype=float)


def has_fresh_seeds(report: Report) -> bool:
    """Return True if the objectives of any design were evaluated again on fresh seeds."""
    return bool(np.isfinite(objective_values([report["baseline"], *report["pareto"]], "mean")).any())


def front_pictures(report: Report) -> list[Picture]:
    """Draw every objective against the first: with the baseline, and the front alone."""
    if not report["pareto"]:
        return []
    others = range(1, len(report["aims"]))
    return [_front_picture(report, j, is_enlarged) for j in others for is_enlarged in (False, True)]


def _front_picture(report: Report, j: int, is_enlarged: bool) -> Picture:
    first, second = report["aims"][0], report["aims"][j]
    contents = "Pareto front, enlarged" if is_enlarged else "Pareto front, knee point and baseline"
    alt = f"{objective_text(second)} against {objective_text(first)}: {contents}"
    name = f"front{j}{'near' if is_enlarged else ''}"
    size = (PAGE_WIDTH / 2, 3.4)
    return draw_picture(name, alt, size, lambda ax: draw_front(ax, report, j, is_enlarged=is_enlarged), bottom=0.5)


def draw_front(ax: Axes, report: Report, j: int, *, is_enlarged: bool = False) -> None:
    """Draw objective j against the first: front, knee point, fresh seeds and, unless enlarged, the baseline.

    Crosses are the results on fresh seeds with the standard deviation of one set; enlarged, the knee point plus the
    paired differences of the designs to it, with their standard errors.
    """
    first, second = report["aims"][0], report["aims"][j]
    front = objective_values(report["pareto"])
    baseline, baseline_mean = (objective_values([report["baseline"]], which) for which in ("objectives", "mean"))
    crosses, bars = _differences_to_knee(report, front) if is_enlarged else _fresh_results(report)
    if np.isfinite(crosses).any():
        label = "knee point + difference on fresh seeds" if is_enlarged else "fresh seeds, ± 1 sd"
        errors: dict[str, Any] = {"xerr": bars[:, 0], "yerr": bars[:, j], "label": label}
        ax.errorbar(crosses[:, 0], crosses[:, j], **errors, **ERROR_BARS)
    if np.isfinite(baseline_mean).any() and not is_enlarged:
        label = "baseline, fresh seeds"
        ax.plot(baseline_mean[:, 0], baseline_mean[:, j], "s", mfc="none", mec=ORANGE, ms=6, label=label)
    ax.plot(front[:, 0], front[:, j], "o", color=BLUE, ms=4, label="Pareto front")
    if report["knee"] is not None:
        knee = front[report["knee"]]
        ax.plot(knee[0], knee[j], "*", color=BLACK, ms=13, mec="white", mew=0.7, label="knee point", zorder=5)
    if not is_enlarged:
        ax.plot(baseline[:, 0], baseline[:, j], "s", color=ORANGE, ms=6, label="baseline")
    ax.legend(frameon=False, fontsize=8, loc="best")
    ax.set_xlabel(_objective_label(first))
    ax.set_ylabel(_objective_label(second))
    ax.locator_params(axis="x", nbins=5)


def _fresh_results(report: Report) -> tuple[FloatArray, FloatArray]:
    """Return mean and standard deviation of the front on fresh seeds [design, objective]."""
    return objective_values(report["pareto"], "mean"), objective_values(report["pareto"], "sd")


def _differences_to_knee(report: Report, front: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the knee point plus the paired differences to it, and their standard errors [design, objective]."""
    mean, error = (
        _number_rows([point["fresh"]["minus_knee"][key] for point in report["pareto"]])
        for key in ("mean", "standard_error")
    )
    return front[report["knee"]] + mean, error


def _objective_label(aim: Mapping[str, str]) -> str:
    sense = "less is better" if aim["sense"] == "minimise" else "more is better"
    return f"{axis_label(objective_text(aim), _unit(aim))}, {sense}"


def _unit(aim: Mapping[str, str]) -> str:
    return typeset_unit(RESPONSE_KEYS[aim["key"]].unit)


def parallel_coordinates(study: Study, report: Report) -> Picture | None:
    """Draw every design of the front as a line across its variables and objectives."""
    if not report["pareto"]:
        return None
    points = [report["baseline"], *report["pareto"]]
    objectives = objective_values(points)
    low, high = np.nanmin(objectives, axis=0), np.nanmax(objectives, axis=0)
    columns = [(_variable_text(v), *_range_text(v)) for v in study.variables]
    for a, b, aim in zip(low, high, report["aims"], strict=True):
        name = objective_text(aim).replace(", ", ",\n")
        columns.append((name, f"{a:.3g} {_unit(aim)}", f"{b:.3g} {_unit(aim)}"))
    scaled = (objectives - low) / np.where(high > low, high - low, 1.0)
    lines = np.hstack([_unit_coordinates(study, points), scaled])
    count = len(study.variables)

    def draw(ax: Axes) -> None:
        import matplotlib

        colours = matplotlib.colormaps["viridis"]
        for line in lines[1:]:
            ax.plot(line, color=colours(0.05 + 0.85 * line[count]), lw=0.9, alpha=0.8)
        ax.plot(lines[0], color=ORANGE, lw=1.8, ls=(0, (4, 2)), label="baseline")
        if report["knee"] is not None:
            ax.plot(lines[1 + report["knee"]], color=BLACK, lw=2.2, label="knee point")
        ax.axvline(count - 0.5, color="#666666", lw=0.7, ls=":")
        text: dict[str, Any] = {"ha": "center", "fontsize": 7.5, "annotation_clip": False}
        for i, (_, bottom, top) in enumerate(columns):
            ax.annotate(bottom, (i, -0.05), va="top", **text)
            ax.annotate(top, (i, 1.05), va="bottom", **text)
        ax.set_xticks(range(len(columns)), [name for name, *_ in columns], fontsize=8)
        ax.tick_params(axis="x", pad=16, length=0)
        ax.set_ylim(-0.04, 1.04)
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.legend(frameon=False, fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.09), ncols=2)

    alt = (
        "Designs of the front as lines across variables (their ranges) and objectives, coloured by the first objective"
    )
    return draw_picture("parallel", alt, (PAGE_WIDTH, 3.9), draw, top=0.62, bottom=0.85)


def _unit_coordinates(study: Study, points: Sequence[Report]) -> FloatArray:
    """Return variables [design, variable] in the unit cube of the search, which is logarithmic for wide ranges."""
    values = np.array([[point["variables"][v.path] for v in study.variables] for point in points])
    return DesignSpace(study.variables).to_unit(values)


def _variable_text(variable: Variable) -> str:
    return "\n".join(variable.path.split(".")[-2:]).replace("_", " ")


def _range_text(variable: Variable) -> tuple[str, str]:
    factor, unit = display_scale([variable.lowest, variable.highest], variable.unit)
    low, high = (f"{factor * end:.3g} {unit}".strip() for end in (variable.lowest, variable.highest))
    return low, high


def hypervolume_history(report: Report) -> Picture | None:
    """Draw the hypervolume of the front against the number of evaluations."""
    if len(report["hypervolume"]) < 2:
        return None
    alt = "Hypervolume of the front against designs evaluated"
    return draw_picture("progress", alt, (4.6, 2.6), lambda ax: draw_hypervolume(ax, report))


def draw_hypervolume(ax: Axes, report: Report) -> None:
    """Draw the hypervolume of the front, and of all designs tried, against the number of evaluations."""
    rows = report["hypervolume"]
    evaluations, front, tried = ([row[key] for row in rows] for key in ("evaluations", "hypervolume", "tried"))
    if tried != front:
        ax.step(evaluations, tried, where="post", color=PALE_BLUE, label="all designs tried")
    ax.step(evaluations, front, where="post", color=BLUE, label="front")
    if tried != front:
        ax.legend(frameon=False, fontsize=8, loc="lower right")
    ax.set_xlabel("designs evaluated")
    ax.set_ylabel("hypervolume")
    ax.set_ylim(0, 1.02)
    ax.set_xlim(0, None)


def sensitivity_bars(report: Report, j: int) -> Picture | None:
    """Draw the change of an objective as each parameter of the vehicle rises by 10 %, the largest first."""
    aim = report["aims"][j]
    changes = [(row["path"], row["objectives"][j]) for row in report["sensitivities"]["one_at_a_time"]]
    largest = sorted([(path, x) for path, x in changes if x], key=lambda row: -abs(row[1]))[:MAX_BARS]
    if not largest:
        return None
    better = -1.0 if aim["sense"] == "minimise" else 1.0

    def draw(ax: Axes) -> None:
        colours = [BLUE if x * better > 0 else ORANGE for _, x in largest]
        draw_changes(ax, largest, colours)
        ax.set_xlabel(axis_label(f"change of {objective_text(aim)}", _unit(aim)))

    alt = f"Change of {objective_text(aim)} for a rise of 10 % of each parameter; blue is better"
    return draw_picture(f"hanging{j}", alt, (PAGE_WIDTH / 2, 0.95 + 0.2 * len(largest)), draw)


def _draw_interval(ax: Axes, y: float, ends: Sequence[float | None]) -> None:
    """Draw an interval as a horizontal line with ends; nothing where it is unknown."""
    low, high = ends
    if low is not None and high is not None:
        ax.plot((low, high), (y, y), color="black", linewidth=0.9, marker="|", markersize=4.0)


def sobol_bars(study: Study, report: Report, j: int) -> Picture | None:
    """Draw the Sobol indices of an objective over the variables."""
    sobol = report["sensitivities"]["sobol"]
    if sobol is None:
        return None
    rows = sobol["variables"]

    def draw(ax: Axes) -> None:
        for i, row in enumerate(rows):
            first, total = (0.0 if row[key][j] is None else row[key][j] for key in ("first", "total"))
            ax.barh(-i + 0.18, first, height=0.34, color=BLUE, label="first order" if i == 0 else None)
            ax.barh(-i - 0.18, total, height=0.34, color=PALE_BLUE, label="total" if i == 0 else None)
            for y, key in ((-i + 0.18, "first_interval"), (-i - 0.18, "total_interval")):
                _draw_interval(ax, y, row[key][j])
        for i, v in enumerate(study.variables):
            ax.annotate(_variable_text(v).replace("\n", " "), (0.005, -i + 0.39), fontsize=7.5, va="bottom")
        ax.set_yticks([])
        ax.set_ylim(0.75 - len(rows), 0.75)
        ax.grid(axis="y", visible=False)
        ax.set_xlim(min(0.0, ax.get_xlim()[0]), max(1.0, ax.get_xlim()[1]))
        ax.set_xlabel(f"share of the variance of {objective_text(report['aims'][j])}")
        ax.legend(frameon=False, fontsize=7.5, loc="lower right")

    alt = f"Sobol indices of {objective_text(report['aims'][j])} over the variables"
    return draw_picture(f"shares{j}", alt, (PAGE_WIDTH / 2, 0.8 + 0.55 * len(rows)), draw)
