"""Summaries of simulated runs, whose inner products the drawn fleets use.

python -m tests.fleet.simulate TEMPLATES --sound --vehicles 12 --days 180 --every 30
python -m tests.fleet.templates TEMPLATES
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from railui.fleet.store import FleetStore
from railui.fleet.summary import RunSummary

STORED = Path(__file__).with_name("templates.npz")
COUNT = 12


def stored_templates() -> list[RunSummary]:
    """Read the stored summaries."""
    with np.load(STORED, allow_pickle=False) as found:
        arrays = {name: found[name] for name in found.files}
    count = 1 + max(int(name.partition(":")[0]) for name in arrays)
    return [
        RunSummary.of_arrays({name.partition(":")[2]: x for name, x in arrays.items() if name.startswith(f"{i}:")})
        for i in range(count)
    ]


def read_templates(directory: Path) -> list[RunSummary]:
    """Read the summaries of all runs of a simulated fleet."""
    store = FleetStore(directory, readonly=True)
    found = [store.read(str(row[8])) for row in store.runs()]
    store.close()
    return [RunSummary.of_arrays(arrays) for arrays in found if arrays is not None]


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.fleet.templates", description=__doc__)
    p.add_argument("directory", type=Path)
    given = p.parse_args(words)
    every = read_templates(given.directory)
    chosen = every[:: max(len(every) // COUNT, 1)][:COUNT]
    arrays = {f"{i}:{name}": x for i, one in enumerate(chosen) for name, x in one.arrays().items()}
    np.savez_compressed(STORED, **arrays)


if __name__ == "__main__":
    main()
