"""Reading study files: variables, cases, objectives, constraints and search method."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from railui.io.atomic import sha256_file
from railui.io.problems import FileProblems, Findings, suggest_name
from railui.io.units import UnitError, convert, split_quantity
from railui.io.yaml_file import load_fields
from railui.optimisation.response_keys import NUMERIC_KEYS, RESPONSE_KEYS, check_bound
from railui.optimisation.scenarios import default_scenarios, read_scenarios
from railui.optimisation.study import Cases, Constraint, Method, Objective, Study, Variable
from railui.optimisation.study_conflicts import check_constraints_agree, check_objectives_differ, check_seeds
from railui.optimisation.study_schema import CasesModel, StudyModel
from railui.optimisation.validity import flange_warnings
from railui.ride_quality.comfort import fixed_transfer
from railui.vehicle.design import Design
from railui.vehicle.effects import Catalogue
from railui.vehicle.model import Model
from railui.vehicle.reference import load_named_design
from railui.vehicle.superseded import warn_of_superseded

CONSTRAINT_PATTERN: Final = re.compile(r"\s*(\w+)\s*(>=|<=|>|<|==|=)?\s*(.*?)\s*\Z")
TRACK_OPTION: Final = re.compile(r"[\w-]+=\S+\Z")
SINGLE_OBJECTIVE_METHODS: Final = ("cmaes", "de")
MULTI_OBJECTIVE_METHODS: Final = ("nsga2", "nsga3")
# from this number of objectives on most designs are nondominated: reference directions select better than crowding
MIN_OBJECTIVES_FOR_NSGA3: Final = 4
COMFORT_KEYS: Final = frozenset(
    {"score", "comfort_hours", "weighted_acceleration", "weighted_acceleration_1974", "n_mv", "wz"}
)
# through the floor transfer; those in yaw act on the motion of the frame only
LATERAL_SECONDARY: Final = ("vehicle.secondary.lateral_stiffness", "vehicle.secondary.lateral_damping")


def load_study(
    path: str | Path, catalogue: Catalogue | None = None, check_track: Callable[[str], object] | None = None
) -> Study:
    """Read a study and the vehicle that it names.

    Parameters
    ----------
    path : str or Path
        Study file.
    catalogue : Catalogue, optional
        Effects that the vehicle may have; those of the kernel by default.
    check_track : callable, optional
        Parser of the text of a synthetic track, which raises ValueError for a faulty one.

    Raises
    ------
    FileProblems
        With every fault of the file.
    """
    source = Path(path)
    remedy = "write `vehicle:`, `variables:`, `cases:` and `objectives:`"
    data, model, findings = load_fields(source, "study", StudyModel, remedy)
    design = load_named_design(source, data, findings, catalogue)
    variables = read_variables(data.get("variables"), design, findings)
    objectives = read_objectives(data.get("objectives"), findings)
    method = read_method(data.get("method"), objectives, variables, findings)
    constraints = read_constraints(data.get("constraints"), findings)
    cases = data["cases"] if isinstance(data.get("cases"), dict) else {}
    check_tracks(cases.get("track"), source.parent, findings, check_track)
    check_seeds(cases.get("seed"), findings)
    scenarios = _read_scenarios(cases, design, variables, findings)
    _check_draws(cases, design, findings)
    if findings.errors() or design is None or model is None:
        raise FileProblems(findings.errors())
    keys = [*(each.key for each in objectives), *(each.key for each in constraints)]
    for path, message, remedy in fixed_transfer_warnings(design, [variable.path for variable in variables], keys):
        findings.warn(f"variables.{path}", message, remedy)
    warn_of_superseded(design, [variable.path for variable in variables], findings, "variables.")
    study = Study(
        name=model.name or source.stem,
        design=design,
        variables=variables,
        cases=_cases(model.cases, scenarios, has_default_seed="seed" not in cases),
        objectives=objectives,
        constraints=constraints,
        method=Method(method, model.method.population, model.method.generations, model.method.seed),
        source=source,
        sha256=sha256_file(source),
    )
    vehicle = Model(design)
    for text in flange_warnings(study, {"": [(vehicle, vehicle.row[None])]}):
        findings.warn("vehicle", text, "add flange_contact to its effects")
    return replace(study, warnings=(*findings.warnings(), *design.warnings))


def _read_scenarios(
    cases: Mapping[str, Any], design: Design | None, variables: Sequence[Variable], findings: Findings
) -> tuple[Mapping[str, Any], ...]:
    if "scenario" in cases:
        return read_scenarios(cases["scenario"], design, findings)
    defaults = default_scenarios(design, [variable.path for variable in variables])
    return read_scenarios(defaults, design, findings)


def _check_draws(cases: Mapping[str, Any], design: Design | None, findings: Findings) -> None:
    path, draws = "cases.draws", cases.get("draws")
    if design is None or not isinstance(draws, int) or draws <= 0:
        return
    if design.adjustment is None:
        findings.add(path, "the vehicle has no adjustment to draw from", "name an adjusted.yaml, or set draws: 0")
    elif design.adjustment.samples and draws > (most := len(design.adjustment.samples)):
        findings.add(path, f"the vehicle has {most} samples of its parameters", f"give {most} or fewer")


def fixed_transfer_warnings(design: Design, paths: Iterable[str], keys: Iterable[str]) -> list[tuple[str, str, str]]:
    """Return path, message and remedy for lateral secondary parameters that vary with comfort but without a carbody.

    Parameters
    ----------
    design
        Vehicle of the study.
    paths
        Parameters that vary.
    keys
        Results in objectives and constraints.
    """
    found = fixed_transfer(design)
    if found is None or COMFORT_KEYS.isdisjoint(keys):
        return []
    quantity, remedy = found
    return [(path, f"varies, but comfort is the {quantity}", remedy) for path in paths if path in LATERAL_SECONDARY]


def _cases(model: CasesModel, scenarios: tuple[Mapping[str, Any], ...], *, has_default_seed: bool) -> Cases:
    return Cases(
        track=tuple(model.track),
        speed=tuple(model.speed),
        seed=tuple(model.seed),
        scenario=scenarios,
        draws=model.draws,
        radius=model.radius,
        cant_deficiency=model.cant_deficiency,
        has_default_seed=has_default_seed,
    )


def read_variables(raw: Any, design: Design | None, findings: Findings) -> tuple[Variable, ...]:
    """Read the variables, their bounds in SI; add unknown parameters and faulty ranges to the findings."""
    variables: list[Variable] = []
    if isinstance(raw, dict) and not raw:
        findings.add("variables", "is empty", "name a parameter and its range")
    if design is None or not isinstance(raw, dict):
        return ()
    for path, bounds in raw.items():
        key = f"variables.{path}"
        if not isinstance(bounds, list) or len(bounds) != 2:
            continue  # reported by the schema
        try:
            unit = design.unit(path)
        except FileProblems as error:
            findings.add(key, error.problems[0].message, error.problems[0].remedy, key=True)
            continue
        lowest, highest = (_read_bound(bound, path, f"{key}.{i}", design, findings) for i, bound in enumerate(bounds))
        if lowest is None or highest is None:
            continue
        if lowest >= highest:
            findings.add(key, "the range does not rise", "give [lowest, highest]")
        variables.append(Variable(path, lowest, highest, unit))
    return tuple(variables)


def _read_bound(value: Any, path: str, key: str, design: Design, findings: Findings) -> float | None:
    try:
        return design.with_values({path: value}).value(path)
    except FileProblems as error:
        findings.add(key, error.problems[0].message, error.problems[0].remedy)
        return None


def _is_numeric_key(name: str, key: str, findings: Findings) -> bool:
    if name in NUMERIC_KEYS:
        return True
    if name in RESPONSE_KEYS:
        findings.add(key, f"{name} is a word, not a number", "use score, weighted_acceleration or flange_margin")
    else:
        findings.add(key, f"{name!r} is no result of ride, stability or curve", suggest_name(name, NUMERIC_KEYS))
    return False


def read_objectives(raw: Any, findings: Findings) -> tuple[Objective, ...]:
    """Read the objectives; add entries that do not name exactly one numeric key, or repeat one, to the findings."""
    objectives: dict[str, Objective] = {}
    if isinstance(raw, list) and not raw:
        findings.add("objectives", "is empty", "add {minimise: weighted_acceleration, over: mean}")
    for i, entry in enumerate(raw if isinstance(raw, list) else []):
        if not isinstance(entry, dict):
            continue
        senses = [sense for sense in ("minimise", "maximise") if entry.get(sense) is not None]
        if len(senses) != 1:
            findings.add(f"objectives.{i}", f"has {len(senses)} senses", "give one of minimise and maximise")
        elif _is_numeric_key(str(entry[senses[0]]), f"objectives.{i}.{senses[0]}", findings):
            over = str(entry.get("over", "mean"))
            objectives[f"objectives.{i}"] = Objective(str(entry[senses[0]]), senses[0], over)
    check_objectives_differ(objectives, findings)
    return tuple(objectives.values())


def read_constraints(raw: Any, findings: Findings) -> tuple[Constraint, ...]:
    """Read the constraints, "linear_damping >= 0.05", bounds in the key's own unit; add faults to the findings."""
    constraints: dict[str, Constraint] = {}
    for i, text in enumerate(raw if isinstance(raw, list) else []):
        key = f"constraints.{i}"
        match = CONSTRAINT_PATTERN.match(text) if isinstance(text, str) else None
        if match is None or match[2] not in (">=", "<=") or not match[3]:
            findings.add(key, f"{text!r} is no constraint", 'write "linear_damping >= 0.05" or "wear_number <= 200"')
        elif _is_numeric_key(match[1], key, findings):
            try:
                number, unit = split_quantity(match[3])
                bound = convert(number, unit, RESPONSE_KEYS[match[1]].unit) if unit else number
                check_bound(match[1], bound)
                constraints[key] = Constraint(match[1], match[2], bound, text)
            except UnitError as error:
                findings.add(key, error.message, error.remedy)
    check_constraints_agree(constraints, findings)
    return tuple(constraints.values())


