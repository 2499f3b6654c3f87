"""Reader of wheel and rail profiles: SIMPACK's .prw and .prr, and text of two columns."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from railui.arrays import FloatArray
from railui.io.problems import Findings, file_problem
from railui.io.units import UnitError, parse_unit, quantity
from railui.io.yaml_document import read_text

if TYPE_CHECKING:
    from railui.contact.profile import Kind, Profile

SIMPACK_KINDS: dict[str, Kind] = {".prw": "wheel", ".prr": "rail"}
SIMPACK_TYPES = {0.0: "rail", 1.0: "wheel"}
MAX_REPORTED = 10  # faulty lines of one file
SETTING = re.compile(r"\s*([A-Za-z][\w.]*)\s*=\s*('[^']*'|\S+)")
HEADED = re.compile(r"\s*([A-Za-z]\w*)\s*(?:\[([^\]]*)\])?\s*\Z")
MILLIMETRES = (20.0, 400.0)  # widths of a profile in mm
METRES = (0.02, 0.4)  # widths of a profile in m
MAX_INCLINATION = 0.2  # rad


@dataclass(frozen=True)
class _Points:
    """Points of a file [m], the line of each, notes on their transformation."""

    y: FloatArray
    z: FloatArray
    lines: tuple[int, ...]
    notes: tuple[str, ...] = ()


def read_profile(path: str | Path, kind: Kind, *, mirror: bool = False, smoothing: float = 0.0) -> Profile:
    """Read a profile.

    SIMPACK's flags and units are applied. Text has two columns, y and z, optionally with a header `y [mm], z [mm]`. y
    of a rail points outward, away from the gauge face, that of a wheel to either side; z up or down. Without units,
    mm or m is inferred from the width.

    Parameters
    ----------
    path : str or Path
        File.
    kind : {"wheel", "rail"}
        Kind of profile.
    mirror : bool
        Exchange inside and outside of a rail.
    smoothing : float
        Cut-off wavelength of a Gaussian filter [m]; 0 for none.

    Raises
    ------
    FileProblems
        With file, line and remedy.
    """
    from railui.contact.profile import Profile, ProfileError

    path = Path(path)
    text = read_text(path)
    simpack = path.suffix.lower() in SIMPACK_KINDS or "point.begin" in text
    points = (_simpack if simpack else _text)(text, str(path), kind)
    try:
        profile = Profile.from_points(kind, points.y, points.z, path.name)
        if kind == "rail" and mirror:
            profile = profile.mirrored()
        if smoothing:
            profile = profile.smoothed(smoothing)
    except ProfileError as fault:
        line = points.lines[fault.point] if fault.point is not None else 0
        raise file_problem(path, fault.message, fault.remedy, position=(line, 1 if line else 0)) from None
    return Profile(profile.kind, profile.y, profile.h, profile.name, (*points.notes, *profile.notes))


def _simpack(text: str, file: str, kind: str) -> _Points:
    findings = Findings(file)
    settings: dict[str, tuple[str, int]] = {}
    rows: list[list[float]] = []
    lines: list[int] = []
    inside = False
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("!")[0]
        if "point.begin" in bare or "point.end" in bare:
            inside = "point.begin" in bare
        elif inside and bare.strip():
            cells = _numbers(bare.split(), findings, number)
            if cells is not None and len(cells) >= 2:
                rows.append(cells[:2])
                lines.append(number)
        elif not inside and (setting := SETTING.match(bare)):
            # the first type is that of the header; that of the original data file follows and is another number
            settings.setdefault(setting[1], (setting[2].strip("'"), number))
    _raise_errors(findings)
    values: dict[str, float] = {}
    for key, (word, number) in settings.items():
        if key.split(".")[0] in ("units", "mirror", "shift", "bound", "rotate", "inversion", "type"):
            read = _numbers([word], findings, number)
            if read is not None:
                values[key] = read[0]
    findings.raise_errors()
    _check_kind(values, settings, kind, findings)
    if not rows:
        findings.add("", "has no points", "list them between point.begin and point.end", position=(1, 1))
    findings.raise_errors()
    return _transformed(np.array(rows), tuple(lines), values, findings)


def _check_kind(values: dict[str, float], settings: dict[str, tuple[str, int]], kind: str, findings: Findings) -> None:
    name = SIMPACK_KINDS.get(Path(findings.file).suffix.lower()) or SIMPACK_TYPES.get(values.get("type", -1.0))
    if name is not None and name != kind:
        line = settings.get("type", ("", 1))[1]
        findings.add("", f"is a {name} profile where a {kind} belongs", "give the wheel first, then the rail",
                     position=(line, 1))  # fmt: skip


def _transformed(p: FloatArray, lines: tuple[int, ...], values: dict[str, float], findings: Findings) -> _Points:
    """Apply SIMPACK's processing in its order: shift, rotation, bounds, mirrors, inversion, units."""
    get = values.get
    y, z = p[:, 0] + get("shift.y", 0.0), p[:, 1] + get("shift.z", 0.0)
    angle = get("rotate", 0.0) / (get("units.ang.f", 1.0) or 1.0)
    y, z = np.cos(angle) * y - np.sin(angle) * z, np.sin(angle) * y + np.cos(angle) * z
    inside = np.ones(len(y), dtype=bool)
    for axis, points in (("y", y), ("z", z)):
        low, high = get(f"bound.{axis}.min", 1.0), get(f"bound.{axis}.max", 0.0)
        if low <= high:
            inside &= (points >= low) & (points <= high)
    y, z, numbers = y[inside], z[inside], [line for line, k in zip(lines, inside, strict=True) if k]
    notes = []
    for axis in "yz":
        if get(f"mirror.{axis}", 0.0):
            y, z = (-y, z) if axis == "y" else (y, -z)
            notes.append(f"{axis} mirrored by a flag of the file")
    if get("inversion", 0.0):
        y, z, numbers = y[::-1], z[::-1], numbers[::-1]
    factor = get("units.len.f", 1.0)
    if not factor > 0.0:
        findings.add("units.len.f", f"{factor:g} is not a unit factor", "give lengths per metre: 1000 for mm")
    findings.raise_errors()
    return _Points(y / factor, z / factor, tuple(numbers), tuple(notes))


