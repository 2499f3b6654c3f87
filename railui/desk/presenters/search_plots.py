"""Convergence and texts of a search and of the designs on its front."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from rich.text import Text

from railui.api.optimisation import is_significant
from railui.arrays import FloatArray
from railui.desk.presenters.loop_text import short_path
from railui.desk.presenters.search_history import SearchHistory
from railui.desk.state.plan import Plan, objective_unit
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.plot_data import Line, PlotData
from railui.io.number_format import format_quantity, typeset
from railui.io.problems import Problem
from railui.optimisation.front import hypervolumes
from railui.track.excitation import is_track_file
from railui.vehicle.design_reader import Design

PATH: Final = re.compile(r"[a-z]\w*(?:\.\w+)+")  # of a parameter

# plots


def convergence_plot(history: SearchHistory) -> PlotData:
    """Plot the hypervolume, or the best value of a single objective, against the number of evaluated designs."""
    generations = history.generations
    if len(generations) < 2:
        return PlotData(Axis(""), Axis(""), placeholder="after two generations")
    signs = history.objective_signs
    if len(signs) == 1:
        count = np.array([float(generation.evaluations) for generation in generations])
        best_of_each = [np.min(generation.feasible_objectives * signs, initial=np.inf) for generation in generations]
        best = np.minimum.accumulate(best_of_each)  # the best one may not be in the last generation
        y = Axis(history.objective_names[0], objective_unit(history.plan.objectives[0][0]))
        return PlotData(Axis("designs"), y, [Line(count, signs[0] * best, "best")])
    volumes = hypervolumes([(g.evaluations, g.feasible_objectives * signs) for g in generations])
    if not volumes:
        return PlotData(Axis(""), Axis(""), placeholder="no feasible design yet")
    count = np.array([float(generation.evaluations) for generation in generations])
    hypervolume = np.array([volume["hypervolume"] for volume in volumes])
    return PlotData(Axis("designs"), Axis("hypervolume", low=0.0, high=1.05), [Line(count, hypervolume, "")])


# texts


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
    return f"{index}: {_variables_text(history.plan.design, values)}" if values else ""


def _variables_text(design: Design, values: dict[str, float]) -> str:
    parts = []
    for path, value in values.items():
        unit, name = design.unit(path), path.split(".")[-1].replace("_", " ")
        new, baseline = (typeset(format_quantity(v, unit, 3)) for v in (value, design.value(path)))
        parts.append(f"{name} {new} (baseline {baseline})")
    return ", ".join(parts)


def warnings_text(warnings: Sequence[str]) -> str:
    """Return the warnings of a study and of its result, one per line, with short names of the parameters.

    >>> warnings_text(["the knee is at the lower bound of vehicle.primary.lateral_stiffness, 1 MN/m"])
    '! the knee is at the lower bound of lateral stiffness primary, 1 MN/m'
    """
    return "\n".join(f"! {PATH.sub(lambda match: short_path(match[0]), text)}" for text in warnings)


def study_warnings(problems: Sequence[Problem]) -> list[str]:
    """Return the warnings of a study without their positions in its file."""
    return [f"{p.key.removeprefix('variables.')} {p.message}: {p.remedy}".strip().removesuffix(":") for p in problems]


def fresh_text(history: SearchHistory, index: int) -> str:
    """Return mean and sd of the objectives of a design on new seeds in one line."""
    statistics = history.fresh_statistics(index)
    if statistics is None:
        if history.result is None:
            return ""
        is_file = is_track_file(history.plan.track)
        return "no spread: track files have no seeds" if is_file else "no spread: failed on new seeds"
    return f"new seeds: {', '.join(mean_sd_text(mean, sd) for mean, sd in zip(*statistics, strict=True))}"


def fresh_comparison(history: SearchHistory, index: int, width: int) -> str:
    """Return every objective in the search and, with mean and sd, on new seeds; the latter alone if width is short."""
    _, front = history.front()
    statistics = history.fresh_statistics(index)
    if index >= len(front) or statistics is None:
        return ""
    fresh = [mean_sd_text(mean, sd) for mean, sd in zip(*statistics, strict=True)]
    rows = [("", "search", "new seeds"), *zip(history.objective_names, _values(front[index]), fresh, strict=True)]
    name_columns, search_columns, fresh_columns = (max(len(row[k]) for row in rows) for k in range(3))
    if name_columns + search_columns + fresh_columns + 2 <= width:
        return "\n".join(f"{n:{name_columns}} {v:>{search_columns}} {f:>{fresh_columns}}" for n, v, f in rows)
    return _two_columns([(name, text) for name, _, text in rows], width)


def baseline_comparison(history: SearchHistory, index: int, width: int) -> str:
    """Return the mean differences of a design from the baseline on new seeds, and the constraints that it misses there.

    A difference has its standard error, from pairs on the same tracks; empty where there are no new seeds.
    """
    if history.result is None or history.fresh_statistics(index) is None:
        return ""
    fresh = history.result["pareto"][index]["fresh"]
    paired = fresh["minus_baseline"]
    differences = [
        (name, mean_sd_text(mean, error) + ("" if is_significant(p_value) else " n.s."))
        for name, mean, error, p_value in zip(
            history.objective_names, paired["mean"], paired["standard_error"], paired["p_value"], strict=True
        )
        if mean is not None and error is not None
    ]
    missed = [
        (constraint.replace("_", " "), f"met on {count} of {fresh['sets']}")
        for constraint, count in zip(history.plan.constraints, fresh["met"], strict=True)
        if count is not None and count < fresh["sets"]
    ]
    heading = [("minus baseline", "mean±se, new seeds")] if differences else []
    return _two_columns([*heading, *differences, *missed], width)


def _two_columns(rows: Sequence[tuple[str, str]], width: int) -> str:
    """Return names and texts below each other; names are cut where the width is short."""
    text_columns = max((len(text) for _, text in rows), default=0)
    name_columns = max(1, min(max((len(name) for name, _ in rows), default=0), width - text_columns - 1))
    return "\n".join(f"{name[:name_columns]:{name_columns}} {text:>{text_columns}}" for name, text in rows)


def _values(objectives: FloatArray) -> list[str]:
    return [f"{value:.4g}" for value in objectives]


def mean_sd_text(mean: float, sd: float) -> str:
    """Return a mean and its standard deviation, both to the second digit of the standard deviation.

    >>> mean_sd_text(0.149713, 0.00231)
    '0.1497±0.0023'
    """
    digits = max(0, 1 - int(np.floor(np.log10(sd)))) if sd > 0 else 4
    return f"{mean:.{digits}f}±{sd:.{digits}f}"
