"""Watch of a link during a recording: silence, and bytes that contain no intact frame."""

from __future__ import annotations

from railui.capture.protocol.link import LinkStatistics
from railui.capture.protocol.load import BITS_PER_BYTE
from railui.capture.protocol.wire import MAX_ENCODED_BYTES

MAX_SILENCE = 5.0  # s without a byte; conventional: a logger sends a status every second
MAX_UNDECODED_BYTES = 2 * MAX_ENCODED_BYTES  # derived: an intact link completes at least one frame in so many bytes
MAX_UNDECODED_SECONDS = 10.0  # s with bytes and without an intact frame; derived: two hellos are due
MAX_FIRST_SECONDS = 3.0  # s of line capacity before the first frame; trial


class LinkWatch:
    """Watch of the time and of the bytes since the last intact frame.

    Parameters
    ----------
    port
        Name of the port.
    baud
        Baud rate [bit/s].
    """

    def __init__(self, port: str, baud: int) -> None:
        self.port = port
        self.baud = baud
        self._frames = 0
        self._frame_time: float | None = None

    def check(self, raw_bytes: int, link: LinkStatistics, silence: float, now: float) -> str | None:
        """Return the likely cause where no bytes or no intact frames arrive, None otherwise.

        Parameters
        ----------
        raw_bytes
            Bytes so far.
        link
            Statistics of the link.
        silence
            Time since the last byte, or since the port was opened [s].
        now
            Monotonic time [s].
        """
        is_silent = silence > MAX_SILENCE
        if self._frame_time is None or link.frames != self._frames or not link.undecoded or is_silent:
            self._frames = link.frames
            self._frame_time = now
        if is_silent:
            start = "no byte has come" if not raw_bytes else "the link is silent: no byte has come"
            return f"{start} in {MAX_SILENCE:g} s: is the logger on, and is {self.port} its port?"
        if not link.frames:
            is_undecoded = raw_bytes > min(MAX_UNDECODED_BYTES, MAX_FIRST_SECONDS * self._capacity)
            cause = f"bytes arrive without a valid frame: is the logger set to {self.baud} baud?"
        else:
            limit = max(MAX_UNDECODED_SECONDS, MAX_UNDECODED_BYTES / self._capacity)
            is_undecoded = link.undecoded > MAX_UNDECODED_BYTES or now - self._frame_time > limit
            cause = "the link has become unreadable: bytes arrive without a valid frame, check the cable and the logger"
        return cause if is_undecoded else None

    @property
    def _capacity(self) -> float:
        """Capacity of the line [bytes/s]."""
        return self.baud / BITS_PER_BYTE
