"""Transcripts in Markdown: the `console` and `python` blocks of a page, run in a copy of the bundled files.

In a `console` block a line that begins with `$ ` is typed, what follows is what it prints; a line `...` stands for
any lines. Numbers may differ by 2 %, seconds and the widths of tables altogether. A block below `<!-- slow -->` takes
more than some seconds; one below `<!-- not run: WHY -->` needs what a test has not.

    python -m tests.docs.transcript README.md docs/first_hour.md     run, and write down what is printed now
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^(?P<indent> *)```(?P<language>console|python)\n(?P<body>.*?)^(?P=indent)```$", re.M | re.S)
REMARK = re.compile(r"<!-- (slow|not run: [^>]+) -->\s*\Z")
NUMBER = re.compile(r"[-+]?(?:\d+\.\d+|\d+)(?:e[-+]?\d+)?")
SECONDS = re.compile(r"\d+(?:\.\d+)? s\b")
RULE = re.compile("[━─]+")
ELIDED = "..."
CLOSE = 0.02
PATIENCE = 280.0  # s


@dataclass
class Command:
    """One line that is typed, and the lines that it prints."""

    line: str
    printed: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Block:
    """One block of a page: where its text stands, and whether a test runs it."""

    language: str
    body: str
    start: int
    indent: str
    remark: str

    @property
    def slow(self) -> bool:
        return self.remark == "slow"

    @property
    def runs(self) -> bool:
        return not self.remark.startswith("not run")

    def commands(self) -> list[Command]:
        """The lines of a console block with what they print."""
        found: list[Command] = []
        for line in self.body.splitlines():
            bare = line.removeprefix(self.indent)
            if bare.startswith("$ "):
                found.append(Command(bare[2:]))
            elif found and found[-1].line.endswith("\\"):
                found[-1].line += "\n" + bare
            elif found:
                found[-1].printed.append(bare.rstrip())
        return found


def blocks(text: str) -> list[Block]:
    """The blocks of a page in their order."""
    found = []
    for match in FENCE.finditer(text):
        remark = REMARK.search(text[: match.start()])
        place = match.start("body")
        found.append(Block(match["language"], match["body"], place, match["indent"], remark[1] if remark else ""))
    return found


def bundled(home: Path) -> Path:
    """A directory that holds what a checkout holds for a reader: designs and the like."""
    shutil.copytree(ROOT / "designs", home / "designs")
    return home


def run(line: str, home: Path) -> tuple[list[str], int]:
    """What a line prints on stdout and stderr, as a terminal would mix them, and its exit code."""
    tools = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    plain = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "FORCE_COLOR", "CLICOLOR_FORCE")}
    done = subprocess.run(
        ["bash", "-c", line], cwd=home, env={**plain, "PATH": tools, "LC_ALL": "C.UTF-8"}, timeout=PATIENCE,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    return [part.rstrip() for part in done.stdout.splitlines()], done.returncode


def agree(told: list[str], printed: list[str]) -> bool:
    """Are the lines the same, but for elided ones, the last digits and the seconds?

    >>> agree(["a 1.00", "...", "c"], ["a 1.001", "b", "b", "c"]), agree(["a 1.00"], ["a 1.1"])
    (True, False)
    """
    if ELIDED in told:
        i = told.index(ELIDED)
        head, rest = told[:i], told[i + 1 :]
        if not agree(head, printed[:i]):
            return False
        return any(agree(rest, printed[j:]) for j in range(i, len(printed) + 1))
    return all(a is not None and b is not None and _alike(a, b) for a, b in zip_longest(told, printed))


def _alike(told: str, printed: str) -> bool:
    told, printed = (RULE.sub("-", SECONDS.sub("T s", line)) for line in (told, printed))
    words = [re.sub(r"\s+", " ", NUMBER.sub("#", line)).strip() for line in (told, printed)]
    pairs = zip(NUMBER.findall(told), NUMBER.findall(printed), strict=False)
    return words[0] == words[1] and all(_near(float(a), float(b), a) for a, b in pairs)


def _near(a: float, b: float, told: str) -> bool:
    last = 10.0 ** -len(told.partition("e")[0].partition(".")[2]) if "." in told else 0.0
    return abs(a - b) <= max(CLOSE * abs(a), 2 * last)


def refresh(page: Path, home: Path) -> None:
    """Runs a page and writes down what its commands print."""
    text = page.read_text()
    found = blocks(text)
    done: dict[int, str] = {}
    for block in found:
        if block.language != "console" or not block.runs:
            continue
        lines: list[str] = []
        for command in block.commands():
            printed, _ = run(command.line, home)
            lines += [f"$ {command.line}", *_elided(command.printed, printed)]
        done[block.start] = "".join(f"{block.indent}{line}".rstrip() + "\n" for line in lines)
    for block in reversed(found):
        if block.start in done:
            text = text[: block.start] + done[block.start] + text[block.start + len(block.body) :]
    page.write_text(text)


def _elided(told: list[str], printed: list[str]) -> list[str]:
    """What is printed, cut where the page cuts it: as many lines before and after the cut."""
    if ELIDED not in told or agree(told, printed):
        return printed if ELIDED not in told else told
    i = told.index(ELIDED)
    last = len(told) - i - 1
    return [*printed[:i], ELIDED, *(printed[-last:] if last else [])]


if __name__ == "__main__":
    import tempfile

    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as scratch:
            refresh(Path(name), bundled(Path(scratch)))
        print(f"wrote {name}")
