"""Blind trial of the loop on simulated campaigns: detections, misses, false alarms, intervals and detection limits.

python -m tests.blind.blind --loops 150 --seed 20000 -o trial.csv --resume --write docs/blind_trials.md
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.identification.result import LoopResult
from railui.identification.structure.minimum_detectable import minimum_detectable_effects
from tests.blind.assessment import TrialRow, run_case, truth_of
from tests.blind.cases import DETECTABLE_PARAMETERS, PlantedCase, with_detectable_effect
from tests.blind.draw import LIMITS, LOOPS, draw_groups
from tests.blind.simulation import simulate_cases
from tests.blind.table import HEAD, format_row, totals, write_section
from tests.trial_rows import append_rows, read_rows
from tests.truth.campaign import write


@dataclass(frozen=True)
class Options:
    """Options of a trial; store: directory of simulated campaigns, deadline: start no campaign after this time."""

    directory: Path
    deadline: float
    store: Path | None = None
    repeat: bool = False
    threads: int = 1
    simulate_only: bool = False


Job = tuple[tuple[PlantedCase, ...], Options]


def run_job(job: Job) -> list[TrialRow]:
    """Run the loop on the cases of a group; for detection limits, also with effects of the stated size."""
    cases, options = job
    done = list(_run_all(cases, options))
    rows = [row for _, row, _ in done]
    stated = [(case, limits) for case, _, result in done if result is not None and (limits := _limits(case, result))]
    for planted in _planted_cases(stated):
        rows += [row for _, row, _ in _run_all(planted, replace(options, repeat=False))]
    return rows


def _run_all(
    cases: Sequence[PlantedCase], options: Options
) -> Iterator[tuple[PlantedCase, TrialRow, LoopResult | None]]:
    if time.time() > options.deadline:
        return
    for case, truth in zip(cases, simulate_cases(cases, options.store), strict=True):
        if truth is not None and not options.simulate_only and time.time() <= options.deadline:
            folder = options.directory / f"{case.order.name} {case.text}".replace(" ", "_").replace(",", "")
            write(truth, folder)
            excluded, threads = options.repeat, options.threads
            row, result = run_case(case, truth_of(case, truth), folder, excluded=excluded, threads=threads)
            yield case, row, result


Limits = dict[tuple[str, str, int | None], dict[str, object]]


def _limits(case: PlantedCase, result: LoopResult) -> Limits:
    """Stated minimum detectable effects of a campaign without an effect, by kind, location and wheelset."""
    if case.sort != "limit" or result.verdict != "none":
        return {}
    min_gain, error = result.dataset.campaign.min_relative_gain, result.validations["after"].nrmse
    rows = minimum_detectable_effects(result.score_test, min_gain, error, result.predicted_gains)
    usable = [r for r in rows if (r["kind"], r["at"]) in DETECTABLE_PARAMETERS and r["value"]]
    return {(r["kind"], r["at"], r["wheelset"]): r for r in usable}


def _planted_cases(stated: Sequence[tuple[PlantedCase, Limits]]) -> Iterator[list[PlantedCase]]:
    """Plant effects of the stated size that all campaigns of a group have, chosen at random."""
    if not stated:
        return
    common = [key for key in stated[0][1] if all(key in limits for _, limits in stated)]
    rng = np.random.default_rng([stated[0][0].order.seed, 43])
    for k in rng.permutation(len(common))[:LIMITS]:
        yield [with_detectable_effect(case, limits[common[k]], 1.0) for case, limits in stated]


def run_trial(groups: Sequence[tuple[PlantedCase, ...]], options: Options, processes: int) -> Iterator[list[TrialRow]]:
    """Run the groups in processes, and yield the rows of each as it finishes."""
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # the processes inherit it
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(run_job, [(group, options) for group in groups])


def stored_rows(parser: argparse.ArgumentParser, options: argparse.Namespace) -> list[TrialRow]:
    """Return the rows that the output file of a trial has; without --resume there may be no such file."""
    if not options.output or not options.output.exists():
        return []
    if not options.resume:
        parser.error(f"{options.output} exists: give --resume, or another file")
    return read_rows(options.output, TrialRow)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.blind", description=__doc__)
    p.add_argument("--loops", type=int, default=LOOPS, help=f"about so many loops; {LOOPS} by default")
    p.add_argument("--seed", type=int, default=20000)
    p.add_argument("--seconds", type=float, nargs=2, default=(70.0, 45.0), help="length of both runs")
    p.add_argument("--minutes", type=float, default=60.0, help="start no campaign after this time")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("--threads", type=int, default=1, help="of each loop; for its use of two cores with --processes 1")
    p.add_argument("--repeat", action="store_true", help="repeat right results with the planted effect excluded")
    p.add_argument("--keep", type=Path, metavar="DIR", help="keep the campaigns in this directory")
    p.add_argument("--simulated", type=Path, metavar="DIR", help="read the simulated campaigns from this directory")
    p.add_argument("--simulate-only", action="store_true", help="fill that directory, and run no loop")
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append the rows of each group as it finishes")
    p.add_argument("--resume", action="store_true", help="leave out the groups that the output has")
    p.add_argument("--write", type=Path, metavar="MD", help="replace the section of the trial in a document")
    options = p.parse_args(arguments)
    rows = stored_rows(p, options)
    done = {row.number for row in rows}
    groups = [g for g in draw_groups(options.loops, options.seed, options.seconds) if g[0].order.seed not in done]
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        trial = Options(
            directory=options.keep or Path(scratch),
            deadline=time.time() + 60.0 * options.minutes,
            store=options.simulated,
            repeat=options.repeat,
            threads=options.threads,
            simulate_only=options.simulate_only,
        )
        for found in run_trial(groups, trial, options.processes):
            print("".join(f"{format_row(row)}\n" for row in found), end="", flush=True)
            rows += found
            if options.output and found:
                append_rows(options.output, found)
    lines = totals(rows)
    print("\n".join(["", *lines]))
    if options.write:
        command = f"python -m tests.blind.blind --loops {options.loops} --seed {options.seed}"
        write_section(options.write, command, lines)


if __name__ == "__main__":
    main()
