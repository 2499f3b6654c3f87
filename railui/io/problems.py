"""Problems of input files with position and remedy, reported all at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

Position = tuple[int, int]
NO_POSITION: Position = (0, 0)
MAX_LISTED_NAMES = 16  # names in one line of a message


@dataclass(frozen=True, order=True)
class Problem:
    """Problem of a file: line and column (from 1, or 0 for none), dotted key, message, remedy.

    >>> print(Problem("a.yaml", 3, 5, "vehicle.frame.mas", "unknown key", "did you mean 'mass'?"))
    a.yaml:3:5: vehicle.frame.mas: unknown key, did you mean 'mass'?
    """

    file: str
    line: int
    column: int
    key: str
    message: str
    remedy: str
    severity: str = "error"

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        parts = [place, "warning" if self.severity == "warning" else "", self.key]
        return ": ".join([p for p in parts if p] + [", ".join(t for t in (self.message, self.remedy) if t)])

    def as_dict(self) -> dict[str, str | int]:
        """Return the keys of `railui check --json`."""
        return {
            "file": self.file,
            "line": self.line,
            "column": self.column,
            "key": self.key,
            "message": self.message,
            "remedy": self.remedy,
            "severity": self.severity,
        }


class FileProblems(ValueError):
    """All problems of input files, one per line of the message; `problems` contains the records."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda p: (p.file, p.line, p.column)))
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[FileProblems], tuple[tuple[Problem, ...]]]:
        return FileProblems, (self.problems,)


def file_problem(
    file: str | Path, message: str, remedy: str, key: str = "", *, position: Position = NO_POSITION
) -> FileProblems:
    """Return the exception for a single problem of a file.

    >>> print(file_problem("a.yaml", "is empty", "write `key: value` lines"))
    a.yaml: is empty, write `key: value` lines
    """
    return FileProblems([Problem(str(file), *position, key, message, remedy)])


def unreadable_file(file: str | Path, error: OSError) -> FileProblems:
    """Return the exception for a file that the system cannot read.

    >>> print(unreadable_file("a.yaml", FileNotFoundError(2, "No such file or directory")))
    a.yaml: cannot be read (No such file or directory), give the path of a file
    """
    remedy = "change its permissions" if isinstance(error, PermissionError) else "give the path of a file"
    return file_problem(file, f"cannot be read ({error.strerror})", remedy)


def refuse_stream(path: str | Path) -> None:
    """Raise FileProblems for a pipe, a device or a socket: reading one may wait or go on for ever."""
    file = Path(path)
    if file.is_fifo() or file.is_socket() or file.is_char_device() or file.is_block_device():
        kind = "a pipe" if file.is_fifo() else "a socket" if file.is_socket() else "a device"
        raise file_problem(path, f"is {kind}, not a file", "write its contents to a file, and name that")


def refuse_overwriting(out: str | Path, inputs: Iterable[str | Path]) -> None:
    """Raise FileProblems if a file to write is one of those that are read, under whatever spelling or link."""
    if any(_is_same_file(Path(out), Path(file)) for file in inputs):
        raise file_problem(out, "is read, and would be overwritten", "name another file to write")


def _is_same_file(out: Path, file: Path) -> bool:
    try:
        return out.is_file() and out.samefile(file)
    except (OSError, ValueError):  # the name is no path of a file
        return False


class TemporaryError(RuntimeError):
    """External condition that may pass: a port, a scheduler or a directory in use."""


class Findings:
    """Collector of the problems of one file, with the position of each dotted path."""

    def __init__(
        self, file: str, marks: Mapping[str, Position] | None = None, keys: Mapping[str, Position] | None = None
    ) -> None:
        self.file, self.positions, self.key_positions = file, marks or {}, keys or {}
        self.problems: list[Problem] = []

    def position(self, path: str, key: bool = False) -> Position:
        """Return the position of a value (or key); of the nearest enclosing group if it is absent."""
        places = self.key_positions if key else self.positions
        while path and path not in places:
            path = path.rpartition(".")[0]
        return places.get(path, self.positions.get(path, (1, 1) if self.positions else NO_POSITION))

    def add(
        self, path: str, message: str, remedy: str = "", *, key: bool = False, position: Position | None = None
    ) -> None:
        """Add an error at a path."""
        line, column = self.position(path, key) if position is None else position
        self.problems.append(Problem(self.file, line, column, path, message, remedy))

    def warn(self, path: str, message: str, remedy: str = "", *, position: Position | None = None) -> None:
        """Add a warning at a path."""
        self.add(path, message, remedy, position=position)
        self.problems[-1] = replace(self.problems[-1], severity="warning")

    def errors(self) -> list[Problem]:
        """Return the problems that are not warnings."""
        return [p for p in self.problems if p.severity == "error"]

    def warnings(self) -> tuple[Problem, ...]:
        """Return the warnings."""
        return tuple(p for p in self.problems if p.severity == "warning")

    def raise_errors(self) -> None:
        """Raise FileProblems if there is an error."""
        if self.errors():
            raise FileProblems(self.errors())


def join_names(names: Sequence[str]) -> str:
    """Return names for one line of a message, the first 16 and the number of the others.

    >>> join_names(["a", "b"]), join_names(list("abcdefghijklmnopqrs"))[-13:]
    ('a, b', ', p, 3 others')
    """
    others = len(names) - MAX_LISTED_NAMES
    return ", ".join([*names[:MAX_LISTED_NAMES], *([f"{others} others"] if others > 0 else [])])


def _half_of(name: str, known: Sequence[str], nearest: str) -> str:
    """Return the known name for half of a length, also of a misspelt one by its nearest name; empty if there is none.

    >>> _half_of("a.gauge", ["a.half_gauge"], ""), _half_of("diameter", ["rolling_radius"], "")
    ('a.half_gauge', 'rolling_radius')
    """
    group, dot, key = name.lower().rpartition(".")
    if key.startswith("half"):
        return ""
    if f"{group}{dot}half_{key}" in known:
        return f"{group}{dot}half_{key}"
    if key in ("diameter", "wheel_diameter", "rolling_diameter", "roller_diameter"):
        radius = "roller_radius" if key.startswith("roller") else "rolling_radius"
        return next((n for n in known if n == f"{group}{dot}{radius}"), "")
    return nearest if nearest.rpartition(".")[2].startswith("half_") else ""


def suggest_name(name: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the nearest known one, or all of them if none is near.

    >>> suggest_name("mas", ["mass", "yaw_inertia"])
    "did you mean 'mass'?"
    >>> suggest_name("wheelbase", ["half_wheelbase", "half_gauge"])
    "did you mean 'half_wheelbase'? give half of it"
    >>> suggest_name("15", ["conicity"])  # {conicity: 0,15}
    "is it behind a decimal comma? write a point: '0.15', not '0,15'"
    """
    if name[:1].isdigit():
        return f"is it behind a decimal comma? write a point: '0.{name}', not '0,{name}'"
    names = list(known)
    same = [known_name for known_name in names if known_name.lower() == name.lower()]
    close = same or get_close_matches(name, names, n=1, cutoff=0.6)
    if half := _half_of(name, names, close[0] if close else ""):
        return f"did you mean {half!r}? give half of it"
    if close:
        return f"did you mean {close[0]!r}?"
    if len(names) > MAX_LISTED_NAMES:
        return f"the nearest is {get_close_matches(name, names, n=1, cutoff=0.0)[0]!r}"
    return f"known are {', '.join(names)}" if names else "leave it out"
