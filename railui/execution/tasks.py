"""A piece of work: vehicles of one case and what is asked of them; done here or anywhere, each known by its content."""

from __future__ import annotations

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
from railui.io.atomic import canonical_json
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses, evaluate_case
from railui.track.excitation import Excitation

PACE: Final = 60e-9  # s per vehicle and sample, until work that was done tells better
COMPUTING: Final = (  # the Python that decides digits
    *("core.py", "io", "parallel.py", "dsp", "contact", "runs", "track", "vehicle"),
    *("ride_quality", "curving.py", "hunting", "optimisation"),
)


@dataclass(frozen=True, eq=False)
class Task:
    """Vehicles, rows [n, row], of a case; the keys asked; the content hash of each vehicle."""

    case: Case
    rows: FloatArray
    keys: tuple[str, ...]
    hashes: tuple[bytes, ...]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def samples(self) -> int:
        """Samples of all rides together."""
        return len(self.rows) * len(self.case.road.track)

    def part(self, some: slice) -> Task:
        """Some of the vehicles."""
        return Task(self.case, self.rows[some], self.keys, self.hashes[some])


@dataclass(frozen=True, eq=False)
class TaskResult:
    """What came of a piece of work, and how long it took [s]."""

    work: Task
    answered: Responses
    seconds: float


class Runner(Protocol):
    """Who does the work: threads or machines. Delivers what is done as it is done, in any order."""

    @property
    def workers(self) -> int:
        """How many pieces are done at a time."""
        ...

    def run(self, works: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Does all the work; what was done before an interrupt is delivered too."""
        ...


def run_task(case: Case, rows: FloatArray, keys: Collection[str]) -> tuple[Responses, float]:
    """Vehicles of a case answered on one thread, and the seconds it took.

    Whatever goes wrong with one of them is its own failure, with its reason, and not its neighbours'.
    """
    begun = time.perf_counter()
    return _do(case, rows, keys), time.perf_counter() - begun


def _do(case: Case, rows: FloatArray, keys: Collection[str]) -> Responses:
    try:
        return evaluate_case(case, rows, keys, 1)
    except Exception as error:
        if len(rows) == 1:
            return Responses.failed(1, keys, f"{type(error).__name__}: {error}")
    half = len(rows) // 2
    parts = [_do(case, rows[:half], keys), _do(case, rows[half:], keys)]
    values = {key: np.concatenate([part.values[key] for part in parts]) for key in keys}
    travelled = np.concatenate([part.travelled for part in parts])
    return Responses(values, travelled, [reason for part in parts for reason in part.reasons])


def split_tasks(works: Iterable[Task], seconds: float, workers: int, pace: float = PACE) -> list[Task]:
    """Works cut into pieces of so many seconds, and smaller where workers would have nothing to do; full lanes."""
    whole = list(works)
    share = sum(work.samples for work in whole) / (4 * workers)
    found = []
    for work in whole:
        each = len(work.case.road.track)
        fitting = int(min(seconds / pace, share) / each)
        size = max(1, fitting // core.LANES) * core.LANES
        found += [work.part(slice(i, i + size)) for i in range(0, len(work), size)]
    return found


@cache
def identity() -> dict[str, str]:
    """What decides digits beside the case: versions, sources of kernel and Python, SIMD level.

    >>> sorted(identity())
    ['kernel', 'numpy', 'python', 'railui', 'scipy', 'simd']
    """
    home = Path(railui.__file__).parent
    files = [path for name in COMPUTING for path in sorted([home / name, *(home / name).rglob("*.py")])]
    python = hashlib.sha256()
    for path in files:
        if path.is_file():
            python.update(path.read_bytes())
    return {
        "railui": railui.__version__,
        "kernel": core.sources(),
        "python": python.hexdigest(),
        "simd": core.simd(),
        "numpy": np.__version__,
        "scipy": version("scipy"),
    }


class Hashes:
    """Content hashes of vehicles in cases: the resolved design, its row, track, speed, curve, keys, who computes."""

    def __init__(self) -> None:
        self._tracks: dict[int, tuple[Excitation, str]] = {}
        self._cases: dict[tuple[int, tuple[str, ...]], tuple[Case, bytes]] = {}

    def of(self, case: Case, rows: FloatArray, keys: tuple[str, ...]) -> tuple[bytes, ...]:
        """A hash of 32 bytes for every row."""
        head = self._case(case, keys)
        data = np.ascontiguousarray(rows, dtype="<f8")
        return tuple(hashlib.sha256(head + row.tobytes()).digest() for row in data)

    def _case(self, case: Case, keys: tuple[str, ...]) -> bytes:
        known = self._cases.get((id(case), keys))
        if known is None:
            resolved = {
                "design": case.vehicle.model.design.resolved(),
                "track": self._track(case.road),
                "speed": case.road.speed,
                "curve": [case.radius, case.cant_deficiency],
                "keys": keys,
                "by": identity(),
            }
            digest = hashlib.sha256(canonical_json(resolved).encode()).digest()
            known = self._cases[id(case), keys] = (case, digest)  # the case is held, so that its id stays its own
        return known[1]

    def _track(self, road: Excitation) -> str:
        known = self._tracks.get(id(road.track))
        if known is None:
            known = self._tracks[id(road.track)] = (road, road.track.sha256)
        return known[1]
