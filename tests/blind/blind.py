"""Blind trial of the loop on simulated campaigns: detections, misses, false alarms, intervals and detection limits.

python -m tests.blind.blind --loops 150 --seed 20000 -o trial.csv --resume --write docs/blind_trials.md
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from railui.identification.result import LoopResult
from railui.identification.structure.minimum_detectable import minimum_detectable_effects
from tests.blind.assessment import TrialRow, run_case, truth_of
from tests.blind.cases import DETECTABLE_PARAMETERS, PlantedCase, with_detectable_effect
from tests.blind.draw import LIMITS, LOOPS, draw_trial
from tests.blind.processes import process_pool
from tests.blind.simulation import simulate, simulation_groups, stored_campaign
from tests.blind.table import HEAD, format_row, totals, write_section
from tests.trial_rows import append_rows, read_rows
from tests.truth.campaign import write

Limits = dict[tuple[str, str, int | None], dict[str, object]]


@dataclass(frozen=True)
class Options:
    """Options of a trial; store: directory of simulated campaigns, deadline: start no campaign after this time."""

    directory: Path
    store: Path
    deadline: float
    repeat: bool = False
    threads: int = 1
    simulate_only: bool = False


@dataclass(frozen=True)
class Simulated:
    """Cases whose campaigns are in the store."""

    cases: Sequence[PlantedCase]


@dataclass(frozen=True)
class Ran:
    """A case whose loop has run, or could not; for detection limits, cases with effects of the stated size."""

    case: PlantedCase
    row: TrialRow | None = None
    planted: Sequence[PlantedCase] = ()


def run_simulation(cases: Sequence[PlantedCase], options: Options) -> Simulated:
    """Simulate campaigns; none after the deadline."""
    if time.time() > options.deadline:
        return Simulated(())
    simulate(cases, options.store)
    return Simulated(cases)


def run_loop(case: PlantedCase, options: Options) -> Ran:
    """Run the loop on the campaign of a case."""
    campaign = stored_campaign(case, options.store)
    if campaign is None or time.time() > options.deadline:
        return Ran(case)
    folder = options.directory / f"{case.order.name} {case.text}".replace(" ", "_").replace(",", "")
    write(campaign, folder)
    excluded = options.repeat and case.sort != "floor"
    row, result = run_case(case, truth_of(case, campaign), folder, excluded=excluded, threads=options.threads)
    return Ran(case, row, [] if result is None else planted_cases(case, result))


def planted_cases(case: PlantedCase, result: LoopResult) -> list[PlantedCase]:
    """Plant effects of the minimum detectable size that the result states, chosen at random."""
    limits = _limits(case, result)
    chosen = np.random.default_rng([case.order.seed, 43]).permutation(len(limits))[:LIMITS]
    return [with_detectable_effect(case, list(limits.values())[k], 1.0) for k in chosen]


def _limits(case: PlantedCase, result: LoopResult) -> Limits:
    """Stated minimum detectable effects of a campaign without an effect, by kind, location and wheelset."""
    if case.sort != "limit" or result.verdict != "none":
        return {}
    min_gain, error = result.dataset.campaign.min_relative_gain, result.validations["after"].nrmse
    rows = minimum_detectable_effects(result.score_test, min_gain, error, result.predicted_gains)
    usable = [r for r in rows if (r["kind"], r["at"]) in DETECTABLE_PARAMETERS and r["value"]]
    return {(r["kind"], r["at"], r["wheelset"]): r for r in usable}


def run_trial(cases: Sequence[PlantedCase], options: Options, processes: int) -> Iterator[TrialRow]:
    """Simulate the campaigns, those of alike time step together, run the loop on each and yield its row.

    When the loops of all campaigns for detection limits have run, those with effects of the stated size follow.
    """
    limits = {case.order.seed for case in cases if case.sort == "limit"}
    planted: list[PlantedCase] = []
    with process_pool(processes) as pool:

        def submit(cases: Sequence[PlantedCase]) -> set[Future[Any]]:
            groups = simulation_groups(cases, options.store)
            lacking = {id(case) for group in groups for case in group}
            ready = [case for case in cases if id(case) not in lacking]
            started = {pool.submit(run_simulation, group, options) for group in groups}
            return started if options.simulate_only else started | {pool.submit(run_loop, c, options) for c in ready}

        pending = submit(sorted(cases, key=lambda case: case.sort != "limit"))
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for found in (future.result() for future in done):
                if isinstance(found, Simulated):
                    if not options.simulate_only:
                        pending |= {pool.submit(run_loop, case, options) for case in found.cases}
                    continue
                if found.row is not None:
                    yield found.row
                planted += found.planted
                if found.case.sort == "limit":
                    limits.discard(found.case.order.seed)
                    if not limits:
                        pending |= submit(planted)


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
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append each row as it is known")
    p.add_argument("--resume", action="store_true", help="leave out the campaigns that the output has")
    p.add_argument("--write", type=Path, metavar="MD", help="replace the section of the trial in a document")
    options = p.parse_args(arguments)
    rows = stored_rows(p, options)
    done = {(row.number, row.planted) for row in rows}
    at_limit = Counter(row.number for row in rows if row.sort == "floor")

    def is_done(case: PlantedCase) -> bool:
        complete = case.sort != "limit" or at_limit[case.order.seed] == LIMITS
        return complete and (case.order.seed, case.text) in done

    cases = [case for case in draw_trial(options.loops, options.seed, options.seconds) if not is_done(case)]
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        trial = Options(
            directory=options.keep or Path(scratch),
            deadline=time.time() + 60.0 * options.minutes,
            store=options.simulated or Path(scratch) / "simulated",
            repeat=options.repeat,
            threads=options.threads,
            simulate_only=options.simulate_only,
        )
        for row in run_trial(cases, trial, options.processes):
            if (row.number, row.planted) in done:
                continue
            print(format_row(row), flush=True)
            rows.append(row)
            if options.output:
                append_rows(options.output, [row])
    lines = totals(rows)
    print("\n".join(["", *lines]))
    if options.write:
        command = f"python -m tests.blind.blind --loops {options.loops} --seed {options.seed}"
        write_section(options.write, command, lines)


if __name__ == "__main__":
    main()
