"""Model of a design, of a design file, or as given."""

from __future__ import annotations

from pathlib import Path

from railui.io.problems import FileProblems, Findings, Problem
from railui.io.yaml_document import load_yaml
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.model import Model

ModelSource = Design | Model | str | Path


def resolve_model(design: ModelSource) -> Model:
    """Return the model of a design, of its file, or the model itself; FileProblems if it cannot run on a track."""
    if isinstance(design, str | Path):
        design = load_design(design)
    model = design if isinstance(design, Model) else Model(design)
    if model.design.kind == "rig":
        raise _refused(model.design, "vehicle", f"a {model.design.kind} rides no track", "give a bogie")
    return model


def missing_limit(design: Design) -> Problem | None:
    """Return the problem of a design for goods without the limit of acceleration for its rating; None if it has it."""
    if not design.is_on_track or design.riding.use != "goods" or design.riding.rms_limit is not None:
        return None
    has_file = design.source is not None and Path(design.source).is_file()
    findings = load_yaml(design.source).findings() if design.source is not None and has_file else Findings(design.name)
    message = "is missing: the ride quality of goods is rated by the rms acceleration that the load bears"
    findings.add("riding.rms_limit", message, "add for example `rms_limit: 2.5 m/s^2` to `riding`")
    return findings.problems[-1]


def require_rating(design: Design) -> None:
    """Raise FileProblems for a design whose ride quality cannot be rated."""
    problem = missing_limit(design)
    if problem is not None:
        raise FileProblems([problem])


def _refused(design: Design, key: str, what: str, remedy: str) -> FileProblems:
    return FileProblems([Problem(str(design.source or design.name), 0, 0, key, what, remedy)])
