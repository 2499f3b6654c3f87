"""The loop report as one self-contained page: report.html."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from railui import core
from railui.identification.result import LoopResult
from railui.io.atomic import write_text
from railui.report.figures.drawing import Picture
from railui.report.loop import figures
from railui.report.loop.effect_figures import compute_effect_forces, effect_figures
from railui.report.loop.force_pictures import EffectFigure
from railui.report.loop.groups import group_table
from railui.report.loop.header import header_rows
from railui.report.loop.next_run import next_run_table
from railui.report.loop.noise import noise_table
from railui.report.loop.notes import divergence_note
from railui.report.loop.overview import overview_data
from railui.report.loop.page_tables import (
    candidate_row,
    detectable_numbers,
    detectable_rows,
    error_rows,
    mean_error_rows,
    parameter_label,
    parameter_rows,
    profiles_text,
    quantity_row,
    ranking_rows,
    ride_quality_rows,
    run_row,
)
from railui.report.loop.phases import segment_text
from railui.report.loop.residual_rows import residual_rows
from railui.report.loop.scatter import scatter_rows
from railui.report.loop.summary import summary_lines
from railui.report.loop.uncertainty import correlated_lines, correlation_table
from railui.report.loop.wording import MODEL_LABELS, MODELS, VERDICT_LABELS, effect_title, shown_models
from railui.report.numbers import DASH, format_number
from railui.report.schematic.subjects import schematic_of_report
from railui.report.templates import render_template
from railui.runs.columns import columns_of

Report = Mapping[str, Any]
Row = dict[str, Any]

NOISE_SOURCES = {
    "stated": "as stated in the campaign",
    "estimated": "estimated from the runs",
    "both": "estimated from the runs, with the stated noise as prior",
}
MAIN_CHANNELS = 4  # shown; the others are folded
VIEWER = Path(__file__).with_name("viewer.js")


def write_page(result: LoopResult, report: Report, path: str | Path) -> Path:
    """Write report.html of a loop, with its figures inside."""
    return write_text(path, render_page(result, report))


def render_page(result: LoopResult, report: Report) -> str:
    """Return the page as HTML."""
    return render_template("loop/page.html.j2", _contents(result, report))


def _contents(result: LoopResult, report: Report) -> Row:
    """Return the variables of the template."""
    window = figures.most_informative_window(result)
    with ThreadPoolExecutor(1) as pool:  # simulation releases the interpreter for the other figures
        forces = pool.submit(compute_effect_forces, result, window)
        contents = _contents_of_window(result, report, window)
        drawn = effect_figures(result, report, window, forces.result())
        return contents | {"effects": _effects(report, drawn)}


def _contents_of_window(result: LoopResult, report: Report, window: figures.Window) -> Row:
    """Return the variables of the template but for the effects."""
    is_rig, structure = result.nominal.design.kind == "rig", result.nominal.design.structure
    band = result.dataset.campaign.band
    shown = figures.raw_series(result, window.index)
    is_diverged = not {"before", "after"} & set(shown)
    return {
        "report": report,
        "labels": MODEL_LABELS | shown_models(report),
        "header": header_rows(result, report),
        "summary": summary_lines(report),
        "verdict": VERDICT_LABELS[report["verdict"]],
        "errors": error_rows(report),
        "bars": figures.error_bars(report),
        "schematic": _schematic(result, report),
        "channels": _channels(result, window),
        "scatter": scatter_rows(result, window, figures.shown_channels(window.segment)),
        "residuals": residual_rows(result, window, MAIN_CHANNELS),
        "runs_overview": [] if is_diverged else overview_data(result),
        "viewer": VIEWER.read_text("utf-8"),
        "correlations": correlation_table(result.after),
        "correlated": correlated_lines(result.after, report["effects"]),
        "ranking_draws": result.context.settings.values()["ranking_draws"],
        "main": MAIN_CHANNELS,
        "lines": [name for name in ("measured", "before", "after") if name in shown],
        "window": {
            "file": window.segment.file,
            "speed": None if is_rig else format_number(window.segment.mean_speed),
            "reason": "largest reduction of the error" if {"before", "after"} <= set(shown) else "largest motion",
        },
        "band": f"{band[0]:g} to {band[1]:g} Hz" if band else None,
        "ranking": ranking_rows(report, structure),
        "classes": [[effect_title(kind) for kind in kinds] for kinds in report["classes"] if len(kinds) > 1],
        "traces": [candidate_row(row, structure=structure) for row in report.get("traces", ())],
        "parameters": parameter_rows(report),
        "groups": group_table(report),
        "profiles": profiles_text(report),
        "riding": ride_quality_rows(report),
        "detectable": detectable_rows(report, structure),
        "numbers": detectable_numbers(report),
        "next_run": next_run_table(report, structure),
        "rig": is_rig,
        "power": sorted({f"{100 * row['power']:.0f} %" for row in report["detectable"] if row["power"]}),
        "runs": [run_row(run) for run in report["runs"]],
        "means": mean_error_rows(report, figures.units_of(result, window.segment)),
        "floor": _noise_floor(report),
        "gate": _data_checks(report),
        "identifiability": _identifiability(report),
        "notes": _notes(report),
        "provenance": _provenance(report),
    }


def _schematic(result: LoopResult, report: Report) -> Picture:
    """Return the vehicle from above with the sensors of all runs and the effects that were added."""
    dataset = result.dataset
    columns = [name for run in dataset.runs for name in run.columns]
    return schematic_of_report(result.nominal.design, dataset.campaign, columns, report)


def _effects(report: Report, pictures: Sequence[EffectFigure]) -> list[Row]:
    """Return the figure of a discrepancy, then the figure, parameters and source of every identified effect."""
    discrepancy = [{"figure": pictures[0], "parameters": [], "source": ""}] if report["outside"] else []
    return discrepancy + [
        {
            "figure": figure,
            "source": core.effect_record(effect["kind"])["source"],
            "parameters": [
                *(quantity_row(parameter_label(key, p), p) for key, p in effect["parameters"].items()),
                *(quantity_row(f"phase on {segment_text(p)}", p) for p in effect["phases"]),
            ],
        }
        for effect, figure in zip(report["effects"], pictures[len(discrepancy) :], strict=True)
    ]


def _channels(result: LoopResult, window: figures.Window) -> list[Row]:
    """Return the excerpt and the spectrum of every compared channel."""
    captions = {column.name: column.caption for column in columns_of(window.segment.kind).values()}
    shown = figures.shown_channels(window.segment)
    pictures = figures.channel_pictures(result, window, shown)
    return [
        {"name": name, "caption": captions[name], "series": series, "spectrum": spectrum}
        for name, (series, spectrum) in zip(shown, pictures, strict=True)
    ]


def _noise_floor(report: Report) -> Row:
    floor = report["floor"]
    return {
        "nrmse": format_number(floor["nrmse"]),
        "sd": format_number(floor["sd"], 2),
        "sensors_only": format_number(floor["sensors_only"]),
        "interval": [format_number(x, 2) for x in floor.get("interval", ())],
        "source": NOISE_SOURCES[floor["source"]],
        "noise": noise_table(floor.get("noise", {})),
        "ratio": DASH if report["unexplained"] is None else f"{report['unexplained']:.2f}",
    }


def _data_checks(report: Report) -> Row:
    """Return the findings of the data-quality checks, and per run the incoherent part of every channel."""
    findings = report.get("gate", ())
    incoherent: dict[str, list[tuple[str, str]]] = {}
    for finding in findings:
        if finding["check"] == "ceiling":
            cell = finding["channel"], format_number(finding["value"], 2)
            incoherent.setdefault(finding["file"], []).append(cell)
    return {"findings": [f for f in findings if f["check"] != "ceiling"], "incoherent": incoherent}


def _identifiability(report: Report) -> Row | None:
    found = report.get("identifiability")
    if not found or not found["singular_values"]:
        return None
    values = found["singular_values"]
    largest, smallest = format_number(values[0], 2), format_number(values[-1], 2)
    return {"words": found["words"], "largest": largest, "smallest": smallest}


def _notes(report: Report) -> list[str]:
    """Return the notes of the report, and one per model that diverges."""
    notes = list(report.get("notes", ()))
    shown = shown_models(report)
    for model in MODELS if "before" in shown else ("declared", "before"):
        diverged = report[model].get("diverged")
        note = diverged and divergence_note(model, diverged["file"], diverged["at_s"])
        if note and note not in notes:
            notes.append(note)
    return notes


def _provenance(report: Report) -> Sequence[tuple[str, str]]:
    """Return version, kernel, seed, effort, and the hash of every input."""
    simulations = f", {report['simulations']} simulations in the accepted fits" if report.get("simulations") else ""
    rows = [
        ("railui", f"{report['version']}, kernel {core.source_hash()}"),
        ("SIMD level", str(report["simd"])),
        ("seed", str(report["seed"])),
        ("effort", f"{format_number(report['seconds'])} s{simulations}"),
    ]
    rows += [(f"sha256 of {Path(source['file']).name}", source["sha256"]) for source in report.get("inputs", ())]
    return rows + [(f"sha256 of {run['file']}", run["sha256"]) for run in report["runs"]]
