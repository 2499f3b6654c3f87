"""Design of a vehicle: numbers in SI by dotted path, and effects added to the linear model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import isclose
from pathlib import Path
from typing import Any

from railui.io.problems import FileProblems, Findings, Problem, file_problem, suggest_name
from railui.io.units import UnitError
from railui.runs.columns import Form
from railui.vehicle.contact_profiles import USE_PATH, ContactProfiles
from railui.vehicle.design_groups import Adjustment, RidingSettings
from railui.vehicle.effect_reader import read_effects
from railui.vehicle.effects import Catalogue, PlacedEffect, effect_parameter, kernel_catalogue
from railui.vehicle.load_states import STATE_PATH, values_in_load_state
from railui.vehicle.multibody import Structure
from railui.vehicle.parameter import Parameter
from railui.vehicle.parameters import (
    BENCH_PARAMETERS,
    DEFAULTS_BY_USE,
    PARAMETERS,
    RIDING,
    SETTINGS,
    expand_path,
    parse_setting,
    setting_paths,
)
from railui.vehicle.profiles_following import follow_profiles, parse_use
from railui.vehicle.sensors import vehicle_columns

__all__ = ["Adjustment", "Design", "RidingSettings"]

SAME_VALUE = 1e-9  # relative: a number that was written in another unit and read again


@dataclass(frozen=True)
class Design:
    """Vehicle with its parameters and effects.

    Attributes
    ----------
    name : str
    kind : str
        "bogie", "rig", or "vehicle" for bodies and elements.
    values : mapping
        Numbers in SI by dotted path.
    effects : tuple of PlacedEffect
    settings : mapping
        Words, switches and riding numbers that the file gives.
    structure : Structure or None
        Bodies and elements of a "vehicle".
    load_states : mapping
        Changed values by path, of each load state.
    load_state : str or None
        Active load state.
    unloaded_values : mapping
        Values without the changes of a load state.
    profiles : ContactProfiles or None
        Profiles from which contact parameters were computed.
    warnings : tuple of Problem

    Examples
    --------
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
    load_states: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    load_state: str | None = None
    unloaded_values: Mapping[str, float] = field(default_factory=dict, compare=False, repr=False)
    profiles: ContactProfiles | None = field(default=None, compare=False, repr=False)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameter records of the vehicle's numbers by path, without those of `contact.profiles`."""
        if self.structure is not None:
            return self.structure.parameters
        return BENCH_PARAMETERS if self.form == "bench" else PARAMETERS

    @property
    def values_with_sites(self) -> Mapping[str, float]:
        """Values, with the stiffness and damping of the suspension at each location of effects."""
        return self.values if self.structure is None else {**self.values, **self.structure.site_values(self.values)}

    @property
    def riding(self) -> RidingSettings:
        """Settings of the ride quality assessment; defaults depend on the use."""
        use = str(self.setting("riding.use"))
        numbers = {p.key: self.settings.get(p.path, DEFAULTS_BY_USE[use].get(p.path, p.default)) for p in RIDING}
        return RidingSettings(use, **numbers)  # type: ignore[arg-type]

    @property
    def gauge_widens_clearance(self) -> bool:
        """True if half the gauge deviation is added to the flange clearance."""
        return bool(self.setting("contact.gauge_widens_clearance"))

    @property
    def rig_input(self) -> str:
        """Input u(t) of a rig: force, base_displacement, base_acceleration, or motion of a component on a bench."""
        return str(self.setting("vehicle.rig.input"))

    @property
    def form(self) -> str:
        """Form of the design's runs: its kind, or "bench" for a rig whose motion is prescribed."""
        return "bench" if self.kind == "rig" and self.rig_input == "motion" else self.kind

    @property
    def run_form(self) -> Form:
        """Form of the design's runs, or of a vehicle of bodies the columns that its runs may have."""
        return self.form if self.structure is None else vehicle_columns(self.structure)

    @property
    def is_on_track(self) -> bool:
        """True for a vehicle that runs on a track, false for a test bench."""
        return self.kind != "rig"

    @property
    def is_on_rollers(self) -> bool:
        """True for a vehicle whose wheelsets all run on the rollers of a rig."""
        wheelsets = () if self.structure is None else self.structure.wheelsets
        return bool(wheelsets) and all(w.is_on_rollers for w in wheelsets)

    @property
    def has_wheelset_equations(self) -> bool:
        """True where the equations of two wheelsets and a frame are those of thesis 3.4."""
        return self.kind == "bogie"

    @property
    def has_sprung_bodies(self) -> bool:
        """True for a vehicle of bodies with more than wheelsets: on soft springs they decay slowly at any speed."""
        return self.structure is not None and bool(self.structure.bodies)

    def setting(self, path: str) -> float | str | bool:
        """Return a word, switch or riding number, or its default."""
        return self.settings.get(path, SETTINGS[path][0])

    def value(self, path: str) -> float:
        """Return the number at a path [SI].

        Raises
        ------
        FileProblems
            If the path is unknown; the message suggests the nearest one.
        """
        if path in self.values:
            return self.values[path]
        if self.profiles is not None and self.profiles.parameter(path) is not None:
            return self.profiles.number(self.values, path)
        if path in PARAMETERS and path.startswith("riding.") and self.kind != "rig":
            number = getattr(self.riding, path.rpartition(".")[2])
            if number is not None:
                return float(number)
        effect, key = self._effect_at(path)
        if effect is not None and isinstance(number := effect.parameters.get(key), float):
            return number
        raise self._unknown_path(path)

    def paths(self) -> list[str]:
        """Return the path of every number of the vehicle and of its effects."""
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
        """Return the paths of a group, or the path itself; FileProblems if it is unknown.

        >>> from railui.vehicle.design_reader import parse_design
        >>> parse_design("vehicle: {rig: {mass: 95}}").expand("vehicle.rig")[:2]
        ['vehicle.rig.mass', 'vehicle.rig.stiffness']
        """
        found = expand_path(path, self.paths())
        if not found:
            raise self._unknown_path(path)
        return found

    def parameter(self, path: str) -> Parameter:
        """Return symbol, unit, caption and range of a path; those of an effect come from the catalogue."""
        if (record := self._own_record(path)) is not None:
            return record
        if self.kind != "rig" and path.startswith("riding.") and path in PARAMETERS:
            return PARAMETERS[path]
        effect, key = self._effect_at(path)
        record = None
        if effect is not None:
            record = effect_parameter(effect, key, path, self._catalogue(), self.values_with_sites)
        if record is None:
            raise self._unknown_path(path)
        return record

    def unit(self, path: str) -> str:
        """Return the SI unit of a path."""
        return self.parameter(path).unit

    def with_values(self, changes: Mapping[str, Any]) -> Design:
        """Return a design with changed values.

        Parameters
        ----------
        changes : mapping
            SI numbers, or quantities such as "3 MN/m", by path; `load.state` selects a load state.

        Raises
        ------
        FileProblems
            If a path is unknown or a value does not fit.
        """
        findings = Findings("override")
        values, settings = dict(self.values), dict(self.settings)
        entries = [effect.entry(given_only=True) for effect in self.effects]
        state = self.load_state
        if STATE_PATH in changes:
            state = str(changes[STATE_PATH])
            try:
                values = values_in_load_state(self, state)
            except UnitError as error:
                findings.add(STATE_PATH, error.message, error.remedy)
        for path, value in changes.items():
            members = (path,) if self.structure is None else self.structure.paths_of(path)
            for member in members if path != STATE_PATH else ():
                self._apply_change(member, value, values, settings, entries, findings)
        changed = replace(self, values=values, settings=settings, load_state=state)
        if self.profiles is not None:
            changed, entries = follow_profiles(self, changed, changes, entries, findings)
        return changed._with_effect_entries(entries, findings)

    def is_set_by_hand(self, path: str) -> bool:
        """Return whether an estimated parameter no longer has its estimate, or no longer exists."""
        adjustment = self.adjustment
        if adjustment is None or path not in adjustment.names or not adjustment.estimates:
            return False
        estimate = adjustment.estimates[adjustment.names.index(path)]
        try:
            return not isclose(self.value(path), estimate, rel_tol=SAME_VALUE)
        except ValueError:
            return True

    @property
    def present_adjustment(self) -> Adjustment | None:
        """Adjustment of the parameters that still have their estimates: others have no deviation; None without any."""
        if self.adjustment is None:
            return None
        numbers = [i for i, name in enumerate(self.adjustment.names) if not self.is_set_by_hand(name)]
        if len(numbers) == len(self.adjustment.names):
            return self.adjustment
        return self.adjustment.restricted(numbers) if numbers else None

    def detached(self) -> Design:
        """Return the same design whose contact parameters no longer follow its profiles."""
        return self if self.profiles is None else replace(self, profiles=self.profiles.detached())

    def with_effects(self, effects: Iterable[PlacedEffect]) -> Design:
        """Return a design with these effects; FileProblems if one does not fit the catalogue."""
        return self._with_effect_entries([effect.entry() for effect in effects], Findings("effects"))

    def content(self) -> dict[str, Any]:
        """Return everything that affects a simulation, with defaults, for content hashes."""
        words = {p: self.setting(p) for p in SETTINGS if p in setting_paths(self.kind)}
        if self.profiles is not None:
            words |= {USE_PATH: self.profiles.present_use(effect.kind for effect in self.effects)}
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

    def _with_effect_entries(self, entries: list[dict[str, Any]], findings: Findings) -> Design:
        catalogue = self._catalogue() if entries else ()
        effects = read_effects(
            entries, findings, "effects", catalogue, self.values, form=self.kind, structure=self.structure
        )
        findings.raise_errors()
        return replace(self, effects=effects)

    def _apply_change(
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
            if (record := self._own_record(path)) is not None:
                values[path] = record.read(value)
            elif path == USE_PATH and self.profiles is not None:
                parse_use(value)
            elif path in setting_paths(self.kind):
                settings[path] = parse_setting(path, value)
            elif effect is not None:
                entries[int(path.split(".")[1])][key] = value
            else:
                findings.problems += self._unknown_path(path).problems
        except UnitError as error:
            findings.add(path, error.message, error.remedy)

    def _own_record(self, path: str) -> Parameter | None:
        """Return the record of a number of the vehicle or of its profiles; None for another path."""
        if self.profiles is not None and (record := self.profiles.parameter(path)) is not None:
            return record
        return self.parameters[path] if path in self.values else None

    def _effect_at(self, path: str) -> tuple[PlacedEffect | None, str]:
        steps = path.split(".")
        if len(steps) == 3 and steps[0] == "effects" and steps[1].isdecimal() and int(steps[1]) < len(self.effects):
            return self.effects[int(steps[1])], steps[2]
        return None, ""

    def _catalogue(self) -> Catalogue:
        return kernel_catalogue() if self.catalogue is None else self.catalogue

    def _unknown_path(self, path: str) -> FileProblems:
        known = [*self.paths(), *setting_paths(self.kind), *([] if self.profiles is None else [USE_PATH])]
        name = "design" if self.source is None else str(self.source)
        if self.profiles is not None and self.profiles.is_file_key(path):
            remedy = "write it into the design, or into a copy of it: overrides and studies take its numbers only"
            return file_problem(name, "is no number", remedy, path)
        if group := expand_path(path, self.paths()):
            remedy = f"name one of them, such as {group[0]}"
            return file_problem(name, f"is a group of {len(group)} numbers", remedy, path)
        groups = {p[:i] for p in known for i, c in enumerate(p) if c == "."}
        ends = [p for p in known if p.rpartition(".")[2] == path.rpartition(".")[2]]
        remedy = (
            f"did you mean {ends[0]!r}?" if ends and path not in ends else suggest_name(path, [*known, *sorted(groups)])
        )
        return file_problem(name, "no such parameter", remedy, path)
