"""Runner of tasks on a dask cluster whose workers reproduce the results of this process bit for bit."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace
from typing import Any, Final, TypeVar

from distributed import Client, Future, KilledWorker
from distributed.protocol.pickle import loads

from railui.execution.dask_worker import (
    BundleResults,
    FailedBundle,
    MismatchedWorker,
    PackedCase,
    identity_differences,
    pack_call,
    run_bundle,
    run_checked,
    worker_identity,
)
from railui.execution.task_bundles import BUNDLE_SECONDS, TaskBundle, bundle_tasks
from railui.execution.tasks import (
    INITIAL_PACE,
    RESUMES,
    EvaluationError,
    Task,
    TaskResult,
    environment_identity,
    split_tasks,
)
from railui.io.problems import TemporaryError
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses
from railui.progress import SILENT, Progress
from railui.track.excitation import Excitation

CONNECT_TIMEOUT: Final = 10.0  # s, for an answer of the scheduler
WORKER_TIMEOUT: Final = 60.0  # s without any worker
POLL_INTERVAL: Final = 1.0  # s between two queries of the workers
WORKER_POLL_INTERVAL: Final = 0.2  # s, while there is no worker
MAX_CASE_SUBMISSIONS: Final = 10
MAX_KILLS: Final = 2  # of an item of `map`, before it counts as their cause
PACE_WEIGHT: Final = 0.2  # of the last bundle in the moving average of the pace
KILLED_WORKER: Final = "killed its worker"  # a key of `failures` in the result

Item = TypeVar("Item")
Result = TypeVar("Result")


class ClusterError(TemporaryError):
    """The scheduler or its workers are not available."""


class DaskRunner:
    """Runner on the workers of a dask scheduler; see `railui.execution.tasks.Runner`.

    Parameters
    ----------
    address : str
        Address of the scheduler, tcp://host:port.
    progress : Progress
        Receives a message for every refused worker.
    remedy : str
        What to do where the scheduler or all workers are lost.

    Raises
    ------
    ClusterError
        If the scheduler does not respond, is lost, or has no worker with the same environment as this process.
    """

    def __init__(self, address: str, progress: Progress = SILENT, remedy: str = RESUMES) -> None:
        self.address = address
        self.remedy = remedy
        self._progress = progress
        try:
            self._client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False, name="railui")
        except (OSError, ValueError) as error:
            what = f"no scheduler answers at {address} ({error})"
            raise ClusterError(f"{what}: start one with `dask scheduler`") from None
        self._pace = INITIAL_PACE
        self._cases: dict[int, tuple[Case, Any]] = {}
        self._case_keys: dict[str, int] = {}  # dask key of every submitted case
        self._is_accepted: dict[str, bool] = {}  # by address of the worker
        self._await_workers()

    @property
    def workers(self) -> int:
        """Number of accepted workers."""
        return max(1, len(self.accepted_workers()))

    def close(self) -> None:
        """Disconnect from the scheduler."""
        self._client.close(timeout=2)

    def run(self, tasks: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Run all tasks; run a bundle that killed its worker again vehicle by vehicle, and suspects in isolation."""
        self._await_workers()
        parts = split_tasks(tasks, BUNDLE_SECONDS, self.workers, self._pace)
        BundleRun(self, deliver).run(bundle_tasks(parts, self._pace, self.workers))

    def map(
        self, function: Callable[[Item], Result], items: Sequence[Item], lost: Result | None = None
    ) -> Iterator[tuple[int, Result]]:
        """Apply a function to items; yield the number of an item and its result as they arrive.

        Parameters
        ----------
        lost
            Result in place of that of an item that kills one worker after another; None: ClusterError.

        Raises
        ------
        ClusterError
            If the scheduler is lost or no worker is left.
        """
        self._await_workers()
        completed: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()
        pending: dict[Future[Any], tuple[int, int]] = {}  # number of the item, workers that it killed

        def submit(number: int, killed: int = 0) -> None:
            workers = self._workers_for_tasks()
            arguments = (run_checked, environment_identity(), pack_call(function, items[number]))
            future = self._client.submit(*arguments, workers=workers, pure=False, retries=1)
            pending[future] = number, killed
            future.add_done_callback(completed.put)

        def submit_again() -> None:
            for future, task in list(pending.items()):
                future.cancel()
                del pending[future]
                submit(*task)

        for number in range(len(items)):
            submit(number)
        try:
            while pending:
                future = self._next(completed, submit_again)
                if future is None or future not in pending:
                    continue
                number, killed = pending.pop(future)
                try:
                    packed: bytes | MismatchedWorker = future.result(timeout=CONNECT_TIMEOUT)
                except KilledWorker as error:
                    if killed < MAX_KILLS:
                        submit(number, killed + 1)
                    elif lost is None:
                        raise ClusterError(f"{error.task} killed its workers at {self.address}") from None
                    else:
                        yield number, lost
                except (OSError, TimeoutError, CancelledError) as error:
                    raise self.lost_scheduler(error) from None
                else:
                    if isinstance(packed, MismatchedWorker):
                        self.refuse(packed.address)
                        submit(number, killed)
                    else:
                        yield number, loads(packed)
        finally:
            for future in pending:
                future.cancel()

    def _next(self, completed: queue.SimpleQueue[Future[Any]], submit_again: Callable[[], None]) -> Future[Any] | None:
        """Return a completed future; None after a while without one, in which scheduler and workers are checked.

        submit_again: submits what is pending once more, so that a new worker may get it where others are refused.
        """
        try:
            return completed.get(timeout=POLL_INTERVAL)
        except queue.Empty:
            if not self.is_connected():
                raise self.lost_scheduler() from None
            before = set(self.accepted_workers())
            self.update_workers()
            self._await_workers()
            if self.has_refused_workers and not before.issuperset(self.accepted_workers()):
                submit_again()
            return None

    # workers

    def _await_workers(self) -> None:
        deadline = time.monotonic() + WORKER_TIMEOUT
        while not self.accepted_workers():
            self.update_workers()
            if self.accepted_workers():
                return
            if time.monotonic() > deadline:
                refused = f", {len(self._is_accepted)} were refused" if self._is_accepted else ""
                what = f"no worker at {self.address} in {WORKER_TIMEOUT:g} s{refused}"
                raise ClusterError(f"{what}: start some with `dask worker {self.address} --nthreads 1 --nworkers N`")
            time.sleep(WORKER_POLL_INTERVAL)

    def update_workers(self) -> bool:
        """Query the environments of new workers; return True if one of them is accepted."""
        workers = self._query(lambda: self._client.scheduler_info(n_workers=-1))["workers"]
        self._is_accepted = {address: accepted for address, accepted in self._is_accepted.items() if address in workers}
        new = [address for address in workers if address not in self._is_accepted]
        if not new:
            return False
        identities = self._query(lambda: self._client.run(worker_identity, workers=new, on_error="return"))
        for address, identity in identities.items():
            if isinstance(identity, OSError):  # the worker has left in the meantime
                continue
            differences = identity_differences(identity)
            self._is_accepted[address] = not differences
            threads = workers[address]["nthreads"]
            if differences:
                self._progress.message(f"worker {address} refused: {differences}")
            elif threads > 1:
                self._progress.message(f"worker {address} has {threads} threads: start it with --nthreads 1")
        return any(self._is_accepted.get(address) for address in identities)

    def accepted_workers(self) -> list[str]:
        """Return the addresses of the workers with the same environment as this process."""
        return [address for address, accepted in self._is_accepted.items() if accepted]

    @property
    def has_refused_workers(self) -> bool:
        """True if the scheduler has workers that must not get tasks."""
        return not all(self._is_accepted.values())

    def _workers_for_tasks(self) -> list[str] | None:
        """Return the workers that may get tasks, after a wait for one if all are refused; None: all may."""
        if not self.has_refused_workers:
            return None
        self._await_workers()  # an empty list would not restrict the workers
        return self.accepted_workers()

    def refuse(self, address: str) -> None:
        """Send no further tasks to a worker."""
        self._is_accepted[address] = False

    def is_connected(self) -> bool:
        """Return True while the scheduler responds."""
        return bool(self._client.status == "running")

    def _query(self, query: Callable[[], Any]) -> Any:
        try:
            return query()
        except (OSError, TimeoutError, ValueError) as error:
            raise self.lost_scheduler(error) from None

    def lost_scheduler(self, error: object = "") -> ClusterError:
        """Return the error for a scheduler that no longer responds."""
        cause = f" ({error})" if str(error) else ""
        return ClusterError(f"the scheduler at {self.address} is lost{cause}: {self.remedy}")

    # submission

    def submit(self, bundle: TaskBundle) -> Future[Any]:
        """Submit a bundle to any accepted worker."""
        cases = [self._case_future(task.case) for task in bundle.tasks]
        parts = [(task.rows, task.keys) for task in bundle.tasks]
        workers = self._workers_for_tasks()
        identity = environment_identity()
        return self._client.submit(run_bundle, identity, parts, *cases, workers=workers, pure=False, retries=1)

    def _case_future(self, case: Case) -> Any:
        """Return a case as the result of a dask task, which dask repeats on another worker if its worker is lost."""
        if id(case) not in self._cases:
            # without input tables, which every worker computes itself
            excitation = Excitation(case.excitation.source, case.excitation.speed)
            packed = PackedCase.of(replace(case, excitation=excitation))
            future = self._client.submit(PackedCase, packed.data, pure=False)
            self._cases[id(case)] = (case, future)
            self._case_keys[str(future.key)] = id(case)
        return self._cases[id(case)][1]

    def drop_case(self, key: str) -> bool:
        """Forget a case that dask blames for the loss of a worker, so that it is submitted again.

        Returns False if the dask key is not that of a case, or if the case was submitted too often.
        """
        case_id = self._case_keys.get(key)
        if case_id is None or list(self._case_keys.values()).count(case_id) > MAX_CASE_SUBMISSIONS:
            return False
        if case_id in self._cases and str(self._cases[case_id][1].key) == key:
            del self._cases[case_id]
        return True

    def update_pace(self, bundle: TaskBundle, seconds: float) -> None:
        """Update the average pace by the duration of a bundle."""
        self._pace = (1 - PACE_WEIGHT) * self._pace + PACE_WEIGHT * seconds / bundle.samples


