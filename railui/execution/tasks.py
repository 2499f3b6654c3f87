"""Tasks: vehicles of one case and the keys to evaluate, identified by content hashes, run by any runner."""

from __future__ import annotations

import builtins
import hashlib
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Final, Protocol

import numpy as np

import railui
from railui import core
from railui.arrays import FloatArray
from railui.core import NoResultError
from railui.io.atomic import canonical_json
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses, evaluate_case
from railui.track.excitation import Excitation

RESUMES: Final = "all results so far are stored, the same command resumes"
INITIAL_PACE: Final = 60e-9  # s per vehicle and track sample, until tasks have been timed
# Python sources that may change the digits of a result
HASHED_SOURCES: Final = (
    "core",
    "arrays.py",
    "memo.py",
    "progress.py",
    "parallel.py",
    "io",
    "dsp",
    "contact",
    "runs",
    "track",
    "vehicle",
    "ride_quality",
    "curving",
    "running_stability",
    "optimisation",
)


@dataclass(frozen=True, eq=False)
class Task:
    """Vehicles of a case to evaluate.

    Attributes
    ----------
    case : Case
    rows : float [n, row]
        Kernel rows of the vehicles.
    keys : tuple of str
        Keys to evaluate.
    hashes : tuple of bytes [n]
        Content hash of every vehicle.
    """

    case: Case
    rows: FloatArray
    keys: tuple[str, ...]
    hashes: tuple[bytes, ...]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def samples(self) -> int:
        """Number of track samples over all vehicles."""
        return len(self.rows) * len(self.case.excitation.track)

    def select(self, vehicles: slice) -> Task:
        """Return the task for some of the vehicles."""
        return Task(self.case, self.rows[vehicles], self.keys, self.hashes[vehicles])


@dataclass(frozen=True, eq=False)
class TaskResult:
    """Responses of a task and its duration [s]."""

    task: Task
    responses: Responses
    seconds: float


class EvaluationError(RuntimeError):
    """An evaluation failed by an error of the program or the machine, which says nothing about the designs."""


class Runner(Protocol):
    """Executor of tasks, on threads or machines, which delivers the results in any order."""

    @property
    def workers(self) -> int:
        """Number of tasks that run at a time."""
        ...

    def run(self, tasks: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Run all tasks; deliver results as they arrive, after an interrupt those of tasks already started."""
        ...


def run_task(case: Case, rows: FloatArray, keys: Collection[str]) -> tuple[Responses, float]:
    """Evaluate vehicles of a case on one thread and return their responses and the duration [s].

    A `NoResultError` is attributed to the vehicle that causes it; the others are evaluated.

    Raises
    ------
    EvaluationError
        For every other exception, which must not count as a failure of a design.
    """
    start = time.perf_counter()
    return _evaluate(case, rows, keys), time.perf_counter() - start


def _evaluate(case: Case, rows: FloatArray, keys: Collection[str]) -> Responses:
    try:
        return evaluate_case(case, rows, keys, 1)
    except NoResultError as error:
        if len(rows) == 1:
            return Responses.failed(1, keys, str(error))
    except Exception as error:
        track, speed = case.excitation.source.name, case.excitation.speed
        place = f"an evaluation on {track} at {speed:g} m/s failed"
        cause = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise EvaluationError(f"{place} by no fault of the design ({cause})") from error
    half = len(rows) // 2
    parts = [_evaluate(case, rows[:half], keys), _evaluate(case, rows[half:], keys)]
    values = {key: np.concatenate([part.values[key] for part in parts]) for key in keys}
    distance_share = np.concatenate([part.distance_share for part in parts])
    return Responses(values, distance_share, [reason for part in parts for reason in part.reasons])


def is_design_failure(reason: str) -> bool:
    """Return False if a reason is the text of an exception that says nothing about the design.

    >>> [is_design_failure(reason) for reason in ("left the track", "ValueError: shapes", "")]
    [True, False, True]
    """
    kind = getattr(builtins, reason.partition(":")[0], None)
    return not (isinstance(kind, type) and issubclass(kind, Exception))


def split_tasks(tasks: Iterable[Task], seconds: float, workers: int, pace: float = INITIAL_PACE) -> list[Task]:
    """Split tasks into parts of about so many seconds, shorter if workers would be idle, in full SIMD groups."""
    whole = list(tasks)
    share = sum(task.samples for task in whole) / (4 * workers)
    parts = []
    for task in whole:
        vehicles = int(min(seconds / pace, share) / len(task.case.excitation.track))
        size = max(1, vehicles // core.LANES) * core.LANES
        parts += [task.select(slice(i, i + size)) for i in range(0, len(task), size)]
    return parts


@cache
def environment_identity() -> dict[str, str]:
    """Return everything besides the case that decides the digits of a result: versions, sources, SIMD level.

    >>> sorted(environment_identity())
    ['kernel', 'numpy', 'python', 'railui', 'scipy', 'simd']
    """
    package = Path(railui.__file__).parent
    files = [path for name in HASHED_SOURCES for path in sorted([package / name, *(package / name).rglob("*.py")])]
    python = hashlib.sha256()
    for path in files:
        if path.is_file():
            python.update(path.read_bytes())
    return {
        "railui": railui.__version__,
        "kernel": core.source_hash(),
        "python": python.hexdigest(),
        "simd": core.simd_level(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
    }


class ContentHashes:
    """Content hashes of vehicles in cases: design, row, track, speed, curve, keys and environment."""

    def __init__(self) -> None:
        self._tracks: dict[int, tuple[Excitation, str]] = {}
        self._cases: dict[tuple[int, tuple[str, ...]], tuple[Case, bytes]] = {}

    def hash_rows(self, case: Case, rows: FloatArray, keys: tuple[str, ...]) -> tuple[bytes, ...]:
        """Return a hash of 32 bytes for every row."""
        prefix = self._hash_case(case, keys)
        data = np.ascontiguousarray(rows, dtype="<f8")
        return tuple(hashlib.sha256(prefix + row.tobytes()).digest() for row in data)

    def _hash_case(self, case: Case, keys: tuple[str, ...]) -> bytes:
        entry = self._cases.get((id(case), keys))
        if entry is None:
            content = {
                "design": case.vehicle.model.design.content(),
                "track": self._hash_track(case.excitation),
                "speed": case.excitation.speed,
                "curve": [case.radius, case.cant_deficiency],
                "keys": keys,
                "by": environment_identity(),
            }
            digest = hashlib.sha256(canonical_json(content).encode()).digest()
            entry = self._cases[id(case), keys] = (case, digest)  # a reference to the case keeps its id unique
        return entry[1]

    def _hash_track(self, excitation: Excitation) -> str:
        entry = self._tracks.get(id(excitation.track))
        if entry is None:
            entry = self._tracks[id(excitation.track)] = (excitation, excitation.track.sha256)
        return entry[1]
