"""Process of a long computation of the desk, started with the number of a socket.

It reads a function with its arguments from a socket, calls it, and writes its messages, its events and its result. The
interface and the computation then share no interpreter, and the interface goes first.
"""

from __future__ import annotations

import gc
import os
import pickle
import socket
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, BinaryIO, Final

from railui.desk.services.files import failure_text
from railui.desk.services.record_stream import RecordWriter
from railui.progress import Progress, Stopped

NICENESS: Final = 5
GC_THRESHOLD: Final = 50_000  # objects
PAUSE, RESUME, STOP = b"p", b"r", b"k"
MESSAGE, EVENT, RESULT, FAILURE = "message", "event", "result", "failure"


@dataclass(frozen=True)
class Failure:
    """Error that ended a computation, or its stop."""

    text: str
    is_stopped: bool = False


class StreamProgress(Progress):
    """Progress written to a stream; each message and each event is a checkpoint, where commands take effect."""

    def __init__(self, stream: BinaryIO) -> None:
        self.stream = stream
        self.is_stopped = False
        self.resumed = threading.Event()
        self.resumed.set()

    def command(self, command: bytes) -> None:
        """Pause or stop the computation at its next checkpoint, or resume it."""
        self.is_stopped |= command == STOP
        if command == PAUSE:
            self.resumed.clear()
        else:
            self.resumed.set()

    def checkpoint(self) -> None:
        """Wait while the computation is paused; raise Stopped if a stop was requested."""
        self.resumed.wait()
        if self.is_stopped:
            raise Stopped

    def message(self, text: str) -> None:
        """Write a line for the user."""
        self.checkpoint()
        self.write(MESSAGE, text)

    def event(self, event: object) -> None:
        """Write an intermediate result."""
        self.checkpoint()
        self.write(EVENT, event)

    def write(self, kind: str, content: Any) -> None:
        """Write a record."""
        RecordWriter(self.stream, protocol=pickle.HIGHEST_PROTOCOL).dump((kind, content))
        self.stream.flush()


def _obey(reader: BinaryIO, progress: StreamProgress) -> None:
    """Pass commands on; end this process if that of the interface has ended."""
    with suppress(OSError):
        while command := reader.read(1):
            progress.command(command)
    os._exit(0)


def main() -> None:
    """Compute what the socket asks for."""
    os.nice(NICENESS)
    gc.set_threshold(GC_THRESHOLD)
    connection = socket.socket(fileno=int(sys.argv[1]))
    reader, writer = connection.makefile("rb"), connection.makefile("wb")
    function, arguments = pickle.load(reader)
    progress = StreamProgress(writer)
    threading.Thread(target=_obey, args=(reader, progress), daemon=True).start()
    try:
        progress.write(RESULT, function(progress, *arguments))
    except Stopped:
        progress.write(FAILURE, Failure("stopped", is_stopped=True))
    except Exception as error:
        progress.write(FAILURE, Failure(failure_text(error)))
    os._exit(0)  # no thread of the computation is waited for
