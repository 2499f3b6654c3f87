"""What `railui capture` wrote: its segments, joined where the logger's clock ran on, with the drift it was told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from railui.capture.processing.recording import Recording
from railui.io.atomic import write_bytes
from railui.io.problems import one_problem
from railui.io.table import read_table


def read_recorded(path: Path) -> list[Recording]:
    """The recordings of a directory, one per start of the logger and layout; of one file that file's."""
    files = [path] if path.is_file() else sorted(path.glob("run_*.csv"))
    if not files:
        remedy = "railui capture decode RAW rebuilds the runs from raw.bin" if (path / "raw.bin").exists() else ""
        raise one_problem(path, "holds no run_*.csv", remedy or "give a recording")
    told = _told(path if path.is_dir() else path.parent)
    found: dict[tuple[object, ...], list[Path]] = {}
    for file in files:
        about = told.get(file.name, {})
        key = (about.get("boot", file.name), json.dumps(about.get("channels")))
        found.setdefault(key, []).append(file)
    return [_joined(members, told) for members in found.values()]


def _told(directory: Path) -> dict[str, dict[str, object]]:
    try:
        document = json.loads((directory / "capture.json").read_text())
        return {s["file"]: s for s in document["segments"] if s["file"]}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _joined(files: list[Path], told: dict[str, dict[str, object]]) -> Recording:
    tables = [read_table(_whole(file)) for file in files]
    kept, last = [], -np.inf
    for table in tables:  # a clock that ran back ends what can be joined
        t = table.column("t")
        if t[0] <= last:
            break
        last = float(t[-1])
        kept.append(table)
    first = kept[0]
    names = [name for name in first.names if name != "t"]
    drift = told.get(files[0].name, {}).get("drift")
    return Recording(
        files[0].parent.name or files[0].name,
        np.concatenate([table.column("t") for table in kept]),
        {name: np.concatenate([table.column(name) for table in kept]) for name in names},
        dict(zip(first.names, first.units, strict=True)),
        drift=float(drift) if isinstance(drift, int | float) else None,
        sources=tuple(files[: len(kept)]),
        notes=[f"{f.name} is left out: its clock runs back" for f in files[len(kept) :]],
    )


def _whole(file: Path) -> Path:
    """The file; a last line that a power cut left unfinished is taken off first."""
    with file.open("rb") as stream:
        stream.seek(max(stream.seek(0, 2) - 65536, 0))
        tail = stream.read()
    if tail and not tail.endswith(b"\n"):
        data = file.read_bytes()
        write_bytes(file, data[: data.rfind(b"\n") + 1])
    return file
