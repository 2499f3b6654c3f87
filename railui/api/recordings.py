"""Recordings of loggers and test benches: recording, decoding, conversion to runs and tracks."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from railui.io.problems import FileProblems, refuse_overwriting

if TYPE_CHECKING:
    from railui.capture.processing.measured_run import MeasuredRun
    from railui.capture.processing.recording import Recording
    from railui.capture.processing.sensor_map import SensorMap


def import_recording(
    file: str | Path,
    map_file: str | Path | None = None,
    out: str | Path | None = None,
    *,
    clock: str | None = None,
    rate: float | None = None,
) -> dict[str, Any]:
    """Convert a recording into a run or a track with the map of its sensors, as `railui import`.

    Parameters
    ----------
    file : str or Path
        CSV, MDF, universal file 58, HDF5, MATLAB, TDMS, MCAP, or a directory of `railui capture`; of several recordings
        the longest is used.
    map_file : str or Path, optional
        Assignment of channels to sensors.
    out : str or Path, optional
        File of the run (.csv, .csv.gz) or track; without a map the same series in another format.
    clock : str, optional
        Time channel, where there is no map.
    rate : float, optional
        Sampling rate [Hz] without a clock.

    Returns
    -------
    dict
        channels (name, unit, values, mean, sd) and notes; with `out` also the report of the run, or columns and rows.

    Raises
    ------
    FileProblems
        For faulty files, and for a file to write that is one of those that are read.
    ValueError
        For a map without a file to write, or a name of an unknown format.
    """
    from railui.capture.formats import read_recordings, write_recording
    from railui.capture.processing.sensor_map import load_map

    if map_file is not None and out is None:
        raise ValueError("give the file of the run: out")
    sensor_map = None if map_file is None else load_map(map_file)
    if sensor_map is not None:
        clock, rate = clock or sensor_map.clock, sensor_map.rate if rate is None else rate
    recording = max(read_recordings(file, clock, rate), key=lambda r: r.t.size)
    body: dict[str, Any] = {"channels": channel_rows(recording), "notes": recording.notes}
    if out is None:
        return body
    if sensor_map is None:
        refuse_overwriting(out, recording.sources)
        write_recording(Path(out), recording)
        return body | {"rows": recording.t.size}
    if recording.abscissa == "s":
        return body | write_track(recording, sensor_map, Path(out))
    return body | write_run(recording, sensor_map, Path(out)).report()


def channel_rows(recording: Recording) -> list[dict[str, Any]]:
    """Return name, unit, number of values, mean and standard deviation of each channel."""
    rows = []
    for name, x in recording.channels.items():
        valid = x[np.isfinite(x)]
        mean, sd = (float(valid.mean()), float(valid.std())) if valid.size else (None, None)
        rows.append({"name": name, "unit": recording.units.get(name), "values": valid.size, "mean": mean, "sd": sd})
    return rows


def write_track(recording: Recording, sensor_map: SensorMap, out: Path) -> dict[str, Any]:
    """Write the track of a recording car; return its columns, rows and notes; FileProblems if it is not usable."""
    from railui.capture.processing.sensors import unit_notes
    from railui.capture.processing.track_car import build_track_columns
    from railui.io.atomic import check_file_writable
    from railui.track.reader import load_track, save_track

    refuse_overwriting(out, [*recording.sources, sensor_map.source])
    columns = build_track_columns(recording, sensor_map)
    about = (f"measured: {recording.name}", "lateral deviation as filtered by the recording car")
    check_file_writable(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".railui-", dir=out.parent) as directory:
        written = Path(directory) / out.name
        save_track(written, columns["s"], columns["yw"], columns.get("phiw"), columns.get("gauge"), about)
        try:
            load_track(written)
        except FileProblems as error:  # the track is not there: name the recording
            source = str(recording.sources[0])
            raise FileProblems(replace(p, file=source, line=0, column=0) for p in error.problems) from None
        written.replace(out)
    notes = [*recording.notes, *unit_notes(sensor_map, recording)]
    return {"columns": list(columns), "rows": columns["s"].size, "notes": notes}


def write_run(recording: Recording, sensor_map: SensorMap, out: Path) -> MeasuredRun:
    """Build the run of a recording and write it; ValueError for a name that is no CSV."""
    from railui.capture.processing.measured_run import save_run
    from railui.capture.processing.run_builder import build_measured_run

    check_run_file(out)
    refuse_overwriting(out, [*recording.sources, sensor_map.source])
    run = build_measured_run(recording, sensor_map)
    save_run(out, run, (f"from {recording.name} by {sensor_map.source.name}", *run.notes))
    return run


def check_run_file(out: Path) -> None:
    """Raise ValueError for a name that is no CSV."""
    if not out.name.lower().endswith((".csv", ".csv.gz")):
        raise ValueError(f"a run is a CSV file: write -o {out.stem}.csv.gz")


def decode_recording(raw: str | Path, directory: str | Path) -> dict[str, Any]:
    """Rebuild the runs of raw bytes, as `railui capture decode`.

    Parameters
    ----------
    raw : str or Path
        raw.bin of a recording, its directory, or bytes stored by another program.
    directory : str or Path
        Directory of the runs.

    Returns
    -------
    dict
        As capture.json, which is written into the directory: frames, lost, crc_errors, gaps, reconnects, segments,
        notes.

    Raises
    ------
    OSError
        If there is no such file.
    """
    from railui.capture.recorder.replay import RAW_FILE, decode

    path = Path(raw) / RAW_FILE if Path(raw).is_dir() else Path(raw)
    return write_capture_report(decode(path, Path(directory)).report(), Path(directory))


def record(
    port: str | None,
    directory: str | Path,
    *,
    baud: int = 115200,
    seconds: float | None = None,
    on_message: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Record a serial logger into a directory, as `railui capture PORT -o DIR`.

    Parameters
    ----------
    port : str or None
        Serial port; None for the demo logger, a simulated vehicle in a process of its own.
    directory : str or Path
        Directory of the recording.
    baud : int
        Bits per second.
    seconds : float, optional
        Duration; until KeyboardInterrupt by default.
    on_message : callable, optional
        Receiver of messages.

    Returns
    -------
    dict
        As capture.json, which is written into the directory: frames, lost, crc_errors, gaps, reconnects, segments,
        notes.

    Raises
    ------
    OSError
        If the port cannot be opened, or the disk is full.
    """
    from railui.capture.recorder.record import Recorder
    from railui.capture.simulator.demo_logger import DemoLogger

    with ExitStack() as stack:
        name = port if port is not None else stack.enter_context(DemoLogger(0)).port
        recorder = Recorder(name, baud, Path(directory), on_message or (lambda text: None))
        with suppress(KeyboardInterrupt):
            for _ in recorder.run(seconds):
                pass
    if recorder.disk_error is not None:
        raise recorder.disk_error
    return write_capture_report(recorder.replay.report(), Path(directory))


def write_capture_report(report: Mapping[str, Any], directory: Path, seed: int | None = None) -> dict[str, Any]:
    """Write the report of a recording as capture.json of its directory; return the document."""
    from railui.api.document import json_document
    from railui.capture.recorder.replay import RAW_FILE
    from railui.io.atomic import write_text

    raw = directory / RAW_FILE
    document = json_document("capture", report, [raw] if raw.exists() else [], seed)
    write_text(directory / "capture.json", json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
    return document
