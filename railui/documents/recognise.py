"""Recognition of the kind of a file by its schema line, keys or name, without importing its reader."""

from __future__ import annotations

from pathlib import Path

from railui.contact.profile_reader import SIMPACK_KINDS
from railui.io.problems import FileProblems, Findings, file_problem
from railui.io.schema_line import document_kind
from railui.io.table import read_header
from railui.io.yaml_document import load_yaml as load_yaml

# commands that read a file of each kind
USES_BY_KIND = {
    "design": "railui ride, stability and curve take it",
    "campaign": "railui loop and adjust take it",
    "study": "railui optimise takes it",
    "plan": "railui plan takes it with --sensors",
    "element": "a design mounts it: `effects: [{element: FILE, at: secondary_lateral}]`",
    "fleet": "railui fleet takes it",
    "map": "railui import and railui capture campaign take it with --map",
    "run": "--track and railui import take it, or a campaign names it",
    "track": "--track takes it",
    "line": "--track takes it",
    "delta_r": "railui contact --delta-r takes it",
    "profile": "railui contact takes it, or `contact: {profiles: {wheel, rail}}` of a design",
}


def recognise(path: str | Path) -> str:
    """Return the kind of a file: design, campaign, study, plan, fleet, element, map, line, run, track, profile or
    delta_r.

    A directory stands for the campaign or the fleet in it. The schema line decides, else the keys, else the
    columns of a table.

    Raises
    ------
    FileProblems
        If railui does not read files of this kind.
    """
    path = Path(path)
    if path.is_dir():
        files = [path / name for name in ("fleet.yaml", "campaign.yaml") if (path / name).is_file()]
        if not files:
            remedy = "name a file, or the directory of a campaign or a fleet"
            raise file_problem(path, "holds no campaign.yaml and no fleet.yaml", remedy)
        path = files[0]
    if path.suffix.lower() in SIMPACK_KINDS:
        return "profile"
    if path.name.lower().endswith((".csv", ".csv.gz", ".txt", ".gz")):
        names = set(read_header(path).names)
        kind = "run" if "t" in names or {"v", "z"} & names else "track" if {"s", "yw"} & names else None
        if "F" in names and "t" not in names and {"v", "z"} & names:
            kind = "element"
        if "y" in names and "t" not in names and {"z", "delta_r"} & names:
            kind = "delta_r" if "delta_r" in names else "profile"
        remedy = (
            "give a run with a column t [s], or a track with s [m], yw [m];"
            f" `railui import {path} --draft map.yaml` begins a map for files of other programs"
        )
    else:
        kind = document_kind(load_yaml(path).value)
        remedy = "write `schema: railui.design/1`, or the keys of a design, campaign, study, plan, fleet, line or map"
    if kind not in USES_BY_KIND:
        findings = Findings(str(path))
        findings.add(
            "",
            "is not a file of railui" if kind is None else f"is a {kind}, which railui writes but does not read",
            remedy,
        )
        findings.raise_errors()
    return str(kind)


def expect_kind(path: str | Path, kind: str) -> None:
    """Raise FileProblems with one line if a file is of another kind, instead of a problem for every key."""
    try:
        actual = recognise(path)
    except FileProblems:
        return  # the reader of the expected kind reports it better
    if actual != kind:
        raise file_problem(path, f"is a {actual}, but a {kind} is required", USES_BY_KIND[actual])
