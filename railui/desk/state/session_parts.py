"""Parts of an autosaved session as JSON: the form of a design, the plan of a search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from railui.desk.state.draft import Draft
from railui.desk.state.plan import Plan
from railui.desk.state.run_conditions import RunConditions
from railui.desk.state.shelf import Shelf, ShelfItem
from railui.documents.saving import design_text
from railui.io.problems import FileProblems
from railui.optimisation.study_reader import load_study
from railui.track import parse_spec
from railui.vehicle.design_reader import Design, load_design, parse_design

PLAN_KEYS: Final = ("track", "speed", "seeds", "scenarios", "kind", "population", "generations", "seed", "directory")


def form_content(draft: Draft) -> dict[str, Any]:
    """Return the design in the form, its base, its run conditions and its file as JSON."""
    path, state = draft.path, draft.states.current
    return {
        "name": draft.name,
        "path": None if path is None else str(path.resolve()),
        "sha256": None if draft.file is None else draft.file.sha256,
        "new_path": str(draft.new_path.resolve()),
        "track": state.conditions.track,
        "speed": state.conditions.speed,
        "design": _design_content(state.design),
        "base": _design_content(state.base),
    }


def restore_form(content: Mapping[str, Any]) -> Draft:
    """Return the draft of a stored form; raise FileProblems, KeyError or TypeError if it cannot be read.

    If its file has changed since, saving asks before it is replaced; without a readable file, the design is a new one.
    """
    design, base = _read_design(content["design"]), _read_design(content["base"])
    conditions = RunConditions(str(content["track"]), float(content["speed"]))
    file = _read_file(content["path"])
    if file is None or content["sha256"] is None:
        return Draft(design, base=base, conditions=conditions, new_path=Path(content["path"] or content["new_path"]))
    draft = Draft(replace(file, sha256=content["sha256"]), base=base, conditions=conditions)
    draft.push(replace(design, source=file.source, sha256=content["sha256"]), "restored session")
    return draft


def _read_file(path: str | None) -> Design | None:
    try:
        return None if path is None else load_design(Path(path))
    except (FileProblems, OSError):
        return None


def plan_content(plan: Plan) -> dict[str, Any]:
    """Return a plan as JSON."""
    return {key: getattr(plan, key) for key in PLAN_KEYS} | {
        "design": _design_content(plan.design),
        "bounds": {path: list(pair) for path, pair in plan.bounds.items()},
        "objectives": [list(pair) for pair in plan.objectives],
        "constraints": list(plan.constraints),
        "study": None if plan.study is None else str(plan.study.source.resolve()),
    }


def restore_plan(content: Mapping[str, Any]) -> Plan:
    """Return a stored plan; raise FileProblems, KeyError or TypeError if it cannot be read."""
    study = None
    if content["study"] is not None and Path(content["study"]).exists():
        study = load_study(Path(content["study"]), check_track=parse_spec)
    return Plan(
        _read_design(content["design"]),
        {path: (float(low), float(high)) for path, (low, high) in content["bounds"].items()},
        tuple((str(objective), str(over)) for objective, over in content["objectives"]),
        tuple(map(str, content["constraints"])),
        **{key: content[key] for key in PLAN_KEYS},
        study=study,
    )


def shelf_content(shelf: Shelf) -> dict[str, Any]:
    """Return the designs of the shelf as JSON."""
    texts = ("letter", "note", "origin", "time")
    return {
        "items": [
            {key: getattr(item, key) for key in texts}
            | {"history": list(item.history), "design": _design_content(item.design)}
            for item in shelf.items
        ]
    }


def restore_shelf(content: Mapping[str, Any]) -> list[ShelfItem]:
    """Return the designs of a stored shelf; raise FileProblems, KeyError or TypeError if they cannot be read."""
    return [
        ShelfItem(
            str(row["letter"]), _read_design(row["design"]), str(row["note"]), str(row["origin"]), str(row["time"]),
            tuple(map(str, row["history"])),
        )
        for row in content["items"]
    ]  # fmt: skip


def _design_content(design: Design) -> dict[str, Any]:
    source = None if design.source is None else str(design.source.resolve())
    return {"text": design_text(design), "source": source, "sha256": design.sha256}


def _read_design(content: Mapping[str, Any]) -> Design:
    source = None if content["source"] is None else Path(content["source"])
    design = parse_design(str(content["text"]), "the autosaved design")
    return replace(design, source=source, sha256=str(content["sha256"]))
