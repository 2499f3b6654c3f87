"""Background jobs: the newest request on one thread, long computations that can be paused and stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from textual.message import Message
from textual.timer import Timer
from textual.widget import Widget

from railui.desk.messages import JobFailed, ProgressEvent, ProgressMessage
from railui.desk.services.files import log_traceback
from railui.progress import Progress, Stopped

Job = Callable[[], Message]
PAUSE_POLL_INTERVAL = 0.05  # s
QUIET_SECONDS = 0.4  # s without a new request, after which a long computation starts


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
    """Long computation on a thread that is paused or stopped at its checkpoints."""

    def __init__(self, owner: Widget, name: str, function: Callable[[BackgroundJob], Message]) -> None:
        self.owner = owner
        self.name = name
        self.function = function
        self.stop_requested = threading.Event()
        self.resumed = threading.Event()
        self.resumed.set()
        self.start_time = time.monotonic()
        self.paused_seconds = 0.0
        self.is_finished = False
        owner.run_worker(self._run, name=name, thread=True, exit_on_error=False)

    def checkpoint(self, _: object = None) -> None:
        """Wait while the job is paused; raise Stopped if a stop was requested."""
        if not self.resumed.is_set():
            since = time.monotonic()
            while not self.resumed.wait(PAUSE_POLL_INTERVAL) and not self.stop_requested.is_set():
                pass
            self.paused_seconds += time.monotonic() - since
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
        return time.monotonic() - self.start_time - self.paused_seconds

    def toggle_pause(self) -> None:
        """Pause the job at its next checkpoint, or resume it."""
        if self.resumed.is_set():
            self.resumed.clear()
        else:
            self.resumed.set()

    def stop(self) -> None:
        """Stop the job at its next checkpoint."""
        self.stop_requested.set()
        self.resumed.set()

    def _run(self) -> None:
        message = run_job(lambda: self.function(self), self.name)
        self.is_finished = True
        self.owner.post_message(message)


class DeskProgress(Progress):
    """Progress of a background job as messages to its owner; each one is a checkpoint."""

    def __init__(self, job: BackgroundJob) -> None:
        self.job = job

    def message(self, text: str) -> None:
        """Post a line for the user."""
        self.job.checkpoint()
        self.job.owner.post_message(ProgressMessage(self.job.name, text))

    def event(self, event: object) -> None:
        """Post an intermediate result."""
        self.job.checkpoint()
        self.job.owner.post_message(ProgressEvent(self.job.name, event))


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
    """Return the message of a job, or a JobFailed message.

    Internal errors are logged with their traceback; the desk continues.
    """
    try:
        return job()
    except Stopped:
        return JobFailed(name, "stopped", is_stopped=True)
    except (ValueError, RuntimeError, OSError, ArithmeticError) as error:
        return JobFailed(name, str(error))
    except Exception as error:
        return JobFailed(name, f"{type(error).__name__}: {error} (traceback in {log_traceback(error)})")


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
