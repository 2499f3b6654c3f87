"""Work on many machines: a dask scheduler and its workers, one thread each, of the same railui and SIMD level."""

from __future__ import annotations

import pickle
import queue
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, replace
from typing import Any, Final

from distributed import Client, Future, KilledWorker

from railui.execution.dask_worker import Parts, Refused, differences, identity_of_worker, run_bundle
from railui.execution.tasks import PACE, Task, TaskResult, identity, split_tasks
from railui.io.problems import LaterError
from railui.optimisation.cases import Case
from railui.optimisation.responses import Responses
from railui.track.excitation import Excitation

SECONDS: Final = 1.0  # of a piece of work: long beside a scheduler's millisecond, short beside a lost worker
CONNECT: Final = 10.0  # s for the scheduler to answer
PATIENCE: Final = 60.0  # s without any worker
TICK: Final = 1.0  # s between two looks at who is there
RENEWALS: Final = 10  # times that a case is sent anew
KILLED: Final = "killed its worker"


class ClusterError(LaterError):
    """The scheduler or its workers cannot be had, now."""


@dataclass(frozen=True, eq=False)
class TaskBundle:
    """Pieces of work that travel together; `alone`: one vehicle, beside nothing else on the whole cluster."""

    works: list[Task]
    alone: bool = False

    @property
    def samples(self) -> int:
        """Samples of all rides together."""
        return sum(work.samples for work in self.works)

    def one_by_one(self) -> list[TaskBundle]:
        """Every vehicle by itself."""
        return [TaskBundle([work.part(slice(i, i + 1))]) for work in self.works for i in range(len(work))]


class DaskRunner:
    """The workers of a dask scheduler; see `railui.execution.tasks.Runner`.

    Raises ClusterError where the scheduler does not answer, is lost, or has no worker that would compute the same.
    """

    def __init__(self, address: str, say: Callable[[str], None] = lambda _: None) -> None:
        self.address, self._say = address, say
        try:
            self._client = Client(address, timeout=CONNECT, set_as_default=False, name="railui")
        except (OSError, ValueError) as error:
            raise ClusterError(
                f"no scheduler answers at {address} ({error}): start one with `dask scheduler`"
            ) from None
        self._pace, self._cases = PACE, dict[int, tuple[Case, Any]]()
        self._sent: dict[str, int] = {}  # keys of tasks that were cases
        self._known: dict[str, bool] = {}  # workers by address: do they compute the same?
        self._await_workers()

    @property
    def workers(self) -> int:
        """Workers that compute the same."""
        return max(1, len(self.good()))

    def close(self) -> None:
        """Takes leave of the scheduler."""
        self._client.close(timeout=2)

    def run(self, works: Sequence[Task], deliver: Callable[[TaskResult], None]) -> None:
        """Does all the work; what killed its worker is tried vehicle by vehicle, and then alone."""
        self._await_workers()
        _Run(self, deliver).all(
            _bundled(split_tasks(works, SECONDS, self.workers, self._pace), self._pace, self.workers)
        )

    # who is there

    def _await_workers(self) -> None:
        until = time.monotonic() + PATIENCE
        while not self.good():
            self.look()
            if self.good():
                return
            if time.monotonic() > until:
                refused = f", {len(self._known)} were refused" if self._known else ""
                what = f"no worker at {self.address} in {PATIENCE:g} s{refused}"
                raise ClusterError(f"{what}: start some with `dask worker {self.address} --nthreads 1 --nworkers N`")
            time.sleep(0.2)

    def look(self) -> bool:
        """Asks workers that are new what they compute with; is one of them good?"""
        told = self._told(lambda: self._client.scheduler_info(n_workers=-1))["workers"]
        self._known = {address: good for address, good in self._known.items() if address in told}
        new = [address for address in told if address not in self._known]
        if not new:
            return False
        answers = self._told(lambda: self._client.run(identity_of_worker, workers=new, on_error="return"))
        for address, theirs in answers.items():
            if isinstance(theirs, OSError):  # it has left meanwhile
                continue
            differing = differences(theirs)
            self._known[address] = not differing
            if differing:
                self._say(f"worker {address} refused: {differing}")
            elif told[address]["nthreads"] > 1:
                self._say(f"worker {address} has {told[address]['nthreads']} threads: start it with --nthreads 1")
        return any(self._known.get(address) for address in answers)

    def good(self) -> list[str]:
        """Addresses of the workers that compute the same."""
        return [address for address, good in self._known.items() if good]

    @property
    def choosy(self) -> bool:
        """Are there workers that must get nothing?"""
        return not all(self._known.values())

    def refuse(self, address: str) -> None:
        """Sends nothing more to a worker."""
        self._known[address] = False

    def alive(self) -> bool:
        """Does the scheduler answer?"""
        return bool(self._client.status == "running")

    def _told(self, question: Callable[[], Any]) -> Any:
        try:
            return question()
        except (OSError, TimeoutError, ValueError) as error:
            raise self.lost(error) from None

    def lost(self, error: object = "") -> ClusterError:
        """What to say when the scheduler is gone."""
        told = f" ({error})" if str(error) else ""
        kept = "what was evaluated is kept, the same command resumes"
        return ClusterError(f"the scheduler at {self.address} is lost{told}: {kept}")

    # what is sent

    def submit(self, bundle: TaskBundle) -> Future[Any]:
        """Sends a bundle to any worker that computes the same."""
        cases = [self._case(work.case) for work in bundle.works]
        parts = [(work.rows, work.keys) for work in bundle.works]
        only = self.good() if self.choosy else None
        return self._client.submit(run_bundle, identity(), parts, *cases, workers=only, pure=False, retries=1)

    def _case(self, case: Case) -> Any:
        """A case as the result of a task, which any worker can make again where the one that held it is lost."""
        if id(case) not in self._cases:
            # roads without their tables, which every worker makes for itself
            bare = pickle.dumps(replace(case, road=Excitation(case.road.laid, case.road.speed)), protocol=5)
            self._cases[id(case)] = (case, sent := self._client.submit(pickle.loads, bare, pure=False))
            self._sent[str(sent.key)] = id(case)
        return self._cases[id(case)][1]

    def renewed(self, key: str) -> bool:
        """Is a task that was blamed for a worker's death a case? Then it was only near: it is sent anew."""
        name = self._sent.get(key)
        if name is None or list(self._sent.values()).count(name) > RENEWALS:
            return False
        if name in self._cases and str(self._cases[name][1].key) == key:
            del self._cases[name]
        return True

    def learn(self, bundle: TaskBundle, seconds: float) -> None:
        """Corrects the pace by what a bundle took."""
        self._pace = 0.8 * self._pace + 0.2 * seconds / bundle.samples


