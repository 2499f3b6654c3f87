"""Dated results of benches: one JSON line each, with machine and commit, and the change against the last one."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from platform import processor, python_version
from typing import Any

from railui.core import simd_level, source_hash

HOME = Path(__file__).parents[2]
CPUINFO = Path("/proc/cpuinfo")


def processor_name() -> str:
    """The processor by its maker's name, as far as the system tells it."""
    text = CPUINFO.read_text("utf-8") if CPUINFO.exists() else ""
    names = [line.partition(":")[2].strip() for line in text.splitlines() if line.startswith("model name")]
    return names[0] if names else processor() or "unknown processor"


def source_commit() -> str:
    """The commit that railui's sources stand at, "-dirty" where they were changed since; "" outside a repository."""
    if not (HOME / ".git").exists():
        return ""
    words = ["git", "-C", str(HOME), "describe", "--always", "--dirty", "--exclude=*"]
    try:
        return subprocess.run(words, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def append(file: Path, what: str, numbers: Mapping[str, float]) -> dict[str, Any] | None:
    """Append a dated line to `file`; returns the last line before it of the same bench, machine and SIMD level.

    Lines that are not whole are passed over: a bench was interrupted while it wrote.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "history.jsonl"
    ...     keep(file, "standard job", {"full": 40.0}) is None, keep(file, "standard job", {"full": 30.0})["numbers"]
    (True, {'full': 40.0})
    """
    entry = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"), "what": what, "machine": processor_name(), "simd": simd_level(),
        "python": python_version(), "commit": source_commit(), "kernel": source_hash()[:12], "numbers": dict(numbers),
    }  # fmt: skip
    same = [one for one in _lines(file) if all(one.get(key) == entry[key] for key in ("what", "machine", "simd"))]
    file.parent.mkdir(parents=True, exist_ok=True)
    broken = file.exists() and not file.read_bytes().endswith(b"\n")
    with file.open("a", encoding="utf-8") as out:
        out.write("\n" * broken + json.dumps(entry) + "\n")
    return same[-1] if same else None


def _lines(file: Path) -> list[dict[str, Any]]:
    found = []
    for line in file.read_text("utf-8").splitlines() if file.exists() else []:
        try:
            one = json.loads(line)
        except ValueError:
            continue
        if isinstance(one, dict) and isinstance(one.get("numbers"), dict):
            found.append(one)
    return found


def describe_changes(numbers: Mapping[str, float], before: Mapping[str, Any]) -> list[str]:
    """One line per number that was there before: what it was, and by how many per cent it changed.

    >>> change({"full": 33.0, "new": 1.0}, {"date": "2026-01-01", "commit": "abc", "numbers": {"full": 30.0}})
    ['full: 30.0 -> 33.0, +10.0 %']
    """
    old = before["numbers"]
    return [
        f"{name}: {old[name]:,.1f} -> {value:,.1f}, {100 * (value / old[name] - 1):+.1f} %"
        for name, value in numbers.items()
        if isinstance(old.get(name), int | float) and old[name] > 0
    ]
