"""Frames whose numbers ran back: late repetitions, or a logger that restarted with the boot it had before."""

from __future__ import annotations

from railui.capture.protocol.messages import Frame, Hello

MAX_FIRST_NUMBER = 1000  # of the frames, near 0
MAX_FIRST_TIME = 60_000_000  # us, near 0
FRAMES_NEAR_ZERO = 8  # in order and near 0 that show a restart; late repetitions are fewer
FRAMES_ELSEWHERE = 200


class RestartWatch:
    """Watch for a restart that only the numbers and times of the frames show."""

    def __init__(self) -> None:
        self._frames: list[Frame] = []

    def add(self, frame: Frame) -> list[Frame]:
        """Add a frame whose number ran back; return all frames since then if they show a restart, else nothing."""
        if self._frames and frame.number <= self._frames[-1].number:
            self._frames = []
        self._frames.append(frame)
        if len(self._frames) < (FRAMES_NEAR_ZERO if self._is_near_zero() else FRAMES_ELSEWHERE):
            return []
        frames, self._frames = self._frames, []
        return frames

    def clear(self) -> None:
        """Forget the frames: one with a higher number has come, so they were late."""
        if self._frames:
            self._frames = []

    def _is_near_zero(self) -> bool:
        """Return True if number and time of the first frames are near 0 together."""
        times = (frame.time for frame in self._frames if not isinstance(frame, Hello))
        return self._frames[0].number <= MAX_FIRST_NUMBER and next(times, MAX_FIRST_TIME) < MAX_FIRST_TIME
