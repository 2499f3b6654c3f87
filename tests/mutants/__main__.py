"""Mutation testing: change a module in one place, run the tests of this module, list the changes that no test notices.

python -m tests.mutants [MODULE ...] [--lines FIRST:LAST]

Every mutant runs in a forked process with numpy, scipy and pytest already imported. Needs requirements/mutants.txt.
Exit code 1 if a mutant survives that tests/mutants/survivors.yaml does not explain.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import os
import pickle
import resource
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

from tests.mutants.mutants import Mutant, list_mutants

ROOT = Path(__file__).parents[2]
EXPLAINED = ROOT / "tests" / "mutants" / "survivors.yaml"
# the tests that concern a module, all fast
TESTS = {
    "railui/identification/verdict.py": ["tests/identification/test_verdict.py"],
    "railui/identification/structure/family_wise_test.py": ["tests/identification/structure/test_family_wise_test.py"],
    "railui/identification/structure/score_result.py": ["tests/identification/structure/test_family_wise_test.py"],
    "railui/identification/structure/student.py": ["tests/identification/structure/test_student.py"],
    "railui/ride_quality/score.py": ["tests/ride_quality/test_score.py"],
    "railui/capture/protocol/wire.py": ["tests/capture/protocol/test_wire.py"],
}
PYTEST = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "addopts=--import-mode=importlib"]
STARTUP_SECONDS = 10  # of processor time
WAIT_RATIO = 50  # of the time at which a process ends to its processor time, on a busy machine
MODULE_SECONDS = 10_000  # of processor time


class _Source(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finder and loader of one module from changed source."""

    def __init__(self, path: str, source: str) -> None:
        self.name = path.removesuffix(".py").replace("/", ".")
        self.path = ROOT / path
        self.source = source

    def find_spec(
        self, name: str, path: object = None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return the specification of the module; None for every other."""
        if name != self.name:
            return None
        return importlib.util.spec_from_file_location(name, self.path, loader=self)  # type: ignore[arg-type]

    def exec_module(self, module: ModuleType) -> None:
        """Execute the changed source."""
        exec(compile(self.source, str(self.path), "exec"), module.__dict__)


def in_fork(work: Callable[[], Any], seconds: float) -> Any:
    """Return what a function returns in a forked process without output; None if it dies or computes for longer."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.close(reader)
            signal.alarm(round(WAIT_RATIO * seconds))
            resource.setrlimit(resource.RLIMIT_CPU, (round(seconds), round(seconds) + 1))
            null = os.open(os.devnull, os.O_RDWR)
            for stream in (0, 1, 2):
                os.dup2(null, stream)
            with os.fdopen(writer, "wb") as pipe:
                pickle.dump(work(), pipe)
            code = 0
        finally:
            os._exit(code)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        data = pipe.read()
    _, status = os.waitpid(child, 0)
    return pickle.loads(data) if status == 0 else None


def run_tests(path: str, source: str) -> int:
    """Run the tests of a module with changed source; return pytest's exit code."""
    sys.meta_path.insert(0, _Source(path, source))
    return int(pytest.main([*PYTEST, *TESTS[path]]))


def independent_modules(path: str, source: str) -> list[str]:
    """Return the modules that the tests of a module use and that do not depend on it."""
    name = path.removesuffix(".py").replace("/", ".")
    importlib.import_module(name)
    below = {m for m in sys.modules if m != name}
    run_tests(path, source)
    return sorted(m for m in sys.modules if m in below or m.partition(".")[0] not in ("railui", "tests", "conftest"))


def import_all(modules: list[str]) -> None:
    """Import modules, so that the forked processes have them."""
    for name in modules:
        try:
            importlib.import_module(name)
        except Exception:
            continue


def survivors(path: str, first: int, last: int) -> tuple[int, list[Mutant]]:
    """Return the number of mutants of a module between two lines, and those that no test notices."""
    source = (ROOT / path).read_text("utf-8")
    import_all(in_fork(lambda: independent_modules(path, source), 600) or [])
    code, seconds = in_fork(lambda: (run_tests(path, source), time.process_time()), 600) or (1, 0.0)
    if code != 0:
        raise ValueError("the tests fail without a change")
    limit = STARTUP_SECONDS + 5 * seconds
    mutants = [mutant for mutant in list_mutants(source) if first <= mutant.line <= last]
    alive = []
    for mutant in mutants:
        result = in_fork(lambda: run_tests(path, mutant.source), limit)  # noqa: B023
        if result == 0:
            alive.append(mutant)
    return len(mutants), alive


def explanations() -> dict[tuple[str, str, str], str]:
    """Return the reason for each explained survivor by module, line before and line after."""
    return {(e["module"], e["line"], e["mutant"]): e["reason"] for e in yaml.safe_load(EXPLAINED.read_text()) or ()}


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("modules", nargs="*", default=list(TESTS), help="paths; by default all")
    parser.add_argument("--lines", default="1:100000", help="FIRST:LAST")
    options = parser.parse_args()
    first, last = map(int, options.lines.split(":"))
    explained = explanations()
    unexplained = 0
    for path in options.modules:
        start = time.monotonic()
        # each module in a process without the modules that were imported for the one before
        result = in_fork(lambda: survivors(path, first, last), MODULE_SECONDS)  # noqa: B023
        if result is None:
            raise SystemExit(f"{path}: the tests fail without a change")
        count, alive = result
        new = [m for m in alive if (path, m.before, m.after) not in explained]
        unexplained += len(new)
        seconds = time.monotonic() - start
        summary = f"{count} mutants, {len(alive)} survive, {len(new)} of them unexplained"
        print(f"{path}: {summary}, {seconds:.0f} s", flush=True)
        for mutant in new:
            print(f"  {path}:{mutant.line}\n    - {mutant.before}\n    + {mutant.after}", flush=True)
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
