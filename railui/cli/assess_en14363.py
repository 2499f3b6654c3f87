"""railui assess --method en14363: estimated maxima of the test zones against their limits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from railui.cli.arguments import input_files, resolve_track_argument
from railui.cli.invocation import Invocation, usage_error
from railui.cli.tables import make_table

if TYPE_CHECKING:
    from railui.vehicle.design_reader import Design

COLUMNS = ("zone", "quantity", "place", "n", "mean", "rule", "estimated", "limit", "")


def evaluate_command(
    call: Invocation,
    track: str,
    design: str,
    loaded: Design,
    overrides: Mapping[str, str],
    speed: float | None,
    cant_deficiency: float | None,
    measured: bool,
) -> bool:
    """Evaluate, print and write the result; return True if a limit is exceeded."""
    from railui.api.assessment import EXCEEDED, assess_en14363

    if measured:
        if speed is not None or call.seed is not None:
            raise usage_error("--measured: the run has its own speed and no seed, leave --speed and --seed out")
        result = assess_en14363(track, loaded, measured=True, cant_deficiency=cant_deficiency)
        files = [design, track]
    else:
        source = resolve_track_argument(track, call.seed, "TRACK")
        result = assess_en14363(source, loaded, speed or 0.0, cant_deficiency=cant_deficiency, jobs=call.jobs)
        files = input_files(design, source)
    call.show(_table(result))
    body = {"design": loaded.name, "overrides": dict(overrides), **result}
    call.write_json(call.document("en14363", body, files, result["seed"]))
    return bool(result["verdict"] == EXCEEDED)


def _table(result: Mapping[str, Any]) -> Any:
    rows = [_row(zone["zone"], item) for zone in result["zones"] for item in zone["quantities"]]
    zones = [f"zone {z['zone']}, {z['caption']}: {z['sections']} sections" for z in result["zones"] if z["sections"]]
    lines = [f"verdict: {result['verdict']}", *zones, *result["exceeded"]]
    lines += [f"missing: {'; '.join(result['missing'])}"] if result["missing"] else []
    title = f"{result['track']}, {result['source']}, {result['standard']}, up to {result['speed']:.4g} m/s"
    return make_table(COLUMNS, rows, title=title, caption="\n".join([*lines, *result["notes"]]))


def _row(zone: int, item: Mapping[str, Any]) -> list[str]:
    factor, unit = (1e-3, "kN") if item["unit"] == "N" else (1.0, "" if item["unit"] == "1" else item["unit"])
    estimated = "-" if item["estimated"] is None else f"{item['estimated'] * factor:.3g}"
    return [
        str(zone),
        item["quantity"] + (f" [{unit}]" if unit else ""),
        item["place"],
        str(item["values"]),
        f"{item['mean'] * factor:.3g}",
        item["rule"],
        estimated,
        f"{item['limit'] * factor:.3g}",
        "exceeded" if item["exceeded"] else "",
    ]
