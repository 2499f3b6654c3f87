"""Checking and loading files of every kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.comparison import upper_band_limit
from railui.campaign.dataset import load_campaign_run, read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Fault
from railui.contact.profile_reader import SIMPACK_KINDS, read_profile
from railui.contact.radius_table_reader import read_radius_table
from railui.documents.recognise import USES_BY_KIND, recognise
from railui.io.number_format import format_quantity
from railui.io.problems import FileProblems, Findings, Problem, file_problem
from railui.io.table import read_header
from railui.io.yaml_document import load_yaml as load_yaml
from railui.optimisation.study import Study
from railui.optimisation.study_reader import load_study
from railui.planning.plan_file import read_plan_fields
from railui.ride_quality.en14363.recording import is_recording, read_recording
from railui.runs.columns import RIG_FORMS, columns_of
from railui.runs.overlap import MAX_SHARED_SHARE, MIN_SAME_NOISE, same_noise, shared_share
from railui.runs.run import Run, load_run
from railui.track.line_file import load_line
from railui.track.reader import TrackColumns, load_track
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.effects import Catalogue, kernel_catalogue
from railui.vehicle.element import Element, load_element
from railui.vehicle.multibody import bogie_masses
from railui.vehicle.parameter import UNUSUAL_FACTOR, UNUSUAL_LENGTH_FACTOR
from railui.vehicle.resolve import missing_limit

if TYPE_CHECKING:
    from railui.contact.profile import Profile


LoadedFile: TypeAlias = (
    "Design | Campaign | Study | Element | Run | TrackColumns | Profile | tuple[FloatArray, FloatArray] | object"
)

READ_ELSEWHERE = {"map": "sensor map", "fleet": "fleet"}


def load(
    path: str | Path,
    catalogue: Catalogue | None = None,
    check_track: Callable[[str], object] | None = None,
    readers: Mapping[str, Callable[[str | Path], object]] | None = None,
) -> LoadedFile:
    """Load a file of any kind; FileProblems with every problem.

    `readers` read kinds of files that belong to packages of the same layer or of a higher one: sensor maps, fleets.
    """
    kind = recognise(path)
    if kind in READ_ELSEWHERE:
        if kind not in (readers or {}):
            raise file_problem(path, f"is a {READ_ELSEWHERE[kind]}", USES_BY_KIND[kind])
        return dict(readers or {})[kind](path)
    loaders: dict[str, Callable[[], LoadedFile]] = {
        "design": lambda: load_design(Path(path), catalogue),
        "campaign": lambda: load_campaign(path, catalogue),
        "plan": lambda: read_plan_fields(path),
        "element": lambda: load_element(path, kernel_catalogue() if catalogue is None else catalogue),
        "study": lambda: load_study(path, catalogue, check_track),
        "run": lambda: _load_run(path),
        "track": lambda: load_track(path),
        "line": lambda: load_line(path),
        "profile": lambda: _load_profile(Path(path)),
        "delta_r": lambda: read_radius_table(path),
    }
    return loaders[kind]()


def _load_run(path: str | Path) -> LoadedFile:
    """Read a run of a campaign, or one with the columns of EN 14363 alone, according to its header."""
    if is_recording(read_header(path).names):
        return read_recording(path)
    return load_run(path)


def _load_profile(path: Path) -> Profile:
    """Read a profile of a wheel or of a rail, according to its name or its shape."""
    if path.suffix.lower() in SIMPACK_KINDS:
        return read_profile(path, SIMPACK_KINDS[path.suffix.lower()])
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
    readers: Mapping[str, Callable[[str | Path], object]] | None = None,
) -> list[Problem]:
    """Return all problems and warnings of files, including the runs that a campaign names."""
    problems = [problem for path in paths for problem in _check_file(path, catalogue, check_track, readers)]
    return list(dict.fromkeys(problems))


def _check_file(
    path: str | Path,
    catalogue: Catalogue | None,
    check_track: Callable[[str], object] | None,
    readers: Mapping[str, Callable[[str | Path], object]] | None,
) -> list[Problem]:
    try:
        loaded = load(path, catalogue, check_track, readers)
    except FileProblems as error:
        return list(error.problems)
    problems: list[Problem] = list(getattr(loaded, "warnings", ()))
    if isinstance(loaded, Campaign):
        problems += _check_runs(loaded)
    if isinstance(loaded, Design):
        problems += _check_two_point_contact(loaded)
        problems += _check_usual_ranges(loaded)
        problems += _check_rating(loaded)
    return problems


def _check_rating(design: Design) -> list[Problem]:
    """Warn of a design whose ride quality cannot be rated; its stability, curves and campaigns can be computed."""
    problem = missing_limit(design)
    if problem is None:
        return []
    return [replace(problem, message=f"{problem.message}, which ride and assess need", severity="warning")]


def _check_usual_ranges(design: Design) -> list[Problem]:
    """Warn of numbers outside the range of real vehicles: without their unit, or the whole of a half or a radius.

    Wagons with two axles have longer wheelbases than bogies.
    """
    findings = load_yaml(design.source).findings() if design.source is not None else Findings(design.name)
    is_bogie = design.structure is None or bool(bogie_masses(design.structure, design.values))
    for path, parameter in design.parameters.items():
        low, high = parameter.usual_range
        size = abs(design.values.get(path, 0.0))
        whole = parameter.whole if is_bogie or "wheelbase" not in parameter.whole else ""
        factor = UNUSUAL_LENGTH_FACTOR if whole else UNUSUAL_FACTOR
        if size and not low / factor <= size <= high * factor:
            value, unit = format_quantity(design.values[path], parameter.unit), parameter.unit
            usual = f"{format_quantity(low, unit)} to {format_quantity(high, unit)}"
            message = f"{value} is {'outside' if whole else 'far from'} the {usual} of real vehicles"
            remedy = "a number without a unit is in SI units: check the unit"
            if whole and size > high:
                remedy = f"give half of it if this is {whole}, else check the unit"
            findings.warn(path, message, remedy)
    return findings.problems


def _check_two_point_contact(design: Design) -> list[Problem]:
    """Warn of wheels whose tread and flange touch the rail at once, which rigid contact does not share."""
    if design.profiles is None or design.profiles.sha256 is None:
        return []
    findings = load_yaml(design.source).findings() if design.source is not None else Findings(design.name)
    for jump in design.profiles.geometry(design.values).jumps:
        if jump.is_at_flange and jump.displacement > 0.0:
            points = f"tread and flange touch at once at e = {jump.displacement * 1e3:.1f} mm"
            message = f"{points}, {jump.separation * 1e3:.1f} mm apart: one point carries the whole load"
            findings.warn("contact.profiles", message, "trust Y, Q and wear beyond it as an indication only")
    return findings.problems


def _check_runs(campaign: Campaign) -> list[Problem]:
    """Return the problems of a campaign's runs; warn of data faults, and of noise of columns that no run has."""
    problems: list[Problem] = []
    runs: list[Run] = []
    for entry in campaign.runs:
        try:
            runs.append(load_campaign_run(campaign, entry))
        except FileProblems as error:
            problems += error.problems
    if problems:
        return problems
    measured = {name for run in runs for name in run.columns}
    findings = load_yaml(campaign.source).findings()
    _check_overlap(campaign, runs, findings)
    _check_sampled_bands(campaign, runs, findings)
    try:
        dataset = read_dataset(campaign)
    except FileProblems as error:
        return list(error.problems)
    for fault in diagnose(dataset).faults:
        findings.warn("runs", f"{', '.join(fault.files)}: {fault.text}{_consequence(fault)}", _remedy(fault))
    for entry, run in zip(campaign.runs, runs, strict=True):
        check_column_names(run, entry.name, findings)
    for name in campaign.noise:
        if name not in measured:
            findings.warn(f"noise.{name}", "no run of the campaign has this column", "leave it out")
    return [*(warning for run in runs for warning in run.warnings), *findings.problems]


