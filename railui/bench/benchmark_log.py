"""Log of benchmarks: one dated JSON line each, with machine and commit, compared with the last one."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from platform import processor, python_version
from typing import Any

from railui.core import simd_level, source_hash

REPOSITORY = Path(__file__).parents[2]
CPUINFO = Path("/proc/cpuinfo")


def processor_name() -> str:
    """Return the name of the processor as the system reports it."""
    text = CPUINFO.read_text("utf-8") if CPUINFO.exists() else ""
    names = [line.partition(":")[2].strip() for line in text.splitlines() if line.startswith("model name")]
    return names[0] if names else processor() or "unknown processor"


def source_commit() -> str:
    """Return the commit of the sources, with "-dirty" if they were changed since; "" outside a repository."""
    if not (REPOSITORY / ".git").exists():
        return ""
    command = ["git", "-C", str(REPOSITORY), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def append(file: Path, what: str, numbers: Mapping[str, float]) -> dict[str, Any] | None:
    """Append a dated line to `file` and return the last line before it of the same benchmark, machine and SIMD level.

    Incomplete lines, of an interrupted benchmark, are ignored.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "history.jsonl"
    ...     append(file, "standard job", {"full": 40.0})
    ...     append(file, "standard job", {"full": 30.0})["numbers"]
    {'full': 40.0}
    """
    entry = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "what": what,
        "machine": processor_name(),
        "simd": simd_level(),
        "python": python_version(),
        "commit": source_commit(),
        "kernel": source_hash()[:12],
        "numbers": dict(numbers),
    }
    same = [each for each in _entries(file) if all(each.get(key) == entry[key] for key in ("what", "machine", "simd"))]
    file.parent.mkdir(parents=True, exist_ok=True)
    is_broken = file.exists() and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as out:
        out.write("\n" * is_broken + json.dumps(entry) + "\n")
    return same[-1] if same else None


def _entries(file: Path) -> list[dict[str, Any]]:
    """Return the complete entries of the log."""
    entries = []
    for line in file.read_text("utf-8").splitlines() if file.exists() else []:
        try:
            entry = json.loads(line)
        except ValueError:
            continue
        if isinstance(entry, dict) and isinstance(entry.get("numbers"), dict):
            entries.append(entry)
    return entries


def describe_changes(numbers: Mapping[str, float], before: Mapping[str, Any]) -> list[str]:
    """Return a line for each number of the last entry: old and new value, relative change.

    >>> describe_changes({"full": 33.0, "new": 1.0}, {"date": "2026-01-01", "commit": "abc", "numbers": {"full": 30.0}})
    ['full: 30.0 -> 33.0, +10.0 %']
    """
    old = before["numbers"]
    return [
        f"{name}: {old[name]:,.1f} -> {value:,.1f}, {100 * (value / old[name] - 1):+.1f} %"
        for name, value in numbers.items()
        if isinstance(old.get(name), int | float) and old[name] > 0
    ]