def check_tracks(
    raw: Any, directory: Path, findings: Findings, check_track: Callable[[str], object] | None = None
) -> None:
    """Add tracks that are neither a file relative to the directory nor a synthetic track to the findings."""
    tracks = raw if isinstance(raw, list) else [] if raw is None else [raw]
    for i, text in enumerate(tracks):
        key = f"cases.track.{i}" if isinstance(raw, list) else "cases.track"
        if not isinstance(text, str):
            continue
        if re.search(r"\.(csv(\.gz)?|ya?ml)\Z", text):
            if not (directory / text).is_file():
                findings.add(key, f"no file {text!r}", f"give a path relative to {directory}")
            continue
        faulty = [part for part in text.split()[1:] if not TRACK_OPTION.match(part)]
        if not text.split() or faulty:
            findings.add(key, f"{text!r} is no track", "write a name and key=value pairs: erri_b176_low length=2000")
        elif check_track is not None:
            try:
                check_track(text)
            except ValueError as error:
                findings.add(key, str(error), "")


def read_method(raw: Any, objectives: Sequence[Objective], variables: Sequence[Variable], findings: Findings) -> str:
    """Return the kind of search, by default one that suits the number of objectives; add a misfit to the findings."""
    is_single = len(objectives) == 1
    suitable = SINGLE_OBJECTIVE_METHODS if is_single else MULTI_OBJECTIVE_METHODS
    kind = raw.get("kind") if isinstance(raw, dict) else None
    if kind is None:
        default = suitable[0] if len(objectives) < MIN_OBJECTIVES_FOR_NSGA3 else "nsga3"
        return "de" if default == "cmaes" and len(variables) == 1 else default
    if (kind == "nsga3" and is_single) or (kind in SINGLE_OBJECTIVE_METHODS and not is_single):
        what = f"{kind} cannot search {len(objectives)} objective{'s' if len(objectives) != 1 else ''}"
        findings.add("method.kind", what, f"write {' or '.join(suitable)}")
    elif kind == "cmaes" and len(variables) == 1:
        findings.add("method.kind", "cmaes needs at least two variables", "write de")
    return str(kind)
