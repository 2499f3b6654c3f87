"""Map of responses in a directory, where every evaluation is stored as it arrives."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from railui.execution.cache import DATABASE_FILES, ResultCache, network_file_system
from railui.execution.cached_evaluator import CachedEvaluator
from railui.execution.lock import LOCK_FILE, Lock
from railui.execution.tasks import Runner, Task, TaskResult
from railui.io.atomic import check_directory_writable, write_text
from railui.io.problems import file_problem
from railui.io.table import table_text
from railui.progress import SILENT, Progress

JSON_FILE: Final = "map.json"
CSV_FILE: Final = "map.csv"
FIGURE_FILE: Final = "map.svg"
MAP_FILES: Final = (JSON_FILE, CSV_FILE, FIGURE_FILE, LOCK_FILE, *DATABASE_FILES)
PARTIAL: Final = re.compile(r"\..*\.part")


class MapSession:
    """Directory of maps of one or several designs, locked while a process uses it.

    Parameters
    ----------
    directory : str or Path
        Made if it does not exist.
    runner : Runner
        Threads that evaluate the vehicles.
    progress : Progress
        Receives the number of evaluated vehicles.

    Attributes
    ----------
    evaluator : CachedEvaluator
        Evaluator that stores every result; results of the same vehicle in the same case are taken from the directory.

    Raises
    ------
    FileProblems
        If the directory has other files.
    LockedError
        If another process uses the directory.
    OSError
        If the directory cannot be written.
    """

    def __init__(self, directory: str | Path, runner: Runner, progress: Progress = SILENT) -> None:
        self.directory = _checked(Path(directory))
        check_directory_writable(self.directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        if kind := network_file_system(self.directory):
            progress.message(f"warning: {self.directory} is on {kind}, where the result cache can be corrupted")
        self._lock = Lock(self.directory)
        self._cache = ResultCache(self.directory)
        self.evaluator = CachedEvaluator(_ReportingRunner(runner, progress), self._cache)

    def write(self, document: Mapping[str, Any]) -> list[Path]:
        """Write map.json and map.csv; return their paths."""
        text = json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
        return [
            write_text(self.directory / CSV_FILE, map_csv(document)),
            write_text(self.directory / JSON_FILE, text),
        ]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._cache.close()
        self._lock.release()


class _ReportingRunner:
    """Runner that reports the number of vehicles of another runner."""

    def __init__(self, runner: Runner, progress: Progress) -> None:
        self._runner, self._progress = runner, progress

    @property
    def workers(self) -> int:
        """Number of tasks that run at a time."""
        return self._runner.workers

    def run(self, tasks: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Run all tasks."""
        total, done = sum(map(len, tasks)), 0

        def deliver_and_report(result: TaskResult) -> None:
            nonlocal done
            deliver(result)
            done += len(result.task)
            self._progress.message(f"{done} of {total} vehicles")

        self._runner.run(tasks, deliver_and_report)


def _checked(path: Path) -> Path:
    """Return the directory; FileProblems for a file and for a directory with other files."""
    remedy = "choose another directory with -o"
    if path.exists() and not path.is_dir():
        raise file_problem(path, "is a file", remedy)
    names = sorted(entry.name for entry in path.iterdir()) if path.exists() else []
    foreign = [name for name in names if name not in MAP_FILES and not PARTIAL.fullmatch(name)]
    if foreign:
        raise file_problem(path, f"has files that are not of a map, such as {foreign[0]}", remedy)
    return path


def map_csv(document: Mapping[str, Any]) -> str:
    """Return a map as CSV in SI: one row per vehicle, NaN where it has no value."""
    x, y = document["x"], document["y"]
    columns: dict[str, list[float]] = {
        f"{x['name']} [{x['unit']}]": [value for _ in y["values"] for value in x["values"]],
        f"{y['name']} [{y['unit']}]": [value for value in y["values"] for _ in x["values"]],
    }
    for key, one in document["of"].items():
        flat = [float("nan") if value is None else value for row in one["values"] for value in row]
        columns[f"{key} [{one['unit']}]"] = flat
    return table_text(columns, digits=None)
