"""Draft of a design: undo and redo of design, base and run conditions, and saving that preserves comments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any, Final

from railui.desk.state.design_file import FileChanged, PreparedFile, differences, is_same_design, prepare_file
from railui.desk.state.form_rows import Field, number_field
from railui.desk.state.history import History
from railui.desk.state.run_conditions import RunConditions
from railui.io.atomic import sha256_file, write_text
from railui.io.number_format import format_quantity, typeset
from railui.io.yaml_document import parse_yaml, read_text
from railui.vehicle.design_reader import Adjustment, Design, load_design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameter import Parameter
from railui.vehicle.parameters import PARAMETERS, SETTINGS, setting_paths

GROUP_ORDER: Final = ("vehicle", "contact", "effects")  # of the form

__all__ = ["Draft", "FileChanged", "FormState"]


@dataclass(frozen=True)
class FormState:
    """Design in work, the base it is compared with, and the conditions of their runs."""

    design: Design
    base: Design
    conditions: RunConditions


class Draft:
    """Editable design with undo and redo.

    Attributes
    ----------
    file
        Design as its file was read or saved; None for a design that has no file yet.
    new_path
        Proposed file of a design that has none.
    """

    def __init__(
        self,
        design: Design,
        *,
        base: Design | None = None,
        conditions: RunConditions | None = None,
        new_path: Path | None = None,
    ) -> None:
        self.file = design if design.source is not None and new_path is None else None
        self.new_path = new_path or Path(f"{design.name}.yaml")
        self.states = History(FormState(design, base or design, conditions or RunConditions()))
        self.line_numbers = _line_numbers(self.path)

    @classmethod
    def load(cls, path: str | Path, conditions: RunConditions | None = None) -> Draft:
        """Load a design file; raise FileProblems with every error."""
        return cls(load_design(Path(path)), conditions=conditions)

    @property
    def path(self) -> Path | None:
        """File of the design, or None."""
        return self.file.source if self.file is not None else None

    @property
    def design(self) -> Design:
        """Current design."""
        return self.states.current.design

    @property
    def base(self) -> Design:
        """Design that the current one is compared with."""
        return self.states.current.base

    @property
    def conditions(self) -> RunConditions:
        """Conditions of the runs."""
        return self.states.current.conditions

    @property
    def is_modified(self) -> bool:
        """True if the design differs from its file, or has none."""
        return self.file is None or not is_same_design(self.design, self.file)

    @property
    def name(self) -> str:
        """Name of the file, or of the proposed file of a new design."""
        return (self.path or self.new_path).name

    # changes

    def set(self, path: str, value: Any, gesture: str = "") -> None:
        """Set a value (SI, or a quantity with unit) at a path; raise FileProblems if it is rejected."""
        self.push(self.design.with_values({path: value}), _name(path), gesture)

    def push(self, design: Design, description: str, gesture: str = "") -> None:
        """Add a design as the next revision; replace the last one if it has the same gesture."""
        if design != self.design:
            self.states.push(replace(self.states.current, design=design), description, gesture)

    def set_conditions(self, conditions: RunConditions, description: str, gesture: str = "") -> None:
        """Set track and speed."""
        if conditions != self.conditions:
            self.states.push(replace(self.states.current, conditions=conditions), description, gesture)

    def add_effect(self, effect: PlacedEffect) -> None:
        """Add an effect."""
        description = f"added effect, {effect.kind.replace('_', ' ')}"
        self.push(self.design.with_effects((*self.design.effects, effect)), description)

    def remove_effect(self, index: int) -> None:
        """Remove an effect."""
        effects = tuple(e for i, e in enumerate(self.design.effects) if i != index)
        description = f"removed effect, {self.design.effects[index].kind.replace('_', ' ')}"
        self.push(self.design.with_effects(effects), description)

    def reset(self, path: str) -> None:
        """Restore the value of the base."""
        value = _value(self.base, path)
        if value is not None:
            self.set(path, value)

    def undo(self) -> str | None:
        """Undo a change of design, base or run conditions; return its description, or None."""
        return self.states.undo()

    def redo(self) -> str | None:
        """Redo a change and return its description, or None."""
        return self.states.redo()

    # comparison

    def set_base(self, base: Design | None = None) -> None:
        """Make a design, by default the current one, the base."""
        base = base or self.design
        if base != self.base:
            self.states.push(replace(self.states.current, base=base), "base of the comparison")

    def swap_with_base(self) -> None:
        """Swap the current design and the base."""
        state = self.states.current
        if state.design != state.base:
            self.states.push(replace(state, design=state.base, base=state.design), "exchange of design and base")

    def take(self, design: Design, base: Design, description: str) -> None:
        """Replace the design and its base; the file and the run conditions stay."""
        if self.file is not None:
            design = replace(design, source=self.file.source, sha256=self.file.sha256)
        self.states.push(replace(self.states.current, design=design, base=base), description)

    # file

    def changes(self) -> dict[str, Any]:
        """Return the differences from the file by path; all effects if their kinds or locations differ."""
        return {} if self.file is None else differences(self.design, self.file)

    @property
    def is_changed_on_disk(self) -> bool:
        """True if the file has changed since it was read."""
        path = self.path
        return path is not None and path.exists() and self.file is not None and sha256_file(path) != self.file.sha256

    def prepare(self, path: Path | None = None) -> PreparedFile:
        """Prepare the text for a file, by default the design's own, with the reasons to ask before it is written.

        Raises
        ------
        FileChanged
            If there is no file, or it was deleted.
        FileProblems
            If the design cannot be written so that it reads back.
        OSError
            If a file cannot be read.
        """
        own = self.path
        if path is None and own is None:
            raise FileChanged("this design has no file yet: save it under a new name")
        if path is None and own is not None and not own.exists():
            raise FileChanged(f"{own.name} is no longer there: save the design under a new name")
        target = path or own
        assert target is not None
        is_own = own is not None and target.exists() and own.exists() and target.samefile(own)
        template = own if own is not None and not is_own and not self.is_changed_on_disk else target if is_own else None
        read_sha256 = self.file.sha256 if is_own and self.file is not None else None
        return prepare_file(self.design, target, template, read_sha256)

    def write(self, prepared: PreparedFile) -> Path:
        """Write a prepared text; raise FileChanged if the file has changed since it was prepared."""
        path = prepared.path
        disk_text = read_text(path) if path.exists() else None
        if disk_text != prepared.disk_text:
            raise FileChanged(f"{path.name} has just been changed by another program", self.prepare(path))
        write_text(path, prepared.text)
        self.file = prepared.design
        state = self.states.current
        saved = replace(state.design, source=path, sha256=self.file.sha256, name=self.file.name)
        self.states.replace(replace(state, design=saved))
        self.line_numbers = _line_numbers(path)
        return path

    def save(self) -> Path:
        """Edit the file, preserving comments and layout; raise FileChanged if that needs a confirmation."""
        return self._write_unless_asked(self.prepare())

    def save_as(self, path: Path) -> Path:
        """Write another file, with the comments of the file that was read; raise FileChanged if it exists."""
        return self._write_unless_asked(self.prepare(path))

    def _write_unless_asked(self, prepared: PreparedFile) -> Path:
        if prepared.reasons:
            raise FileChanged(f"{prepared.path.name} {', and '.join(prepared.reasons)}", prepared)
        return self.write(prepared)

    def read_again(self) -> None:
        """Read the file again; undo returns to the design before. Raise FileProblems with every error."""
        path = self.path
        assert path is not None
        self.file = load_design(path)
        self.line_numbers = _line_numbers(path)
        self.push(self.file, f"reading of {path.name}")

    # form

    def fields(self) -> Iterator[Field]:
        """Yield the fields of every parameter in the order of the form."""
        design = self.design
        paths = sorted(design.paths(), key=lambda path: GROUP_ORDER.index(path.split(".")[0]))
        yield from (self._number_field(design.parameter(path)) for path in paths)
        for path in setting_paths(design.kind):
            yield self._number_field(PARAMETERS[path]) if path in PARAMETERS else self._choice_field(path)

    @property
    def _reference(self) -> Design:
        """Design from which the form marks differences: the file, or the base of a design that has no file."""
        return self.base if self.file is None else self.file

    def _number_field(self, p: Parameter) -> Field:
        value, saved, base = (_value(d, p.path) for d in (self.design, self._reference, self.base))
        return number_field(p, value, saved if base is None else base, value != saved, self._source(p))

    def _choice_field(self, path: str) -> Field:
        value, saved = self.design.setting(path), self._reference.setting(path)
        title = path.rpartition(".")[2].replace("_", " ")
        line = self.line_numbers.get(path)
        source = f"line {line}" if line else "default"
        return Field(path, "", title, "", value, 0.0, 1.0, value != saved, source, SETTINGS[path])

    def _source(self, p: Parameter) -> str:
        calibration = self.design.adjustment
        if calibration is not None and p.path in calibration.names:
            if self.design.is_set_by_hand(p.path):
                return f"set by hand (estimate {_estimate_text(calibration, p)})"
            return f"calibrated on {calibration.campaign}"
        if p.path in self.line_numbers and self.path is not None:
            return f"{self.path.name}:{self.line_numbers[p.path]}"
        if self.design.profiles is not None and p.path.startswith("contact."):
            return self._profile_source(p.path)
        return p.origin or ("optional" if p.optional else "")

    def _profile_source(self, path: str) -> str:
        """Return the source of a contact parameter that is computed from the profiles."""
        profiles = self.design.profiles
        assert profiles is not None
        if _value(self.design, path) == _value(self._reference, path):
            sd = self.design.values["contact.profiles.sd"]
            return f"{profiles.wheel.stem} on {profiles.rail.stem}, sd {1e3 * sd:g} mm"
        is_scaled = profiles.use == "table" and path.endswith(("conicity", "gravitational_stiffness"))
        return "typed: scales the table of the profiles" if is_scaled else "typed: differs from the profiles"


def _estimate_text(calibration: Adjustment, p: Parameter) -> str:
    """Return the estimate of a parameter with its standard deviation."""
    i = calibration.names.index(p.path)
    sd = sqrt(max(calibration.covariance[i][i], 0.0))
    return typeset(f"{format_quantity(calibration.estimates[i], p.unit)} +/- {format_quantity(sd, p.unit, 2)}")


def _name(path: str) -> str:
    """Return the name of a parameter with its group.

    >>> _name("vehicle.primary.lateral_stiffness"), _name("effects.0.half_width")
    ('primary lateral stiffness', 'half width')
    """
    *groups, name = path.split(".")
    group = groups[-1] if groups and groups[-1] not in ("vehicle", "contact") and groups[0] != "effects" else ""
    return f"{group} {name}".replace("_", " ").strip()


def _value(design: Design, path: str) -> float | None:
    try:
        return design.value(path)
    except ValueError:
        return None


def _line_numbers(source: Path | None) -> dict[str, int]:
    """Return the line number of each path in a file; none if it cannot be read."""
    if source is None:
        return {}
    try:
        findings = parse_yaml(read_text(source), str(source)).findings()
    except (OSError, ValueError):
        return {}
    return {path: position[0] for path, position in findings.positions.items()}