class BundleRun:
    """One run of bundles on a cluster: the pending ones, and the suspects, which run in isolation at the end."""

    def __init__(self, runner: DaskRunner, deliver: Callable[[TaskResult], None]) -> None:
        self.runner = runner
        self.deliver = deliver
        self.completed: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()
        self.pending: dict[Future[Any], TaskBundle] = {}
        self.suspects: list[TaskBundle] = []

    def run(self, bundles: Iterable[TaskBundle]) -> None:
        """Submit all bundles and wait for their results; then run the suspects one after the other."""
        try:
            self._submit(bundles)
            self._wait()
            while self.suspects:
                self._submit([replace(self.suspects.pop(), is_isolated=True)])
                self._wait()
        finally:
            for future in self.pending:
                future.cancel()

    def _submit(self, bundles: Iterable[TaskBundle]) -> None:
        for bundle in bundles:
            future = self.runner.submit(bundle)
            self.pending[future] = bundle
            future.add_done_callback(self.completed.put)

    def _wait(self) -> None:
        no_worker_since: float | None = None
        while self.pending:
            try:
                future = self.completed.get(timeout=POLL_INTERVAL)
            except queue.Empty:
                no_worker_since = self._check_workers(no_worker_since)
                continue
            if future in self.pending:
                self._receive(future, self.pending.pop(future))

    def _check_workers(self, no_worker_since: float | None) -> float | None:
        """Check scheduler and workers; return the time since when there is no worker [s], None if there is one."""
        if not self.runner.is_connected():
            raise self.runner.lost_scheduler()
        if self.runner.update_workers() and self.runner.has_refused_workers:
            self._resubmit()
        if self.runner.accepted_workers():
            return None
        since = no_worker_since or time.monotonic()
        if time.monotonic() - since > WORKER_TIMEOUT:
            raise ClusterError(f"all workers at {self.runner.address} are gone: {self.runner.remedy}")
        return since

    def _resubmit(self) -> None:
        """Submit the pending bundles again, so that a new worker may get them too."""
        bundles = list(self.pending.values())
        for future in self.pending:
            future.cancel()
        self.pending.clear()
        self._submit(bundles)

    def _receive(self, future: Future[Any], bundle: TaskBundle) -> None:
        if future.status == "cancelled":
            raise self.runner.lost_scheduler()
        try:
            results: BundleResults | MismatchedWorker | FailedBundle = future.result(timeout=CONNECT_TIMEOUT)
        except KilledWorker as error:
            if self.runner.drop_case(str(error.task)):
                self._submit([bundle])
            else:
                self._isolate(bundle, KILLED_WORKER)
        except (OSError, TimeoutError, CancelledError) as error:
            if not (isinstance(error, TimeoutError) and self.runner.is_connected()):
                raise self.runner.lost_scheduler(error) from None
            future.cancel()  # the worker that held the result was lost before it was fetched
            self._submit([bundle])
        else:
            self._handle(bundle, results)

    def _handle(self, bundle: TaskBundle, results: BundleResults | MismatchedWorker | FailedBundle) -> None:
        if isinstance(results, MismatchedWorker):
            self.runner.refuse(results.address)
            self._submit([bundle])
        elif isinstance(results, FailedBundle):
            self._repeat(bundle, results.reason)
        else:
            self.runner.update_pace(bundle, sum(seconds for _, seconds in results))
            for task, (responses, seconds) in zip(bundle.tasks, results, strict=True):
                self.deliver(TaskResult(task, responses, seconds))

    def _repeat(self, bundle: TaskBundle, reason: str) -> None:
        """Run a bundle once more that failed by no fault of its designs; EvaluationError if it was the second time."""
        if bundle.is_repeated:
            raise EvaluationError(f"{reason}, twice on {self.runner.address}: {self.runner.remedy}")
        self._submit([replace(bundle, is_repeated=True)])

    def _isolate(self, bundle: TaskBundle, reason: str) -> None:
        """Handle a bundle that killed its worker: split it, then isolate the vehicle, then mark it as failed."""
        if bundle.is_isolated:
            task = bundle.tasks[0]
            self.deliver(TaskResult(task, Responses.failed(len(task), task.keys, reason), 0.0))
        elif bundle.vehicles > 1:
            self._submit(bundle.split())
        else:
            self.suspects.append(bundle)