def _text(text: str, file: str, kind: str) -> _Points:
    findings = Findings(file)
    rows: list[list[float]] = []
    lines: list[int] = []
    factors: list[float | None] = [None, None]
    for number, line in enumerate(text.splitlines(), 1):
        bare = re.split(r"[#!%]", line)[0].strip()
        if not bare:
            continue
        cells = _cells(bare)
        if not rows and any(HEADED.match(cell) for cell in cells):
            factors = [_factor(cell, findings, number) for cell in cells[:2]]
            continue
        read = _numbers(cells, findings, number)
        if read is not None and len(read) < 2:
            findings.add("", f"{bare[:30]!r} is a single number", "write y and z of a point", position=(number, 1))
        elif read is not None:
            rows.append(read[:2])
            lines.append(number)
    if not rows and not findings.problems:
        findings.add("", "has no points", "write y and z of a point on each line", position=(1, 1))
    _raise_errors(findings)
    p = np.array(rows)
    if factors[0] is None or factors[1] is None:
        factors = [_metres_per_unit(float(np.ptp(p[:, 0])), kind, findings)] * 2
    y, z = (p[:, i] * float(factors[i] or 1.0) for i in (0, 1))
    return _Points(y, z, tuple(lines))


def _raise_errors(findings: Findings) -> None:
    """Raise FileProblems for faulty lines: the first ten, and the number of the others."""
    more = len(findings.problems) - MAX_REPORTED
    if more > 0:
        del findings.problems[MAX_REPORTED:]
        findings.add("", f"{more} more lines are faulty", "is it the file of a profile?")
    findings.raise_errors()


def _cells(line: str) -> list[str]:
    if ";" in line:
        return [cell.strip().replace(",", ".") for cell in line.split(";") if cell.strip()]
    if "[" in line:
        return [cell.strip() for cell in re.split(r",|(?<=\])\s+", line) if cell.strip()]
    return [cell for cell in re.split(r"[,\s]+", line) if cell]


def _numbers(cells: list[str], findings: Findings, line: int) -> list[float] | None:
    out = []
    for cell in cells[:3]:
        try:
            out.append(float(cell.replace("D", "E").replace("d", "e")))
        except ValueError:
            findings.add("", f"{cell!r} is not a number", "write y and z of a point", position=(line, 1))
            return None
    return out


def _factor(cell: str, findings: Findings, line: int) -> float | None:
    header = HEADED.match(cell)
    if not header or not header[2]:
        return None
    try:
        unit = parse_unit(header[2])
        if unit.dimension != parse_unit("m").dimension:
            raise UnitError(f"{header[2]} is not a length", "write y [mm], z [mm]")
    except UnitError as error:
        findings.add("", error.message, error.remedy, position=(line, 1))
        return None
    return unit.factor


def _metres_per_unit(width: float, kind: str, findings: Findings) -> float:
    """Return the factor to metres for a profile without units, from its width."""
    if MILLIMETRES[0] <= width <= MILLIMETRES[1]:
        return 1e-3
    if METRES[0] <= width <= METRES[1]:
        return 1.0
    fault = f"the {kind} profile is {width:.4g} wide: neither mm nor m"
    findings.add("", fault, "give the unit in the header, `y [mm], z [mm]`", position=(1, 1))
    findings.raise_errors()
    return 1.0


def read_inclination(value: object) -> float:
    """Return an inclination of the rails [rad] from "1:40" or an angle; raise UnitError for anything else.

    >>> round(read_inclination("1:40"), 6), read_inclination("0")
    (0.024995, 0.0)
    """
    text = str(value)
    up, colon, along = text.partition(":")
    remedy = "write 1:40, 1:20 or 0"
    try:
        angle = math.atan(float(up) / float(along)) if colon else quantity(_plain(value), "rad")
    except (ValueError, ZeroDivisionError):
        raise UnitError(f"{text!r} is not an inclination", remedy) from None
    if not abs(angle) <= MAX_INCLINATION:
        raise UnitError(f"{text!r} is an inclination of {math.degrees(angle):.3g} degrees", remedy)
    return angle


def _plain(value: object) -> object:
    try:
        return float(str(value))
    except ValueError:
        return value
