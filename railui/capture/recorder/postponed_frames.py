"""Frames that wait for the hello of their layout, within a bound of memory."""

from __future__ import annotations

from collections import deque

from railui.capture.protocol.messages import Frame, Samples

MAX_PENDING_BYTES = 1 << 20  # of frames that wait for their hello
FRAME_BYTES = 64  # of a frame without its data


class PostponedFrames:
    """Queue of frames; the oldest are dropped where the memory is full."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque()
        self.bytes = 0

    def add(self, frame: Frame) -> int:
        """Store a frame; return the number of frames that were dropped for it."""
        self._frames.append(frame)
        self.bytes += _memory_size(frame)
        dropped = 0
        while self.bytes > MAX_PENDING_BYTES:
            self.bytes -= _memory_size(self._frames.popleft())
            dropped += 1
        return dropped

    def take(self) -> list[Frame]:
        """Remove all frames and return them, in their order."""
        frames = list(self._frames)
        self._frames.clear()
        self.bytes = 0
        return frames


def _memory_size(frame: Frame) -> int:
    """Return the approximate memory [bytes] of a frame."""
    if not isinstance(frame, Samples):
        return FRAME_BYTES
    return FRAME_BYTES + len(frame.data) * (1 if isinstance(frame.data, bytes) else 8)
