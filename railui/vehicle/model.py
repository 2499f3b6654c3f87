"""A design as rows of numbers: the bridge from paths to the lanes of the kernel."""

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
from railui.track import Behind, distances_behind
from railui.vehicle.design_reader import Design, PlacedEffect
from railui.vehicle.kernel_layout import layout_of, paths_of
from railui.vehicle.multibody_reader import position_terms

RADIUS = "rolling_radius"  # of what turns: its angle is s/r_e + phase
TURN = 2.0 * np.pi


def numbers_of(design: Design) -> FloatArray:
    """The numbers of a design in the kernel's order, shape [parameters of its kind]."""
    return np.array([design.values[path] for path in parameters_of(design)])


def parameters_of(design: Design) -> tuple[str, ...]:
    """The paths of a design's numbers in the kernel's order."""
    return core.parameters(design.kind) if design.structure is None else paths_of(design.structure)


def effect_row(effect: PlacedEffect) -> list[float]:
    """The numbers of one effect in the kernel's order."""
    return core.effect_numbers(effect.kind, effect.parameters)


def placement(effect: PlacedEffect) -> Placement:
    """Where an effect stands, as the kernel wants it."""
    return Placement(effect.kind, effect.at, effect.wheelset, len(effect_row(effect)), effect.against)


