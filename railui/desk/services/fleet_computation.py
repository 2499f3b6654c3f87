"""Update of a fleet as a process of its own computes it."""

from __future__ import annotations

from pathlib import Path

from railui.api.fleet import update_fleet
from railui.progress import Progress


def compute_update(progress: Progress, path: Path, loops: int) -> None:
    """Compute the new runs of a fleet and test all vehicles; the results are written beside its file."""
    update_fleet(path, loops=loops, progress=progress)
