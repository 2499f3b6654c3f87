"""Run the `console` and `python` blocks of Markdown pages in a copy of the bundled files.

In a `console` block a line that begins with `$ ` is a command, the lines below it are its output; a line `...` matches
any lines. Numbers may differ by 2 %; seconds and the widths of tables are ignored. `<!-- within N % -->` above a
block sets another tolerance, for numbers that depend on rounding, as in a search. `<!-- slow -->` marks a block that
takes real time, `<!-- not run: WHY -->` a block that a test cannot run.

    python -m tests.docs.transcript README.md docs/first_hour.md     run the pages and write their present output
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
ELLIPSIS = "..."
RELATIVE_TOLERANCE = 0.02
TIMEOUT = 280.0  # s


@dataclass
class Command:
    """A command line and its output."""

    line: str
    output: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Block:
    """A code block of a page with the position of its text and the remark above it."""

    language: str
    body: str
    start: int
    indent: str
    remark: str

    @property
    def is_slow(self) -> bool:
        """True if the block takes real time."""
        return self.remark == "slow"

    @property
    def is_run(self) -> bool:
        """True if a test runs the block."""
        return not self.remark.startswith("not run")

    @property
    def tolerance(self) -> float:
        """Relative difference that the numbers of the block may have."""
        return int(self.remark.split()[1]) / 100 if self.remark.startswith("within") else RELATIVE_TOLERANCE

    def commands(self) -> list[Command]:
        """Return the commands of a console block with their output."""
        commands: list[Command] = []
        for line in self.body.splitlines():
            text = line.removeprefix(self.indent)
            if text.startswith("$ "):
                commands.append(Command(text[2:]))
            elif commands and commands[-1].line.endswith("\\"):
                commands[-1].line += "\n" + text
            elif commands:
                commands[-1].output.append(text.rstrip())
        return commands


def parse_blocks(text: str) -> list[Block]:
    """Return the blocks of a page in their order."""
    blocks = []
    for match in FENCE.finditer(text):
        remark = REMARK.search(text[: match.start()])
        start = match.start("body")
        blocks.append(Block(match["language"], match["body"], start, match["indent"], remark[1] if remark else ""))
    return blocks


def copy_bundled_files(home: Path) -> Path:
    """Copy the bundled designs into a directory and return it."""
    shutil.copytree(ROOT / "designs", home / "designs")
    return home


def run_command(line: str, home: Path) -> tuple[list[str], int]:
    """Run a command line; return its mixed stdout and stderr, and its exit code."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {
        k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "FORCE_COLOR", "CLICOLOR_FORCE")
    }
    done = subprocess.run(
        ["bash", "-c", line],
        cwd=home,
        env={**environment, "PATH": path, "LC_ALL": "C.UTF-8"},
        timeout=TIMEOUT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return [line.rstrip() for line in done.stdout.splitlines()], done.returncode


@dataclass(frozen=True)
class Outcome:
    """The result of a command: its output, its exit code, the files that it wrote and those that it removed."""

    output: list[str]
    code: int
    written: dict[str, bytes]
    removed: set[str]

    def repeat(self, home: Path) -> None:
        """Apply the changes of the command to the files of a directory."""
        for name in self.removed:
            (home / name).unlink()
        for name, content in self.written.items():
            (home / name).parent.mkdir(parents=True, exist_ok=True)
            (home / name).write_bytes(content)


class Shell:
    """Run every command only once per state of its directory: pages share the loop and the search."""

    def __init__(self) -> None:
        self.outcomes: dict[tuple[str, str], Outcome] = {}

    def run(self, line: str, home: Path) -> tuple[list[str], int]:
        """Return the output and the exit code of a command line; the directory changes as by the command."""
        before = file_digests(home)
        state = hashlib.sha256(repr(sorted(before.items())).encode()).hexdigest()
        known = self.outcomes.get((line, state))
        if known is not None:
            known.repeat(home)
            return known.output, known.code
        output, code = run_command(line, home)
        after = file_digests(home)
        written = {name: (home / name).read_bytes() for name in after if after[name] != before.get(name)}
        self.outcomes[line, state] = Outcome(output, code, written, set(before) - set(after))
        return output, code


def file_digests(home: Path) -> dict[str, str]:
    """Return the files below a directory with a digest of their content."""
    files = sorted(path for path in home.rglob("*") if path.is_file())
    return {str(path.relative_to(home)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def outputs_agree(expected: list[str], output: list[str], tolerance: float = RELATIVE_TOLERANCE) -> bool:
    """Return whether two outputs agree, apart from omitted lines, last digits and seconds.

    >>> outputs_agree(["a 1.00", "...", "c"], ["a 1.001", "b", "b", "c"]), outputs_agree(["a 1.00"], ["a 1.1"])
    (True, False)
    """
    if ELLIPSIS in expected:
        i = expected.index(ELLIPSIS)
        head, tail = expected[:i], expected[i + 1 :]
        if not outputs_agree(head, output[:i], tolerance):
            return False
        return any(outputs_agree(tail, output[j:], tolerance) for j in range(i, len(output) + 1))
    pairs = zip_longest(expected, output)
    return all(a is not None and b is not None and _lines_agree(a, b, tolerance) for a, b in pairs)


def _lines_agree(expected: str, printed: str, tolerance: float) -> bool:
    pairs = zip(_numbers(expected), _numbers(printed), strict=False)
    return _masked(expected) == _masked(printed) and all(_numbers_agree(a, b, tolerance) for a, b in pairs)


def _numbers(line: str) -> list[str]:
    return NUMBER.findall(SECONDS.sub("T s", line))


def _masked(line: str) -> str:
    """Return a line with masked numbers, and rules and spaces of one width."""
    return re.sub(r"\s+", " ", NUMBER.sub("#", RULE.sub("-", SECONDS.sub("T s", line)))).strip()


def _numbers_agree(expected: str, printed: str, tolerance: float) -> bool:
    last_digit = 10.0 ** -len(expected.partition("e")[0].partition(".")[2]) if "." in expected else 0.0
    a, b = float(expected), float(printed)
    return abs(a - b) <= max(tolerance * abs(a), 2 * last_digit)


def update_page(page: Path, home: Path, shell: Shell) -> None:
    """Run a page and write the present output of its commands."""
    text = page.read_text()
    blocks = parse_blocks(text)
    updated: dict[int, str] = {}
    for block in blocks:
        if block.language != "console" or not block.is_run:
            continue
        lines: list[str] = []
        for command in block.commands():
            output, _ = shell.run(command.line, home)
            lines += [f"$ {command.line}", *updated_output(command.output, output, block.tolerance)]
        updated[block.start] = "".join(f"{block.indent}{line}".rstrip() + "\n" for line in lines)
    for block in reversed(blocks):
        if block.start in updated:
            text = text[: block.start] + updated[block.start] + text[block.start + len(block.body) :]
    page.write_text(text)


def updated_output(expected: list[str], output: list[str], tolerance: float) -> list[str]:
    """Return the output with the omissions of the page; a page with omissions that agrees is kept."""
    if ELLIPSIS not in expected:
        return output
    if outputs_agree(expected, output, tolerance):
        return expected
    lines: list[str] = []
    remaining = output
    for line in expected:
        if line == ELLIPSIS:
            lines.append(line)
            continue
        matches = [i for i, other in enumerate(remaining) if _masked(other) == _masked(line)]
        if not matches:
            return output
        lines.append(remaining[matches[0]])
        remaining = remaining[matches[0] + 1 :]
    return lines


if __name__ == "__main__":
    import tempfile

    shell = Shell()
    for name in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as scratch:
            update_page(Path(name), copy_bundled_files(Path(scratch)), shell)
        print(f"wrote {name}")
