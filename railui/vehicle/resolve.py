"""Model of a design, of a design file, or as given."""

from __future__ import annotations

from pathlib import Path

from railui.io.problems import FileProblems, Problem
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
    riding = model.design.riding
    if riding.use == "goods" and riding.rms_limit is None:
        what = "use: goods needs the rms acceleration that the load bears, which has no default"
        raise _refused(model.design, "riding.rms_limit", what, "add for example `rms_limit: 2.5 m/s^2`")
    return model


def _refused(design: Design, key: str, what: str, remedy: str) -> FileProblems:
    return FileProblems([Problem(str(design.source or design.name), 0, 0, key, what, remedy)])
