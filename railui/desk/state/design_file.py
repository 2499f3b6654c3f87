"""File of a design: text that reads back as the design, and reasons to ask before it is written."""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from railui.documents.saving import design_text
from railui.io.atomic import sha256, sha256_file
from railui.io.number_format import format_quantity, typeset
from railui.io.problems import FileProblems, file_problem
from railui.io.yaml_document import read_text
from railui.io.yaml_edit import edit_values
from railui.vehicle.contact_profiles import SHAPE_KIND, USE_PATH
from railui.vehicle.design_reader import Design, parse_design
from railui.vehicle.division import path_in_list
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameters import setting_paths

MAX_EDITS: Final = 3  # rounds of editing a file until it reads back as the design
CHANGED: Final = "was changed by another program since it was read"
EXISTS: Final = "exists already"
REWRITTEN: Final = "cannot be edited in its layout: it is written anew, without its comments"


@dataclass(frozen=True)
class PreparedFile:
    """Text to write, checked to read back as the design.

    disk_text: text of the file now, None if there is no file; reasons: reasons to ask before it is written.
    """

    path: Path
    text: str
    design: Design
    disk_text: str | None
    reasons: tuple[str, ...] = ()

    def difference(self) -> list[str]:
        """Return the changed values, if the file is a design, and the lines of a unified diff of the texts."""
        return [*self._changed_values(), *text_difference(self.disk_text or "", self.text, "on disk", "to be written")]

    def _changed_values(self) -> list[str]:
        try:
            disk = read_back(self.disk_text or "", self.path)
        except FileProblems:
            return []
        changes = differences(self.design, disk)
        lines = [f"{path}: {_value_text(disk, path)} → {_value_text(self.design, path)}" for path in changes]
        return ["Values, on disk → to be written:", *lines, ""] if lines else []


class FileChanged(ValueError):
    """The design has no file, or writing it needs a confirmation: see `prepared`."""

    def __init__(self, message: str, prepared: PreparedFile | None = None) -> None:
        super().__init__(message)
        self.prepared = prepared


def is_same_design(a: Design, b: Design) -> bool:
    """True if two designs run alike and are of the same calibration."""
    return a.content() == b.content() and a.present_adjustment == b.present_adjustment


def prepare_file(design: Design, path: Path, template: Path | None, read_sha256: str | None) -> PreparedFile:
    """Prepare the text of a design for a file.

    Parameters
    ----------
    design
        Design that the file must read back as.
    path
        File to write.
    template
        File whose comments and layout are kept; None for a complete new text.
    read_sha256
        Hash of the file `path` when it was read; None if it was not read.

    Raises
    ------
    FileProblems
        If no text reads back as the design.
    OSError
        If a file cannot be read.
    """
    disk_text = read_text(path) if path.exists() else None
    reasons = []
    if disk_text is not None and read_sha256 is None:
        reasons.append(EXISTS)
    elif disk_text is not None and sha256_file(path) != read_sha256:
        reasons.append(CHANGED)
    edited = _edited(design, path, template) if template is not None and template.exists() else None
    if edited is None:
        if disk_text is not None and EXISTS not in reasons:
            reasons.append(REWRITTEN)
        edited = _complete(design, path)
    return PreparedFile(path, *edited, disk_text, tuple(reasons))


def _edited(design: Design, path: Path, template: Path) -> tuple[str, Design] | None:
    """Return the template with the numbers of the design, and the design read back; None if that is not possible."""
    try:
        text = read_text(template)
        if design.profiles is not None and path.resolve().parent != template.resolve().parent:
            files = design.profiles.files(path.resolve().parent)
            text = edit_values(text, {f"contact.profiles.{key}": file for key, file in files.items()}, str(path))
        saved = read_back(text, path)
        for _ in range(MAX_EDITS):
            if is_same_design(saved, design):
                return text, saved
            if saved.kind != design.kind or saved.adjustment != design.present_adjustment:
                return None
            text = edit_values(text, differences(design, saved), str(path))
            saved = read_back(text, path)
    except FileProblems:
        return None
    return (text, saved) if is_same_design(saved, design) else None


