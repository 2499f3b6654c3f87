"""The report of a plan as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railui import core
from railui.io.atomic import write_text
from railui.report.numbers import DASH, format_number
from railui.report.plan.figures import map_picture, selection_picture
from railui.report.plan.rows import confounded_rows, effect_rows, marks_legend, parameter_rows, sentence
from railui.report.templates import render_template
from railui.vehicle.multibody import Structure


def write_plan_page(document: Mapping[str, Any], structure: Structure | None, path: str | Path) -> Path:
    """Write the page of a plan; `document` is the JSON document of `railui plan`."""
    groups = effect_rows(document, structure=structure)
    effects = effect_rows(document, groups_only=False, structure=structure)
    contents = {
        "document": document,
        "sentence": sentence(document),
        "map": map_picture(document, groups),
        "selection": selection_picture(document) if document["steps"] else None,
        "columns": ["selection", "everything", *(run["name"] for run in document["runs"])],
        "effects": effects,
        "legend": "; ".join(marks_legend(effects)),
        "parameters": parameter_rows(document),
        "confounded": confounded_rows(document, structure),
        "steps": [
            (s["added"], format_number(s["cost"]), f"{100 * s['attained_share']:.0f} %") for s in document["steps"]
        ],
        "provenance": _provenance(document),
    }
    return write_text(path, render_template("plan/page.html.j2", contents))


def _provenance(document: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [
        ("railui", f"{document['version']}, kernel {core.source_hash()}"),
        ("SIMD level", str(document["simd"])),
        ("seed", str(document["seed"])),
        ("critical score", format_number(document["critical_score"])),
        ("noise floor on the validation run", format_number(document["noise_floor"])),
    ]
    return rows + [(f"sha256 of {Path(i['file']).name}", i["sha256"] or DASH) for i in document["inputs"]]
