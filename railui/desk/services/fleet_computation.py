"""Results of a fleet for the Fleet panel, and their update in a process of its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from railui.api.fleet import fleet_block_means, fleet_status, results_directory, update_fleet
from railui.fleet.block_means import BlockMeans
from railui.io.problems import FileProblems
from railui.progress import Progress


@dataclass(frozen=True, eq=False)
class FleetResults:
    """Results of a fleet: its document and the block means of every vehicle type."""

    document: dict[str, Any]
    means: list[BlockMeans]
    directory: Path


def load_results(path: Path) -> FleetResults | None:
    """Read the results of the last update; None: there are none that can be read."""
    try:
        return FleetResults(fleet_status(path), fleet_block_means(path), results_directory(path.parent, None))
    except (FileProblems, OSError, ValueError):
        return None


def compute_update(progress: Progress, path: Path, loops: int) -> FleetResults | None:
    """Compute the new runs of a fleet, test all vehicles and return the results."""
    update_fleet(path, loops=loops, progress=progress)
    return load_results(path)
