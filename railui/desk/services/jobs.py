"""Background jobs: the newest request on one thread, long computations that can be paused and stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from textual.message import Message
from textual.timer import Timer
from textual.widget import Widget

from railui.desk.messages import JobFailed
from railui.desk.services.files import failure_text
from railui.progress import Progress, Stopped

Job = Callable[[], Message]
PAUSE_POLL_INTERVAL = 0.05  # s
QUIET_SECONDS = 0.4  # s without a new request, after which a long computation starts
STOP_SECONDS = 15.0  # s for a process to reach its next checkpoint


class LatestJobRunner:
    """Thread that runs the newest job of a widget; jobs submitted in between are skipped."""

    def __init__(self, owner: Widget, name: str) -> None:
        self.owner = owner
        self.name = name
        self.lock = threading.Lock()
        self.waiting: Job | None = None
        self.is_busy = False

    def submit(self, job: Job, unless_waiting: bool = False) -> None:
        """Submit a job; its message is posted to the owner.

        Parameters
        ----------
        job
            Function that returns the message.
        unless_waiting
            Discard this job if another one is waiting.
        """
        with self.lock:
            if unless_waiting and self.waiting is not None:
                return
            self.waiting = job
            if self.is_busy:
                return
            self.is_busy = True
        self.owner.run_worker(self._run, name=self.name, thread=True, exit_on_error=False)

    def _run(self) -> None:
        while True:
            with self.lock:
                job, self.waiting = self.waiting, None
                if job is None:
                    self.is_busy = False
                    return
            self.owner.post_message(run_job(job, self.name))


class BackgroundJob:
    """Long computation on a thread that is paused or stopped at its checkpoints.

    on_command: called after a pause, a resumption and a stop; stop_seconds: time [s] for a process to stop.
    """

    def __init__(self, owner: Widget, name: str, function: Callable[[BackgroundJob], Message]) -> None:
        self.owner = owner
        self.name = name
        self.function = function
        self.stop_requested = threading.Event()
        self.resumed = threading.Event()
        self.resumed.set()
        self.on_command: Callable[[], None] | None = None
        self.stop_seconds = STOP_SECONDS
        self._paused_since: float | None = None
        self.start_time = time.monotonic()
        self.paused_seconds = 0.0
        self.is_finished = False
        owner.run_worker(self._run, name=name, thread=True, exit_on_error=False)

    def checkpoint(self, _: object = None) -> None:
        """Wait while the job is paused; raise Stopped if a stop was requested."""
        while not self.resumed.wait(PAUSE_POLL_INTERVAL) and not self.stop_requested.is_set():
            pass
        if self.stop_requested.is_set():
            raise Stopped

    @property
    def is_paused(self) -> bool:
        """True if the job is paused."""
        return not self.resumed.is_set()

    @property
    def is_stopping(self) -> bool:
        """True if a stop was requested."""
        return self.stop_requested.is_set()

    @property
    def elapsed(self) -> float:
        """Computing time [s] so far, without pauses."""
        now = time.monotonic()
        paused = 0.0 if self._paused_since is None else now - self._paused_since
        return now - self.start_time - self.paused_seconds - paused

    def toggle_pause(self) -> None:
        """Pause the job at its next checkpoint, or resume it."""
        if self.resumed.is_set():
            self._paused_since = time.monotonic()
            self.resumed.clear()
        else:
            self._end_pause()
        self._call_on_command()

    def stop(self, seconds: float = STOP_SECONDS) -> None:
        """Stop the job at its next checkpoint; a process that does not reach one within `seconds` is killed."""
        self.stop_seconds = seconds
        self.stop_requested.set()
        self._end_pause()
        self._call_on_command()

    def _end_pause(self) -> None:
        if self._paused_since is not None:
            self.paused_seconds += time.monotonic() - self._paused_since
            self._paused_since = None
        self.resumed.set()

    def _call_on_command(self) -> None:
        if (on_command := self.on_command) is not None:
            on_command()

    def _run(self) -> None:
        message = run_job(lambda: self.function(self), self.name)
        self.is_finished = True
        self.owner.post_message(message)


class Checkpoints(Progress):
    """Progress that only pauses and stops a background job."""

    def __init__(self, job: BackgroundJob) -> None:
        self.job = job

    def message(self, text: str) -> None:
        """Pass a checkpoint."""
        self.job.checkpoint()

    def event(self, event: object) -> None:
        """Pass a checkpoint."""
        self.job.checkpoint()


def run_job(job: Job, name: str) -> Message:
    """Return the message of a job, or a JobFailed message."""
    try:
        return job()
    except Stopped:
        return JobFailed(name, "stopped", is_stopped=True)
    except Exception as error:
        return JobFailed(name, failure_text(error))


class NewestJob:
    """Long computation for the newest request: an older one is stopped, the new one starts after a quiet moment."""

    def __init__(self, owner: Widget, name: str, delay: float = QUIET_SECONDS) -> None:
        self.owner = owner
        self.name = name
        self.delay = delay
        self.job: BackgroundJob | None = None
        self.timer: Timer | None = None

    def request(self, function: Callable[[BackgroundJob], Message]) -> None:
        """Run a function soon instead of the one before."""
        self.cancel()
        self.timer = self.owner.set_timer(self.delay, lambda: self._start(function))

    @property
    def is_active(self) -> bool:
        """True if a function is running or waiting."""
        return self.timer is not None or (self.job is not None and not self.job.is_finished)

    def cancel(self) -> None:
        """Stop what is running or waiting."""
        if self.timer is not None:
            self.timer.stop()
            self.timer = None
        if self.job is not None:
            self.job.stop()
            self.job = None

    def _start(self, function: Callable[[BackgroundJob], Message]) -> None:
        self.timer = None
        self.job = BackgroundJob(self.owner, self.name, function)
