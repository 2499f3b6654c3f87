"""Plots, rows and texts of a search: Pareto front, convergence, designs on the front."""

from __future__ import annotations

import numpy as np
from rich.text import Text

from railui.arrays import FloatArray
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.state.plan import Plan, objective_unit
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bar
from railui.desk.widgets.plot_data import Line, Mark, PlotData
from railui.io.number_format import format_quantity, typeset
from railui.optimisation.multi_objective import hypervolumes, knee
from railui.vehicle.design_reader import Design

SHOWN_PERCENTILE = 90  # of the objectives; the plot ends half a span beyond
FRAME_MARGIN = 0.5  # of the span


# plots


def front_plot(history: SearchHistory, index: int) -> PlotData:
    """Plot the evaluated designs, the Pareto front, the baseline, and the selected design with its spread."""
    plan = history.plan
    if len(plan.objectives) < 2:
        return PlotData(Axis(""), Axis(""), placeholder="single objective: see the convergence")
    _, front = history.front()
    x, y = (
        Axis(name, objective_unit(objective))
        for name, (objective, _) in zip(history.objective_names[:2], plan.objectives[:2], strict=True)
    )
    lines, marks = [], []
    evaluated = history.feasible_objectives()
    if len(evaluated):
        low, high = _plot_range(np.vstack([front, evaluated]) if len(front) else evaluated)
        inside = np.all((evaluated[:, :2] >= low) & (evaluated[:, :2] <= high), axis=1)
        lines.append(Line(evaluated[inside, 0], evaluated[inside, 1], "evaluated", "base", is_points=True))
    lines.append(Line(front[:, 0], front[:, 1], "front", "current"))
    if history.generations and np.all(np.isfinite(history.generations[-1].baseline)):
        baseline = history.generations[-1].baseline
        marks.append(Mark(float(baseline[0]), float(baseline[1]), "x", "baseline", "other"))
        lines.append(Line(baseline[:1], baseline[1:2], "", "other", is_points=True))
    if index < len(front):
        lines += _spread_lines(history, index)
        marks.append(Mark(float(front[index, 0]), float(front[index, 1]), "o", f"{index + 1}", "limit"))
    return PlotData(x, y, lines, marks=marks)


def _spread_lines(history: SearchHistory, index: int) -> list[Line]:
    """Return a cross of one standard deviation about the mean on new seeds."""
    statistics = history.fresh_statistics(index)
    if statistics is None:
        return []
    (x, y), (dx, dy) = statistics[0][:2], statistics[1][:2]
    return [
        Line(np.array([x - dx, x + dx]), np.array([y, y]), "new seeds", "limit"),
        Line(np.array([x, x]), np.array([y - dy, y + dy]), "", "limit"),
    ]


def _plot_range(objectives: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the plotted range; distant designs would hide the front."""
    low, high = np.nanpercentile(objectives[:, :2], [0, SHOWN_PERCENTILE], axis=0)
    margin = FRAME_MARGIN * (high - low)
    return low - margin, high + margin


def convergence_plot(history: SearchHistory) -> PlotData:
    """Plot the hypervolume, or the best value of a single objective, against the number of evaluated designs."""
    generations = history.generations
    if len(generations) < 2:
        return PlotData(Axis(""), Axis(""), placeholder="after two generations")
    signs = history.objective_signs
    if len(signs) == 1:
        count = np.array([float(generation.evaluations) for generation in generations])
        best = [np.min(generation.feasible_objectives * signs, initial=np.inf) for generation in generations]
        y = Axis(history.objective_names[0], objective_unit(history.plan.objectives[0][0]))
        return PlotData(Axis("designs"), y, [Line(count, signs[0] * np.array(best), "best")])
    volumes = hypervolumes([(g.evaluations, g.feasible_objectives * signs) for g in generations])
    if not volumes:
        return PlotData(Axis(""), Axis(""), placeholder="no feasible design yet")
    count = np.array([float(generation.evaluations) for generation in generations])
    hypervolume = np.array([volume["hypervolume"] for volume in volumes])
    return PlotData(Axis("designs"), Axis("hypervolume", low=0.0, high=1.05), [Line(count, hypervolume, "")])


# rows and texts


def front_rows(history: SearchHistory) -> list[Bar]:
    """Return a row per design on the front: its objectives; the bar is the relative first objective."""
    _, front = history.front()
    best = history.result["knee"] if history.result is not None else None
    if best is None and len(front) > 1:
        best = knee(front, history.objective_signs)
    span = float(np.ptp(front[:, 0])) if len(front) else 0.0
    rows = []
    for i, objectives in enumerate(front):
        text = "  ".join(f"{value:8.4g}" for value in objectives)
        fraction = 1 - abs(objectives[0] - front[0, 0]) / span if span else 1.0
        rows.append(Bar(f"{i + 1}{' knee' if i == best else ''}", float(fraction), text, is_emphasised=i == best))
    return rows


def plan_text(plan: Plan) -> Text:
    """Return the vehicle of a plan and the origin of its contact parameters."""
    calibration = plan.design.adjustment
    text = Text(no_wrap=True, overflow="ellipsis")
    text.append(f"{plan.design.name}\n", "bold")
    if calibration:
        text.append(f"contact calibrated on {calibration.campaign}\n")
    else:
        text.append("nominal contact, not calibrated\n", "yellow")
    return text


def design_text(history: SearchHistory, index: int) -> str:
    """Return the variables of a design on the front with their baseline values."""
    values = history.design_values(index)
    return f"{index + 1}: {_variables_text(history.plan.design, values)}" if values else ""


def _variables_text(design: Design, values: dict[str, float]) -> str:
    parts = []
    for path, value in values.items():
        unit, name = design.unit(path), path.split(".")[-1].replace("_", " ")
        new, baseline = (typeset(format_quantity(v, unit, 3)) for v in (value, design.value(path)))
        parts.append(f"{name} {new} (baseline {baseline})")
    return ", ".join(parts)


def fresh_text(history: SearchHistory, index: int) -> str:
    """Return mean and sd of the objectives of a design on new seeds in one line."""
    statistics = history.fresh_statistics(index)
    if statistics is None:
        return "" if history.result is None else "no spread: track files have no seeds"
    return f"new seeds: {', '.join(mean_sd_text(mean, sd) for mean, sd in zip(*statistics, strict=True))}"


def fresh_comparison(history: SearchHistory, index: int, width: int) -> str:
    """Return mean and sd of every objective on new seeds and, if the width permits, its value in the search."""
    _, front = history.front()
    statistics = history.fresh_statistics(index)
    if index >= len(front) or statistics is None:
        return ""
    rows = []
    for name, value, mean, sd in zip(history.objective_names, front[index], *statistics, strict=True):
        text = f"{mean_sd_text(mean, sd)} new seeds"
        wide = f"{name[:21]:22}{text}, {value:.4g} search"
        columns = width - len(text)
        rows.append(wide if len(wide) <= width else f"{name[: columns - 1]:{columns}}{text}")
    return "\n".join(rows)


def mean_sd_text(mean: float, sd: float) -> str:
    """Return a mean and its standard deviation, both to the second digit of the standard deviation.

    >>> mean_sd_text(0.149713, 0.00231)
    '0.1497±0.0023'
    """
    digits = max(0, 1 - int(np.floor(np.log10(sd)))) if sd > 0 else 4
    return f"{mean:.{digits}f}±{sd:.{digits}f}"
