"""Long computations of the desk in a process of their own, seen from the interface."""

from __future__ import annotations

import os
import pickle
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final, Self

from railui.desk.messages import ProgressEvent, ProgressMessage
from railui.desk.services.child import EVENT, FAILURE, MESSAGE, PAUSE, RESUME, STOP
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.record_stream import RecordReader
from railui.progress import Stopped

CHILD_PROGRAM: Final = "from railui.desk.services.child import main; main()"
BUFFER_SIZE: Final = 1 << 16  # bytes, after which a reading thread lets the interface run


def run_in_child(job: BackgroundJob, function: Callable[..., Any], *arguments: object) -> Any:
    """Run `function(progress, *arguments)` in a process of its own and return its result.

    Its messages and events are posted to the owner of the job; pause, stop and the end of this process reach it.

    Raises
    ------
    Stopped
    RuntimeError
        With the text of the error, or if the process ended without a result.
    """
    with Child(job) as child:
        child.start(function, arguments)
        while True:
            kind, content = child.receive()
            if kind == MESSAGE:
                job.owner.post_message(ProgressMessage(job.name, content))
            elif kind == EVENT:
                job.owner.post_message(ProgressEvent(job.name, content))
            elif kind != FAILURE:
                return content
            elif content.is_stopped:
                raise Stopped
            else:
                raise RuntimeError(content.text)


class Child:
    """Process of a computation; it is killed if it does not stop in time."""

    def __init__(self, job: BackgroundJob) -> None:
        self.job = job
        self._killer: threading.Timer | None = None

    def __enter__(self) -> Self:
        self._socket, other = socket.socketpair()
        self._reader = self._socket.makefile("rb", BUFFER_SIZE)
        self._log = tempfile.TemporaryFile()
        paths = os.pathsep.join(path or os.getcwd() for path in sys.path)
        environment = os.environ | {"PYTHONPATH": paths}
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", CHILD_PROGRAM, str(other.fileno())], pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._log, env=environment,
                start_new_session=True,
            )  # fmt: skip
        return self

    def __exit__(self, *_: object) -> None:
        self.job.on_command = None
        if self._killer is not None:
            self._killer.cancel()
        self._process.kill()
        self._process.wait()
        self._reader.close()
        self._socket.close()
        self._log.close()

    def start(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> None:
        """Send the function with its arguments."""
        self._socket.sendall(pickle.dumps((function, arguments)))
        self.job.on_command = self._command
        self._command()  # one that was given before

    def _command(self) -> None:
        """Pass the state of the job on; kill the process if it goes on in spite of a stop."""
        command = STOP if self.job.is_stopping else PAUSE if self.job.is_paused else RESUME
        with suppress(OSError):  # it has ended
            self._socket.sendall(command)
        if self.job.is_stopping:
            if self._killer is not None:
                self._killer.cancel()
            self._killer = threading.Timer(self.job.stop_seconds, self._process.kill)
            self._killer.daemon = True
            self._killer.start()

    def receive(self) -> tuple[str, Any]:
        """Return the next record of the process."""
        try:
            kind, content = RecordReader(self._reader).load()
        except (EOFError, OSError, pickle.UnpicklingError) as error:
            if self.job.is_stopping:
                raise Stopped from None
            self._process.kill()
            code = self._process.wait()
            self._log.seek(0)
            last = self._log.read().decode(errors="replace").strip().rpartition("\n")[2]
            text = f"the process of the computation ended with code {code}: {last or error}"
            raise RuntimeError(text) from error
        return kind, content
