"""Instructions per design-step of the standard jobs, for regressions that noise hides: make bench-counts.

python -m tests.bench.counts [--keep FILE]: valgrind counts what a process does that rides every job once, and once
more; the difference is one job. Four processes of a minute each, most of it the start of Python. The level is AVX2
(RAILUI_SIMD=v3), which valgrind knows, so the numbers of two machines compare.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from railui.bench.benchmark_log import append, describe_changes
from railui.bench.standard_job import bogie_model, coach_job, coach_model, full_job, reduced_job, spread_designs

DESIGNS = 16
STEPS = 20_000 - 1
JOBS = {
    "full": (full_job, bogie_model),
    "reduced": (reduced_job, lambda: bogie_model(reduced=True)),
    "coach": (coach_job, coach_model),
}


def ride(twice: str) -> None:
    """Every job once, one of them once more."""
    for name, (job, vehicle) in JOBS.items():
        run = job(spread_designs(vehicle(), DESIGNS), 1)
        run()
        if name == twice:
            run()


def counted(twice: str) -> int:
    """Instructions of a process of its own that does so."""
    surroundings = os.environ | {"RAILUI_SIMD": "v3", "PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"}
    with tempfile.TemporaryDirectory() as folder:
        words = ["valgrind", "--tool=cachegrind", "--cache-sim=no", f"--cachegrind-out-file={folder}/out"]
        words += [sys.executable, "-m", "tests.bench.counts", "--ride", twice]
        completed = subprocess.run(words, env=surroundings, capture_output=True, text=True)
    result = re.search(r"I\s+refs:\s+([\d,]+)", completed.stderr)
    if completed.returncode or not result:
        raise SystemExit(f"valgrind did not count:\n{completed.stderr[-2000:]}")
    return int(result[1].replace(",", ""))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--keep", type=Path, help="append the result, dated, and print the change against the last one")
    parser.add_argument("--ride", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.ride is not None:
        ride(args.ride)
        return
    if shutil.which("valgrind") is None:
        print("skipped: valgrind is not installed, and it is what counts instructions", file=sys.stderr)
        return
    once = counted("none")
    numbers = {name: (counted(name) - once) / (DESIGNS * STEPS) for name in JOBS}
    for name, number in numbers.items():
        print(f"{name:8s} {number:7.1f} instructions per design-step")
    if args.keep and (before := append(args.keep, "instructions per design-step", numbers)):
        print(f"since {before['date'][:10]}, {before['commit']}:", *describe_changes(numbers, before), sep="\n  ")


if __name__ == "__main__":
    main()
