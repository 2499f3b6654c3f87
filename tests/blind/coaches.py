"""Blind trial of the loop on simulated campaigns of a coach of bodies: 30 by chance from a seed.

python -m tests.blind.coaches --seed 50000 -o coaches.csv --resume --write docs/blind_trials.md
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from pathlib import Path
from typing import Any

from tests.blind.assessment import TrialRow, Truth, run_case
from tests.blind.blind import stored_rows
from tests.blind.coach_cases import CoachCase, draw_coaches
from tests.blind.coach_table import MARKS, coach_totals
from tests.blind.processes import process_pool
from tests.blind.simulation import grouped
from tests.blind.table import HEAD, format_row, write_section
from tests.trial_rows import append_rows
from tests.truth.coach_campaign import drawn, steps_of, true_values, write_campaigns

GROUP = 30  # campaigns simulated side by side


def folder_of(case: CoachCase, directory: Path) -> Path:
    """Folder of a campaign."""
    return directory / case.order.name.replace(" ", "_")


def is_simulated(case: CoachCase, directory: Path) -> bool:
    """True where the directory has the campaign."""
    return (folder_of(case, directory) / "truth.yaml").exists()


def simulate(cases: Sequence[CoachCase], directory: Path) -> list[CoachCase]:
    """Simulate campaigns side by side; return those whose coach does not derail."""
    write_campaigns([case.order for case in cases], [folder_of(case, directory) for case in cases])
    return [case for case in cases if is_simulated(case, directory)]


def run(case: CoachCase, directory: Path) -> TrialRow:
    """Run the loop on a campaign."""
    truth = Truth(true_values(drawn(case.order)), case.order.all_effects(0)[: len(case.effects)])
    return run_case(case, truth, folder_of(case, directory))[0]


def run_trial(cases: Sequence[CoachCase], directory: Path, processes: int) -> Iterator[TrialRow]:
    """Simulate the campaigns, those of alike time step together, run the loop on each and yield its row."""
    with process_pool(processes, max_tasks_per_child=1) as pool:
        ready = [case for case in cases if is_simulated(case, directory)]
        pending: set[Future[Any]] = {pool.submit(run, case, directory) for case in ready}
        lacking = groups_of([case for case in cases if case not in ready])
        pending |= {pool.submit(simulate, group, directory) for group in lacking}
        while pending:
            done, pending = wait(pending, return_when=FIRST_COMPLETED)
            for found in (future.result() for future in done):
                if isinstance(found, TrialRow):
                    yield found
                else:
                    pending |= {pool.submit(run, case, directory) for case in found}


def groups_of(cases: Sequence[CoachCase]) -> list[list[CoachCase]]:
    """Group campaigns of the same time step, the quickest first."""
    return grouped(cases, [steps_of(case.order) for case in cases], GROUP)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.coaches", description=__doc__)
    p.add_argument("--seed", type=int, default=50000)
    p.add_argument("--campaigns", type=int, help="the first so many of the trial's")
    p.add_argument("--seconds", type=float, nargs=2, default=(40.0, 30.0), help="length of both runs")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("--keep", type=Path, metavar="DIR", help="keep the campaigns in this directory")
    p.add_argument("-o", "--output", type=Path, metavar="CSV", help="append each row as it is known")
    p.add_argument("--resume", action="store_true", help="leave out the campaigns that the output has")
    p.add_argument("--write", type=Path, metavar="MD", help="replace the section of this trial in a document")
    options = p.parse_args(arguments)
    rows = stored_rows(p, options)
    done = {row.number for row in rows}
    cases = draw_coaches(options.seed, options.seconds)[: options.campaigns]
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        cases = [case for case in cases if case.order.seed not in done]
        for row in run_trial(cases, options.keep or Path(scratch), options.processes):
            print(format_row(row), flush=True)
            rows.append(row)
            if options.output:
                append_rows(options.output, [row])
    lines = coach_totals(rows)
    print("\n".join(["", *lines]))
    if options.write:
        write_section(options.write, f"python -m tests.blind.coaches --seed {options.seed}", lines, MARKS)


if __name__ == "__main__":
    main()
