"""A design: the vehicle's numbers in SI by their dotted paths, and the effects added to the linear model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, Problem, nearest, one_problem
from railui.io.units import UnitError
from railui.vehicle.contact_profiles import ContactProfiles
from railui.vehicle.effect_reader import read_effects, unit_of
from railui.vehicle.effect_records import Catalogue, kernel_catalogue, range_at, record_of
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.load_states import STATE, loaded
from railui.vehicle.multibody import Structure
from railui.vehicle.parameters import BY_USE, PARAMETERS, RIDING, SETTINGS, Parameter, below, settings_of


@dataclass(frozen=True)
class Riding:
    """What the train is for, and what its riding quality is judged by (riding_quality, SI)."""

    use: str
    journey: float
    comfort_weight: float
    admissible_flange_fraction: float
    floor_frequency: float
    floor_damping: float
    cushion_frequency: float | None = None
    cushion_damping: float | None = None
    rms_limit: float | None = None
    peak_limit: float | None = None


@dataclass(frozen=True)
class Adjustment:
    """What adjusted the design: campaign, its hash, the adjusted paths, their covariance (rows, SI)."""

    campaign: str
    sha256: str
    names: tuple[str, ...]
    covariance: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Design:
    """A vehicle as designed: `values` are SI by dotted path.

    `kind` is "bogie", "rig", or "vehicle": one of bodies and elements, whose `structure` says who joins whom.

    `settings` are the words, switches and riding numbers that were given; `warnings` what is odd; `profiles` what the
    contact was measured from, where it was.

    >>> from railui.vehicle.design_reader import parse_design
    >>> design = parse_design("vehicle: {rig: {mass: 95 kg, gain: 2}}")
    >>> design.with_values({"vehicle.rig.mass": "0.1 t"}).value("vehicle.rig.mass")
    100.0
    """

    name: str
    kind: str
    values: Mapping[str, float]
    effects: tuple[PlacedEffect, ...] = ()
    settings: Mapping[str, float | str | bool] = field(default_factory=dict)
    adjustment: Adjustment | None = None
    source: Path | None = None
    sha256: str = ""
    warnings: tuple[Problem, ...] = field(default=(), compare=False)
    catalogue: Catalogue | None = field(default=None, compare=False, repr=False)
    structure: Structure | None = None
    loads: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    load_state: str | None = None
    declared: Mapping[str, float] = field(default_factory=dict, compare=False, repr=False)
    profiles: ContactProfiles | None = field(default=None, compare=False, repr=False)

    @property
    def records(self) -> Mapping[str, Parameter]:
        """The records of the vehicle's numbers by path."""
        return PARAMETERS if self.structure is None else self.structure.parameters

    @property
    def at_places(self) -> Mapping[str, float]:
        """The numbers, and with them what springs and dampers stand at each place where an effect may stand."""
        return self.values if self.structure is None else {**self.values, **self.structure.sites(self.values)}

    @property
    def riding(self) -> Riding:
        """The riding settings with their defaults, which depend on the use."""
        use = str(self.setting("riding.use"))
        numbers = {p.key: self.settings.get(p.path, BY_USE[use].get(p.path, p.default)) for p in RIDING}
        return Riding(use, **numbers)  # type: ignore[arg-type]

    @property
    def gauge_widens_clearance(self) -> bool:
        """Is half the gauge deviation added to the flange clearance?"""
        return bool(self.setting("contact.gauge_widens_clearance"))

    @property
    def rig_input(self) -> str:
        """What u(t) of a rig is: force, base_displacement or base_acceleration."""
        return str(self.setting("vehicle.rig.input"))

    def setting(self, path: str) -> float | str | bool:
        """A word or switch, given or by default."""
        return self.settings.get(path, SETTINGS[path][0])

    def value(self, path: str) -> float:
        """The number at a path, SI; FileProblems naming the nearest path where there is none."""
        if path in self.values:
            return self.values[path]
        if path in PARAMETERS and path.startswith("riding.") and self.kind != "rig":
            number = getattr(self.riding, path.rpartition(".")[2])
            if number is not None:
                return float(number)
        effect, key = self._effect_at(path)
        if effect is not None and isinstance(number := effect.parameters.get(key), float):
            return number
        raise self._unknown(path)

    def paths(self) -> list[str]:
        """Every path that holds one number of the vehicle or of its effects."""
        return [
            *self.values,
            *(
                f"effects.{i}.{k}"
                for i, e in enumerate(self.effects)
                for k, v in e.parameters.items()
                if isinstance(v, float)
            ),
        ]

    def expand(self, path: str) -> list[str]:
        """The paths of a group, or the path itself; FileProblems naming the nearest where it is unknown.

        >>> from railui.vehicle.design_reader import parse_design
        >>> parse_design("vehicle: {rig: {mass: 95}}").expand("vehicle.rig")[:2]
        ['vehicle.rig.mass', 'vehicle.rig.stiffness']
        """
        found = below(path, self.paths())
        if not found:
            raise self._unknown(path)
        return found

    def parameter(self, path: str) -> Parameter:
        """The record of a path: symbol, unit, caption, range; that of an effect comes from the catalogue."""
        if path in self.values:
            return self.records[path]
        if self.kind != "rig" and path.startswith("riding.") and path in PARAMETERS:
            return PARAMETERS[path]
        effect, key = self._effect_at(path)
        record = record_of(effect.kind, self._catalogue()) if effect is not None else None
        found = next((p for p in (record or {}).get("parameters", ()) if p["key"] == key), None)
        if effect is None or record is None or found is None:
            raise self._unknown(path)
        low, high = range_at(found, effect.at, self.at_places)
        unit, title = (
            unit_of(found, effect.at, effect.against),
            f"{key.replace('_', ' ')} of the {record['title']}",
        )
        return Parameter(
            path,
            str(found["symbol"]),
            unit,
            title,
            origin=str(found.get("origin", "")),
            minimum=low,
            maximum=high,
            usual=(low, high),
        )

    def unit(self, path: str) -> str:
        """The SI unit of a path."""
        return self.parameter(path).unit

    def with_values(self, changes: Mapping[str, Any]) -> Design:
        """A new design with some values changed: SI numbers or quantities; FileProblems otherwise."""
        findings = Findings("override")
        values, settings = dict(self.values), dict(self.settings)
        entries = [effect.entry(given_only=True) for effect in self.effects]
        state = self.load_state
        if STATE in changes:
            state = str(changes[STATE])
            try:
                values = loaded(self, state)
            except UnitError as error:
                findings.add(STATE, error.message, error.remedy)
        for path, value in changes.items():
            if path != STATE:
                self._change(path, value, values, settings, entries, findings)
        changed = replace(self, values=values, settings=settings, load_state=state)
        return changed._with_entries(entries, findings)

    def with_effects(self, effects: Iterable[PlacedEffect]) -> Design:
        """A new design with these effects, checked against the catalogue; FileProblems otherwise."""
        return self._with_entries([effect.entry() for effect in effects], Findings("effects"))

    def resolved(self) -> dict[str, Any]:
        """All that decides what the design does, defaults written out: for content hashes."""
        words = {p: self.setting(p) for p in SETTINGS if p in settings_of(self.kind)}
        riding = vars(self.riding) if self.kind != "rig" else None
        built = {} if self.structure is None else {"structure": self.structure.words()}
        return {
            "kind": self.kind,
            **built,
            "values": dict(self.values),
            "settings": words,
            "riding": riding,
            "effects": [effect.entry() for effect in self.effects],
        }

    def _with_entries(self, entries: list[dict[str, Any]], findings: Findings) -> Design:
        effects = read_effects(
            entries, findings, "effects", self._catalogue() if entries else (), self.values, form=self.kind,
            structure=self.structure,
        )  # fmt: skip
        findings.stop()
        return replace(self, effects=effects)

    def _change(
        self,
        path: str,
        value: Any,
        values: dict[str, float],
        settings: dict[str, Any],
        entries: list[dict[str, Any]],
        findings: Findings,
    ) -> None:
        effect, key = self._effect_at(path)
        try:
            if path in values:
                values[path] = self.records[path].read(value)
            elif path in settings_of(self.kind):
                settings[path] = read_setting(path, value)
            elif effect is not None:
                entries[int(path.split(".")[1])][key] = value
            else:
                findings.problems += self._unknown(path).problems
        except UnitError as error:
            findings.add(path, error.message, error.remedy)

    def _effect_at(self, path: str) -> tuple[PlacedEffect | None, str]:
        steps = path.split(".")
        if len(steps) == 3 and steps[0] == "effects" and steps[1].isdecimal() and int(steps[1]) < len(self.effects):
            return self.effects[int(steps[1])], steps[2]
        return None, ""

    def _catalogue(self) -> Catalogue:
        return kernel_catalogue() if self.catalogue is None else self.catalogue

    def _unknown(self, path: str) -> FileProblems:
        known = [*self.paths(), *settings_of(self.kind)]
        name = "design" if self.source is None else str(self.source)
        if group := below(path, self.paths()):
            told = f"name one of them, such as {group[0]}"
            return one_problem(name, f"is a group of {len(group)} numbers", told, path)
        groups = {p[:i] for p in known for i, c in enumerate(p) if c == "."}
        ends = [p for p in known if p.rpartition(".")[2] == path.rpartition(".")[2]]
        told = f"did you mean {ends[0]!r}?" if ends and path not in ends else nearest(path, [*known, *sorted(groups)])
        return one_problem(name, "no such parameter", told, path)


def read_setting(path: str, value: Any) -> float | str | bool:
    """The value of a word, switch or riding number; UnitError where it does not fit."""
    if path in PARAMETERS:
        return PARAMETERS[path].read(value)
    choices = SETTINGS[path]
    if isinstance(choices[0], bool) and isinstance(value, str) and value in ("true", "false"):
        value = value == "true"
    if not any(value is choice or (isinstance(value, str) and value == choice) for choice in choices):
        words = [str(choice).lower() if isinstance(choice, bool) else choice for choice in choices]
        raise UnitError(f"{value!r} is not known here", nearest(str(value), map(str, words)))
    return value  # type: ignore[no-any-return]
