"""Tables of the commands adjust and loop: errors, parameters, effects, minimum detectable effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from railui.cli.tables import format_fixed, make_table

if TYPE_CHECKING:
    from railui.vehicle.multibody import Structure

Report = Mapping[str, Any]

MAX_CHANNEL_COLUMNS = 10  # of the table of errors; more channels stand below each other
MAX_DETECTABLE_ROWS = 16
MIN_CHI2 = 4.0  # of the values per track section, from which a parameter is shown as varying
MIN_RELATIVE_VARIATION = 0.01  # of a parameter between track sections


def errors_table(report: Report) -> Any:
    """Return the NRMSE of every model on the validation runs, all channels and each."""
    from railui.report.loop.wording import MODEL_LABELS, MODELS

    channels = list(report["declared"]["channels"])
    rows = [("", "all", *channels)]
    for model in MODELS:
        errors = report[model]
        values = [errors["nrmse"], *(errors["channels"].get(channel) for channel in channels)]
        rows.append((MODEL_LABELS[model], *map(format_fixed, values)))
    if len(channels) > MAX_CHANNEL_COLUMNS:
        rows = list(zip(*rows, strict=True))
    return make_table(rows[0], rows[1:], title="NRMSE on the validation runs", align_right=True)


def parameters_table(report: Report, paths: Sequence[str]) -> Any:
    """Return nominal and calibrated parameters, with those of the design's profiles where it has any."""
    from railui.io.number_format import format_quantity

    profiles = report["profiles"]
    columns = ("path", "nominal", *(["profiles"] if profiles else []), "calibrated", "standard deviation", "")
    rows = []
    for path in paths:
        p = report["parameters"][path]
        from_profiles = []
        if profiles:
            value = profiles["parameters"].get(path)
            from_profiles.append("-" if value is None else format_quantity(value, p["unit"]))
        nominal, calibrated, sd = (format_quantity(p[key], p["unit"]) for key in ("declared", "value", "sd"))
        rows.append((path, nominal, *from_profiles, calibrated, sd, p["flag"] or ""))
    return make_table(columns, rows, title="calibrated parameters")


def conditions_table(conditions: Report) -> Any:
    """Return every parameter under every stated condition, with its standard deviation."""
    from railui.report.numbers import quantity_with_sd

    rows = []
    for row in conditions["parameters"]:
        cells = [quantity_with_sd(x, sd, row["unit"]) for x, sd in zip(row["values"], row["sd"], strict=True)]
        rows.append((row["path"], *cells, f"{row['p']:.1g}", format_fixed(row["alone_nrmse"])))
    columns = ("path", *conditions["values"], "p", "NRMSE with it apart")
    return make_table(columns, rows, title=f"parameters against {conditions['name']}")


def profiles_note(profiles: Report) -> str:
    """Return which profiles the table refers to, or why they give no parameters."""
    pair = f"profiles: {profiles['wheel']} on {profiles['rail']}, linearised over the measured motion"
    return str(profiles["note"] or pair)


def effects_table(report: Report, structure: Structure | None = None) -> Any:
    """Return the effects that were added, with their parameters; structure: that of a vehicle of bodies."""
    from railui.report.loop.phases import segment_text
    from railui.report.loop.wording import joint_text
    from railui.report.numbers import quantity_cells

    rows = []
    for effect in report["effects"]:
        joint = joint_text(effect["at"], effect["wheelset"], structure)
        phases = [(f"phase, {segment_text(p)}", p) for p in effect["phases"]]
        for name, p in [*effect["parameters"].items(), *phases]:
            cells = quantity_cells(p["value"], p["sd"], p["unit"])
            label = f"{name} (at its bound)" if p.get("is_on_bound") else name
            rows.append((effect["kind"], effect["at"], joint, label, *cells))
    columns = ("kind", "at", "wheelset", "parameter", "value", "standard deviation")
    shown = [k for k, name in enumerate(columns) if name != "wheelset" or any(row[k] for row in rows)]
    title = "identified effect" + ("s" if len(report["effects"]) > 1 else "")
    return make_table([columns[k] for k in shown], [[row[k] for k in shown] for row in rows], title=title)


def detectable_table(report: Report) -> Any:
    """Return the minimum detectable magnitude of common effects."""
    from railui.io.number_format import format_quantity
    from railui.report.loop.wording import common_rows

    detectable = [r for r in report["detectable"] if r["wheelset"] is None and r["value"] is not None]
    rows = [
        (r["kind"], r["at"], f"{r['parameter']} {format_quantity(r['value'], r['unit'])}")
        for r in common_rows(detectable)[:MAX_DETECTABLE_ROWS]
    ]
    title = "minimum detectable effects (nominal power 90 %)"
    return make_table(("kind", "at", "minimum detectable"), rows, title=title)


def coefficients_table(rows: Sequence[Report]) -> Any:
    """Return the coefficients that contradict their derivation, or a sentence where there is none."""
    contradicting = [
        (
            row["wheelset"],
            row["equation"],
            row["motion"],
            f"{row['difference']:.4g}",
            row["unit"],
            f"{row['t']:+.1f}",
            f"{100 * row['share']:.1f} %",
        )
        for row in rows
        if row["contradicts"]
    ]
    if not contradicting:
        return "no coefficient of the wheelset equations contradicts its derivation"
    columns = ("wheelset", "equation", "coefficient of", "difference", "unit", "deviation [sd]", "explains alone")
    return make_table(columns, contradicting, title="coefficients that contradict their derivation")


def sections_table(report: Report) -> Any:
    """Return the parameters that vary between track sections by more than their standard deviations explain."""
    varying = {path: p for path, p in report["parameters"].items() if _varies(p)}
    if not varying:
        return f"no parameter varies between the {len(report['between'])} track sections"
    rows = [
        (path, *(f"{value:.4g}" for value in p["values"]), f"{p['chi2']:.1f}")
        for path, p in sorted(varying.items(), key=lambda item: -float(item[1]["chi2"]))
    ]
    columns = ("path", *(f"{start:.0f}-{end:.0f} m" for start, end in report["between"]), "chi2")
    return make_table(columns, rows, title="parameters that vary between track sections")


def _varies(p: Report) -> bool:
    spread = max(p["values"]) - min(p["values"])
    return (p["chi2"] or 0.0) > MIN_CHI2 and spread > MIN_RELATIVE_VARIATION * abs(p["values"][0])
