"""The report of a search as one page: report.html, which opens anywhere without a network."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from railui import core
from railui.io.atomic import write_text
from railui.io.number_format import unit_text
from railui.optimisation.design_space import Ranges
from railui.optimisation.objectives import keys_of, on_edge
from railui.optimisation.response_keys import RESULTS
from railui.optimisation.study import Study
from railui.report.figures.drawing import scale
from railui.report.numbers import DASH, number, with_sd
from railui.report.rendered import rendered
from railui.report.search import figures as figures

Report = Mapping[str, Any]
Row = dict[str, Any]


def write_study_page(study: Study, report: Report, path: str | Path) -> Path:
    """Writes report.html of a search: figures inside, nothing fetched from elsewhere."""
    return write_text(path, rendered("search/page.html.j2", contents(study, report)))


def contents(study: Study, report: Report) -> Row:
    """All that the template shows, as words and pictures."""
    each = range(len(report["aims"]))
    return {
        "report": report,
        "sentence": sentence(report),
        "fronts": figures.fronts(report),
        "parallel": figures.parallel(study, report),
        "progress": figures.progress(report),
        "hanging": [p for j in each if (p := figures.hanging(report, j)) is not None],
        "shares": [p for j in each if (p := figures.shares(study, report, j)) is not None],
        "sobol": report["sensitivities"]["sobol"],
        "chosen": chosen(study, report),
        "riding": riding(report),
        "front": front(study, report),
        "cases": cases(study),
        "failures": sorted(report["failures"].items(), key=lambda row: -row[1]),
        "provenance": provenance(report),
    }


def sentence(report: Report) -> str:
    """What came of it, in one sentence."""
    if report["knee"] is None:
        return "No design keeps the limits."
    knee, base = (point["objectives"] for point in (report["pareto"][report["knee"]], report["baseline"]))
    parts = []
    for aim, new, old in zip(report["aims"], knee, base, strict=True):
        unit = unit_text(RESULTS[aim["key"]].unit)
        told = f"{number(new)} {unit}".strip()
        parts.append(f"{figures.aim_words(aim)} {told}" + (f" instead of {number(old)}" if old is not None else ""))
    return f"At the knee of {len(report['pareto'])} designs: {'; '.join(parts)}."


def chosen(study: Study, report: Report) -> Row:
    """The vehicle as it is, the knee and the ends of the front, side by side."""
    points: list[tuple[str, Report]] = [("as it is", report["baseline"])]
    front = report["pareto"]
    if report["knee"] is not None:
        named = {report["knee"]: "knee"}
        for j, aim in enumerate(report["aims"]):
            best = min if aim["sense"] == "minimise" else max
            values = [point["objectives"][j] for point in front]
            named.setdefault(values.index(best(values)), f"best {figures.aim_words(aim)}")
        points += [(f"{words} ({i})", front[i]) for i, words in named.items()]
    rows: list[Row] = []
    for v in study.variables:
        values = [point["variables"][v.path] for _, point in points]
        factor, unit = scale(values, v.unit)
        shares = Ranges([v]).unit(np.array([values]).T)[:, 0].tolist()
        bounds = [" (bound)" if on_edge(share) else "" for share in shares]
        cells = [number(factor * x) + bound for x, bound in zip(values, bounds, strict=True)]
        rows.append({"name": v.path, "unit": unit, "cells": cells})
    for j, aim in enumerate(report["aims"]):
        unit = unit_text(RESULTS[aim["key"]].unit)
        name = f"{aim['sense']} {figures.aim_words(aim)}"
        rows.append({"name": name, "unit": unit, "cells": [number(point["objectives"][j]) for _, point in points]})
        fresh = [with_sd(point["fresh"]["mean"][j], point["fresh"]["sd"][j]) for _, point in points]
        rows.append({"name": "on fresh seeds", "unit": unit, "cells": fresh, "quiet": True})
    for j, limit in enumerate(report["limits"]):
        unit = unit_text(RESULTS[study.constraints[j].key].unit)
        rows.append({"name": limit, "unit": unit, "cells": [number(point["constraints"][j]) for _, point in points]})
    return {"names": [name for name, _ in points], "rows": rows}


def riding(report: Report) -> list[Row]:
    """Riding quality before and after, means over the cases."""
    before, after = (report["riding"][when] or {} for when in ("before", "after"))
    rows = []
    for key in before or after:
        unit = unit_text(RESULTS[key].unit) if key in RESULTS else ""
        cells = [x if isinstance(x := one.get(key), str) else number(x) for one in (before, after)]
        name = key.replace("_", " ") + (", worst" if key == "class" else "")
        rows.append({"name": name, "unit": unit, "cells": cells})
    return rows


def front(study: Study, report: Report) -> Row:
    """The whole front."""
    scales = [scale([v.lowest, v.highest], v.unit) for v in study.variables]
    head = [f"{v.path} [{unit or 1}]" for v, (_, unit) in zip(study.variables, scales, strict=True)]
    rows = []
    for i, point in enumerate(report["pareto"]):
        values = zip(scales, point["variables"].values(), strict=True)
        fresh = zip(point["fresh"]["mean"], point["fresh"]["sd"], strict=True)
        cells = [*(number(factor * x) for (factor, _), x in values), *map(number, point["objectives"])]
        cells += [with_sd(mean, sd) for mean, sd in fresh] + [number(x) for x in point["constraints"]]
        rows.append({"index": i, "knee": i == report["knee"], "cells": cells})
    aims = [figures.aim_words(aim) for aim in report["aims"]]
    return {"head": [*head, *aims, *(f"{aim}, fresh" for aim in aims), *report["limits"]], "rows": rows}


def cases(study: Study) -> list[tuple[str, str]]:
    """What every design was judged on."""
    c = study.cases
    told = [{path: number(x) if isinstance(x, float) else x for path, x in one.items()} for one in c.scenario]
    scenarios = [", ".join(f"{path} {x}" for path, x in one.items()) for one in told]
    rows = [
        ("tracks", "; ".join(c.track)),
        ("speeds", ", ".join(f"{v:g} m/s" for v in c.speed)),
        ("seeds", ", ".join(map(str, c.seed))),
        ("scenarios", "; ".join(one or "as is" for one in scenarios)),
        ("draws of the covariance", str(c.draws)),
    ]
    if any(RESULTS[key].question == "curve" for key in keys_of(study)):
        rows.append(("curve", f"radius {c.radius:g} m, cant deficiency {1e3 * c.cant_deficiency:g} mm"))
    return rows


def provenance(report: Report) -> list[tuple[str, str]]:
    """What made this page."""
    method = ", ".join(f"{key} {value}" for key, value in report["method"].items())
    rows = [
        ("railui", f"{report['version']}, kernel {core.sources()}"),
        ("SIMD level", str(report["simd"])),
        ("method", method),
        ("effort", f"{number(report['seconds'])} s this time, on {report['cases']} cases"),
    ]
    return rows + [(f"sha256 of {Path(i['file']).name}", i["sha256"] or DASH) for i in report["inputs"]]
