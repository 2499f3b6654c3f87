"""The loop tried blind on campaigns that it did not make: who is named, what is missed, what is cried for nothing.

python -m tests.blind.blind --campaigns 20 --seed 1000 -o blind.csv
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path

import numpy as np

from railui.identification.loop import LoopResult
from railui.report.loop.detectable import detectable
from tests.blind.answers import Line, traced
from tests.blind.plants import FLOORS, Plant, at_floor, drawn
from tests.blind.table import HEAD, printed, totals
from tests.truth.campaign import campaign, write

TAKEN = 3  # every third effect that is found is taken away
FACTORS = (0.5, 1.0, 2.0)  # of the stated floor, planted


def one(job: tuple[Plant, Path, float]) -> list[Line]:
    """A campaign drawn and traced; where nothing is missing, what its report says it would have seen is planted."""
    plant, home, until = job
    if time.time() > until:
        return []
    line, found = _lines(plant, home, barred=plant.order.seed % TAKEN == 0)
    lines = [] if line is None else [line]
    if plant.sort == "nothing" and found is not None and found.verdict == "none" and not plant.nuisance:
        for further in _planted(plant, found):
            if time.time() < until:
                more, _ = _lines(further, home, barred=False)
                lines += [] if more is None else [more]
    return lines


def _lines(plant: Plant, home: Path, barred: bool) -> tuple[Line | None, LoopResult | None]:
    try:
        truth = campaign(plant.order)
    except (ArithmeticError, ValueError):
        return None, None  # derails whatever vehicle is drawn: no campaign of it can be measured
    folder = home / plant.order.name.replace(" ", "_")
    write(truth, folder)
    return traced(plant, truth, folder, barred)


def _planted(plant: Plant, found: LoopResult) -> list[Plant]:
    """One of the floors that a report states, planted weaker, as stated, and stronger, in the same vehicle."""
    material, rest = found.measurement.campaign.material, found.validations["after"].nrmse
    rows = detectable(found.last, material, rest, found.foreseen)
    rows = [r for r in rows if (r["kind"], r["at"]) in FLOORS and r["value"]]
    rng = np.random.default_rng([plant.order.seed, 43])
    if not rows:
        return []
    row = rows[int(rng.integers(len(rows)))]
    return [at_floor(plant, row, factor) for factor in FACTORS]


def trial(plants: Sequence[Plant], home: Path, minutes: float, processes: int) -> Iterator[Line]:
    """Lines of a trial as they come."""
    until = time.time() + 60.0 * minutes
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # the processes inherit it
    jobs = [(plant, home, until) for plant in plants]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for lines in pool.imap_unordered(one, jobs):
            yield from lines


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.blind", description=__doc__)
    p.add_argument("--campaigns", type=int, default=20)
    p.add_argument("--seed", type=int, default=1000)
    p.add_argument("--seconds", type=float, nargs=2, default=(50.0, 35.0), help="length of both runs")
    p.add_argument("--minutes", type=float, default=60.0, help="no campaign is begun after")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("--keep", type=Path, metavar="DIR", help="where the campaigns stay")
    p.add_argument("-o", "--output", type=Path, metavar="CSV")
    given = p.parse_args(words)
    lines = []
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        plants = drawn(given.campaigns, given.seed, tuple(given.seconds))
        for line in trial(plants, given.keep or Path(scratch), given.minutes, given.processes):
            print(printed(line), flush=True)
            lines.append(line)
    print("\n".join(["", *totals(lines)]))
    if given.output:
        with given.output.open("w", newline="") as file:
            writer = csv.DictWriter(file, [f.name for f in fields(Line)])
            writer.writeheader()
            writer.writerows(asdict(replace(x)) for x in sorted(lines, key=lambda x: (x.number, x.planted)))


if __name__ == "__main__":
    main()
