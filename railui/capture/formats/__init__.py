"""Readers and writers of recordings: test benches, track recording cars, `railui capture`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.processing.recording import Recording
from railui.io.atomic import check_file_writable
from railui.io.extras import install_extra
from railui.io.problems import FileProblems, file_problem, refuse_stream

# module of this package that reads or writes each suffix
READERS = {
    ".csv": "delimited", ".txt": "delimited", ".asc": "delimited", ".dat": "delimited", ".tsv": "delimited",
    ".mf4": "mdf", ".mdf": "mdf",
    ".uff": "universal", ".unv": "universal", ".uf": "universal",
    ".h5": "hdf5", ".hdf5": "hdf5", ".hdf": "hdf5",
    ".mat": "matlab",
    ".tdms": "tdms",
    ".mcap": "mcap_",
}  # fmt: skip
WRITERS = {".csv": "delimited", ".mf4": "mdf", ".uff": "universal", ".h5": "hdf5", ".hdf5": "hdf5", ".mat": "matlab"}
MIN_RATE, MAX_RATE = 1e-3, 1e7  # Hz, of a recording without a clock
RATE_TOLERANCE = 1e-3  # of a stated rate to that of the recording


def format_suffix(path: Path) -> str:
    """Return the suffix that identifies the format, without .gz.

    >>> format_suffix(Path("RUN_A.CSV.gz"))
    '.csv'
    """
    name = path.name.lower().removesuffix(".gz")
    return "." + name.rpartition(".")[2] if "." in name else ""


def read_recordings(path: str | Path, clock: str | None = None, rate: float | None = None) -> list[Recording]:
    """Read the recordings of a file, or of a directory that `railui capture` wrote.

    Parameters
    ----------
    path
        File or directory.
    clock
        Name of the time channel; by default it is recognised by its name.
    rate
        Sampling rate [Hz] of a file without a time channel; a note where the file has its own times.

    Returns
    -------
    One recording, or several if the series have no common clock.

    Raises
    ------
    FileProblems
        If the file cannot be read, or for a rate that no recorder has.
    """
    path = Path(path)
    if rate is None:
        return _read(path, clock, None)
    if not MIN_RATE <= rate <= MAX_RATE:
        raise file_problem(path, f"{rate:g} Hz is no sampling rate", f"give {MIN_RATE:g} to {MAX_RATE:g} Hz", "rate")
    recordings = _read(path, clock, rate)
    for recording in recordings:
        if recording.clock is not None or abs(recording.interval * rate - 1) > RATE_TOLERANCE:
            recording.notes.append(f"the rate of {rate:g} Hz is not used: the file has its own times")
    return recordings


def _read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    if path.is_dir() or (path.name.startswith("run_") and (path.parent / "raw.bin").exists()):
        from railui.capture.formats.recorded import read_recorded

        return read_recorded(path)
    format_name = READERS.get(format_suffix(path))
    refuse_stream(path)
    if not path.is_file():
        raise file_problem(path, "cannot be read (no such file)", "give the path of a file")
    if format_name is None:
        raise file_problem(path, f"has the unknown suffix {format_suffix(path)!r}", f"give one of {', '.join(READERS)}")
    read: Callable[[Path, str | None, float | None], list[Recording]] = _format_module(format_name).read
    try:
        return read(path, clock, rate)
    except FileProblems:
        raise
    except ModuleNotFoundError as error:
        raise file_problem(path, f"needs {error.name}", install_extra("formats")) from None
    except Exception as error:  # readers of foreign formats raise any exception
        raise file_problem(
            path, f"cannot be read as {format_name.rstrip('_')}: {type(error).__name__}: {error}", "check the file"
        ) from error


def write_recording(path: Path, recording: Recording) -> None:
    """Write a recording in the format of the suffix, completely or not at all.

    The file is written under a temporary name and read back; it is renamed if that returns every channel and unit.

    Raises
    ------
    ValueError
        If there is no writer for the suffix, or the format cannot hold the recording.
    OSError
        If the file cannot be written.
    """
    format_name = WRITERS.get(format_suffix(path))
    if format_name is None:
        raise ValueError(f"{path.name}: supported are .csv.gz, {', '.join(WRITERS)}")
    write: Callable[[Path, Recording], None] = _format_module(format_name).write
    check_file_writable(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".railui-", dir=path.parent) as directory:
        temporary = Path(directory) / path.name
        try:
            write(temporary, recording)
        except ModuleNotFoundError as error:
            raise ValueError(f"{path.name} needs {error.name}: {install_extra('formats')}") from None
        except (OSError, ValueError):
            raise
        except Exception as error:  # writers of foreign formats raise any exception
            raise ValueError(f"{path.name} cannot be written as {format_name}: {error}") from error
        check_written(temporary, recording)
        temporary.replace(path)


def check_written(path: Path, recording: Recording) -> None:
    """Raise ValueError if a file does not give the time, channels and units that it was written with."""
    try:
        (found,) = read_recordings(path)
    except FileProblems as error:
        raise ValueError(f"{path.name} cannot hold this recording: {error.problems[0].message}") from None
    wanted = recording.columns()
    there = found.columns()
    for name, x in wanted.items():
        unit = recording.unit(name)
        if name not in there or found.unit(name) not in (unit, unit or "1"):
            raise ValueError(
                f"{path.name} cannot hold the channel {name!r} [{unit}]: rename it, or write another format"
            )
        if not np.allclose(x, there[name], rtol=1e-11, atol=0.0, equal_nan=True):
            raise ValueError(f"{path.name} cannot hold the values of {name!r}: write another format")
    if set(there) != set(wanted) or found.abscissa != recording.abscissa:
        raise ValueError(f"{path.name} cannot hold this recording: write another format")


def _format_module(name: str) -> Any:
    return import_module(f"{__name__}.{name}")
