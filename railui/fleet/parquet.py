"""Export of the estimates of all runs as Parquet files, partitioned by vehicle and month."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from railui.fleet.fleet_file import Fleet
from railui.fleet.schema import SECONDS_PER_DAY
from railui.fleet.store import FleetStore
from railui.fleet.summary import RunSummary

COLUMNS = (
    "type", "file", "time", "mileage", "load", "temperature", "section", "quantity", "value", "sd", "determined",
)  # fmt: skip


def export_parquet(fleet: Fleet, store: FleetStore, directory: Path) -> tuple[int, int]:
    """Write vehicle=NAME/month=YYYY-MM/runs.parquet with one row per run and quantity; return files and rows.

    Raises
    ------
    ImportError
        Without pyarrow, the extra `parquet`.
    """
    import pyarrow
    import pyarrow.parquet

    parts: dict[tuple[str, str], list[tuple[Any, ...]]] = {}
    for file, vehicle, kind, time, mileage, load, temperature, section, key, state in store.runs():
        arrays = store.read(key) if state == "summarised" and vehicle in fleet.vehicles else None
        if arrays is None:
            continue
        summary = RunSummary.of_arrays(arrays)
        moment = datetime.fromtimestamp(time * SECONDS_PER_DAY, UTC)
        rows = parts.setdefault((vehicle, moment.strftime("%Y-%m")), [])
        about = (kind, file, moment, mileage, load, temperature, summary.section or section)
        numbers = zip(summary.estimate.tolist(), summary.sd.tolist(), summary.determined.tolist(), strict=True)
        rows += [(*about, n, *x) for n, x in zip((*summary.paths, *summary.directions), numbers, strict=True)]
        rows += [
            (*about, f"error at {c}", e, None, None)
            for c, e in zip(summary.channels, summary.errors.tolist(), strict=True)
        ]
    for (vehicle, month), rows in parts.items():
        place = directory / f"vehicle={vehicle}" / f"month={month}"
        place.mkdir(parents=True, exist_ok=True)
        table = pyarrow.table(dict(zip(COLUMNS, zip(*rows, strict=True), strict=True)))
        pyarrow.parquet.write_table(table, place / "runs.parquet")
    return len(parts), sum(map(len, parts.values()))
