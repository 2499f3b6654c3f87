"""What is wrong in a file, where, and what to write instead: all of it at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path

Place = tuple[int, int]
NOWHERE: Place = (0, 0)
MANY = 16  # more names than one reads in a line


@dataclass(frozen=True, order=True)
class Problem:
    """One finding: file, line and column (1-based, 0 where there is none), dotted key, what, remedy.

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
        """The keys of `railui check --json`."""
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
    """Everything that is wrong, one line each; `problems` holds the records."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda p: (p.file, p.line, p.column)))
        super().__init__("\n".join(map(str, self.problems)))

    def __reduce__(self) -> tuple[type[FileProblems], tuple[tuple[Problem, ...]]]:
        return FileProblems, (self.problems,)


def one_problem(file: str | Path, message: str, remedy: str, key: str = "", *, place: Place = NOWHERE) -> FileProblems:
    """What to raise where one thing is wrong with a file: what, what to write instead, at which dotted key and place.

    >>> print(one_problem("a.yaml", "is empty", "write `key: value` lines"))
    a.yaml: is empty, write `key: value` lines
    """
    return FileProblems([Problem(str(file), *place, key, message, remedy)])


def unread(file: str | Path, error: OSError) -> FileProblems:
    """What to raise where the system does not give a file away.

    >>> print(unread("a.yaml", FileNotFoundError(2, "No such file or directory")))
    a.yaml: cannot be read (No such file or directory), give the path of a file
    """
    remedy = "let yourself read it" if isinstance(error, PermissionError) else "give the path of a file"
    return one_problem(file, f"cannot be read ({error.strerror})", remedy)


class LaterError(RuntimeError):
    """Something outside stands in the way and may work later: a port, a scheduler, a directory in use."""


class Findings:
    """Gathers the problems of one file; knows where each dotted path stands."""

    def __init__(
        self, file: str, marks: Mapping[str, Place] | None = None, keys: Mapping[str, Place] | None = None
    ) -> None:
        self.file, self.marks, self.keys = file, marks or {}, keys or {}
        self.problems: list[Problem] = []

    def place(self, path: str, key: bool = False) -> Place:
        """Where the value (or the key) stands; of the nearest group around it where it is absent."""
        places = self.keys if key else self.marks
        while path and path not in places:
            path = path.rpartition(".")[0]
        return places.get(path, self.marks.get(path, (1, 1) if self.marks else NOWHERE))

    def add(self, path: str, message: str, remedy: str = "", *, key: bool = False, place: Place | None = None) -> None:
        """An error at a path."""
        line, column = self.place(path, key) if place is None else place
        self.problems.append(Problem(self.file, line, column, path, message, remedy))

    def warn(self, path: str, message: str, remedy: str = "") -> None:
        """A warning at a path."""
        self.add(path, message, remedy)
        self.problems[-1] = replace(self.problems[-1], severity="warning")

    def errors(self) -> list[Problem]:
        """The problems without the warnings."""
        return [p for p in self.problems if p.severity == "error"]

    def warnings(self) -> tuple[Problem, ...]:
        """The warnings alone."""
        return tuple(p for p in self.problems if p.severity == "warning")

    def stop(self) -> None:
        """Raises FileProblems where there is an error."""
        if self.errors():
            raise FileProblems(self.errors())


def nearest(name: str, known: Iterable[str]) -> str:
    """The remedy for an unknown name: the nearest known one, or all of them where none is near.

    >>> nearest("mas", ["mass", "yaw_inertia"])
    "did you mean 'mass'?"
    >>> nearest("15", ["conicity"])  # {conicity: 0,15}
    "is it behind a decimal comma? write a point: '0.15', not '0,15'"
    """
    if name[:1].isdigit():
        return f"is it behind a decimal comma? write a point: '0.{name}', not '0,{name}'"
    names = list(known)
    same = [known_name for known_name in names if known_name.lower() == name.lower()]
    close = same or get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]!r}?"
    if len(names) > MANY:
        return f"the nearest is {get_close_matches(name, names, n=1, cutoff=0.0)[0]!r}"
    return f"known are {', '.join(names)}" if names else "leave it out"
