"""railui contact DESIGN: its profiles linearised over its own motion on a track."""

from __future__ import annotations

from typing import Any

from railui.cli.arguments import input_files, load_design_argument, resolve_track_argument
from railui.cli.invocation import Invocation, usage_error
from railui.cli.tables import make_table


def close_design(
    design: str | None,
    overrides: dict[str, str],
    track: str | None,
    speed: float | None,
    once: bool,
    call: Invocation,
) -> None:
    """Linearise the profiles of a design over its own motion, and print the passes."""
    from railui.api.contact import close_linearisation_of

    if design is None or track is None or speed is None:
        raise usage_error("give a design, --track and --speed")
    source = resolve_track_argument(track, call.seed)
    result = close_linearisation_of(load_design_argument(call, design, overrides), source, speed, once=once)
    if not once and not result.has_converged:
        call.warn([f"the motion does not reproduce itself within {len(result.steps)} passes"])
    head = {"design": result.design.name, "overrides": overrides, "track": source.name, "speed": speed}
    body = head | result.document()
    call.show(_passes_table(body))
    call.write_json(call.document("contact", body, input_files(design, source), source.seed))


def _passes_table(body: dict[str, Any]) -> Any:
    """Return a row for each pass: sd of e before and after, conicity, for each contact group."""
    rows = [
        (str(i), *(_millimetres(one[key]) for key in ("sd", "ridden_sd")), _join(one["conicity"]))
        for i, one in enumerate(body["iterations"], 1)
    ]
    if body["table_sd"] is not None:
        rows.append(("table", "", _millimetres(body["table_sd"]), ""))
    columns = ("pass", "linearised over [mm]", "sd of e in the ride [mm]", f"conicity, {', '.join(body['groups'])}")
    return make_table(columns, rows)


def _millimetres(values: list[float]) -> str:
    return _join([1e3 * x for x in values])


def _join(values: list[float]) -> str:
    return ", ".join(f"{x:.4g}" for x in values)
