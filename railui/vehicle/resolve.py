"""The model of a design, a file or a model."""

from __future__ import annotations

from pathlib import Path

from railui.io.problems import FileProblems, Problem
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.model import Model

Given = Design | Model | str | Path


def model_of(design: Given) -> Model:
    """The model of a design, a file of one or a model; FileProblems for what cannot ride a track."""
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
