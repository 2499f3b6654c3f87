"""Files of a study that is built of mappings: the vehicle and study.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from railui.documents.saving import save_design
from railui.io.atomic import write_text
from railui.io.problems import file_problem
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter
from railui.vehicle.design import Design

STUDY_FILE: Final = "study.yaml"
VEHICLE_FILE: Final = "vehicle.yaml"


def write_study_files(directory: Path, name: str, design: Design, content: Mapping[str, Any]) -> Path:
    """Write vehicle.yaml and study.yaml with its groups; return the path of the study.

    Raises
    ------
    FileProblems
        If the directory has a study.
    """
    file = directory / STUDY_FILE
    if file.exists():
        raise file_problem(file, "exists and is not overwritten", "name another directory")
    directory.mkdir(parents=True, exist_ok=True)
    save_design(design, directory / VEHICLE_FILE)
    writer = YamlWriter()
    writer.entry("schema", schema_name("study"))
    writer.entry("name", name)
    writer.entry("vehicle", VEHICLE_FILE)
    for key, value in content.items():
        if value:
            writer.entry(key, value)
    return write_text(file, writer.text())