class _Run:
    """One run: bundles on their way, and vehicles under suspicion, which go alone at the end."""

    def __init__(self, cluster: DaskRunner, deliver: Callable[[TaskResult], None]) -> None:
        self.cluster, self.deliver = cluster, deliver
        self.arrived: queue.SimpleQueue[Future[Any]] = queue.SimpleQueue()
        self.waiting: dict[Future[Any], TaskBundle] = {}
        self.suspects: list[TaskBundle] = []

    def all(self, bundles: Iterable[TaskBundle]) -> None:
        """Sends everything and waits for it; the suspects one after the other."""
        try:
            self._send(bundles)
            self._wait()
            while self.suspects:
                self._send([replace(self.suspects.pop(), alone=True)])
                self._wait()
        finally:
            for future in self.waiting:
                future.cancel()

    def _send(self, bundles: Iterable[TaskBundle]) -> None:
        for bundle in bundles:
            future = self.cluster.submit(bundle)
            self.waiting[future] = bundle
            future.add_done_callback(self.arrived.put)

    def _wait(self) -> None:
        empty_since: float | None = None
        while self.waiting:
            try:
                future = self.arrived.get(timeout=TICK)
            except queue.Empty:
                empty_since = self._tick(empty_since)
                continue
            if future in self.waiting:
                self._arrived(future, self.waiting.pop(future))

    def _tick(self, empty_since: float | None) -> float | None:
        """Nothing has arrived for a while: is anybody there? Since when [s] not."""
        if not self.cluster.alive():
            raise self.cluster.lost()
        if self.cluster.look() and self.cluster.choosy:
            self._again()
        if self.cluster.good():
            return None
        since = empty_since or time.monotonic()
        if time.monotonic() - since > PATIENCE:
            raise ClusterError(f"all workers at {self.cluster.address} are gone: the same command resumes")
        return since

    def _again(self) -> None:
        """A worker has joined: what was bound to others may go there too."""
        bundles = list(self.waiting.values())
        for future in self.waiting:
            future.cancel()
        self.waiting.clear()
        self._send(bundles)

    def _arrived(self, future: Future[Any], bundle: TaskBundle) -> None:
        if future.status == "cancelled":
            raise self.cluster.lost()
        try:
            parts: Parts | Refused | str = future.result(timeout=CONNECT)
        except KilledWorker as error:
            if self.cluster.renewed(str(error.task)):
                self._send([bundle])
            else:
                self._failed(bundle, KILLED)
        except (OSError, TimeoutError, CancelledError) as error:
            if not (isinstance(error, TimeoutError) and self.cluster.alive()):
                raise self.cluster.lost(error) from None
            future.cancel()  # who held the answer died before it was fetched
            self._send([bundle])
        else:
            self._answered(bundle, parts)

    def _answered(self, bundle: TaskBundle, parts: Parts | Refused | str) -> None:
        if isinstance(parts, Refused):
            self.cluster.refuse(parts.address)
            self._send([bundle])
        elif isinstance(parts, str):
            self._failed(bundle, parts)
        else:
            self.cluster.learn(bundle, sum(seconds for _, seconds in parts))
            for work, (found, seconds) in zip(bundle.works, parts, strict=True):
                self.deliver(TaskResult(work, found, seconds))

    def _failed(self, bundle: TaskBundle, reason: str) -> None:
        """Workers failed over a bundle: of many, each by itself; of one, alone; alone, it is to blame."""
        if bundle.alone:
            work = bundle.works[0]
            self.deliver(TaskResult(work, Responses.failed(len(work), work.keys, reason), 0.0))
        elif sum(map(len, bundle.works)) > 1:
            self._send(bundle.one_by_one())
        else:
            self.suspects.append(bundle)


def _bundled(works: Sequence[Task], pace: float, workers: int) -> list[TaskBundle]:
    """Pieces together until they make a second's work, or a worker's share."""
    share = min(SECONDS / pace, sum(work.samples for work in works) / (2 * workers))
    found: list[list[Task]] = []
    room = 0.0
    for work in works:
        if not found or work.samples > room:
            found.append([])
            room = share
        found[-1].append(work)
        room -= work.samples
    return [TaskBundle(some) for some in found]
