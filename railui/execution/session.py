"""A search in its directory: locked, frozen, resumed from what is stored, told to whoever asks how it stands."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from railui.documents.saving import save_design
from railui.execution.cache import FILE, Store, remote_disk
from railui.execution.cached_evaluator import StoredEvaluator
from railui.execution.config_snapshot import check_same, snapshot
from railui.execution.lock import Lock, holder
from railui.execution.outputs import STUDY, VEHICLE, check_directory, save_outcome, study_text
from railui.execution.tasks import Runner, identity
from railui.io.atomic import check_writable, write_text
from railui.io.problems import one_problem
from railui.optimisation.optimise import FRESH, SearchState
from railui.optimisation.study import Study

RUNNING, INTERRUPTED, FINISHED = "running", "interrupted", "finished"


class Session:
    """A study searched in a directory, by a runner; `evaluator` answers the search and keeps every evaluation.

    Raises FileProblems for a directory that holds something else, LockedError where another process works in
    it, OSError where it cannot be written.
    """

    def __init__(
        self, study: Study, directory: str | Path, runner: Runner, *, unlock: bool = False,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:  # fmt: skip
        self.directory = check_directory(study, directory)
        check_writable(self.directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        if kind := remote_disk(self.directory):
            say(f"warning: {self.directory} lies on {kind}, where a store can be spoilt: choose a disk of this machine")
        self._lock = Lock(self.directory, unlock)
        for left in self.directory.glob(".*.part"):  # of a process that was killed as it wrote
            left.unlink()
        self._store = Store(self.directory)
        self._study, self.evaluator = study, StoredEvaluator(runner, self._store)
        self._freeze(study, say)

    def _freeze(self, study: Study, say: Callable[[str], None]) -> None:
        begun = self._store.told("frozen")
        if begun is not None:
            try:
                check_same(self.directory, begun, study)
            except Exception:
                self.close()
                raise
            if self._store.told("by") != identity():
                say("warning: another railui, SIMD level or numpy began this search: what it evaluated does not count")
            elif kept := len(self._store):
                say(f"{kept} rides are in {self._store.path.name}: the search goes the same way again with them")
        if begun is None or begun != snapshot(study):
            save_design(study.design, self.directory / VEHICLE)
            inside = replace(study, design=replace(study.design, source=self.directory / VEHICLE))
            write_text(self.directory / STUDY, study_text(inside, self.directory))
        rides = (study.method.population * (study.method.generations + FRESH) + FRESH + 1) * _cases(study)
        self._store.tell(
            frozen=snapshot(study), by=identity(), finished=False, stand=None, tally=[0, 0.0], rides=rides,
            session=[time.time(), len(self._store)],
        )  # fmt: skip

    def watch(self, stand: SearchState) -> None:
        """Keeps where the search stands."""
        self._store.tell(
            stand={"evaluations": stand.evaluations, "failures": dict(stand.failures), "doing": stand.doing}
        )

    def finish(self, document: Mapping[str, Any], choose: Sequence[int] = ()) -> list[Path]:
        """Writes the outcome; the search is at its end. Returns the files."""
        written = save_outcome(self._study, document, self.directory, choose)
        self._store.tell(finished=True)
        return written

    def close(self) -> None:
        """Closes the store and lets go of the directory."""
        self._store.close()
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


def _cases(study: Study) -> int:
    c = study.cases
    return len(c.track) * len(c.speed) * len(c.seed) * len(c.scenario) * max(1, c.draws)


def status(directory: str | Path) -> dict[str, Any]:
    """Where the search of a directory stands: state ("running", "interrupted", "finished"), evaluations, failed.

    `eta_s` [s] at the rate of the present session, None where it cannot be told; `failures` by reason, `doing`
    in words, `rides` stored, `held_by`. Raises FileProblems where there is no search.
    """
    path = Path(directory)
    if not (path / FILE).is_file():
        raise one_problem(path, "holds no search", "name the directory that railui optimise wrote")
    store = Store(path, readonly=True)
    try:
        stand = store.told("stand") or {"evaluations": 0, "failures": {}, "doing": "beginning"}
        finished, rides, planned = store.told("finished"), len(store), store.told("rides")
        began, before = store.told("session") or (0.0, 0)
        done, _ = store.told("tally") or (0, 0.0)
        name = (store.told("frozen") or {}).get("study")
    finally:
        store.close()
    who = holder(path)
    state = FINISHED if finished else RUNNING if who is not None and (who.living or who.elsewhere) else INTERRUPTED
    rate = done / max(time.time() - began, 1e-9)
    left = max(0, (planned or 0) - before - done)
    eta = 0.0 if finished else left / rate if state == RUNNING and rate > 0 else None
    return {
        "study": name,
        "state": state,
        "evaluations": stand["evaluations"],
        "failed": sum(stand["failures"].values()),
        "eta_s": eta,
        "failures": stand["failures"],
        "doing": stand["doing"],
        "rides": rides,
        "held_by": str(who) if who is not None and state == RUNNING else None,
    }
