"""Response time of the desk, measured from outside: `make desk-latency`.

The desk runs in a pseudo terminal. The time from writing a key to the first output that follows is measured while
nothing runs, and while a loop and a search run; and the time until the results of a changed design are drawn.
"""

from __future__ import annotations

import fcntl
import os
import pty
import select
import shutil
import statistics
import struct
import sys
import tempfile
import termios
import time
from contextlib import suppress
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
KEYS = 40
PAUSE = 0.15  # s between two keys
RESULT_SECONDS = 1.0  # s in which the results of a changed design are drawn
DOWN, UP, RIGHT, LEFT = b"\x1b[B", b"\x1b[A", b"\x1b[C", b"\x1b[D"
OPEN, ENTER = b"\x0f", b"\r"
PANEL = {"design": b"\x1bOQ", "campaign": b"\x1bOR", "optimise": b"\x1bOS"}


class Terminal:
    """Pseudo terminal with a desk."""

    def __init__(self, words: list[str], home: str) -> None:
        self.pid, self.master = pty.fork()
        if self.pid == 0:
            os.environ |= {"XDG_STATE_HOME": home, "TERM": "xterm-256color", "COLORTERM": "truecolor"}
            os.chdir(home)
            os.execv(sys.executable, [sys.executable, "-m", "railui", "desk", *words])
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", 40, 132, 0, 0))

    def read(self, seconds: float) -> bytes:
        """Read what is written within a time."""
        data, end = b"", time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if select.select([self.master], [], [], left)[0]:
                data += os.read(self.master, 1 << 16)
        return data

    def until(self, text: bytes, seconds: float = 240.0) -> None:
        """Read until a text is written."""
        data, end = b"", time.monotonic() + seconds
        while text not in data:
            if time.monotonic() > end:
                raise SystemExit(f"{text!r} was not written")
            data = data[-4096:] + self.read(0.05)

    def press(self, key: bytes) -> None:
        """Press a key."""
        os.write(self.master, key)

    def delay(self, key: bytes) -> float:
        """Return the time [s] from a key to the first output after it."""
        self.read(0.0)
        start = time.perf_counter()
        self.press(key)
        select.select([self.master], [], [], 10.0)
        return time.perf_counter() - start

    def close(self) -> None:
        """End the desk."""
        os.kill(self.pid, 15)
        end = time.monotonic() + 20.0
        with suppress(OSError):  # the terminal of a process that has ended
            while time.monotonic() < end and os.waitpid(self.pid, os.WNOHANG)[0] == 0:
                self.read(0.1)
        os.close(self.master)


def delays(terminal: Terminal, keys: tuple[bytes, bytes] = (DOWN, UP)) -> list[float]:
    """Return the delays of the cursor in the form."""
    found = []
    for k in range(KEYS):
        found.append(terminal.delay(keys[k % 2]))
        terminal.read(PAUSE)
    return found


def result_delays(terminal: Terminal) -> list[float]:
    """Return the times [s] from a slider key to the last output that follows it, the results."""
    found = []
    for key in (RIGHT, LEFT) * 5:
        terminal.read(0.5)
        start = last = time.perf_counter()
        terminal.press(key)
        while time.perf_counter() - start < RESULT_SECONDS:
            if select.select([terminal.master], [], [], 0.01)[0]:
                os.read(terminal.master, 1 << 16)
                last = time.perf_counter()
        found.append(last - start)
    return found


def row(name: str, found: list[float]) -> str:
    """Return a row of the table."""
    return f"{name:32} {1e3 * statistics.median(found):7.0f} {1e3 * max(found):7.0f}"


def start_loop_and_search(terminal: Terminal, campaign: Path) -> None:
    """Start a loop on a campaign and a search of the design in the form, and return to the form."""
    terminal.press(OPEN)
    terminal.read(1.0)
    terminal.press(str(campaign).encode())
    terminal.read(1.0)
    terminal.press(ENTER)
    terminal.read(6.0)
    terminal.press(b"s")
    terminal.until(b"calibration")
    terminal.press(PANEL["optimise"])
    terminal.read(1.0)
    terminal.press(b"s")
    terminal.read(0.2)  # the start of the search is measured too
    terminal.press(PANEL["design"])
    terminal.read(0.5)


def main() -> None:
    """Measure and print the table."""
    print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
    print(f"{'key to screen, ms':32} {'median':>7} {'worst':>7}")
    with tempfile.TemporaryDirectory() as home:
        campaign = shutil.copytree(REPOSITORY / "designs/campaigns/worn_axle_box", Path(home) / "campaign")
        design = shutil.copy(REPOSITORY / "designs/test_bogie.yaml", home)
        terminal = Terminal([str(design)], home)
        terminal.until(b"SATISFACTORY")
        terminal.read(3.0)
        print(row("idle", delays(terminal)), flush=True)
        print(row("idle, results of the bogie", result_delays(terminal)), flush=True)
        start_loop_and_search(terminal, campaign)
        print(row("a loop and a search run", delays(terminal)), flush=True)
        print(row("both run, results of the bogie", result_delays(terminal)), flush=True)
        terminal.press(PANEL["campaign"])
        terminal.read(1.0)
        print(row("both run, another view", delays(terminal, (b"v", b"v"))), flush=True)
        coach = shutil.copy(REPOSITORY / "designs/manchester_coach.yaml", home)
        terminal.close()
        (other := Path(home) / "other").mkdir()
        terminal = Terminal([str(coach)], str(other))
        terminal.until(b"SATISFACTORY")
        terminal.read(3.0)
        print(row("idle, results of the coach", result_delays(terminal)), flush=True)
        terminal.close()


if __name__ == "__main__":
    main()
