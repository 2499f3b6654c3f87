"""Structures whose rows the kernel compiles as straight code: python -m tests.kernel.structures writes their files.

A bundled vehicle of bodies and elements has such a file, and the bundled coach with primary lateral dampers another.
The kernel describes its rows itself; to add a structure, name it here, write the files and build the kernel anew.
"""

from __future__ import annotations

from pathlib import Path

from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model

ROOT = Path(__file__).parents[2]
FILES = ROOT / "rust_core" / "structures"
# dampers that the bundled coach lacks
YAW_DAMPERS = {"vehicle.elements.secondary_damper.longitudinal_damping": 1e5}
LATERAL_DAMPERS = {"vehicle.elements.primary_damper.lateral_damping": 4e3}
# name: design, parameters that are changed; a vehicle without some terms has the structure, too
STRUCTURES: dict[str, tuple[str, dict[str, float]]] = {
    "bogie_under_coach": ("bogie_under_coach", {}),
    "coach": ("manchester_coach", YAW_DAMPERS),
    "coach_with_primary_lateral_dampers": ("manchester_coach", YAW_DAMPERS | LATERAL_DAMPERS),
    "cooperrider": ("cooperrider", {}),
    "wheelset": ("roller_rig", {}),
}


def model_of(name: str) -> Model:
    """Return the vehicle that has a structure."""
    design, changed = STRUCTURES[name]
    model = Model(load_design(ROOT / "railui" / "designs" / f"{design}.yaml"))
    for path, value in changed.items():
        model.row[model.columns[path]] = value
    return model


def file_of(name: str) -> str:
    """Return the text of a structure's file as the kernel describes the rows of its vehicle."""
    model = model_of(name)
    design, changed = STRUCTURES[name]
    of = " ".join([design, *(f"{path}={value:g}" for path, value in changed.items())])
    rows = model.vehicles().structure_file(model.single_batch())
    return f"# written by tests/kernel/structures.py: {of}\n{rows}"


if __name__ == "__main__":
    FILES.mkdir(exist_ok=True)
    for name in STRUCTURES:
        (FILES / f"{name}.txt").write_text(file_of(name), encoding="utf-8")
