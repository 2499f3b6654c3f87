"""Recordings of `railui capture`: sessions joined where the logger's clock ran on, with its drift."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from railui.capture.formats.sentinels import gaps_at_sentinels
from railui.capture.processing.recording import Recording
from railui.capture.recorder.clock import is_significant
from railui.io.problems import file_problem
from railui.io.table import read_table


def read_recorded(path: Path) -> list[Recording]:
    """Read the recordings of a directory, one per start and layout of the logger, or that of one file.

    A file of a directory is empty where the recorder was killed as it began it: the session's rows are in raw.bin.
    """
    files = [path] if path.is_file() else [f for f in sorted(path.glob("run_*.csv")) if f.stat().st_size]
    if not files:
        remedy = "railui capture decode RAW rebuilds the runs from raw.bin" if (path / "raw.bin").exists() else ""
        raise file_problem(path, "holds no run_*.csv", remedy or "give a recording")
    reports = _session_reports(path if path.is_dir() else path.parent)
    groups: dict[tuple[object, ...], list[Path]] = {}
    for file in files:
        report = reports.get(file.name, {})
        key = (report.get("boot", file.name), report.get("start"), json.dumps(report.get("channels")))
        groups.setdefault(key, []).append(file)
    return [_join(members, reports) for members in groups.values()]


def _session_reports(directory: Path) -> dict[str, dict[str, object]]:
    try:
        document = json.loads((directory / "capture.json").read_text())
        return {s["file"]: s for s in document["segments"] if s["file"]}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _join(files: list[Path], reports: dict[str, dict[str, object]]) -> Recording:
    tables = [read_table(file, drop_unfinished=True) for file in files]
    joined = []
    last = -np.inf
    for table in tables:  # only tables before a clock that ran back can be joined
        t = table.column("t")
        if t[0] <= last:
            break
        last = float(t[-1])
        joined.append(table)
    first = joined[0]
    channels = {n: np.concatenate([table.column(n) for table in joined]) for n in first.names if n != "t"}
    units = dict(zip(first.names, first.units, strict=True))
    channels, marks = gaps_at_sentinels(channels, units)
    drift, notes = _significant_drift(reports.get(files[0].name, {}))
    return Recording(
        files[0].parent.name or files[0].name,
        np.concatenate([table.column("t") for table in joined]),
        channels,
        units,
        drift=drift,
        device=str(reports.get(files[0].name, {}).get("device", "")),
        sources=tuple(files[: len(joined)]),
        notes=notes + marks + [f"{f.name} is ignored: its clock runs back" for f in files[len(joined) :]],
    )


def _significant_drift(report: dict[str, object]) -> tuple[float | None, list[str]]:
    """Return the drift of a segment if it exceeds its uncertainty, else None with a note."""
    drift, sd = report.get("drift"), report.get("drift_sd")
    if not isinstance(drift, int | float):
        return None, []
    if not isinstance(sd, int | float) or is_significant(drift, sd):
        return float(drift), []
    return None, [f"the drift of the clock, {1e6 * drift:.0f} +/- {1e6 * sd:.0f} ppm, is not certain: not corrected"]
