"""The report of an optimisation as one self-contained page: report.html."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railui import core
from railui.io.atomic import write_text
from railui.io.number_format import typeset_unit
from railui.optimisation.design_space import DesignSpace
from railui.optimisation.objectives import is_at_bound, required_keys
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.optimisation.study import Study
from railui.report.numbers import DASH, display_scale, format_number, format_with_sd
from railui.report.search import figures
from railui.report.templates import render_template

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
        "provenance": _provenance(report),
    }


def sentence(report: Report) -> str:
    """Return the result in one sentence: the objectives of the knee point and of the baseline."""
    if report["knee"] is None:
        return "No design satisfies the constraints."
    knee, baseline = report["pareto"][report["knee"]], report["baseline"]
    parts = []
    for j, aim in enumerate(report["aims"]):
        value, reference = knee["objectives"][j], baseline["objectives"][j]
        text = f"{figures.objective_text(aim)} {format_number(value)} {_unit(aim['key'])}".strip()
        parts.append(text + (f" (baseline {format_number(reference)})" if reference is not None else ""))
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


def selected_designs(study: Study, report: Report) -> Row:
    """Return the table of the baseline, the knee point and the best design of each objective."""
    points, is_repeated = _selected_points(report), figures.has_fresh_seeds(report)
    rows: list[Row] = []
    for variable in study.variables:
        values = [point["variables"][variable.path] for _, point in points]
        factor, unit = display_scale(values, variable.unit)
        positions = DesignSpace([variable]).to_unit(np.array([values]).T)[:, 0].tolist()
        bounds = [" (bound)" if is_at_bound(position) else "" for position in positions]
        cells = [format_number(factor * value) + bound for value, bound in zip(values, bounds, strict=True)]
        rows.append({"name": variable.path, "unit": unit, "cells": cells})
    for j, aim in enumerate(report["aims"]):
        unit = _unit(aim["key"])
        cells = [format_number(point["objectives"][j]) for _, point in points]
        rows.append({"name": f"{aim['sense']} {figures.objective_text(aim)}", "unit": unit, "cells": cells})
        if not is_repeated:
            continue
        fresh = [format_with_sd(point["fresh"]["mean"][j], point["fresh"]["sd"][j]) for _, point in points]
        rows.append({"name": "on fresh seeds", "unit": unit, "cells": fresh, "quiet": True})
    for j, limit in enumerate(report["limits"]):
        cells = [format_number(point["constraints"][j]) for _, point in points]
        rows.append({"name": limit, "unit": _unit(study.constraints[j].key), "cells": cells})
    return {"names": [name for name, _ in points], "rows": rows}


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
    scales = [display_scale([v.lowest, v.highest], v.unit) for v in study.variables]
    is_repeated = figures.has_fresh_seeds(report)
    head = [f"{v.path} [{unit or 1}]" for v, (_, unit) in zip(study.variables, scales, strict=True)]
    rows = []
    for i, point in enumerate(report["pareto"]):
        values = zip(scales, point["variables"].values(), strict=True)
        fresh = zip(point["fresh"]["mean"], point["fresh"]["sd"], strict=True)
        cells = [
            *(format_number(factor * value) for (factor, _), value in values),
            *map(format_number, point["objectives"]),
            *(format_with_sd(mean, sd) for mean, sd in fresh if is_repeated),
            *map(format_number, point["constraints"]),
        ]
        rows.append({"index": i, "knee": i == report["knee"], "cells": cells})
    objectives = [figures.objective_text(aim) for aim in report["aims"]]
    on_fresh_seeds = [f"{objective}, fresh" for objective in objectives if is_repeated]
    return {"head": [*head, *objectives, *on_fresh_seeds, *report["limits"]], "rows": rows}


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
        *([("seeds", ", ".join(map(str, c.seed)))] if figures.has_fresh_seeds(report) else []),
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
