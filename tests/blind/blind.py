"""Blind trial of the loop on simulated campaigns: detections, misses and false alarms.

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

from railui.identification.result import LoopResult
from railui.report.loop.detectable import minimum_detectable_effects
from tests.blind.assessment import TrialRow, run_case
from tests.blind.cases import DETECTABLE_PARAMETERS, PlantedCase, draw_cases, with_detectable_effect
from tests.blind.table import HEAD, format_row, totals
from tests.truth.campaign import campaign, write

REPEAT_EVERY = 3  # seeds; the loop of every third case is repeated with its effect excluded
FACTORS = (0.5, 1.0, 2.0)  # of the minimum detectable effect


def run_job(job: tuple[PlantedCase, Path, float]) -> list[TrialRow]:
    """Run the loop on a case; without a planted effect, also on cases with its minimum detectable effects."""
    case, directory, deadline = job
    if time.time() > deadline:
        return []
    row, result = _run(case, directory, excluded=case.order.seed % REPEAT_EVERY == 0)
    rows = [] if row is None else [row]
    if case.sort == "nothing" and result is not None and result.verdict == "none" and not case.nuisance:
        for detectable in _detectable_cases(case, result):
            if time.time() < deadline:
                more, _ = _run(detectable, directory, excluded=False)
                rows += [] if more is None else [more]
    return rows


def _run(case: PlantedCase, directory: Path, excluded: bool) -> tuple[TrialRow | None, LoopResult | None]:
    try:
        truth = campaign(case.order)
    except (ArithmeticError, ValueError):
        return None, None  # every drawn vehicle derails: no such campaign can be simulated
    folder = directory / case.order.name.replace(" ", "_")
    write(truth, folder)
    return run_case(case, truth, folder, excluded)


def _detectable_cases(case: PlantedCase, result: LoopResult) -> list[PlantedCase]:
    """Plant one of the reported minimum detectable effects, weaker, as reported and stronger, in the same vehicle."""
    min_gain, error = result.dataset.campaign.min_relative_gain, result.validations["after"].nrmse
    rows = minimum_detectable_effects(result.score_test, min_gain, error, result.predicted_gains)
    rows = [r for r in rows if (r["kind"], r["at"]) in DETECTABLE_PARAMETERS and r["value"]]
    rng = np.random.default_rng([case.order.seed, 43])
    if not rows:
        return []
    row = rows[int(rng.integers(len(rows)))]
    return [with_detectable_effect(case, row, factor) for factor in FACTORS]


def run_trial(cases: Sequence[PlantedCase], directory: Path, minutes: float, processes: int) -> Iterator[TrialRow]:
    """Run the cases in processes and yield their rows as they finish."""
    deadline = time.time() + 60.0 * minutes
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # the processes inherit it
    jobs = [(case, directory, deadline) for case in cases]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for rows in pool.imap_unordered(run_job, jobs):
            yield from rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command row."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.blind", description=__doc__)
    p.add_argument("--campaigns", type=int, default=20)
    p.add_argument("--seed", type=int, default=1000)
    p.add_argument("--seconds", type=float, nargs=2, default=(50.0, 35.0), help="length of both runs")
    p.add_argument("--minutes", type=float, default=60.0, help="start no campaign after this time")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("--keep", type=Path, metavar="DIR", help="keep the campaigns in this directory")
    p.add_argument("-o", "--output", type=Path, metavar="CSV")
    options = p.parse_args(arguments)
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        cases = draw_cases(options.campaigns, options.seed, tuple(options.seconds))
        for row in run_trial(cases, options.keep or Path(scratch), options.minutes, options.processes):
            print(format_row(row), flush=True)
            rows.append(row)
    print("\n".join(["", *totals(rows)]))
    if options.output:
        with options.output.open("w", newline="") as file:
            writer = csv.DictWriter(file, [f.name for f in fields(TrialRow)])
            writer.writeheader()
            writer.writerows(asdict(replace(x)) for x in sorted(rows, key=lambda x: (x.number, x.planted)))


if __name__ == "__main__":
    main()
