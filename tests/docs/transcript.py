"""Transcripts in Markdown: the `console` and `python` blocks of a page, run in a copy of the bundled files.

In a `console` block a line that begins with `$ ` is typed, what follows is what it prints; a line `...` stands for
any lines. Numbers may differ by 2 %, seconds and the widths of tables altogether. A block below `<!-- within N % -->`
has numbers that depend on rounding, as a search does; one below `<!-- slow -->` waits for real time; one below
`<!-- not run: WHY -->` needs what a test has not.

    python -m tests.docs.transcript README.md docs/first_hour.md     run, and write down what is printed now
"""

from __future__ import annotations

import hashlib
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
REMARK = re.compile(r"<!-- (slow|not run: [^>]+|within \d+ %) -->\s*\Z")
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

    @property
    def close(self) -> float:
        """Share by which its numbers may differ."""
        return int(self.remark.split()[1]) / 100 if self.remark.startswith("within") else CLOSE

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


@dataclass(frozen=True)
class Outcome:
    """The result of a command: its output, its exit code, the files that it wrote and those that it removed."""

    printed: list[str]
    code: int
    written: dict[str, bytes]
    removed: set[str]

    def repeat(self, home: Path) -> None:
        """Leave a directory as the command left its own."""
        for name in self.removed:
            (home / name).unlink()
        for name, content in self.written.items():
            (home / name).parent.mkdir(parents=True, exist_ok=True)
            (home / name).write_bytes(content)


class Shell:
    """Runs commands, and each only once per state of the directory: pages share the loop and the search."""

    def __init__(self) -> None:
        self.outcomes: dict[tuple[str, str], Outcome] = {}

    def run(self, line: str, home: Path) -> tuple[list[str], int]:
        """The output of a line and its exit code, as `run` gives them; the directory is left as the line leaves it."""
        before = digests(home)
        state = hashlib.sha256(repr(sorted(before.items())).encode()).hexdigest()
        known = self.outcomes.get((line, state))
        if known is not None:
            known.repeat(home)
            return known.printed, known.code
        printed, code = run(line, home)
        after = digests(home)
        written = {name: (home / name).read_bytes() for name in after if after[name] != before.get(name)}
        self.outcomes[line, state] = Outcome(printed, code, written, set(before) - set(after))
        return printed, code


def digests(home: Path) -> dict[str, str]:
    """The files below a directory with a digest of their content."""
    files = sorted(path for path in home.rglob("*") if path.is_file())
    return {str(path.relative_to(home)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def agree(told: list[str], printed: list[str], close: float = CLOSE) -> bool:
    """Are the lines the same, but for elided ones, the last digits and the seconds?

    >>> agree(["a 1.00", "...", "c"], ["a 1.001", "b", "b", "c"]), agree(["a 1.00"], ["a 1.1"])
    (True, False)
    """
    if ELIDED in told:
        i = told.index(ELIDED)
        head, rest = told[:i], told[i + 1 :]
        if not agree(head, printed[:i], close):
            return False
        return any(agree(rest, printed[j:], close) for j in range(i, len(printed) + 1))
    return all(a is not None and b is not None and _alike(a, b, close) for a, b in zip_longest(told, printed))


def _alike(told: str, printed: str, close: float) -> bool:
    pairs = zip(_numbers(told), _numbers(printed), strict=False)
    return _words(told) == _words(printed) and all(_near(float(a), float(b), a, close) for a, b in pairs)


def _numbers(line: str) -> list[str]:
    return NUMBER.findall(SECONDS.sub("T s", line))


def _words(line: str) -> str:
    """A line with its numbers masked, rules and spaces of any width."""
    return re.sub(r"\s+", " ", NUMBER.sub("#", RULE.sub("-", SECONDS.sub("T s", line)))).strip()


def _near(a: float, b: float, told: str, close: float) -> bool:
    last = 10.0 ** -len(told.partition("e")[0].partition(".")[2]) if "." in told else 0.0
    return abs(a - b) <= max(close * abs(a), 2 * last)


def refresh(page: Path, home: Path, shell: Shell) -> None:
    """Runs a page and writes down what its commands print."""
    text = page.read_text()
    found = blocks(text)
    done: dict[int, str] = {}
    for block in found:
        if block.language != "console" or not block.runs:
            continue
        lines: list[str] = []
        for command in block.commands():
            printed, _ = shell.run(command.line, home)
            lines += [f"$ {command.line}", *rewritten(command.printed, printed, block.close)]
        done[block.start] = "".join(f"{block.indent}{line}".rstrip() + "\n" for line in lines)
    for block in reversed(found):
        if block.start in done:
            text = text[: block.start] + done[block.start] + text[block.start + len(block.body) :]
    page.write_text(text)


def rewritten(told: list[str], printed: list[str], close: float) -> list[str]:
    """The printed lines, cut where the page cuts them; a page that cuts and agrees stays as it is."""
    if ELIDED not in told:
        return printed
    if agree(told, printed, close):
        return told
    found: list[str] = []
    rest = printed
    for line in told:
        if line == ELIDED:
            found.append(line)
            continue
        same = [i for i, other in enumerate(rest) if _words(other) == _words(line)]
        if not same:
            return printed
        found.append(rest[same[0]])
        rest = rest[same[0] + 1 :]
    return found


if __name__ == "__main__":
    import tempfile

    shell = Shell()
    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as scratch:
            refresh(Path(name), bundled(Path(scratch)), shell)
        print(f"wrote {name}")