def _complete(design: Design, path: Path) -> tuple[str, Design]:
    text = design_text(design, path.parent)
    saved = read_back(text, path)
    if not is_same_design(saved, design):
        names = ", ".join(list(differences(design, saved))[:3])
        raise file_problem(str(path), f"would not read back as the design in the form ({names})", "undo these changes")
    return text, saved


def read_back(text: str, path: Path) -> Design:
    """Return the design of a text as a file would be read."""
    return replace(parse_design(text, str(path), path), sha256=sha256(text))


def differences(design: Design, saved: Design) -> dict[str, Any]:
    """Return the values of a design that a file lacks, by path in the file; all effects if their places differ."""
    follows = design.profiles.derived if design.profiles is not None else frozenset()
    edits: dict[str, Any] = {}
    for path, value in design.values.items():
        if value != saved.values.get(path) and path not in follows:
            edits[_path_in_file(saved, path)] = value
    for path in setting_paths(design.kind):
        is_given = path in design.settings or path in saved.settings
        if is_given and (value := _setting(design, path)) != _setting(saved, path):
            edits[path] = value
    if design.profiles is not None and saved.profiles is not None:
        use = design.profiles.present_use(e.kind for e in design.effects)
        edits |= {USE_PATH: use} if use != saved.profiles.use else {}
    listed, listed_before = _listed_effects(design), _listed_effects(saved)
    if [_location(e) for e in listed] != [_location(e) for e in listed_before]:
        return edits | {"effects": [e.entry(given_only=True) for e in design.effects]}
    for i, (a, b) in enumerate(zip(listed, listed_before, strict=True)):
        edits |= {f"effects.{i}.{k}": _plain(v) for k, v in a.parameters.items() if b.parameters.get(k) != v}
    return edits


def _listed_effects(design: Design) -> list[PlacedEffect]:
    """Return the effects without the tables that follow from the profiles, which are the last."""
    follows = design.profiles is not None and design.profiles.has_derived_table
    return [e for e in design.effects if not (follows and e.kind == SHAPE_KIND)]


def _path_in_file(saved: Design, path: str) -> str:
    """Return the path of a number in a file: that of its active load state if the state sets it."""
    state = saved.load_state
    if state is not None and path in saved.load_states[state]:
        return f"load.{state}.{path}"
    return path if saved.structure is None else path_in_list(saved.structure, path)


def _setting(design: Design, path: str) -> Any:
    """Return a word, a switch or a riding number as it takes effect."""
    riding = None if design.kind == "rig" or not path.startswith("riding.") else vars(design.riding)
    key = path.rpartition(".")[2]
    return riding[key] if riding is not None and key in riding else design.setting(path)


def _value_text(design: Design, path: str) -> str:
    """Return the value at a path with its unit, `-` if the design has none."""
    try:
        return typeset(format_quantity(design.value(path), design.unit(path)))
    except ValueError:
        pass
    if path == "effects":
        return ", ".join(effect.kind.replace("_", " ") for effect in design.effects) or "no effects"
    return str(design.settings.get(path, "-"))


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _location(effect: PlacedEffect) -> tuple[Any, ...]:
    return effect.kind, effect.at, effect.wheelset, effect.against


def text_difference(a: str, b: str, a_name: str, b_name: str) -> list[str]:
    """Return the difference of two texts as lines of a unified diff with one line of context.

    >>> text_difference("a\\nb\\n", "a\\nc\\n", "read", "disk")[3:]
    [' a', '-b', '+c']
    """
    return list(difflib.unified_diff(a.splitlines(), b.splitlines(), a_name, b_name, n=1, lineterm=""))


def free_path(path: Path) -> Path:
    """Return a path that is not taken: the given one, or with _2, _3 and so on."""
    number = 1
    candidate = path
    while candidate.exists():
        number += 1
        candidate = path.with_name(f"{path.stem}_{number}{path.suffix}")
    return candidate
