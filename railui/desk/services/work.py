"""Work beside the screen: the newest question answered by a thread, long studies that can be paused and stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from textual.message import Message
from textual.widget import Widget

from railui.desk.messages import Failed
from railui.progress import Stopped

Job = Callable[[], Message]


class Latest:
    """One thread that answers the newest question; those that came in between are skipped."""

    def __init__(self, owner: Widget, name: str) -> None:
        self.owner, self.name = owner, name
        self.lock = threading.Lock()
        self.waiting: Job | None = None
        self.busy = False

    def ask(self, job: Job, unless_waiting: bool = False) -> None:
        """Asks for the message that a job makes; it is posted to the owner. `unless_waiting`: newer ones come first."""
        with self.lock:
            if unless_waiting and self.waiting is not None:
                return
            self.waiting = job
            if self.busy:
                return
            self.busy = True
        self.owner.run_worker(self._run, name=self.name, thread=True, exit_on_error=False)

    def _run(self) -> None:
        while True:
            with self.lock:
                job, self.waiting = self.waiting, None
                if job is None:
                    self.busy = False
                    return
            self.owner.post_message(answered(job, self.name))


class Study:
    """A long study in a thread: it looks in at `checkpoint` now and then, where it is paused or stopped."""

    def __init__(self, owner: Widget, name: str, job: Callable[[Study], Message]) -> None:
        self.owner, self.name, self.job = owner, name, job
        self.stopping = threading.Event()
        self.going = threading.Event()
        self.going.set()
        self.began = time.monotonic()
        self.rested = 0.0
        owner.run_worker(self._run, name=name, thread=True, exit_on_error=False)

    def checkpoint(self, _: object = None) -> None:
        """Waits while the study is paused; raises Stopped where it is to end."""
        if not self.going.is_set():
            since = time.monotonic()
            while not self.going.wait(0.05) and not self.stopping.is_set():
                pass
            self.rested += time.monotonic() - since
        if self.stopping.is_set():
            raise Stopped

    @property
    def paused(self) -> bool:
        """Does it rest?"""
        return not self.going.is_set()

    @property
    def seconds(self) -> float:
        """How long it has worked."""
        return time.monotonic() - self.began - self.rested

    def pause(self) -> None:
        """Rests at the next look-in, or goes on."""
        if self.going.is_set():
            self.going.clear()
        else:
            self.going.set()

    def stop(self) -> None:
        """Ends at the next look-in."""
        self.stopping.set()
        self.going.set()

    def _run(self) -> None:
        self.owner.post_message(answered(lambda: self.job(self), self.name))


def answered(job: Job, name: str) -> Message:
    """The message of a job, or what went wrong with it."""
    from railui.desk.log import keep_trace

    try:
        return job()
    except Stopped:
        return Failed(name, "stopped", stopped=True)
    except (ValueError, RuntimeError, OSError, ArithmeticError) as error:
        return Failed(name, str(error))
    except Exception as error:  # a fault of our own: said, kept in the log, and the desk goes on
        return Failed(name, f"{type(error).__name__}: {error} (the whole trace is in {keep_trace(error)})")
