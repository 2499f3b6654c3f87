"""Page of a fleet: one self-contained file with links to the reports of its loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui import core
from railui.fleet.fleet_file import Fleet
from railui.fleet.status import TypeState
from railui.io.atomic import write_text
from railui.report.fleet.alarm_texts import alarm_texts, fleet_sentence
from railui.report.fleet.figures import fleet_map, history_picture, section_picture
from railui.report.numbers import DASH, format_number, format_with_sd
from railui.report.templates import render_template

MAX_HISTORIES = 40  # alarms with a picture, the latest


def write_fleet_page(fleet: Fleet, document: Mapping[str, Any], states: Sequence[TypeState], path: str | Path) -> Path:
    """Write the page of a fleet; `document` is the JSON document of `railui fleet run`."""
    types = []
    for state in states:
        rows = [row for row in document["alarms"] if row["type"] == state.type.name]
        shown = list(zip(rows, state.alarms, strict=True))[::-1]
        types.append(
            {
                "name": state.type.name,
                "map": fleet_map(state),
                "sections": section_picture(state) if len(state.data.sections) > 1 else None,
                "alarms": [
                    {**alarm_texts(row), "picture": history_picture(state, alarm) if i < MAX_HISTORIES else None}
                    for i, (row, alarm) in enumerate(shown)
                ],
                "parameters": [_parameter(row) for row in document["parameters"] if row["type"] == state.type.name],
            }
        )
    contents = {
        "document": document,
        "sentence": fleet_sentence(document),
        "types": types,
        "sections": [(row["section"], a) for row in document["sections"] for a in row["alarms"]],
        "vehicles": document["vehicles"],
        "number": format_number,
        "provenance": _provenance(fleet, document),
    }
    return write_text(path, render_template("fleet/page.html.j2", contents))


def _parameter(row: Mapping[str, Any]) -> dict[str, str]:
    relative = abs(row["mean"]) or 1.0
    percent = row["kind"] == "parameter"
    spread = f"{100 * row['vehicle_sd'] / relative:.1f} %" if percent else format_number(row["vehicle_sd"])
    section = f"{100 * row['section_sd'] / relative:.1f} %" if percent else format_number(row["section_sd"])
    return {
        "name": row["quantity"],
        "unit": row["unit"],
        "mean": format_with_sd(row["mean"], row["mean_sd"]),
        "spread": spread,
        "section": section,
        "temperature": format_with_sd(row["per_temperature"], row["per_temperature_sd"]),
        "use": format_with_sd(row["per_use"], row["per_use_sd"]),
    }


def _provenance(fleet: Fleet, document: Mapping[str, Any]) -> list[tuple[str, str]]:
    runs = document["runs"]
    rows = [
        ("railui", f"{document['version']}, kernel {core.source_hash()}"),
        ("runs", f"{runs['all']}, of which {runs['computed']} computed now"),
        *((f"left out: {reason}", str(count)) for reason, count in runs["left_out"].items()),
    ]
    return rows + [(f"sha256 of {Path(i['file']).name}", i["sha256"] or DASH) for i in document["inputs"]]
