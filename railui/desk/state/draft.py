"""A design on the desk: what stands in its file, what has been changed, and the way back."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from railui.documents.saving import save_design
from railui.io.atomic import sha256_file
from railui.io.yaml_document import parse, read_text
from railui.io.yaml_edit import edit_file
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameters import PARAMETERS, SETTINGS, Parameter, settings_of

GROUPS = ("vehicle", "contact", "effects")  # the order of the form
DECADE = 10.0  # from this ratio of its ends on a range is walked in its logarithm


class Moved(ValueError):
    """The file is no longer what it was when it was read."""


@dataclass(frozen=True)
class Step:
    """One state of the design and what led to it; `gesture` joins the many steps of one slide."""

    design: Design
    what: str
    gesture: str = ""


@dataclass(frozen=True)
class Field:
    """One line of the form: a number, or a word out of `choices`. value None: not given, no default."""

    path: str
    symbol: str
    caption: str
    unit: str
    value: float | str | bool | None
    low: float
    high: float
    changed: bool
    source: str
    choices: tuple[str | bool, ...] = ()
    title: str = ""

    @property
    def name(self) -> str:
        """What its line is called."""
        return self.title or self.path.rpartition(".")[2].replace("_", " ")

    @property
    def group(self) -> str:
        """The group that it stands in."""
        return self.path.rpartition(".")[0]

    @property
    def log(self) -> bool:
        """Is its range walked in decades?"""
        return self.low > 0 and self.high >= DECADE * self.low

    def place(self, value: float) -> float:
        """Where a value lies in the range, 0 .. 1."""
        if not self.high > self.low:
            return 0.0
        if self.log:
            from math import log

            return min(1.0, max(0.0, log(max(value, self.low) / self.low) / log(self.high / self.low)))
        return min(1.0, max(0.0, (value - self.low) / (self.high - self.low)))

    def at(self, place: float) -> float:
        """The value at a place of the range, with three digits, as a slider gives it."""
        place = min(1.0, max(0.0, place))
        value = self.low * (self.high / self.low) ** place if self.log else self.low + place * (self.high - self.low)
        return float(f"{value:.3g}")


class Draft:
    """A design under work: changed value by value, undone, redone, compared, saved with its comments kept."""

    def __init__(self, design: Design) -> None:
        self.file, self.base = design, design
        self.steps, self.at = [Step(design, "as read")], 0
        self.marks = _marks(design.source)

    @classmethod
    def load(cls, path: str | Path) -> Draft:
        """A draft of a file; FileProblems with every fault."""
        return cls(load_design(Path(path)))

    @property
    def design(self) -> Design:
        """The design as it is now."""
        return self.steps[self.at].design

    @property
    def dirty(self) -> bool:
        """Would something be lost without saving?"""
        return self.design.resolved() != self.file.resolved() or self.design.adjustment != self.file.adjustment

    @property
    def name(self) -> str:
        """What it is called: its file, or its own name."""
        return self.file.source.name if self.file.source else self.design.name

    # changes

    def set(self, path: str, value: Any, gesture: str = "") -> None:
        """Another value at a path, SI or a quantity. FileProblems where it does not fit; nothing changes then."""
        self.push(self.design.with_values({path: value}), f"{path} = {value}", gesture)

    def push(self, design: Design, what: str, gesture: str = "") -> None:
        """Another design as the next step; steps of the same gesture are one."""
        if design == self.design:
            return
        last = self.steps[self.at]
        keep = self.at if gesture and last.gesture == gesture and self.at else self.at + 1
        self.steps[keep:] = [Step(design, what, gesture)]
        self.at = keep

    def with_effect(self, effect: PlacedEffect) -> None:
        """One effect more."""
        self.push(self.design.with_effects((*self.design.effects, effect)), f"{effect.kind} added")

    def without_effect(self, index: int) -> None:
        """One effect less."""
        kept = tuple(e for i, e in enumerate(self.design.effects) if i != index)
        self.push(self.design.with_effects(kept), "effect removed")

    def reset(self, path: str) -> None:
        """The value that it is compared with, back again."""
        found = _value(self.base, path)
        if found is not None:
            self.set(path, found)

    def undo(self) -> str | None:
        """One step back; says what was undone, None where there is nothing."""
        if not self.at:
            return None
        self.at -= 1
        return self.steps[self.at + 1].what

    def redo(self) -> str | None:
        """One step forward again."""
        if self.at + 1 >= len(self.steps):
            return None
        self.at += 1
        return self.steps[self.at].what

    # comparison

    def compare_with_this(self) -> None:
        """The design as it is becomes what later ones are compared with."""
        self.base = self.design

    def exchange(self) -> None:
        """The design and what it is compared with change places: A and B."""
        now = self.design
        self.push(self.base, "A and B exchanged")
        self.base = now

    # the file

    def changes(self) -> dict[str, Any]:
        """What differs from the file, by path, as an edit of it; effects whole where their structure differs."""
        mine, theirs = self.design, self.file
        found: dict[str, Any] = {p: v for p, v in mine.values.items() if v != theirs.values[p]}
        found |= {p: v for p, v in mine.settings.items() if theirs.settings.get(p) != v}
        if [_placed(e) for e in mine.effects] != [_placed(e) for e in theirs.effects]:
            if mine.profiles is not None:
                found["contact.profiles.use"] = mine.profiles.entry(None, [e.kind for e in mine.effects])["use"]
            return found | {"effects": [e.entry(given_only=True) for e in mine.effects]}
        for i, (a, b) in enumerate(zip(mine.effects, theirs.effects, strict=True)):
            found |= {f"effects.{i}.{k}": v for k, v in a.parameters.items() if b.parameters.get(k) != v}
        return found

    def save(self) -> Path:
        """Edits the file that was read: comments and layout stay. Moved where somebody else has changed it."""
        source = self.file.source
        if source is None or self.design.kind != self.file.kind or self.design.adjustment != self.file.adjustment:
            raise Moved("this design has no file yet: save it under a name")
        if not source.exists():
            raise Moved(f"{source.name} is no longer there: save under a name")
        if sha256_file(source) != self.file.sha256:
            raise Moved(f"{source.name} was changed by somebody else since it was read")
        edit_file(source, self.changes())
        return self._saved(source)

    def save_as(self, path: Path) -> Path:
        """Writes a new file: that which was read with its changes and comments, or a whole new one."""
        source = self.file.source
        same = source is not None and source.exists() and sha256_file(source) == self.file.sha256
        if same and source is not None and self.design.adjustment == self.file.adjustment:
            from railui.io.atomic import write_text
            from railui.io.yaml_edit import edit_values

            changes = self.changes()
            if self.design.profiles is not None and path.resolve().parent != source.resolve().parent:
                changes |= {f"contact.profiles.{k}": v for k, v in self.design.profiles.files(path.parent).items()}
            write_text(path, edit_values(read_text(source), changes, str(path)))
        else:
            save_design(replace(self.design, name=path.stem), path)
        return self._saved(path)

    def _saved(self, path: Path) -> Path:
        self.file = load_design(path)
        saved = replace(self.design, source=path, sha256=self.file.sha256, name=self.file.name)
        self.steps[self.at] = replace(self.steps[self.at], design=saved)
        self.marks = _marks(path)
        return path

    # the form

    def fields(self) -> Iterator[Field]:
        """Every parameter of the design, in the order of the form."""
        design = self.design
        paths = sorted(design.paths(), key=lambda path: GROUPS.index(path.split(".")[0]))
        yield from (self._number(design.parameter(path)) for path in paths)
        for path in settings_of(design.kind):
            yield self._number(PARAMETERS[path]) if path in PARAMETERS else self._word(path)

    def _number(self, p: Parameter) -> Field:
        value, file, base = (_value(d, p.path) for d in (self.design, self.file, self.base))
        return Field(
            p.path, p.symbol, p.caption, p.unit, value, *span(p, (value, base)),
            changed=value != file, source=self._source(p),
        )  # fmt: skip

    def _word(self, path: str) -> Field:
        value, file = self.design.setting(path), self.file.setting(path)
        title = path.rpartition(".")[2].replace("_", " ")
        place = self.marks.get(path)
        source = f"line {place}" if place else "default"
        return Field(path, "", title, "", value, 0.0, 1.0, value != file, source, SETTINGS[path])

    def _source(self, p: Parameter) -> str:
        adjusted = self.design.adjustment
        if adjusted is not None and p.path in adjusted.names:
            return f"adjusted to {adjusted.campaign}"
        if p.path in self.marks and self.file.source is not None:
            return f"{self.file.source.name}:{self.marks[p.path]}"
        if self.design.profiles is not None and p.path.startswith("contact."):
            return self._measured(p.path)
        return p.origin or ("by use" if p.optional else "")

    def _measured(self, path: str) -> str:
        """Where a number of the contact comes from that the file leaves to its profiles."""
        profiles, changed = self.design.profiles, _value(self.design, path) != _value(self.file, path)
        assert profiles is not None
        if not changed:
            return f"{profiles.wheel.stem} on {profiles.rail.stem}, sd {1e3 * profiles.given['sd']:g} mm"
        scaled = profiles.given["use"] == "table" and path.endswith(("conicity", "gravitational_stiffness"))
        return "typed: the table of the profiles is scaled to it" if scaled else "typed: the profiles give another"


def span(p: Parameter, values: tuple[float | str | bool | None, ...]) -> tuple[float, float]:
    """The range of a slider: that of real vehicles, wide enough for the values at hand."""
    low, high = p.usual
    numbers = [float(v) for v in values if isinstance(v, int | float)]
    if not abs(low) < 1e15:
        low = min([0.0, *numbers])
    if not abs(high) < 1e15:
        high = max([1.0, *(10 * abs(v) for v in numbers)])
    low, high = min([low, *numbers]), max([high, *numbers])
    return max(low, p.minimum), min(high, p.maximum) if p.maximum < 1e15 else high


def _placed(effect: PlacedEffect) -> tuple[Any, ...]:
    return effect.kind, effect.at, effect.wheelset


def _value(design: Design, path: str) -> float | None:
    try:
        return design.value(path)
    except ValueError:
        return None


def _marks(source: Path | None) -> dict[str, int]:
    """The line of the file in which each path stands."""
    if source is None:
        return {}
    findings = parse(read_text(source), str(source)).findings()
    return {path: place[0] for path, place in findings.marks.items()}
