"""The report of a ride as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from railui import core
from railui.io.atomic import write_text
from railui.optimisation.response_keys import RESPONSE_KEYS
from railui.report.numbers import DASH, format_number
from railui.report.ride.figures import RidePanels, ride_pictures
from railui.report.templates import render_template

SHOWN: Final = (
    *("score", "class", "decided_by", "comfort_point", "comfort_hours", "weighted_acceleration"),
    *("weighted_acceleration_1974", "flange_fraction", "flange_fraction_gaussian", "flange_margin", "n_mv", "wz"),
)
HEADINGS: Final = {
    "track": "Track and displacement",
    "comfort": "Accelerations",
    "psd_e": "Power spectral densities",
    "sum_y": "Guiding forces along the line",
}
NOTES: Final = {
    "psd_e": "Welch's estimate: Hann window, segments of an eighth of the ride that overlap by half; one-sided.",
    "sum_y": "An indication: vertical irregularities are left out. No acceptance or running-safety assessment.",
}


def write_ride_page(panels: RidePanels, document: Mapping[str, Any], path: str | Path) -> Path:
    """Write the page of a ride; `document` is the JSON document of `railui ride`."""
    sections: list[dict[str, Any]] = []
    for picture in ride_pictures(panels):
        if picture.name in HEADINGS:
            heading = HEADINGS[picture.name]
            sections.append({"heading": heading, "pictures": [], "note": NOTES.get(picture.name)})
        sections[-1]["pictures"].append(picture)
    contents = {
        "design": document["design"],
        "speed": document["speed"],
        "track": document["track"],
        "sentence": _sentence(document),
        "rows": [_row(key, document[key]) for key in SHOWN],
        "sections": sections,
        "notes": document["notes"],
        "provenance": _provenance(document),
    }
    return write_text(path, render_template("ride/page.html.j2", contents))


def _sentence(document: Mapping[str, Any]) -> str:
    if document["diverged"] is not None:
        return f"The simulation diverged at s = {document['diverged']['at_s']:.5g} m."
    score = format_number(document["score"])
    return f"Ride quality {document['class']}, score {score} of 100: {document['decided_by']}."


def _row(key: str, value: Any) -> tuple[str, str, str]:
    unit = RESPONSE_KEYS[key].unit if key in RESPONSE_KEYS and not RESPONSE_KEYS[key].is_text else ""
    text = value if isinstance(value, str) else DASH if value is None else format_number(value, 4)
    return key.replace("_", " "), text, "" if unit == "1" else unit


def _provenance(document: Mapping[str, Any]) -> list[tuple[str, str]]:
    overrides = ", ".join(f"{path} = {value}" for path, value in document["overrides"].items())
    rows = [
        ("railui", f"{document['version']}, kernel {core.source_hash()}"),
        ("SIMD level", str(document["simd"])),
        ("time steps per sample", str(document["steps"])),
        ("overrides", overrides or "none"),
    ]
    return rows + [(f"sha256 of {Path(i['file']).name}", i["sha256"] or DASH) for i in document["inputs"]]
