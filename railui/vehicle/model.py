"""Model: a design as rows of numbers for the kernel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.arrays import FloatArray
from railui.core import Batch, Placement, Vehicles
from railui.track import Wheelbase, wheelset_distances
from railui.vehicle.design_reader import Design, PlacedEffect
from railui.vehicle.kernel_layout import kernel_layout
from railui.vehicle.kernel_rows import effect_row, kernel_placement, parameter_paths, parameter_values, rig_input
from railui.vehicle.load_states import changed_paths, values_in_load_state
from railui.vehicle.multibody import position_terms
from railui.vehicle.profile_tables import with_tables

RADIUS = "rolling_radius"  # parameter r_e of an effect with a rotation angle s/r_e + phase
FLANGE, GAUGE = "flange_contact", "gauge"  # an effect, and what widens its clearance
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Model:
    """Design prepared for the kernel, with the sensor effects of a campaign.

    Its row contains the numbers of the design, then those of its effects; a batch has many rows of one structure.

    Attributes
    ----------
    design : Design
    sensors : tuple of PlacedEffect
    phases : mapping
        Run-dependent angles [rad] of rotating effects, by path and segment: `effects.0.phase@1.0` belongs to segment 0
        of run 1. Each is the angle in the middle of the segment, where it is least correlated with the radius. The
        phase in the design applies outside the runs of a campaign.
    """

    design: Design
    sensors: tuple[PlacedEffect, ...] = ()
    phases: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def effects(self) -> tuple[PlacedEffect, ...]:
        """Effects of the design, then those of the sensors."""
        return (*self.design.effects, *self.sensors)

    @cached_property
    def row(self) -> FloatArray:
        """All numbers of the vehicle and its effects, [row]."""
        tail = [x for effect in self.effects for x in effect_row(effect)]
        return np.concatenate([parameter_values(self.design), np.array(tail, dtype=float)])

    @cached_property
    def columns(self) -> dict[str, int]:
        """Column in the row of every path; paths of sensors are like `sensors.0.delay`."""
        columns = {p: i for i, p in enumerate(parameter_paths(self.design))}
        at = len(columns)
        for group, effects in (("effects", self.design.effects), ("sensors", self.sensors)):
            for i, effect in enumerate(effects):
                width = len(effect_row(effect))
                if effect.kind not in core.CURVE_KINDS:
                    keys = [p["key"] for p in core.effect_record(effect.kind)["parameters"]]
                    columns |= {f"{group}.{i}.{key}": at + j for j, key in enumerate(keys)}
                elif effect.kind == "measured_force":
                    half = (width - 1) // 2
                    columns |= {f"{group}.{i}.force.{j}": at + 1 + half + j for j in range(half)}
                at += width
        return columns

    @property
    def limits_hunting(self) -> bool:
        """True where an effect bounds the limit cycle of the linear part: a creep law or a flange."""
        return any(core.effect_record(e.kind)["acts"] == "creep" or e.kind == FLANGE for e in self.effects)

    @property
    def structure_key(self) -> tuple[Any, ...]:
        """Everything but the numbers, which vehicles of one kernel call must have in common."""
        design = self.design
        placed = tuple(map(kernel_placement, self.effects))
        return (design.kind, rig_input(design), design.structure, design.gauge_widens_clearance, placed)

    def vehicles(
        self, measured: Sequence[str] = (), extra: Sequence[Placement] = (), *, line: bool = False
    ) -> Vehicles:
        """Return the structure of the vehicle in the kernel.

        Parameters
        ----------
        measured : sequence of str
            Measured coach forces that act on the vehicle.
        extra : sequence of Placement
            Further effects after those of the vehicle.
        line : bool
            True on a line with curves.
        """
        structure = self.design.structure
        layout = None if structure is None else kernel_layout(structure)
        placed = [*map(kernel_placement, self.effects), *extra]
        if self.design.gauge_widens_clearance:
            placed = [replace(p, against=GAUGE) if p.kind == FLANGE else p for p in placed]
        names = None if structure is None else structure.channel_names
        return Vehicles(self.design.kind, placed, measured, layout, rig_input(self.design), names, line)

    @cached_property
    def local_elements(self) -> dict[tuple[str, int], tuple[float, float]]:
        """Stiffness and damping at every (location, wheelset or 0) of the vehicle."""
        return self.vehicles().local_stiffness_and_damping(self.single_batch())

    def batch(self, rows: FloatArray, extra: FloatArray | None = None, amounts: FloatArray | None = None) -> Batch:
        """Return vehicles from rows [n, row], with numbers [n, ...] and amounts [n, k] of k further effects."""
        n, parameters = len(rows), len(parameter_paths(self.design))
        effects = rows[:, parameters:] if extra is None else np.hstack([rows[:, parameters:], extra])
        full = np.ones((n, len(self.effects)))
        return Batch.from_arrays(rows[:, :parameters], effects, full if amounts is None else np.hstack([full, amounts]))

    def single_batch(self) -> Batch:
        """Return a batch of this vehicle only."""
        return self.batch(self.row[None])

    def value(self, path: str) -> float:
        """Return the number at a path, or the phase of a segment."""
        return self.phases[path] if "@" in path else float(self.row[self.columns[path]])

    def on_segment(self, segment: str, middle: float, load: str | None = None) -> Model:
        """Return the vehicle with its phases and its load on a segment.

        Parameters
        ----------
        segment : str
            Run and segment, such as "1.0".
        middle : float
            Distance s in the middle of the segment [m].
        load : str, optional
            Load state; that of the design by default.
        """
        row = self.row[None].copy()
        self.set_on_segment(row, segment, middle, load)
        paths = [p.partition("@")[0] for p in self.phases if p.endswith(f"@{segment}")]
        paths += self.values_in_load(load)
        return self.with_path_values(paths, row[0, [self.columns[p] for p in paths]]) if paths else self

    def values_in_load(self, load: str | None) -> dict[str, float]:
        """Return the numbers that differ between load states, by path, in one of them; empty for None."""
        if load is None:
            return {}
        values = values_in_load_state(self.design, load)
        return {path: values[path] for path in sorted(changed_paths(self.design))}

    def set_on_segment(
        self,
        rows: FloatArray,
        segment: str,
        middle: float,
        load: str | None = None,
        angles: Mapping[str, FloatArray] | None = None,
    ) -> None:
        """Set the phases and the load of a segment in rows [n, row], in place.

        The phase of each row is such that s/r_e + phase in the middle of the segment is the given angle.

        Parameters
        ----------
        rows : array [n, row]
        segment : str
            Run and segment.
        middle : float
            Distance s in the middle of the segment [m].
        load : str, optional
            Load state; that of the design by default.
        angles : mapping, optional
            Angles [n] by path that replace those of `phases` [rad].
        """
        for path, value in self.values_in_load(load).items():
            rows[:, self.columns[path]] = value
        for path, angle in self.phases.items():
            phase_path, _, phase_segment = path.partition("@")
            if phase_segment == segment:
                radius = rows[:, self.columns[phase_path.rpartition(".")[0] + f".{RADIUS}"]]
                rows[:, self.columns[phase_path]] = wrap_angle((angles or {}).get(path, angle) - middle / radius)

    def free_paths(self, paths: Sequence[str]) -> list[str]:
        """Return the paths that a fit of these paths estimates: run-dependent ones are replaced by all phases."""
        run = set(self.run_dependent_paths())
        return [*(p for p in dict.fromkeys(paths) if p not in run and "@" not in p), *self.phases]

    def with_path_values(self, paths: Sequence[str], values: Sequence[float] | FloatArray) -> Model:
        """Return the vehicle with changed values at some paths."""
        changes: dict[str, float] = {}
        phases = dict(self.phases)
        sensors = [dict(s.parameters) for s in self.sensors]
        curves: dict[int, dict[int, float]] = {}
        for path, value in zip(paths, values, strict=True):
            group, _, rest = path.partition(".")
            if "@" in path:
                phases[path] = float(value)
            elif group == "sensors":
                sensors[int(rest.partition(".")[0])][rest.partition(".")[2]] = float(value)
            elif group == "effects" and rest.count(".") == 2:
                curves.setdefault(int(rest.split(".")[0]), {})[int(rest.split(".")[2])] = float(value)
            else:
                changes[path] = float(value)
        # the numbers of a row are given: none of them follows the profiles
        design = self.design.detached().with_values(changes)
        if curves:
            design = design.with_effects(_with_curves(design.effects, curves))
        placed = tuple(PlacedEffect(s.kind, s.at, s.wheelset, p) for s, p in zip(self.sensors, sensors, strict=True))
        return Model(design, placed, phases)

    def with_row(self, row: FloatArray) -> Model:
        """Return the vehicle with the numbers of a row [row], tables of profiles included."""
        vehicle = self.with_path_values(list(self.columns), [float(row[i]) for i in self.columns.values()])
        return replace(vehicle, design=with_tables(vehicle.design, row, len(parameter_paths(self.design))))

    def with_effect(self, effect: PlacedEffect, phases: Mapping[str, float] | None = None) -> Model:
        """Return the vehicle with a further effect of the design or of a sensor; `phases` [rad] by segment."""
        if core.effect_record(effect.kind)["acts"] == "sensor":
            return replace(self, sensors=(*self.sensors, effect))
        effects = self.design.effects
        paths = [f"effects.{len(effects)}.{p}" for p in _run_dependent_keys(effect)]
        added = {f"{path}@{segment}": angle for path in paths for segment, angle in (phases or {}).items()}
        return Model(self.design.with_effects((*effects, effect)), self.sensors, {**self.phases, **added})

    def without_effect(self, index: int) -> Model:
        """Return the vehicle without the effect at an index of `effects`."""
        design_effects = len(self.design.effects)
        if index >= design_effects:
            return replace(self, sensors=tuple(s for i, s in enumerate(self.sensors) if i != index - design_effects))
        phases = {}
        for path, angle in self.phases.items():
            group, number, rest = path.split(".", 2)
            if int(number) != index:
                phases[f"{group}.{int(number) - (int(number) > index)}.{rest}"] = angle
        design = self.design.with_effects(e for i, e in enumerate(self.design.effects) if i != index)
        return Model(design, self.sensors, phases)

    def effect_paths(self) -> list[str]:
        """Return the paths of all effects and sensors that a fit may estimate, without run-dependent ones."""
        paths = []
        for group, effects in (("effects", self.design.effects), ("sensors", self.sensors)):
            for i, effect in enumerate(effects):
                if effect.kind == "measured_force":
                    width = len(effect.parameters["force"])  # type: ignore[arg-type]
                    paths += [f"{group}.{i}.force.{j}" for j in range(width)]
                    continue
                if effect.kind in core.CURVE_KINDS:
                    continue
                free = [p for p in core.effect_record(effect.kind)["parameters"] if p["role"] in ("strength", "shape")]
                paths += [f"{group}.{i}.{p['key']}" for p in free]
        return paths

    def run_dependent_paths(self) -> list[str]:
        """Return the paths of numbers that belong to a run, not to the vehicle: phases."""
        return [
            f"effects.{i}.{key}" for i, effect in enumerate(self.design.effects) for key in _run_dependent_keys(effect)
        ]

    def wheelset_spacing(self) -> Wheelbase:
        """Return the wheelset spacing for the input table.

        Half the wheelbase [m] of a bogie, 0 of a rig; the distance of each wheelset behind the first [m] of a
        multibody vehicle.
        """
        return self.wheelset_spacings(self.row[None])[0]

    def wheelset_distances(self) -> tuple[float, ...]:
        """Return the distance of each wheelset behind the first [m]."""
        return wheelset_distances(self.wheelset_spacing())

    def wheelset_spacings(self, rows: FloatArray) -> list[Wheelbase]:
        """Return the `wheelset_spacing` of each of n rows [n, row]."""
        structure, columns = self.design.structure, self.columns
        if structure is None:
            path = "vehicle.geometry.half_wheelbase"
            return rows[:, columns[path]].tolist() if path in columns else [0.0] * len(rows)
        terms = [position_terms(structure, wheelset) for wheelset in structure.wheelsets]
        positions = [sum((f * rows[:, columns[p]] for f, p in one), np.zeros(len(rows))) for one in terms]
        distances = np.stack([positions[0] - x for x in positions], axis=1)
        return [tuple(one) for one in distances.tolist()]

    def eigenvalues(self, speed: float, rows: FloatArray | None = None) -> NDArray[np.complex128]:
        """Return eigenvalues [n, 2 x degrees of freedom] of the linear vehicle at a speed [m/s].

        The largest real part comes first.
        """
        return self.vehicles().eigenvalues(self.batch(self.row[None] if rows is None else rows), speed)

    def growth_rate(self, speed: float, rows: FloatArray | None = None) -> float:
        """Return the largest real part of all eigenvalues of all rows [1/s]; infinite if undefined."""
        return float(self.growth_rates(speed, rows).max())

    def growth_rates(self, speed: float, rows: FloatArray | None = None) -> FloatArray:
        """Return the largest real part of the eigenvalues of each row [n], in 1/s; infinite if undefined."""
        largest = self.eigenvalues(speed, rows)[:, 0].real
        return np.where(np.isfinite(largest), largest, np.inf)


def wrap_angle(angle: FloatArray) -> FloatArray:
    """Wrap angles [rad] to the interval from -pi to pi.

    >>> wrap_angle(np.array([7.0, -4.0])).round(3).tolist()
    [0.717, 2.283]
    """
    return np.asarray(angle - TURN * np.round(angle / TURN))


def _run_dependent_keys(effect: PlacedEffect) -> list[str]:
    """Return the parameters of an effect that belong to a run, not to the vehicle."""
    return [p["key"] for p in core.effect_record(effect.kind)["parameters"] if p["role"] == "run"]


def _with_curves(effects: Sequence[PlacedEffect], curves: Mapping[int, Mapping[int, float]]) -> list[PlacedEffect]:
    out = list(effects)
    for i, points in curves.items():
        force = list(out[i].parameters["force"])  # type: ignore[arg-type]
        for j, value in points.items():
            force[j] = value
        parameters = dict(out[i].parameters) | {"force": tuple(force)}
        out[i] = PlacedEffect(out[i].kind, out[i].at, out[i].wheelset, parameters, out[i].against)
    return out
