"""Recordings on disk: their list, their roles in a campaign, their series for the replay."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.capture.formats import read_recordings
from railui.capture.processing.recording import Recording
from railui.desk.services.recording import CHART_SECONDS, RecordingStatus
from railui.desk.state.playback import Playback, PlayedRun
from railui.runs.clipping import clipped_samples

RECORDINGS: Final = Path("railui-capture")  # directory of the recordings that the desk makes
REPORT_FILE: Final = "capture.json"


@dataclass(frozen=True)
class StoredRecording:
    """Recording on disk; seconds and samples from its report, None where there is none."""

    path: Path
    seconds: float | None = None
    samples: int | None = None
    lost: int | None = None


def stored_recordings(directory: Path = RECORDINGS) -> list[StoredRecording]:
    """Return the recordings in a directory, the newest first."""
    if not directory.is_dir():
        return []
    found = [path for path in sorted(directory.iterdir(), reverse=True) if any(path.glob("run_*.csv"))]
    return [stored_recording(path) for path in found]


def stored_recording(path: Path) -> StoredRecording:
    """Return a recording with the counts of its report, if it has one."""
    try:
        report = _report(path)
        spans = [s["last"] - s["first"] for s in report["segments"] if s["first"] is not None]
        return StoredRecording(path, float(sum(spans)), int(report["samples"]), int(report["lost"]))
    except (OSError, ValueError, KeyError, TypeError):
        return StoredRecording(path)


def _report(path: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(((path if path.is_dir() else path.parent) / REPORT_FILE).read_text("utf-8"))
    return report


def read_played_run(path: Path) -> PlayedRun:
    """Read the longest recording of a directory or a file.

    Raises
    ------
    FileProblems
        If it cannot be read.
    ValueError
        If it has fewer than two samples, or runs over distance.
    """
    recording = max(read_recordings(path), key=lambda r: r.t.size)
    if recording.abscissa != "t":
        raise ValueError(f"{path.name} has distances, no times: it cannot be replayed")
    if recording.t.size < 2:
        raise ValueError(f"{path.name} has fewer than two samples")
    names = tuple(name for name in recording.channels if name != recording.clock)
    values = np.stack([recording.channels[name] for name in names], axis=1)
    clipped = frozenset(name for i, name in enumerate(names) if clipped_samples(values[:, i]) is not None)
    units = tuple(recording.units.get(name) or "" for name in names)
    markers = _markers(path, recording)
    return PlayedRun(path.name, recording.t, values, names, units, recording.interval, markers, clipped)


def _markers(path: Path, recording: Recording) -> tuple[tuple[float, str], ...]:
    """Return the markers of the sessions that a recording was read from."""
    try:
        report = _report(path)
        files = {source.name for source in recording.sources}
        numbers = {k for k, segment in enumerate(report["segments"], 1) if segment["file"] in files}
        return tuple(
            (float(marker["t"]), str(marker["text"]))
            for marker in report["markers"]
            if marker["segment"] in numbers and marker["t"] is not None
        )
    except (OSError, ValueError, KeyError, TypeError):
        return ()


def playback_status(playback: Playback) -> RecordingStatus:
    """Return what a replay shows at its position: the same as a recording at that time."""
    run, rows = playback.run, playback.rows(CHART_SECONDS)
    counts = {"samples": playback.sample_count, "missing": playback.missing_count, "gaps": playback.gap_count}
    return RecordingStatus(
        run.t[rows],
        run.values[rows],
        counts,
        playback.position,
        names=run.names,
        units=run.units,
        rate=1.0 / run.interval,
        markers=tuple(marker for marker in run.markers if marker[0] <= playback.clock),
        device=run.name,
        full_scales=(float("nan"),) * len(run.names),
        clipped=run.clipped,
    )
