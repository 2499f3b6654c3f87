"""The report of an optimisation as one self-contained page: report.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui import core
from railui.io.atomic import write_text
from railui.io.number_format import typeset_unit
from railui.optimisation.cases import used_seeds
from railui.optimisation.design_space import DesignSpace
from railui.optimisation.failures import all_failed, failure_line
from railui.optimisation.fresh import is_significant
from railui.optimisation.objectives import is_at_bound, required_keys
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study
from railui.report.numbers import DASH, digits_apart, display_scale, format_number, format_with_sd
from railui.report.search import figures
from railui.report.templates import render_template

VARIABLE_DIGITS: Final = 4  # of variables, at most: no spring is made to more

Report = Mapping[str, Any]
Row = dict[str, Any]


def write_study_page(study: Study, report: Report, path: str | Path) -> Path:
    """Write report.html of an optimisation, with its figures inside."""
    return write_text(path, render_template("search/page.html.j2", _contents(study, report)))


def _contents(study: Study, report: Report) -> Row:
    """Return the variables of the template."""
    objectives = range(len(report["aims"]))
    return {
        "report": report,
        "sentence": sentence(report),
        "front_note": front_note(report),
        "has_fresh_seeds": figures.has_fresh_seeds(report),
        "fronts": figures.front_pictures(report),
        "parallel": figures.parallel_coordinates(study, report),
        "progress": figures.hypervolume_history(report),
        "sensitivities": [p for j in objectives if (p := figures.sensitivity_bars(report, j)) is not None],
        "sobol_pictures": [p for j in objectives if (p := figures.sobol_bars(study, report, j)) is not None],
        "sobol": report["sensitivities"]["sobol"],
        "chosen": selected_designs(study, report),
        "riding": _ride_quality(report),
        "front": _front(study, report),
        "cases": _cases(study, report),
        "failures": sorted(report["failures"].items(), key=lambda row: -row[1]),
        "all_failed": all_failed(report),
        "provenance": _provenance(report),
    }


def sentence(report: Report) -> str:
    """Return the result in one sentence: the objectives of the knee point and of the baseline."""
    if report["knee"] is None:
        return f"{failure_line(report).capitalize()}." if all_failed(report) else "No design satisfies the constraints."
    knee, baseline = report["pareto"][report["knee"]], report["baseline"]
    parts = []
    for j, aim in enumerate(report["aims"]):
        value, reference = knee["objectives"][j], baseline["objectives"][j]
        digits = digits_apart([value, reference])
        text = f"{figures.objective_text(aim)} {format_number(value, digits)} {_unit(aim['key'])}".strip()
        parts.append(text + (f" (baseline {format_number(reference, digits)})" if reference is not None else ""))
    return f"{_subject(report)}: {'; '.join(parts)}."


def _subject(report: Report) -> str:
    """Return the design of the first sentence."""
    count = len(report["pareto"])
    if len(report["aims"]) == 1:
        return "Best design"
    return f"Knee point of a Pareto front of {count} designs" if count > 1 else "Best design in every objective"


def front_note(report: Report) -> str:
    """Return the sentence on how the front was selected."""
    count, tried = len(report["pareto"]), report["nondominated"]
    feasible = "that meets the constraints " if report["limits"] else ""
    note = f"No design tried {feasible}is better than a design of the front in every objective."
    return note if count == tried else f"{note} {tried} such designs were found, of which the front has {count}."


def _digits(report: Report, which: str, key: Any) -> int:
    """Return the digits that tell the designs of the front apart in a number of theirs; of variables fewer."""
    values = [point[which][key] for point in report["pareto"]]
    return digits_apart(values, most=VARIABLE_DIGITS) if which == "variables" else digits_apart(values)


def selected_designs(study: Study, report: Report) -> Row:
    """Return the table of the baseline, the knee point and the best design of each objective."""
    points, is_repeated = _selected_points(report), figures.has_fresh_seeds(report)
    designs = [point for _, point in points]
    rows: list[Row] = []
    for variable in study.variables:
        values = [point["variables"][variable.path] for point in designs]
        factor, unit = display_scale(values, variable.unit)
        positions = DesignSpace([variable]).to_unit(np.array([values]).T)[:, 0].tolist()
        bounds = [" (bound)" if is_at_bound(position) else "" for position in positions]
        digits = _digits(report, "variables", variable.path)
        cells = [format_number(factor * value, digits) + bound for value, bound in zip(values, bounds, strict=True)]
        rows.append({"name": variable.path, "unit": unit, "cells": cells})
    for j, aim in enumerate(report["aims"]):
        digits = _digits(report, "objectives", j)
        cells = [format_number(point["objectives"][j], digits) for point in designs]
        name = f"{aim['sense']} {figures.objective_text(aim)}"
        rows.append({"name": name, "unit": _unit(aim["key"]), "cells": cells})
        if is_repeated:
            rows += [row | {"unit": _unit(aim["key"]), "quiet": True} for row in _fresh_rows(designs, j)]
    for j, limit in enumerate(report["limits"]):
        cells = [_constraint_cell(report, point, j) for point in designs]
        rows.append({"name": limit, "unit": _unit(study.constraints[j].key), "cells": cells})
    if any(point["fresh"]["failed"] for point in designs):
        rows.append({"name": "failed on fresh seeds", "unit": "", "cells": list(map(_failure_cell, designs))})
    return {"names": [name for name, _ in points], "rows": rows}


def _fresh_rows(designs: Sequence[Report], j: int) -> list[Row]:
    """Return the rows of an objective on fresh seeds: mean of each design, and its paired differences."""
    means = [format_with_sd(point["fresh"]["mean"][j], point["fresh"]["sd"][j]) for point in designs]
    references = {"minus_baseline": "minus the baseline", "minus_knee": "minus the knee point"}
    differences = [
        {"name": name, "cells": [_difference_cell(point["fresh"][key], j) for point in designs]}
        for key, name in references.items()
    ]
    return [{"name": "on fresh seeds", "cells": means}, *differences]


def _difference_cell(difference: Report, j: int) -> str:
    """Return a mean difference with its standard error, marked where it is not significant."""
    mean, error, p_value = (difference[key][j] for key in ("mean", "standard_error", "p_value"))
    if mean is None:
        return DASH
    return format_with_sd(mean, error) + ("" if is_significant(p_value) else " (n. s.)")


def _constraint_cell(report: Report, point: Report, j: int) -> str:
    """Return the worst value of a constrained key, and in how many sets of fresh seeds the constraint is met."""
    value = format_number(point["constraints"][j], _digits(report, "constraints", j))
    met, sets = point["fresh"]["met"][j], point["fresh"]["sets"]
    return value if met is None else f"{value} ({met} of {sets})"


def _failure_cell(point: Report) -> str:
    return f"{point['fresh']['failed']} of {point['fresh']['sets']}"


def _selected_points(report: Report) -> list[tuple[str, Report]]:
    """Return the selected designs with their names."""
    points: list[tuple[str, Report]] = [("baseline", report["baseline"])]
    if report["knee"] is None:
        return points
    front = report["pareto"]
    names = {report["knee"]: "knee point"}
    for j, aim in enumerate(report["aims"]):
        best = min if aim["sense"] == "minimise" else max
        values = [point["objectives"][j] for point in front]
        names.setdefault(values.index(best(values)), f"best {figures.objective_text(aim)}")
    return points + [(f"{name} ({i})", front[i]) for i, name in names.items()]


def _ride_quality(report: Report) -> list[Row]:
    """Return the ride quality of the baseline and the knee point, means over the cases."""
    designs = [report["riding"][when] or {} for when in ("before", "after")]
    rows = []
    for key in designs[0] or designs[1]:
        values = [design.get(key) for design in designs]
        cells = [value if isinstance(value, str) else format_number(value) for value in values]
        name = key.replace("_", " ") + (", worst" if key == "class" else "")
        rows.append({"name": name, "unit": _unit(key) if key in RESPONSE_KEYS else "", "cells": cells})
    return rows


def _front(study: Study, report: Report) -> Row:
    """Return the table of the whole front."""
    is_repeated = figures.has_fresh_seeds(report)
    has_failures = any(point["fresh"]["failed"] for point in report["pareto"])
    scales = [display_scale([v.lowest, v.highest], v.unit) for v in study.variables]
    objectives = [figures.objective_text(aim) for aim in report["aims"]]
    head = [
        *(f"{v.path} [{unit or 1}]" for v, (_, unit) in zip(study.variables, scales, strict=True)),
        *objectives,
        *(f"{objective}, fresh" for objective in objectives if is_repeated),
        *(f"{objective}, minus the knee point" for objective in objectives if is_repeated),
        *report["limits"],
        *(["failed on fresh seeds"] if has_failures else []),
    ]
    factors = {v.path: factor for v, (factor, _) in zip(study.variables, scales, strict=True)}
    digits = {path: _digits(report, "variables", path) for path in factors}
    rows = []
    for i, point in enumerate(report["pareto"]):
        fresh = point["fresh"]
        cells = [
            *(format_number(factor * point["variables"][path], digits[path]) for path, factor in factors.items()),
            *(format_number(value, _digits(report, "objectives", j)) for j, value in enumerate(point["objectives"])),
            *(format_with_sd(*pair) for pair in zip(fresh["mean"], fresh["sd"], strict=True) if is_repeated),
            *(_difference_cell(fresh["minus_knee"], j) for j in range(len(objectives)) if is_repeated),
            *(_constraint_cell(report, point, j) for j in range(len(report["limits"]))),
            *([_failure_cell(point)] if has_failures else []),
        ]
        rows.append({"index": i, "knee": i == report["knee"], "cells": cells})
    return {"head": head, "rows": rows}


def _cases(study: Study, report: Report) -> list[tuple[str, str]]:
    """Return the cases on which every design was evaluated."""
    c = study.cases
    scenarios = [
        ", ".join(f"{path} {format_number(x) if isinstance(x, float) else x}" for path, x in scenario.items())
        for scenario in c.scenario
    ]
    rows = [
        ("tracks", "; ".join(c.track)),
        ("speeds", ", ".join(f"{v:.4g} m/s" for v in c.speed)),
        *([("seeds", ", ".join(map(str, used_seeds(study))))] if figures.has_fresh_seeds(report) else []),
        ("scenarios", "; ".join(scenario or "as designed" for scenario in scenarios)),
        ("samples of the calibrated parameters", str(c.draws)),
    ]
    if any(RESPONSE_KEYS[key].analysis == "curve" for key in required_keys(study)):
        rows.append(("curve", f"radius {c.radius:g} m, cant deficiency {1e3 * c.cant_deficiency:g} mm"))
    return rows


def _provenance(report: Report) -> list[tuple[str, str]]:
    """Return version, kernel, method, effort, and the hash of every input."""
    rows = [
        ("railui", f"{report['version']}, kernel {core.source_hash()}"),
        ("SIMD level", str(report["simd"])),
        ("method", ", ".join(f"{key} {value}" for key, value in report["method"].items())),
        ("effort", f"{format_number(report['seconds'])} s in this session, {report['cases']} cases"),
    ]
    return rows + [(f"sha256 of {Path(i['file']).name}", i["sha256"] or DASH) for i in report["inputs"]]


def _unit(key: str) -> str:
    return typeset_unit(RESPONSE_KEYS[key].unit)
