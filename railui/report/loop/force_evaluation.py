"""Forces of suspensions and contact, evaluated by the kernel over the motion of a validation run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.comparison import cut_samples
from railui.campaign.segment import Segment
from railui.core import LINKAGE_NUMBER
from railui.identification.component_force import elements_at_port, require_convergence, restoring_force
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.prediction import Predictor
from railui.identification.result import LoopResult
from railui.report.loop.figures import Window, units_of
from railui.report.loop.wording import location_text
from railui.track import COLUMNS_PER_WHEELSET, FIRST_WHEELSET_COLUMN
from railui.vehicle.effects import unit_at
from railui.vehicle.model import Model

MASS_FACTOR = 1e9  # on the mass of a body: the forces under test do not move it
TRACK_INPUTS = 4  # columns of a wheelset in the kernel's input table: yw, its slope, phiw, its slope


@dataclass(frozen=True, eq=False)
class EvaluationWindow:
    """A model with effects, and the calibrated one, on the segment that the report shows."""

    model: Model
    before: Model
    segment: Segment
    start: FloatArray
    piece: slice
    settled: slice
    units: Mapping[str, str]
    result: LoopResult

    @classmethod
    def of(cls, result: LoopResult, model: Model, window: Window) -> EvaluationWindow:
        """Return the evaluation of a window: the whole segment, simulated from its estimated initial state."""
        segment = window.segment
        cut = cut_samples(result.dataset.campaign, segment)
        model = estimate_phases(result.context, model, segment)
        start = estimate_initial_state(result.context, model, segment)
        settled = slice(cut, segment.samples - cut)
        units = units_of(result, segment)
        return cls(model, result.before.model, segment, start, window.rows(cut), settled, units, result)

    def unit(self, word: str, at: str) -> str:
        """Return the unit of z, v or F at a location; at a rig that of the run."""
        named = {"z": "z", "v": "vz", "F": "F"}.get(word, "")
        return self.units.get(named, "1") if at == "rig" else unit_at(word, at)

    @property
    def path(self) -> slice:
        """Rows of a path that is short enough to be readable in a picture."""
        return slice(self.piece.start, self.piece.start + max(2, (self.piece.stop - self.piece.start) // 2))

    def motion(self, channels: Sequence[str], model: Model | None = None) -> FloatArray:
        """Simulate channels [channel, n] of the model (or of another with the same states)."""
        predictor = Predictor(model or self.model, self.segment, initial_state=self.start)
        return require_convergence(*predictor.simulate(channels))


def ports_at(model: Model, at: str, wheelset: int | None) -> list[int]:
    """List the ports at which an effect of a location acts: the linkage between the wheelsets, where it has one."""
    elements = model.local_elements
    if wheelset is None and (at, LINKAGE_NUMBER) in elements:
        return [LINKAGE_NUMBER]
    return [w for a, w in elements if a == at and w != LINKAGE_NUMBER and wheelset in (None, w)]


def most_active_port(evaluation: EvaluationWindow, at: str, wheelset: int | None) -> tuple[int, FloatArray]:
    """Return the port of an effect with the largest motion, and that motion z [n]."""
    ports = ports_at(evaluation.model, at, wheelset)
    motion = evaluation.motion([f"z.{at}.{w}" for w in ports])
    largest = int(np.argmax(motion.std(axis=1)))
    return ports[largest], motion[largest]


def total_force(
    evaluation: EvaluationWindow, at: str, w: int, z: FloatArray
) -> tuple[dict[str, FloatArray], FloatArray]:
    """Return the total force that resists a motion z at a port, before and after [n], and the speed [n]."""
    dt = evaluation.segment.dt
    after, v = restoring_force(z, dt, *elements_at_port(evaluation.model, at, w))
    before, _ = restoring_force(z, dt, *elements_at_port(evaluation.before, at, w))
    return {"before": before, "after": after}, v


def forces_on_fixed_wheelsets(
    evaluation: EvaluationWindow, model: Model, is_track_moved: bool
) -> dict[str, FloatArray]:
    """Return the forces and moments [n] on all wheelsets of a vehicle with too much mass to move: Y1, Y2, M1, M2.

    is_track_moved: the rails move so that e is that of the simulated run; else the track is straight.
    """
    segment, columns = evaluation.segment, model.columns
    vehicles = model.vehicles(segment.coach_forces)
    row = model.row.copy()
    inertias = ("mass", "yaw_inertia", "roll_inertia")
    masses = [path for path in columns if path.startswith("vehicle.") and path.endswith(inertias)]
    row[[columns[path] for path in masses]] *= MASS_FACTOR
    batch = model.batch(row[None])
    steps = vehicles.required_steps(batch, *segment.speeds, segment.dt)[0]
    table = segment.table(model.wheelset_spacing(), steps).copy()
    numbers = range(1, 1 + len(model.wheelset_distances()))
    first = [FIRST_WHEELSET_COLUMN + COLUMNS_PER_WHEELSET * (w - 1) for w in numbers]
    table[:, [column + k for column in first for k in range(TRACK_INPUTS)]] = 0.0
    if is_track_moved:
        t = np.arange(len(table)) * (segment.dt / (2 * steps))
        e = evaluation.motion([f"e{w}" for w in numbers])
        spline = core.Spline(segment.dt * np.arange(segment.samples), -e.T)
        table[:, first] = spline(t)
        table[:, [column + 1 for column in first]] = spline(t, 1) / table[:, 1:2]
    channels = [f"ay{w}" for w in numbers] + [f"v.wheelset_yaw.{w}" for w in numbers]
    accelerations, rates = np.split(
        require_convergence(*vehicles.simulate(batch, table, segment.dt, steps, channels)), 2
    )
    forces: dict[str, FloatArray] = {}
    for w, acceleration, rate in zip(numbers, accelerations, rates, strict=True):
        mass, inertia = wheelset_inertia(model, w)
        forces[f"Y{w}"] = row[columns[mass]] * acceleration
        forces[f"M{w}"] = row[columns[inertia]] * np.gradient(rate, segment.dt)
    return forces


def wheelset_inertia(model: Model, wheelset: int) -> tuple[str, str]:
    """Return the paths of mass and yaw inertia of a wheelset."""
    structure = model.design.structure
    if structure is None:
        return "vehicle.wheelset.mass", "vehicle.wheelset.yaw_inertia"
    part = structure.wheelsets[wheelset - 1].part
    return part.number_path("mass"), part.number_path("yaw_inertia")


def gauge_at_wheelset(evaluation: EvaluationWindow, wheelset: int) -> FloatArray | None:
    """Return the gauge deviation [n] under a wheelset, None where it was not measured."""
    gauge, s = evaluation.segment.columns.get("gauge"), evaluation.segment.columns.get("s")
    if gauge is None or s is None or not np.any(gauge):
        return None
    return np.interp(s - evaluation.model.wheelset_distances()[wheelset - 1], s, gauge)


def explained_variance(x: FloatArray, y: FloatArray, bins: int = 100) -> float:
    """Return the share of the variance of y that a function of x explains, from quantile bins."""
    parts = np.array_split(y[np.argsort(x)], min(bins, len(x)))
    within = sum(float(np.sum((part - part.mean()) ** 2)) for part in parts)
    total = float(np.sum((y - y.mean()) ** 2))
    return 1.0 - within / total if total > 0 else 1.0


def rms(x: FloatArray) -> float:
    """Return the root mean square, in the unit of x."""
    return float(np.sqrt(np.mean(x**2)))


def force_word(unit: str) -> str:
    """Return the word for a force of this unit."""
    return "moment" if unit.endswith("*m") else "force"


def total_force_title(evaluation: EvaluationWindow, at: str, w: int) -> str:
    """Return the title of the total force at a location."""
    place = location_text(at, w if 0 < w != LINKAGE_NUMBER else None, evaluation.model.design.structure)
    return f"total {force_word(evaluation.unit('F', at))}, {place}"


@dataclass(frozen=True, eq=False)
class SuspensionForce:
    """Total force at the location of an effect: motion [n], force before and after [n], SI units of both."""

    title: str
    motion: FloatArray
    before: FloatArray
    after: FloatArray
    motion_unit: str
    force_unit: str


def suspension_forces(result: LoopResult, window: Window) -> list[SuspensionForce]:
    """Return force against motion at every suspension with an identified effect, over the motion of the run."""
    evaluation = EvaluationWindow.of(result, result.after.model, window)
    settled = evaluation.settled
    forces = []
    for effect in result.after.model.effects:
        if "rig" in core.effect_record(effect.kind)["at"] and effect.kind != "measured_force":
            w, z = most_active_port(evaluation, effect.at, effect.wheelset)
            total, _ = total_force(evaluation, effect.at, w, z)
            forces.append(
                SuspensionForce(
                    total_force_title(evaluation, effect.at, w),
                    z[settled],
                    total["before"][settled],
                    total["after"][settled],
                    evaluation.unit("z", effect.at),
                    evaluation.unit("F", effect.at),
                )
            )
    return forces
