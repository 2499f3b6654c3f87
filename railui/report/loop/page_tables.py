"""Tables of the loop page: rows of text from the report."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from railui import core
from railui.identification.estimation.identifiability import COMBINED, DETERMINED, ROUGH, UNSEEN
from railui.report.loop.uncertainty import interval_text
from railui.report.loop.wording import MODEL_LABELS, MODELS, ROLE_LABELS, effect_title, location_text, shown_models
from railui.report.numbers import DASH, display_scale, format_number, format_percent_change, format_with_sd
from railui.vehicle.multibody import Structure
from railui.vehicle.parameters import PARAMETERS

Report = Mapping[str, Any]
Row = dict[str, Any]

MAX_RANKED = 12  # candidates shown
MEANING = {
    "declared": "parameters of the design",
    "before": "parameters estimated, no effect added",
    "after": "effect added, parameters estimated again",
    "floor": "expected from noise alone",
}
# identifiability of a parameter from the data alone: text, and how it is graded
IDENTIFIABILITY = {
    DETERMINED: ("determined", "good"),
    ROUGH: ("determined roughly", "fair"),
    COMBINED: ("only in combination with others", "fair"),
    UNSEEN: ("not identifiable, prior-dominated", "poor"),
}
RIDE_QUALITY = {
    "sd_e1": ("sd of e1, leading wheelset relative to the rails", "m"),
    "sd_e2": ("sd of e2, trailing wheelset relative to the rails", "m"),
    "flange_fraction": ("proportion of flange contact", "1"),
    "weighted_acceleration": ("weighted acceleration at the comfort point (W_d)", "m/s^2"),
}
EXCLUDED_ROWS = {
    "missing_rows": "missing rows",
    "nan_rows": "rows with empty or NaN cells",
    "stuck_rows": "rows with a stuck channel",
    "standing_rows": "rows at standstill",
    "short_stretches": "segments too short",
    "unused_rows": "rows not used",
}


def error_rows(report: Report) -> Row:
    """Return the channels and, per model and for the noise floor, all errors and their ratio to the noise floor."""
    channels = list(report["declared"]["channels"])
    floor = report["floor"]["nrmse"]
    decimals = _error_decimals(report)
    models = shown_models(report)
    rows = []
    for model, label in models.items():
        errors = report[model]
        nrmse = errors["nrmse"]
        meaning = MEANING["before" if label == MODEL_LABELS["before"] else model]
        meaning += ", constrained to be stable" if errors.get("constrained") else ""
        rows.append(
            {
                "label": label,
                "meaning": meaning,
                "all": f"{nrmse:.{decimals}f}" if nrmse is not None else "diverged",
                "ratio": f"{nrmse / floor:.2f}" if nrmse is not None and floor else DASH,
                "channels": [
                    DASH if (error := errors["channels"].get(channel)) is None else f"{error:.{decimals}f}"
                    for channel in channels
                ],
            }
        )
    return {"channels": channels, "rows": rows}


def _error_decimals(report: Report) -> int:
    errors = [e for model in MODELS for e in (report[model]["nrmse"], *report[model]["channels"].values()) if e]
    smallest = min(errors, default=1.0)
    return 3 if smallest >= 0.01 else 4 if smallest >= 1e-3 else 6


def parameter_label(key: str, p: Mapping[str, Any]) -> str:
    """Return the name of a parameter of an effect, and whether its estimate is on a bound of the catalogue."""
    return f"{key.replace('_', ' ')}{' (at its bound)' if p.get('is_on_bound') else ''}"


def quantity_row(name: str, p: Mapping[str, Any]) -> Row:
    """Return a value with its standard deviation, in a readable unit."""
    factor, unit = display_scale(p["value"], p["unit"])
    sd = None if p["sd"] is None else factor * p["sd"]
    return {"name": name, "value": format_with_sd(factor * p["value"], sd), "unit": unit}


def ranking_rows(report: Report, structure: Structure | None = None) -> Row:
    """Return the best candidates and the model without an effect, whatever its rank."""
    rows = report["ranking"]
    without_effect = next((row["nrmse"] for row in rows if row["kind"] == "none"), None)
    shown = [(i, row) for i, row in enumerate(rows, 1) if i <= MAX_RANKED or row["kind"] == "none"]
    largest = max([row["nrmse"] for _, row in shown if row["nrmse"]], default=0.0)
    return {
        "rows": [candidate_row(row, largest, without_effect, structure) | {"rank": i} for i, row in shown],
        "count": len(rows),
    }


def candidate_row(
    row: Report,
    largest_error: float = 0.0,
    error_without_effect: float | None = None,
    structure: Structure | None = None,
) -> Row:
    """Return a candidate with its bars in per cent: hollow where it is estimated, dotted where it does not improve."""
    rho, error, is_none, is_refitted = row["rho"], row["nrmse"], row["kind"] == "none", row.get("refitted", True)
    no_gain = not is_none and None not in (error_without_effect, error) and error >= error_without_effect
    return {
        "title": effect_title(row["kind"]),
        "none": is_none,
        "location": location_text(row["at"], row["wheelset"], structure) if row["at"] else "",
        "rho": DASH if is_none or rho is None else f"{rho:.2f}".replace("-", "−"),
        "rho_width": f"{100 * min(1.0, abs(rho or 0.0)):.1f}",
        "nrmse": format_number(error),
        "nrmse_width": f"{100 * min(1.0, (error or 0.0) / largest_error):.1f}" if largest_error else "0",
        "bar": ("" if is_refitted else " estimate") + (" no-gain" if no_gain else ""),
        "refitted": is_refitted,
        "weight": f"{100 * row['weight']:.0f} %" if row.get("weight") else "",
        "p": format_number(row.get("p"), 2),
    }


def parameter_rows(report: Report) -> list[Row]:
    """Return every estimated parameter in one unit per row, with its identifiability."""
    from_profiles = (report.get("profiles") or {}).get("parameters", {})
    identifiability = report["identifiability"]["parameters"]
    rows = []
    for path, p in report["parameters"].items():
        factor, unit = display_scale([p["declared"], p["before"], p["value"]], p["unit"])
        text, grade = _identifiability(identifiability.get(path), p["flag"])
        has_change = p["declared"] and p["value"] is not None
        rows.append(
            {
                "path": path,
                "caption": PARAMETERS[path].caption if path in PARAMETERS else "",
                "declared": format_number(_scaled(factor, p["declared"])),
                "before": format_number(_scaled(factor, p["before"])),
                "value": format_with_sd(_scaled(factor, p["value"]), _scaled(factor, p["sd"])),
                "interval": interval_text(_scaled(factor, p["value"]), _scaled(factor, p["sd"])),
                "profiles": format_number(_scaled(factor, from_profiles.get(path))),
                "unit": unit,
                "change": _change(p["value"], p["declared"], 0) if has_change else DASH,
                "identifiability": text,
                "grade": grade,
            }
        )
    return rows


def _identifiability(found: Mapping[str, Any] | None, flag: str | None) -> tuple[str, str]:
    """Return how well the data determine a parameter, in words, and the grade of that."""
    text, grade = IDENTIFIABILITY[found["word"]] if found else ("", "poor")
    if flag == "bound":
        return "at its bound", "poor"
    return (f"{text}, shifted" if flag == "moved" else text), grade


def profiles_text(report: Report) -> Row | None:
    """Return the text on the profiles of the design above the parameters, None without profiles."""
    profiles = report.get("profiles")
    if not profiles:
        return None
    e1, e2 = (f"{1e3 * sd:.2g}" for sd in profiles["deviation"])
    return {**profiles, "e1": e1, "e2": e2, "surface": f"{profiles['surface']:g}"}


def ride_quality_rows(report: Report) -> list[Row]:
    """Return ride-quality quantities as measured and as simulated by each model, with the deviation of each."""
    sources = ("measured", "declared", "before", "after")
    rows = []
    for key, (name, si_unit) in RIDE_QUALITY.items():
        values = [report["riding"].get(source, {}).get(key) for source in sources]
        if all(value is None for value in values):
            continue
        factor, unit = display_scale(values, si_unit)
        measured = values[0]
        cells = [{"value": format_number(_scaled(factor, value)), "deviation": ""} for value in values]
        for cell, value in zip(cells[1:], values[1:], strict=True):
            if measured and value is not None:
                cell["deviation"] = _change(value, measured, 1)
        rows.append({"name": name, "unit": unit, "cells": cells})
    return rows


def detectable_rows(report: Report, structure: Structure | None = None) -> list[Row]:
    """Return the minimum detectable effects, one row per kind, location and parameter."""
    order = {record["kind"]: i for i, record in enumerate(core.effect_catalogue())}
    by_parameter: dict[tuple[str, str, str], dict[int | None, str]] = {}
    for row in sorted(report["detectable"], key=lambda r: (order[r["kind"]], r["at"], r["parameter"])):
        factor, unit = display_scale(row["value"], row["unit"])
        text = "not detectable" if row["value"] is None else f"{format_number(factor * row['value'])} {unit}".strip()
        by_parameter.setdefault((row["kind"], row["at"], row["parameter"]), {})[row["wheelset"]] = text
    rows: list[Row] = []
    last_kind = ""
    for (kind, at, parameter), values in by_parameter.items():
        rows.append(
            {
                "title": effect_title(kind),
                "new": kind != last_kind,
                "location": location_text(at, None, structure),
                "parameter": parameter.replace("_", " "),
                "values": [values.get(wheelset, "") for wheelset in (None, *detectable_numbers(report))],
            }
        )
        last_kind = kind
    return rows


def detectable_numbers(report: Report) -> list[int]:
    """Return the numbers of wheelsets or joints for which effects have a minimum detectable size of their own."""
    return sorted({row["wheelset"] for row in report["detectable"] if row["wheelset"]} or {1, 2})


def run_row(run: Report) -> Row:
    """Return a run with the rows that were excluded from it."""
    counts = run.get("counts", {})
    return {
        "file": run["file"],
        "role": ROLE_LABELS.get(run["role"], run["role"]),
        "samples": run["samples"],
        "used": counts.get("used", DASH),
        "segments": run["stretches"],
        "gaps": counts.get("gaps", DASH),
        "excluded": "; ".join(f"{counts[key]} {name}" for key, name in EXCLUDED_ROWS.items() if counts.get(key)),
        "ignored": ", ".join(run.get("ignored", ())),
    }


def mean_error_rows(report: Report, units: Mapping[str, str]) -> list[Row]:
    """Return the mean of measured minus simulated per channel, which the comparison band excludes."""
    rows = []
    for channel, value in report["means"].items():
        factor, unit = display_scale(value, units[channel])
        rows.append({"name": channel, "value": format_number(_scaled(factor, value), 2), "unit": unit})
    return rows


def _scaled(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _change(value: float, reference: float, decimals: int) -> str:
    return format_percent_change((value / reference - 1.0) * 100, decimals)
