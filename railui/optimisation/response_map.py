"""Map of responses over two parameters of a design: a grid of vehicles, each evaluated in one case."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import FileProblems, suggest_name
from railui.io.units import quantity
from railui.optimisation.cases import Case
from railui.optimisation.evaluation import Evaluator, ResponseTable, evaluate_in_process
from railui.optimisation.response_keys import CRITICAL_SPEEDS, MAX_SPEED, NUMERIC_KEYS, RESPONSE_KEYS
from railui.optimisation.responses import NONLINEAR_KEYS
from railui.track.excitation import Excitation, TrackSource
from railui.vehicle.contact_profiles import GROUP as PROFILES_GROUP
from railui.vehicle.design_reader import Design
from railui.vehicle.linear import STRAIGHT_TRACK
from railui.vehicle.parameter import is_numbered
from railui.vehicle.resolve import require_rating, resolve_model
from railui.vehicle.sampling import ParameterisedModel

DEFAULT_INTERVALS: Final = 20  # of a range without a step
DIGITS: Final = 12  # of the values of an axis
MIN_VALUES, MAX_VALUES = 2, 400  # of an axis
WITH_SPEED: Final = ("linear_damping",)
WITH_TRACK: Final = ("practical_critical_speed",)


@dataclass(frozen=True, eq=False)
class Axis:
    """Parameter of a map.

    Attributes
    ----------
    name : str
        As given: a path, or a group and a key that all its members have, such as contact.conicity.
    paths : tuple of str
        Paths that have the value.
    unit : str
        SI unit.
    values : array
        Values in SI, increasing.
    """

    name: str
    paths: tuple[str, ...]
    unit: str
    values: FloatArray


def read_axis(design: Design, text: str) -> Axis:
    """Read an axis, PATH=FIRST:LAST or PATH=FIRST:LAST:STEP, in SI or with units; a twentieth of the range by default.

    Raises
    ------
    ValueError
        For an unknown path, a value outside the range of a file, and a range that does not increase.

    Examples
    --------
    >>> from railui.vehicle.design_reader import load_design
    >>> axis = read_axis(load_design("designs/test_bogie.yaml"), "contact.conicity=0.1:0.4:0.1")
    >>> axis.paths, axis.values.round(9).tolist()
    (('contact.leading.conicity', 'contact.trailing.conicity'), [0.1, 0.2, 0.3, 0.4])
    """
    name, equals, words = (part.strip() for part in text.partition("="))
    ends = [end.strip() for end in words.split(":")]
    if not equals or not name or len(ends) not in (2, 3) or not all(ends):
        raise ValueError(f"{text!r} is not an axis: write PATH=FIRST:LAST, such as contact.conicity=0.05:0.4")
    paths = paths_of(design, name)
    unit = design.unit(paths[0])
    low, high = (_value(design, paths, end) for end in ends[:2])
    if not low < high:
        raise ValueError(f"{name}: the range {words} does not increase, write the smaller value first")
    step = quantity(ends[2], unit) if len(ends) == 3 else (high - low) / DEFAULT_INTERVALS
    if not step > 0:
        raise ValueError(f"{name}: the step {ends[2]} is not above 0")
    count = int((high - low) / step + 1e-9) + 1
    if not MIN_VALUES <= count <= MAX_VALUES:
        raise ValueError(f"{name}: {count} values, {MIN_VALUES} to {MAX_VALUES} are possible: change the step")
    # rounded, so that ranges of one step have values in common and 0.1 + 2 x 0.1 is 0.3
    values = [float(f"{low + i * step:.{DIGITS}g}") for i in range(count)]
    return Axis(name, tuple(paths), unit, np.array(values))


def paths_of(design: Design, name: str) -> list[str]:
    """Return the path of a number, or the paths GROUP.MEMBER.KEY of a name GROUP.KEY, which all get one value.

    The name of a number that differs between joints selects those of all joints.

    >>> from railui.vehicle.design_reader import load_design
    >>> paths_of(load_design("designs/test_bogie.yaml"), "vehicle.primary.lateral_stiffness")
    ['vehicle.primary.lateral_stiffness']
    """
    known = [*resolve_model(design).columns, *(p for p in design.paths() if p.startswith(f"{PROFILES_GROUP}."))]
    if name in known or (design.profiles is not None and design.profiles.parameter(name) is not None):
        return [name]
    if numbered := [path for path in known if is_numbered(path) and path.rpartition(".")[0] == name]:
        return numbered
    group, _, key = name.rpartition(".")
    levels = len(name.split(".")) + 1
    members = [
        path
        for path in known
        if path.startswith(f"{group}.") and path.endswith(f".{key}") and len(path.split(".")) == levels
    ]
    if members and len({design.unit(path) for path in members}) == 1:
        return members
    if name.startswith("riding."):
        raise ValueError(f"{name} is a criterion of the assessment, not a parameter of the vehicle")
    raise ValueError(f"no parameter {name!r}, {suggest_name(name, known)}")


def _value(design: Design, paths: Sequence[str], text: str) -> float:
    try:
        return design.with_values(dict.fromkeys(paths, text)).value(paths[0])
    except FileProblems as error:
        problem = error.problems[0]
        raise ValueError(f"{problem.key or paths[0]}: {problem.message}, {problem.remedy}") from None


def check_keys(keys: Collection[str], *, has_track: bool, has_speed: bool) -> None:
    """Raise ValueError for a key that is not a number of ride, stability or curve, or lacks its track or speed."""
    for key in keys:
        if key in RESPONSE_KEYS and RESPONSE_KEYS[key].is_text:
            raise ValueError(f"{key} is a word, not a number: take score, weighted_acceleration or flange_margin")
        if key not in NUMERIC_KEYS:
            raise ValueError(f"{key!r} is no result of ride, stability or curve, {suggest_name(key, NUMERIC_KEYS)}")
        on_track = RESPONSE_KEYS[key].analysis == "ride" or key in WITH_TRACK
        if on_track and not has_track:
            raise ValueError(f"{key} needs a track: give --track")
        if (on_track or key in WITH_SPEED) and key not in WITH_TRACK and not has_speed:
            raise ValueError(f"{key} needs a speed: give --speed")


def check_axes(x: Axis, y: Axis) -> None:
    """Raise ValueError for axes with a common path."""
    if shared := set(x.paths) & set(y.paths):
        raise ValueError(f"{' and '.join(sorted(shared))} on both axes: give two parameters")


def case_of(
    design: Design,
    paths: Sequence[str],
    track: TrackSource | None,
    speed: float | None,
    radius: float = 600.0,
    cant_deficiency: float = 0.0,
) -> Case:
    """Return the case in which vehicles with values at `paths` are evaluated; straight level track by default."""
    if track is not None:
        require_rating(design)
    excitation = Excitation(STRAIGHT_TRACK if track is None else track, 1.0 if speed is None else speed)
    vehicle = ParameterisedModel(resolve_model(design), tuple(paths))
    return Case(excitation, vehicle, 0, 0, radius, cant_deficiency)


def evaluate_vehicles(case: Case, rows: FloatArray, keys: Sequence[str], evaluator: Evaluator) -> ResponseTable:
    """Evaluate vehicles [n, row] in one case; each on its own for slow keys, whose results arrive one by one."""
    if not set(keys) & NONLINEAR_KEYS:
        return evaluator([case], [rows], keys)
    single = evaluator([case] * len(rows), [rows[i : i + 1] for i in range(len(rows))], keys)
    values = {key: column.T for key, column in single.values.items()}
    return ResponseTable(values, single.distance_share.T, single.reasons.T)


def response_map(
    design: Design, x: Axis, y: Axis, keys: Sequence[str], case: Case, evaluator: Evaluator | None = None
) -> dict[str, Any]:
    """Evaluate keys over a grid of two parameters.

    Parameters
    ----------
    design : Design
    x, y : Axis
        Axes without a common path.
    keys : sequence of str
        Keys of ride, stability or curve.
    case : Case
        As `case_of` returns it for the paths of x, then those of y.
    evaluator : Evaluator, optional
        In this process by default.

    Returns
    -------
    dict
        `x`, `y`: name, paths, unit, values; `of`: by key its unit, `values` [y][x], the `baseline` of the design and
        the number of vehicles whose critical speed is `beyond` the range of the search; `failures`: number of vehicles
        by reason; `notes`. NaN for a vehicle that failed, and for a critical speed above the range of the search.

    Raises
    ------
    ValueError
        For axes with a common path.
    """
    check_axes(x, y)
    columns, lines = np.meshgrid(x.values, y.values)
    count = (len(x.paths), len(y.paths))
    points = np.hstack([np.tile(c.reshape(-1, 1), n) for c, n in zip((columns, lines), count, strict=True)])
    own = [[design.value(path) for path in (*x.paths, *y.paths)]]
    rows = case.vehicle.rows(np.vstack([own, points]))
    table = evaluate_vehicles(case, rows, sorted(set(keys)), evaluator or evaluate_in_process())
    has_failed = table.distance_share[:, 0] < 1
    of, notes = {}, []
    for key in keys:
        values = np.where(has_failed, np.nan, table.values[key][:, 0])
        beyond = (key in CRITICAL_SPEEDS) & (values >= MAX_SPEED)
        if np.any(beyond):
            notes.append(f"{key}: null where there is none up to {MAX_SPEED:g} m/s, {int(beyond[1:].sum())} vehicles")
        values = np.where(beyond, np.nan, values)
        unit, grid = RESPONSE_KEYS[key].unit, values[1:].reshape(len(y.values), len(x.values))
        of[key] = {"unit": unit, "values": grid, "baseline": float(values[0]), "beyond": int(beyond[1:].sum())}
    reasons = [str(reason) for reason in table.reasons[1:, 0] if reason]
    return {
        "x": _axis_document(x, design),
        "y": _axis_document(y, design),
        "of": of,
        "failures": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
        "notes": notes,
    }


def _axis_document(axis: Axis, design: Design) -> dict[str, Any]:
    own = {design.value(path) for path in axis.paths}
    return {
        "name": axis.name,
        "paths": list(axis.paths),
        "unit": axis.unit,
        "values": axis.values,
        "baseline": own.pop() if len(own) == 1 else None,
    }
