"""Session of a search in a directory: lock, configuration snapshot, result cache, status."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from railui.documents.saving import save_design
from railui.execution.cache import DATABASE, ResultCache, network_file_system
from railui.execution.cached_evaluator import CachedEvaluator
from railui.execution.config_snapshot import check_unchanged, snapshot
from railui.execution.lock import Lock, lock_holder
from railui.execution.outputs import STUDY_FILE, VEHICLE_FILE, check_directory, save_result, study_text
from railui.execution.tasks import Runner, environment_identity
from railui.io.atomic import check_directory_writable, write_text
from railui.io.problems import file_problem
from railui.optimisation.fresh import FRESH_SEED_SETS
from railui.optimisation.search import SearchState
from railui.optimisation.study import Study
from railui.progress import SILENT, Progress

RUNNING: Final = "running"
INTERRUPTED: Final = "interrupted"
FINISHED: Final = "finished"


class Session:
    """Search of a study in a directory.

    Parameters
    ----------
    study : Study
    directory : str or Path
        Directory of the search; made if it does not exist.
    runner : Runner
        Threads or machines that evaluate the designs.
    unlock : bool
        Take over the lock of a process of another machine.
    progress : Progress
        Receives warnings about the directory.

    Attributes
    ----------
    evaluator : CachedEvaluator
        Evaluator that stores every result.

    Raises
    ------
    FileProblems
        If the directory holds other files, or a search with another configuration.
    LockedError
        If another process uses the directory.
    OSError
        If the directory cannot be written.
    """

    def __init__(
        self,
        study: Study,
        directory: str | Path,
        runner: Runner,
        *,
        unlock: bool = False,
        progress: Progress = SILENT,
    ) -> None:
        self.directory = check_directory(study, directory)
        check_directory_writable(self.directory)
        self.directory.mkdir(parents=True, exist_ok=True)
        if kind := network_file_system(self.directory):
            risk = f"{self.directory} is on {kind}, where the result cache can be corrupted"
            progress.message(f"warning: {risk}: choose a local disk")
        self._lock = Lock(self.directory, unlock)
        for partial in self.directory.glob(".*.part"):  # of a process that was killed while it wrote a file
            partial.unlink()
        self._cache = ResultCache(self.directory)
        self._study = study
        self.evaluator = CachedEvaluator(runner, self._cache)
        self._start(progress)

    def _start(self, progress: Progress) -> None:
        """Check the configuration against the snapshot of the directory, then store the new one."""
        study = self._study
        before, content = self._cache.value("frozen"), snapshot(study)
        if before is not None:
            self._check_resumable(before, progress)
        if before != content:
            save_design(study.design, self.directory / VEHICLE_FILE)
            inside = replace(study, design=replace(study.design, source=self.directory / VEHICLE_FILE))
            write_text(self.directory / STUDY_FILE, study_text(inside, self.directory))
        self._cache.set_values(
            frozen=content,
            by=environment_identity(),
            finished=False,
            stand=None,
            tally=[0, 0.0],
            rides=_planned_simulations(study),
            session=[time.time(), len(self._cache)],
        )

    def _check_resumable(self, before: Mapping[str, Any], progress: Progress) -> None:
        try:
            check_unchanged(self.directory, before, self._study)
        except Exception:
            self.close()
            raise
        generations = self._study.method.generations
        if (longer := int((before.get("method") or {}).get("generations", 0))) > generations:
            shorter = f"{generations} generations replace the result of {longer}"
            progress.message(f"warning: {shorter}, whose simulations remain stored: set {longer} to have it again")
        if self._cache.value("by") != environment_identity():
            reason = "another version of railui, SIMD level or numpy started this search"
            progress.message(f"warning: {reason}: its results are not used")
        elif stored := len(self._cache):
            progress.message(f"{stored} simulations are in {self._cache.path.name}: the search resumes with them")

    @property
    def damaged_rows(self) -> int:
        """Number of stored simulations whose checksum was wrong."""
        return self._cache.damaged_rows

    def progress(self, receiver: Progress = SILENT) -> Progress:
        """Return a Progress for the search that stores its state for `status` and passes everything on."""
        return _SessionProgress(self, receiver)

    def store_state(self, state: SearchState) -> None:
        """Store the state of the search for `status`."""
        self._cache.set_values(
            stand={"evaluations": state.evaluations, "failures": dict(state.failures), "doing": state.activity}
        )

    def finish(self, document: Mapping[str, Any], choose: Sequence[int] = ()) -> list[Path]:
        """Write the result and mark the search as finished; return the files."""
        written = save_result(self._study, document, self.directory, choose)
        self._cache.set_values(finished=True)
        return written

    def close(self) -> None:
        """Close the result cache and release the lock."""
        self._cache.close()
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()


class _SessionProgress(Progress):
    """Progress of a search that stores every state in its session."""

    def __init__(self, session: Session, receiver: Progress) -> None:
        self._session = session
        self._receiver = receiver
        self._reported_rows = 0

    def message(self, text: str) -> None:
        """Pass a message on."""
        self._receiver.message(text)

    def event(self, event: object) -> None:
        """Store the state of the search and pass it on."""
        if isinstance(event, SearchState):
            self._session.store_state(event)
            self._report_damage()
        self._receiver.event(event)

    def _report_damage(self) -> None:
        """Report new rows of the cache whose checksum is wrong."""
        damaged = self._session.damaged_rows
        if damaged > self._reported_rows:
            count = damaged - self._reported_rows
            self._receiver.message(f"warning: {count} stored simulations are damaged: computed again")
            self._reported_rows = damaged


def _planned_simulations(study: Study) -> int:
    """Return the number of simulations of a search: generations, baseline and front, both also on fresh seeds."""
    cases = study.cases
    count = len(cases.track) * len(cases.speed) * len(cases.seed) * len(cases.scenario) * max(1, cases.draws)
    designs = study.method.population * (study.method.generations + FRESH_SEED_SETS) + FRESH_SEED_SETS + 1
    return designs * count


def status(directory: str | Path) -> dict[str, Any]:
    """Return the status of the search in a directory.

    Returns
    -------
    dict
        `study`, its name; `state`, "running", "interrupted" or "finished"; `evaluations`; `failed`; `failures` by
        reason; `eta_s`, remaining time [s] at the rate of this session, None if unknown; `doing`, the current step;
        `rides`, the number of stored simulations; `held_by`, the running process.

    Raises
    ------
    FileProblems
        If the directory holds no search.
    """
    path = Path(directory)
    if not (path / DATABASE).is_file():
        raise file_problem(path, "holds no search", "name the directory that railui optimise wrote")
    cache = ResultCache(path, readonly=True)
    try:
        search = cache.value("stand") or {"evaluations": 0, "failures": {}, "doing": "starting"}
        is_finished, stored, planned = cache.value("finished"), len(cache), cache.value("rides")
        session_start, stored_before = cache.value("session") or (0.0, 0)
        computed, _ = cache.value("tally") or (0, 0.0)
        name = (cache.value("frozen") or {}).get("study")
    finally:
        cache.close()
    holder = lock_holder(path)
    is_running = holder is not None and (holder.is_alive or holder.is_remote)
    state = FINISHED if is_finished else RUNNING if is_running else INTERRUPTED
    rate = computed / max(time.time() - session_start, 1e-9)
    remaining = max(0, (planned or 0) - stored_before - computed)
    eta = 0.0 if is_finished else remaining / rate if state == RUNNING and rate > 0 else None
    return {
        "study": name,
        "state": state,
        "evaluations": search["evaluations"],
        "failed": sum(search["failures"].values()),
        "eta_s": eta,
        "failures": search["failures"],
        "doing": search["doing"],
        "rides": stored,
        "held_by": str(holder) if holder is not None and state == RUNNING else None,
    }
