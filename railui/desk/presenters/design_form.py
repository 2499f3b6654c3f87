"""Form rows of a design and its run conditions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from railui.desk.state.draft import Draft
from railui.desk.state.form_rows import Field, Heading, speed_field

TRACK_PATH: Final = "case.track"
SPEED_PATH: Final = "case.speed"


def design_rows(draft: Draft, speed_unit: str = "m/s") -> Iterator[Heading | Field]:
    """Yield the rows of the form of a design: run conditions, then its parameters by group."""
    conditions = draft.conditions
    yield Heading("run conditions")
    yield Field(TRACK_PATH, "", "track", "", conditions.track, source="the desk")
    yield speed_field(SPEED_PATH, conditions.speed, speed_unit, "the desk")
    profiles = draft.design.profiles
    if profiles is not None:
        yield Heading(f"contact: {profiles.wheel.stem} on {profiles.rail.stem}, {profiles.use}")
    group = ""
    for field in draft.fields():
        if field.group != group:
            group = field.group
            yield Heading(_heading(draft, group))
        yield field


def _heading(draft: Draft, group: str) -> str:
    if group.startswith("effects."):
        effect = draft.design.effects[int(group.split(".")[1])]
        wheelset = f" {effect.wheelset}" if effect.wheelset else ""
        return f"{effect.kind.replace('_', ' ')} at {effect.at.replace('_', ' ')}{wheelset}"
    for prefix in ("vehicle.", "bodies.", "elements."):
        group = group.removeprefix(prefix)
    return group.replace(".", " ").replace("_", " ")