def _check_sampled_bands(campaign: Campaign, runs: Sequence[Run], findings: Findings) -> None:
    """Warn of runs that are sampled more slowly than others, so that the comparison ends at a lower frequency."""
    if campaign.band is None:
        return
    limits = [upper_band_limit(campaign.band, run.rate) for run in runs]
    lowest, highest = min(limits), max(limits)
    for i, (entry, run, limit) in enumerate(zip(campaign.runs, runs, limits, strict=True)):
        if limit < highest:
            message = f"{entry.name}: sampled at {run.rate:.4g} Hz, compared up to {limit:.3g} Hz, not {highest:.3g} Hz"
            band = f"band: [{campaign.band[0]:g} Hz, {lowest:.3g} Hz]"
            findings.warn(f"runs.{i}.file", message, f"`{band}` compares all runs at the same frequencies")


def _consequence(fault: Fault) -> str:
    """Return what a serious fault does to the loop; empty for one that does not stop it."""
    if not fault.serious:
        return ""
    correct = " unless `--correct` makes the correction" if fault.is_correctable else ""
    return f"; the loop stops here{correct}"


def _remedy(fault: Fault) -> str:
    """Return what undoes a fault: its correction with all alternatives, and its remedy outside the campaign file."""
    lines = [f"`{line}`" for line in (fault.yaml, *fault.alternatives) if line]
    options = [f"add {' or '.join(lines)}"] if lines else []
    options += [fault.remedy] if fault.remedy else []
    return ", or ".join(options) or "leave the channel out, or record again"


def _letters(name: str) -> str:
    """Return the letters and digits of a name, small."""
    return "".join(c for c in name.lower() if c.isalnum())


def check_column_names(run: Run, name: str, findings: Findings) -> None:
    """Warn of columns with the name of a channel but for its case or points."""
    known = {_letters(c): c for c in columns_of(run.kind)}
    for column in run.unknown_columns:
        if meant := known.get(_letters(column)):
            findings.warn("runs", f"{name}: column {column} has no known name and is not used", f"name it {meant}")


def _check_overlap(campaign: Campaign, runs: Sequence[Run], findings: Findings) -> None:
    """Report runs of different roles that share samples: a model would be validated on what it was fitted to."""
    for (i, first), (j, second) in combinations(enumerate(campaign.runs), 2):
        if first.role == second.role:
            continue
        (a, b), form = (runs[i].columns, runs[j].columns), runs[i].kind
        if (share := shared_share(a, b, form)) > MAX_SHARED_SHARE:
            message = f"shares {100 * share:.0f} % of its samples with {first.name}, whose role is {first.role}"
        elif form not in RIG_FORMS and same_noise(a, b, form) > MIN_SAME_NOISE:
            same = "the noise of its sensors is the same, which that of two recordings is not"
            message = f"is {first.name}, whose role is {first.role}, resampled or rounded: {same}"
        else:
            continue
        findings.add(f"runs.{j}.file", message, "give another recording, or leave one of them out")
