"""Reading effects of a file: kind, location, wheelset and numbers, checked against the catalogue."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from railui.io.problems import Findings, suggest_name
from railui.io.units import UnitError, quantity, quantity_in_any_unit
from railui.io.yaml_nodes import join_path
from railui.runs.columns import RIG_COLUMNS, columns_of
from railui.vehicle.effects import (
    WHEELSET_LOCATIONS,
    Catalogue,
    Number,
    PlacedEffect,
    Record,
    default_at,
    has_abscissa,
    has_absolute_range,
    has_equal_steps,
    is_curve,
    is_sensor,
    parameter_unit,
    range_at,
    record_of,
    unit_at,
)
from railui.vehicle.multibody import Structure

ABSCISSAE = ("z", "v", "s")
SUPERSEDED_TERMS = {
    "stiffness": ("linear stiffness",),
    "stiffness_and_damping": ("linear stiffness", "linear damping"),
    "creep_forces": ("linear creep forces",),
    "rolling_radii": ("linear rolling radii",),
    "rigid_rail": ("rigid rail",),
}


def read_effects(
    raw: Sequence[Any],
    findings: Findings,
    path: str,
    catalogue: Catalogue,
    values: Mapping[str, float],
    *,
    form: str = "bogie",
    sensors: bool = False,
    structure: Structure | None = None,
) -> tuple[PlacedEffect, ...]:
    """Read a list of effects; problems join `findings`.

    Parameters
    ----------
    raw : sequence
        Entries of the file.
    findings : Findings
    path : str
        Path of the list in the file.
    catalogue : sequence of records
    values : mapping
        Numbers of the vehicle, on which defaults depend.
    form : str
        Kind of the vehicle.
    sensors : bool
        True for effects of sensors.
    structure : Structure, optional
        Bodies and elements of a multibody vehicle.
    """
    if structure is not None:
        values = {**values, **structure.site_values(values)}
    reader = _EffectReader(findings, catalogue, values, form, sensors, structure)
    read = {i: reader.read(entry, join_path(path, str(i))) for i, entry in enumerate(raw)}
    effects = {i: effect for i, effect in read.items() if effect is not None}
    check_conflicts(effects, findings, path, catalogue)
    return tuple(effects.values())


def check_conflicts(effects: Mapping[int, PlacedEffect], findings: Findings, path: str, catalogue: Catalogue) -> None:
    """Report effects that supersede the same linear term at the same location."""
    superseded: list[tuple[str, int, PlacedEffect]] = []
    for i, effect in effects.items():
        record = record_of(effect.kind, catalogue) or {}
        terms = SUPERSEDED_TERMS.get(str(record.get("supersedes")), ())
        clash = next(
            ((t, j, o) for t, j, o in superseded if t in terms and o.at == effect.at and _share_wheelset(o, effect)),
            None,
        )
        if clash is not None:
            term, j, other = clash
            pair = f"{effect.kind} and {other.kind} ({join_path(path, str(j))})"
            message = f"{pair} both supersede the {term} at {effect.at}"
            findings.add(join_path(path, str(i)), message, "leave one of them out")
        superseded += [(term, i, effect) for term in terms]


def _share_wheelset(a: PlacedEffect, b: PlacedEffect) -> bool:
    return a.wheelset is None or b.wheelset is None or a.wheelset == b.wheelset


@dataclass(frozen=True)
class _EffectReader:
    findings: Findings
    catalogue: Catalogue
    values: Mapping[str, float]
    form: str
    sensors: bool
    structure: Structure | None = None

    def add(self, path: str, key: str, message: str, remedy: str) -> None:
        """Add an error at a key of an effect."""
        self.findings.add(join_path(path, key), message, remedy)

    def read(self, raw: Any, path: str) -> PlacedEffect | None:
        if not isinstance(raw, dict):
            self.findings.add(
                path, "is not an effect", "write {kind: free_play, at: primary_lateral, half_width: 0.3 mm}"
            )
            return None
        record = self.read_record(raw, path)
        if record is None:
            return None
        at = self.read_location(raw, record, path)
        wheelset = self.read_wheelset(raw, at, path) if at else None
        against = self.read_abscissa(raw, record, path)
        known = ["kind", "at", "wheelset", *(["against"] if has_abscissa(record) else [])]
        known += [str(p["key"]) for p in record["parameters"]]
        for key in raw:
            if key not in known:
                remedy = suggest_name(key, known)
                self.findings.add(join_path(path, key), f"unknown key of {record['kind']}", remedy, key=True)
        if at is None:
            return None
        return self.read_numbers(raw, record, at, wheelset, against, path)

    def read_record(self, raw: Mapping[str, Any], path: str) -> Record | None:
        kinds = [str(r["kind"]) for r in self.catalogue if is_sensor(r) == self.sensors]
        if "kind" not in raw:
            self.findings.add(path, "has no kind", f"add `kind:`, one of {', '.join(kinds)}")
            return None
        record = record_of(str(raw["kind"]), self.catalogue)
        if record is None:
            self.add(path, "kind", f"unknown kind {raw['kind']!r}", suggest_name(str(raw["kind"]), kinds))
        elif is_sensor(record) != self.sensors:
            owner, other = ("the vehicle", "a sensor") if self.sensors else ("a sensor", "a vehicle")
            remedy = "move it to `effects` of the design" if self.sensors else "move it to `sensors` of the campaign"
            self.add(path, "kind", f"{raw['kind']} belongs to {owner}, not to {other}", remedy)
            return None
        return record

    def read_location(self, raw: Mapping[str, Any], record: Record, path: str) -> str | None:
        if self.sensors:
            locations = [at for at in map(str, record["at"]) if at in columns_of(self.form)]
        elif self.structure is not None:
            locations = self.multibody_locations(record, self.structure)
        else:
            locations = [at for at in map(str, record["at"]) if (at == "rig") == (self.form == "rig")]
        at = raw.get("at")
        if at is None and len(locations) == 1:
            return locations[0]
        if at is None:
            self.findings.add(path, f"{record['kind']} has no location", f"add `at:`, one of {', '.join(locations)}")
        elif not locations:
            self.add(path, "at", f"{record['kind']} has no location at a {self.form}", "leave it out")
        elif at not in locations:
            self.add(path, "at", f"{record['kind']} is not possible at {at!r}", suggest_name(str(at), locations))
        else:
            return str(at)
        return None

    @staticmethod
    def multibody_locations(record: Record, structure: Structure) -> list[str]:
        """Return the locations of a multibody vehicle, which has a carbody itself and takes no coach_mode."""
        if record.get("acts") == "body":
            return []
        return [at for at, location in structure.effect_locations.items() if location.catalogue_name in record["at"]]

    def read_wheelset(self, raw: Mapping[str, Any], at: str, path: str) -> int | None:
        wheelset = raw.get("wheelset")
        if wheelset is None:
            return None
        if self.structure is not None:
            numbers = [n for n in self.structure.effect_locations[at].numbers if n]
            if wheelset not in numbers or isinstance(wheelset, bool):
                remedy = f"write one of {numbers}, or leave the key out for all" if numbers else "leave the key out"
                self.add(path, "wheelset", f"{at} has no number {wheelset!r}", remedy)
                return None
            return int(wheelset)
        if at not in WHEELSET_LOCATIONS:
            self.add(path, "wheelset", f"{at} has no wheelset", "leave the key out")
        elif isinstance(wheelset, bool) or wheelset not in (1, 2):
            self.add(
                path,
                "wheelset",
                f"{wheelset!r} is not a wheelset",
                "write 1 (leading) or 2 (trailing), or leave the key out for both",
            )
        else:
            return int(wheelset)
        return None

    def read_abscissa(self, raw: Mapping[str, Any], record: Record, path: str) -> str | None:
        if not has_abscissa(record):
            return None
        against = raw.get("against", "z")
        if against not in ABSCISSAE:
            self.add(
                path,
                "against",
                f"{against!r} is none of z, v, s",
                "write the abscissa of the curve: z, v or s",
            )
            return None
        return str(against)

    def read_numbers(
        self,
        raw: Mapping[str, Any],
        record: Record,
        at: str,
        wheelset: int | None,
        against: str | None,
        path: str,
    ) -> PlacedEffect | None:
        read: dict[str, Number] = {}
        defaulted: set[str] = set()
        before = len(self.findings.problems)
        for parameter in record["parameters"]:
            key, where = str(parameter["key"]), join_path(path, str(parameter["key"]))
            unit = parameter_unit(parameter, at, against)
            try:
                if raw.get(key) is not None:
                    read[key] = _read_value(raw[key], parameter, at, unit, self.values, curve=is_curve(record))
                elif not parameter.get("optional"):
                    default = None if is_curve(record) else default_at(parameter, at, self.values)
                    if default is None:
                        raise UnitError("is missing and has no default here", f"add `{key}:` with a unit like {unit}")
                    read[key] = default
                    defaulted.add(key)
            except UnitError as error:
                self.findings.add(where, error.message, error.remedy)
        if is_curve(record):
            self.check_curve(read, [str(p["key"]) for p in record["parameters"]], path, even=has_equal_steps(record))
        if len(self.findings.problems) > before:
            return None
        return PlacedEffect(str(record["kind"]), at, wheelset, read, against, frozenset(defaulted))

    def check_curve(self, read: Mapping[str, Number], keys: Sequence[str], path: str, *, even: bool) -> None:
        """Check that lists have equal length and the first one rises, by equal steps if `even`."""
        first = read.get(keys[0])
        if not isinstance(first, tuple):
            return
        for key in keys[1:]:
            other = read.get(key)
            if isinstance(other, tuple) and (len(other) != len(first) or len(first) < 2):
                message = f"has {len(other)} values, {keys[0]} has {len(first)}"
                self.add(path, key, message, "give the same number of values, at least two")
                return
        steps = [b - a for a, b in pairwise(first)]
        if min(steps, default=0.0) <= 0.0:
            remedy = f"sort the curve by its {keys[0]}"
            self.add(path, keys[0], "does not rise from value to value", remedy)
        elif even and max(steps) > 1.001 * min(steps):
            self.add(path, keys[0], "has unequal steps", "space the values equally")


def _read_value(
    value: Any, parameter: Record, at: str, unit: str, values: Mapping[str, float], *, curve: bool
) -> Number:
    if not curve:
        return _check_range(_read_number(value, at, unit), value, parameter, at, values)
    if not isinstance(value, Iterable) or isinstance(value, str | dict):
        raise UnitError("is not a list", "write [one, two, ...]")
    return tuple(_check_range(_read_number(item, at, unit), item, parameter, at, values) for item in value)


def _read_number(value: Any, at: str, unit: str) -> float:
    return quantity_in_any_unit(value) if at == "rig" or at in RIG_COLUMNS else quantity(value, unit)


def _check_range(number: float, value: Any, parameter: Record, at: str, values: Mapping[str, float]) -> float:
    low, high = range_at(parameter, at, values)
    lowest = float(parameter["minimum"]) if parameter.get("minimum") is not None else -1.0
    if number < 0 <= lowest or (number == 0 < lowest):
        raise UnitError(f"{value!r} is too small", f"give a value above {'0' if lowest else 'or equal to 0'}")
    loose = 1e-9 * abs(number)  # a fit may end on the bound
    if has_absolute_range(parameter) and not low - loose <= number <= high + loose:
        unit = unit_at(str(parameter["unit"]), at)
        raise UnitError(
            f"{value!r} is out of range", f"give {low:.6g} to {high:.6g}{'' if unit == '1' else f' {unit}'}"
        )
    return number
