"""Files of test benches, recording cars and our own recordings, read as series on one clock."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from railui.capture.processing.recording import Recording
from railui.io.problems import FileProblems, one_problem

# the reader of each ending, and what it is called
READERS = {
    ".csv": "delimited", ".txt": "delimited", ".asc": "delimited", ".dat": "delimited", ".tsv": "delimited",
    ".mf4": "mdf", ".mdf": "mdf",
    ".uff": "universal", ".unv": "universal", ".uf": "universal",
    ".h5": "hdf5", ".hdf5": "hdf5", ".hdf": "hdf5",
    ".mat": "matlab",
}  # fmt: skip
WRITERS = {".mf4": "mdf", ".uff": "universal", ".h5": "hdf5", ".hdf5": "hdf5", ".mat": "matlab"}


def ending(path: Path) -> str:
    """The ending that tells the format, without .gz.

    >>> ending(Path("RUN_A.CSV.gz"))
    '.csv'
    """
    name = path.name.lower().removesuffix(".gz")
    return "." + name.rpartition(".")[2] if "." in name else ""


def read_recordings(path: str | Path, clock: str | None = None, rate: float | None = None) -> list[Recording]:
    """The series of a file, or of a directory that `railui capture` wrote; several where they have no common clock.

    `clock` names the channel of time, `rate` [Hz] stands in where there is none. FileProblems where it cannot be
    read.
    """
    path = Path(path)
    if path.is_dir() or (path.name.startswith("run_") and (path.parent / "raw.bin").exists()):
        from railui.capture.formats.recorded import read_recorded

        return read_recorded(path)
    found = READERS.get(ending(path))
    if not path.is_file():
        raise one_problem(path, "cannot be read (no such file)", "give the path of a file")
    if found is None:
        raise one_problem(path, f"has the ending {ending(path)!r}", f"give one of {', '.join(READERS)}")
    read: Callable[[Path, str | None, float | None], list[Recording]] = _part(found).read
    try:
        return read(path, clock, rate)
    except FileProblems:
        raise
    except ModuleNotFoundError as error:
        raise one_problem(path, f"needs {error.name}", "pip install 'railui[formats]'") from None
    except Exception as error:  # readers of foreign formats raise what they like
        raise one_problem(
            path, f"cannot be read as {found}: {type(error).__name__}: {error}", "check the file"
        ) from error


def write_recording(path: Path, recording: Recording) -> None:
    """Writes series in the format of the ending. ValueError for one that is not written."""
    found = WRITERS.get(ending(path))
    if found is None:
        raise ValueError(f"{path.name}: written are .csv, .csv.gz, {', '.join(WRITERS)}")
    write: Callable[[Path, Recording], None] = _part(found).write
    path.parent.mkdir(parents=True, exist_ok=True)
    write(path, recording)


def _part(name: str) -> Any:
    return import_module(f"{__name__}.{name}")
