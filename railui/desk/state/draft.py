"""Draft of a design: revisions with undo and redo, comparison with a base, saving."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from railui.desk.state.form_rows import Field, slider_range
from railui.documents.saving import save_design
from railui.io.atomic import sha256_file, write_text
from railui.io.yaml_document import parse_yaml, read_text
from railui.io.yaml_edit import edit_file, edit_values
from railui.vehicle.contact_profiles import SHAPE_KIND, USE_PATH
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameter import Parameter
from railui.vehicle.parameters import PARAMETERS, SETTINGS, setting_paths

GROUP_ORDER = ("vehicle", "contact", "effects")  # of the form


class FileChanged(ValueError):
    """The design has no file, or the file has changed since it was read."""


@dataclass(frozen=True)
class Revision:
    """Revision of a design; revisions with the same `gesture` (one slider movement) are merged."""

    design: Design
    description: str
    gesture: str = ""


class Draft:
    """Editable design with undo, redo, a base for comparison, and saving that preserves comments."""

    def __init__(self, design: Design) -> None:
        self.file = design
        self.base = design
        self.revisions = [Revision(design, "as read")]
        self.index = 0
        self.line_numbers = _line_numbers(design.source)

    @classmethod
    def load(cls, path: str | Path) -> Draft:
        """Load a design file; raise FileProblems with every error."""
        return cls(load_design(Path(path)))

    @property
    def design(self) -> Design:
        """Current design."""
        return self.revisions[self.index].design

    @property
    def is_modified(self) -> bool:
        """True if the design differs from its file."""
        return self.design.content() != self.file.content() or self.design.adjustment != self.file.adjustment

    @property
    def name(self) -> str:
        """Name of the file, or of the design if it has no file."""
        return self.file.source.name if self.file.source else self.design.name

    # changes

    def set(self, path: str, value: Any, gesture: str = "") -> None:
        """Set a value (SI, or a quantity with unit) at a path; raise FileProblems if it is rejected."""
        self.push(self.design.with_values({path: value}), f"{path} = {value}", gesture)

    def push(self, design: Design, description: str, gesture: str = "") -> None:
        """Add a design as the next revision; replace the last one if it has the same gesture."""
        if design == self.design:
            return
        last = self.revisions[self.index]
        position = self.index if gesture and last.gesture == gesture and self.index else self.index + 1
        self.revisions[position:] = [Revision(design, description, gesture)]
        self.index = position

    def add_effect(self, effect: PlacedEffect) -> None:
        """Add an effect."""
        self.push(self.design.with_effects((*self.design.effects, effect)), f"add {effect.kind}")

    def remove_effect(self, index: int) -> None:
        """Remove an effect."""
        effects = tuple(e for i, e in enumerate(self.design.effects) if i != index)
        self.push(self.design.with_effects(effects), "remove effect")

    def reset(self, path: str) -> None:
        """Restore the value of the base."""
        value = _value(self.base, path)
        if value is not None:
            self.set(path, value)

    def undo(self) -> str | None:
        """Undo a revision and return its description, or None."""
        if not self.index:
            return None
        self.index -= 1
        return self.revisions[self.index + 1].description

    def redo(self) -> str | None:
        """Redo a revision and return its description, or None."""
        if self.index + 1 >= len(self.revisions):
            return None
        self.index += 1
        return self.revisions[self.index].description

    # comparison

    def set_base(self) -> None:
        """Make the current design the base."""
        self.base = self.design

    def swap_with_base(self) -> None:
        """Swap the current design and the base."""
        current = self.design
        self.push(self.base, "swap A and B")
        self.base = current

    # file

    def changes(self) -> dict[str, Any]:
        """Return the differences from the file by path; all effects if their kinds or locations differ."""
        current, saved = self.design, self.file
        follows = current.profiles.derived if current.profiles is not None else frozenset()
        edits: dict[str, Any] = {
            p: v for p, v in current.values.items() if v != saved.values.get(p) and p not in follows
        }
        edits |= {p: v for p, v in current.settings.items() if saved.settings.get(p) != v}
        if current.profiles is not None and saved.profiles is not None:
            use = current.profiles.present_use(e.kind for e in current.effects)
            edits |= {USE_PATH: use} if use != saved.profiles.use else {}
        listed, listed_before = _listed_effects(current), _listed_effects(saved)
        if [_location(e) for e in listed] != [_location(e) for e in listed_before]:
            return edits | {"effects": [e.entry(given_only=True) for e in current.effects]}
        for i, (a, b) in enumerate(zip(listed, listed_before, strict=True)):
            edits |= {f"effects.{i}.{k}": v for k, v in a.parameters.items() if b.parameters.get(k) != v}
        return edits

    def save(self) -> Path:
        """Edit the file that was read, preserving comments and layout; raise FileChanged if it has changed."""
        source = self.file.source
        if source is None or self.design.kind != self.file.kind or self.design.adjustment != self.file.adjustment:
            raise FileChanged("this design has no file yet: save it under a new name")
        if not source.exists():
            raise FileChanged(f"{source.name} is no longer there: save the design under a new name")
        if sha256_file(source) != self.file.sha256:
            raise FileChanged(f"{source.name} was changed by another program since it was read")
        edit_file(source, self.changes())
        return self._reload(source)

    def save_as(self, path: Path) -> Path:
        """Write a new file: the one that was read with its comments and the changes, or a complete new one."""
        source = self.file.source
        is_unchanged = source is not None and source.exists() and sha256_file(source) == self.file.sha256
        if is_unchanged and source is not None and self.design.adjustment == self.file.adjustment:
            changes = self.changes()
            if self.design.profiles is not None and path.resolve().parent != source.resolve().parent:
                changes |= {f"contact.profiles.{k}": v for k, v in self.design.profiles.files(path.parent).items()}
            write_text(path, edit_values(read_text(source), changes, str(path)))
        else:
            save_design(replace(self.design, name=path.stem), path)
        return self._reload(path)

    def _reload(self, path: Path) -> Path:
        self.file = load_design(path)
        saved = replace(self.design, source=path, sha256=self.file.sha256, name=self.file.name)
        self.revisions[self.index] = replace(self.revisions[self.index], design=saved)
        self.line_numbers = _line_numbers(path)
        return path

    # form

    def fields(self) -> Iterator[Field]:
        """Yield the fields of every parameter in the order of the form."""
        design = self.design
        paths = sorted(design.paths(), key=lambda path: GROUP_ORDER.index(path.split(".")[0]))
        yield from (self._number_field(design.parameter(path)) for path in paths)
        for path in setting_paths(design.kind):
            yield self._number_field(PARAMETERS[path]) if path in PARAMETERS else self._choice_field(path)

    def _number_field(self, p: Parameter) -> Field:
        value, file, base = (_value(d, p.path) for d in (self.design, self.file, self.base))
        low, high = slider_range(p, (value, base))
        is_changed = value != file
        return Field(p.path, p.symbol, p.caption, p.unit, value, low, high, is_changed, source=self._source(p))

    def _choice_field(self, path: str) -> Field:
        value, file = self.design.setting(path), self.file.setting(path)
        title = path.rpartition(".")[2].replace("_", " ")
        line = self.line_numbers.get(path)
        source = f"line {line}" if line else "default"
        return Field(path, "", title, "", value, 0.0, 1.0, value != file, source, SETTINGS[path])

    def _source(self, p: Parameter) -> str:
        calibration = self.design.adjustment
        if calibration is not None and p.path in calibration.names:
            return f"calibrated on {calibration.campaign}"
        if p.path in self.line_numbers and self.file.source is not None:
            return f"{self.file.source.name}:{self.line_numbers[p.path]}"
        if self.design.profiles is not None and p.path.startswith("contact."):
            return self._profile_source(p.path)
        return p.origin or ("optional" if p.optional else "")

    def _profile_source(self, path: str) -> str:
        """Return the source of a contact parameter that is computed from the profiles."""
        profiles = self.design.profiles
        assert profiles is not None
        if _value(self.design, path) == _value(self.file, path):
            sd = self.design.values["contact.profiles.sd"]
            return f"{profiles.wheel.stem} on {profiles.rail.stem}, sd {1e3 * sd:g} mm"
        is_scaled = profiles.use == "table" and path.endswith(("conicity", "gravitational_stiffness"))
        return "typed: scales the table of the profiles" if is_scaled else "typed: differs from the profiles"


def _listed_effects(design: Design) -> list[PlacedEffect]:
    """Return the effects without the tables that follow from the profiles, which are the last."""
    follows = design.profiles is not None and design.profiles.has_derived_table
    return [e for e in design.effects if not (follows and e.kind == SHAPE_KIND)]


def _location(effect: PlacedEffect) -> tuple[Any, ...]:
    return effect.kind, effect.at, effect.wheelset


def _value(design: Design, path: str) -> float | None:
    try:
        return design.value(path)
    except ValueError:
        return None


def _line_numbers(source: Path | None) -> dict[str, int]:
    """Return the line number of each path in a file."""
    if source is None:
        return {}
    findings = parse_yaml(read_text(source), str(source)).findings()
    return {path: position[0] for path, position in findings.positions.items()}
