"""Checking and loading any of our files: what it is told by its schema line, its keys or its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from .campaign import Campaign, campaign_file, load_campaign
from .delta_r import read_delta_r
from .design import Design, load_design
from .effect_records import Catalogue
from .problems import FileProblems, Findings, Problem, one_problem
from .profile import SIMPACK, read_profile
from .run import Run, load_run
from .schema_line import kind_of
from .study import Study, load_study
from .table import read_header
from .track_file import TrackColumns, load_track
from .yaml12 import load as load_yaml

if TYPE_CHECKING:
    from railui.contact import Profile

    from .delta_r import Floats

Anything: TypeAlias = "Design | Campaign | Study | Run | TrackColumns | Profile | tuple[Floats, Floats]"
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


def load(
    path: str | Path, catalogue: Catalogue | None = None, check_track: Callable[[str], object] | None = None
) -> Anything:
    """Loads any of our files; FileProblems with every fault."""
    kind = recognise(path)
    loaders: dict[str, Callable[[], Anything]] = {
        "design": lambda: load_design(Path(path), catalogue),
        "campaign": lambda: load_campaign(path, catalogue),
        "study": lambda: load_study(path, catalogue, check_track),
        "run": lambda: load_run(path),
        "track": lambda: load_track(path),
        "profile": lambda: _profile(Path(path)),
        "delta_r": lambda: read_delta_r(path),
    }
    return loaders[kind]()


def _profile(path: Path) -> Profile:
    """A profile of a wheel or of a rail: what its name or its shape says."""
    if path.suffix.lower() in SIMPACK:
        return read_profile(path, SIMPACK[path.suffix.lower()])
    try:
        return read_profile(path, "wheel")
    except FileProblems as as_wheel:
        try:
            return read_profile(path, "rail")
        except FileProblems:
            raise as_wheel from None


def check(
    paths: Iterable[str | Path],
    catalogue: Catalogue | None = None,
    check_track: Callable[[str], object] | None = None,
) -> list[Problem]:
    """Every problem of some files, and of the runs that a campaign names; warnings carry that severity."""
    found = [problem for path in paths for problem in _problems(path, catalogue, check_track)]
    return list(dict.fromkeys(found))


def _problems(
    path: str | Path, catalogue: Catalogue | None, check_track: Callable[[str], object] | None
) -> list[Problem]:
    try:
        loaded = load(path, catalogue, check_track)
    except FileProblems as error:
        return list(error.problems)
    found: list[Problem] = list(getattr(loaded, "warnings", ()))
    if isinstance(loaded, Campaign):
        found += _runs(loaded)
    return found


def _runs(campaign: Campaign) -> list[Problem]:
    """The problems of the runs, and noise of columns that no run has."""
    found: list[Problem] = []
    measured: set[str] = set()
    for entry in campaign.runs:
        try:
            measured |= set(load_run(entry.file, campaign.design.kind).columns)
        except FileProblems as error:
            found += error.problems
    if found:
        return found
    findings = load_yaml(campaign.source).findings()
    for name in campaign.noise:
        if name not in measured:
            findings.warn(f"noise.{name}", "no run of the campaign has this column", "leave it out")
    return findings.problems
