"""What a file is, by its schema line, its keys or its name: apart from its reading, which takes longer to import."""

from __future__ import annotations

from pathlib import Path

from railui.campaign.directory import campaign_file
from railui.contact.profile_reader import SIMPACK
from railui.io.problems import FileProblems, Findings, one_problem
from railui.io.schema_line import kind_of
from railui.io.table import read_header
from railui.io.yaml_document import load as load_yaml

# what takes a file of each kind
TAKEN_BY = {
    "design": "railui ride, stability and curve take it",
    "campaign": "railui loop and adjust take it",
    "study": "railui optimise takes it",
    "run": "--track and railui import take it, or a campaign names it",
    "track": "--track takes it",
    "delta_r": "railui contact --delta-r takes it",
    "profile": "railui contact takes it, or `contact: {profiles: {wheel, rail}}` of a design",
}


def recognise(path: str | Path) -> str:
    """What a file is: design, campaign, study, run, track, profile or delta_r; FileProblems where it is none of ours.

    A directory is the campaign in it. The schema line decides, else the keys, else the columns of a table.
    """
    path = campaign_file(path)
    if path.suffix.lower() in SIMPACK:
        return "profile"
    if path.name.lower().endswith((".csv", ".csv.gz", ".txt", ".gz")):
        names = set(read_header(path).names)
        kind = "run" if "t" in names or {"v", "z"} & names else "track" if {"s", "yw"} & names else None
        if "y" in names and "t" not in names and {"z", "delta_r"} & names:
            kind = "delta_r" if "delta_r" in names else "profile"
        remedy = "give a run with a column t [s], or a track with s [m], yw [m]"
    else:
        kind = kind_of(load_yaml(path).value)
        remedy = "write `schema: railui.design/1`, or the keys of a design, a campaign or a study"
    if kind not in TAKEN_BY:
        findings = Findings(str(path))
        findings.add(
            "",
            "is no file of railui" if kind is None else f"is a {kind}: railui writes it, but does not read it",
            remedy,
        )
        findings.stop()
    return str(kind)


def expect(path: str | Path, kind: str) -> None:
    """FileProblems where a file is one of ours but of another kind: one line, not a fault for every key."""
    try:
        found = recognise(path)
    except FileProblems:
        return  # the reader of the kind that was asked for tells it better
    if found != kind:
        raise one_problem(path, f"is a {found}, where a {kind} belongs", TAKEN_BY[found])