@dataclass(frozen=True)
class Model:
    """A design ready for the kernel, with sensor effects behind it (they belong to a campaign).

    Its row is its numbers, then those of its effects, shape [row]; a batch is many rows of one structure.
    phases: what belongs to a run and not to the vehicle, by the path of the number and the stretch behind an @
    (`effects.0.phase@1.0`: of run 1, its stretch 0): the angle [rad] of what turns in the middle of the stretch, where
    it hangs least on the radius. The design's own phase is that of a vehicle on no run in particular.
    """

    design: Design
    sensors: tuple[PlacedEffect, ...] = ()
    phases: Mapping[str, float] = field(default_factory=dict, hash=False)

    @property
    def effects(self) -> tuple[PlacedEffect, ...]:
        """Those of the design, then those of the sensors."""
        return (*self.design.effects, *self.sensors)

    @cached_property
    def row(self) -> FloatArray:
        """All numbers of this vehicle, shape [row]."""
        tail = [x for effect in self.effects for x in effect_row(effect)]
        return np.concatenate([numbers_of(self.design), np.array(tail, dtype=float)])

    @cached_property
    def columns(self) -> dict[str, int]:
        """Path of a number -> its column in the row; sensors stand at `sensors.0.delay`."""
        found = {p: i for i, p in enumerate(parameters_of(self.design))}
        at = len(found)
        for group, effects in (("effects", self.design.effects), ("sensors", self.sensors)):
            for i, effect in enumerate(effects):
                width = len(effect_row(effect))
                if effect.kind not in core.CURVES:
                    keys = [p["key"] for p in core.record(effect.kind)["parameters"]]
                    found |= {f"{group}.{i}.{key}": at + j for j, key in enumerate(keys)}
                elif effect.kind == "measured_force":
                    half = (width - 1) // 2
                    found |= {f"{group}.{i}.force.{j}": at + 1 + half + j for j in range(half)}
                at += width
        return found

    @property
    def form(self) -> tuple[Any, ...]:
        """All of a vehicle but its numbers: what those in the lanes of one kernel call must share."""
        design = self.design
        return (design.kind, _rig_input(design), design.structure, tuple(map(placement, self.effects)))

    def vehicles(self, measured: Sequence[str] = (), extra: Sequence[Placement] = ()) -> Vehicles:
        """The structure of this vehicle in the kernel, with further placed effects behind its own."""
        structure = self.design.structure
        layout = None if structure is None else layout_of(structure)
        placed = [*map(placement, self.effects), *extra]
        return Vehicles(self.design.kind, placed, measured, layout, _rig_input(self.design))

    def batch(self, rows: FloatArray, extra: FloatArray | None = None, amounts: FloatArray | None = None) -> Batch:
        """Vehicles from rows [n, row], with the numbers [n, ...] and amounts [n, k] of further effects."""
        n, own = len(rows), len(parameters_of(self.design))
        effects = rows[:, own:] if extra is None else np.hstack([rows[:, own:], extra])
        full = np.ones((n, len(self.effects)))
        return Batch.of(rows[:, :own], effects, full if amounts is None else np.hstack([full, amounts]))

    def single(self) -> Batch:
        """This vehicle alone."""
        return self.batch(self.row[None])

    def value(self, path: str) -> float:
        """The number at a path of its row, or the phase of a stretch."""
        return self.phases[path] if "@" in path else float(self.row[self.columns[path]])

    def on(self, stretch: str, middle: float) -> Model:
        """The vehicle as it was on a stretch, with its phases there; middle: of the stretch, a distance [m]."""
        row = self.row[None].copy()
        self.turn(row, stretch, middle)
        own = [p.partition("@")[0] for p in self.phases if p.endswith(f"@{stretch}")]
        return self.with_row(own, row[0, [self.columns[p] for p in own]]) if own else self

    def turn(
        self, rows: FloatArray, stretch: str, middle: float, angles: Mapping[str, FloatArray] | None = None
    ) -> None:
        """Lay the phases of a stretch into rows [n, row]: that angle s/r_e + phase in its middle, of each row's radius.

        angles: path -> angle [n] of each row, for those that are not as `phases` has them.
        """
        for path, angle in self.phases.items():
            base, _, where = path.partition("@")
            if where == stretch:
                radius = rows[:, self.columns[base.rpartition(".")[0] + f".{RADIUS}"]]
                rows[:, self.columns[base]] = less_turns((angles or {}).get(path, angle) - middle / radius)

    def freed(self, paths: Sequence[str]) -> list[str]:
        """What a fit of these numbers moves: of what belongs to a run one per stretch, whether it is named or not."""
        run = set(self.run_paths())
        return [*(p for p in paths if p not in run and "@" not in p), *self.phases]

    def with_row(self, paths: Sequence[str], values: Sequence[float] | FloatArray) -> Model:
        """The vehicle with other values at some paths."""
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
        design = self.design.with_values(changes)
        if curves:
            design = design.with_effects(_with_curves(design.effects, curves))
        placed = tuple(PlacedEffect(s.kind, s.at, s.wheelset, p) for s, p in zip(self.sensors, sensors, strict=True))
        return Model(design, placed, phases)

    def with_effect(self, effect: PlacedEffect, phases: Mapping[str, float] | None = None) -> Model:
        """The vehicle (or its sensors) with one effect more; phases: its own, by stretch."""
        if core.record(effect.kind)["acts"] == "sensor":
            return replace(self, sensors=(*self.sensors, effect))
        effects = self.design.effects
        paths = [f"effects.{len(effects)}.{p}" for p in _run_keys(effect)]
        own = {f"{path}@{where}": angle for path in paths for where, angle in (phases or {}).items()}
        return Model(self.design.with_effects((*effects, effect)), self.sensors, {**self.phases, **own})

    def without(self, index: int) -> Model:
        """The vehicle without one of `effects`."""
        own = len(self.design.effects)
        if index >= own:
            return replace(self, sensors=tuple(s for i, s in enumerate(self.sensors) if i != index - own))
        phases = {}
        for path, angle in self.phases.items():
            group, number, rest = path.split(".", 2)
            if int(number) != index:
                phases[f"{group}.{int(number) - (int(number) > index)}.{rest}"] = angle
        left = self.design.with_effects(e for i, e in enumerate(self.design.effects) if i != index)
        return Model(left, self.sensors, phases)

    def effect_paths(self) -> list[str]:
        """Paths of the numbers of all effects and sensors that a fit may move, but for what belongs to a run."""
        paths = []
        for group, effects in (("effects", self.design.effects), ("sensors", self.sensors)):
            for i, effect in enumerate(effects):
                if effect.kind == "measured_force":
                    width = len(effect.parameters["force"])  # type: ignore[arg-type]
                    paths += [f"{group}.{i}.force.{j}" for j in range(width)]
                    continue
                if effect.kind in core.CURVES:
                    continue
                free = [p for p in core.record(effect.kind)["parameters"] if p["role"] in ("strength", "shape")]
                paths += [f"{group}.{i}.{p['key']}" for p in free]
        return paths

    def run_paths(self) -> list[str]:
        """Paths of what belongs to a run and not to the vehicle: phases."""
        return [f"effects.{i}.{key}" for i, effect in enumerate(self.design.effects) for key in _run_keys(effect)]

    def half_wheelbase(self) -> Behind:
        """a [m] of a bogie, 0 of one mass; of bodies and elements how far each wheelset runs behind the first [m]."""
        return self.wheelbases(self.row[None])[0]

    def behind(self) -> tuple[float, ...]:
        """How far each wheelset runs behind the first [m]."""
        return distances_behind(self.half_wheelbase())

    def wheelbases(self, rows: FloatArray) -> list[Behind]:
        """`half_wheelbase` of each of many rows [n, row]."""
        structure, columns = self.design.structure, self.columns
        if structure is None:
            path = "vehicle.geometry.half_wheelbase"
            return rows[:, columns[path]].tolist() if path in columns else [0.0] * len(rows)
        terms = [position_terms(structure, wheelset) for wheelset in structure.wheelsets]
        places = [sum((f * rows[:, columns[p]] for f, p in one), np.zeros(len(rows))) for one in terms]
        behind = np.stack([places[0] - x for x in places], axis=1)
        return [tuple(one) for one in behind.tolist()]

    def eigenvalues(self, speed: float, rows: FloatArray | None = None) -> NDArray[np.complex128]:
        """Eigenvalues [n, 2 x degrees of freedom] of the linear vehicle at a speed [m/s], largest real part first."""
        return self.vehicles().eigenvalues(self.batch(self.row[None] if rows is None else rows), speed)

    def growth(self, speed: float, rows: FloatArray | None = None) -> float:
        """Growth [1/s] of the least damped small motion, the largest of rows; infinite where it is not defined."""
        largest = float(self.eigenvalues(speed, rows)[:, 0].real.max())
        return largest if np.isfinite(largest) else np.inf


def less_turns(angle: FloatArray) -> FloatArray:
    """An angle [rad] without whole turns, between -pi and pi.

    >>> less_turns(np.array([7.0, -4.0])).round(3).tolist()
    [0.717, 2.283]
    """
    return np.asarray(angle - TURN * np.round(angle / TURN))


def _rig_input(design: Design) -> str | None:
    return design.rig_input if design.kind == "rig" else None


def _run_keys(effect: PlacedEffect) -> list[str]:
    """What of an effect belongs to a run and not to the vehicle."""
    return [p["key"] for p in core.record(effect.kind)["parameters"] if p["role"] == "run"]


def _with_curves(effects: Sequence[PlacedEffect], curves: Mapping[int, Mapping[int, float]]) -> list[PlacedEffect]:
    out = list(effects)
    for i, points in curves.items():
        force = list(out[i].parameters["force"])  # type: ignore[arg-type]
        for j, value in points.items():
            force[j] = value
        parameters = dict(out[i].parameters) | {"force": tuple(force)}
        out[i] = PlacedEffect(out[i].kind, out[i].at, out[i].wheelset, parameters, out[i].against)
    return out
