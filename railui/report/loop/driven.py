"""Laws driven through the motion that was seen, on the kernel as a bench: what resists it, as numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import Segment, cut_samples, simulate
from railui.core import LINKAGE, Batch, Placement, Vehicles
from railui.identification.estimation.initial_state import estimate_initial_state, estimate_phases
from railui.identification.loop import LoopResult
from railui.report.loop.figures import Window, place, units_of
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effect_records import unit_at
from railui.vehicle.model import Model, effect_row

HEAVY = 1e9  # times the mass of the vehicle: a bench that its forces do not move


@dataclass(frozen=True, eq=False)
class Scene:
    """A vehicle with what was found, and the one before, on the stretch that is shown."""

    model: Model
    before: Model
    stretch: Segment
    start: FloatArray
    piece: slice
    settled: slice
    units: Mapping[str, str]

    @classmethod
    def of(cls, found: LoopResult, model: Model, window: Window) -> Scene:
        """The scene of a window: the whole stretch, ridden from the state it began with."""
        stretch = window.stretch
        cut = cut_samples(found.measurement.campaign, stretch)
        model = estimate_phases(model, stretch, found.measurement.noise)
        start = estimate_initial_state(model, stretch, found.measurement.noise)
        settled = slice(cut, stretch.samples - cut)
        return cls(model, found.before.model, stretch, start, window.rows(cut), settled, units_of(found, stretch))

    def unit(self, word: str, at: str) -> str:
        """Unit of z, v or F at a place; at a rig as the run calls it."""
        named = {"z": "z", "v": "vz"}.get(word, "")
        return self.units.get(named, "1") if at == "rig" else unit_at(word, at)

    @property
    def path(self) -> slice:
        """The rows of a path that is still to be followed by eye."""
        return slice(self.piece.start, self.piece.start + max(2, (self.piece.stop - self.piece.start) // 2))

    def motion(self, channels: Sequence[str], model: Model | None = None) -> FloatArray:
        """Channels [channel, n] of the vehicle (or another with its states)."""
        series, lost = simulate(model or self.model, self.stretch, channels, initial=self.start)
        return sound(series, lost)


def resisted(z: FloatArray, dt: float, mass: float, effects: Sequence[PlacedEffect], k: float, c: float) -> FloatArray:
    """The force [n] with which effects beside a spring and a damper resist a motion z [n], and its speed: [2, n].

    The kernel's own laws: they stand under a mass that they cannot move, on a base that makes the motion.
    """
    t = np.linspace(0.0, dt * (len(z) - 1), len(z))
    bench = Segment("", "", 0, {"t": t, "u": -z}, dt, "rig")
    placed = [Placement(e.kind, "rig", None, len(effect_row(e)), e.against) for e in effects]
    vehicles = Vehicles("rig", placed, rig_input="base_displacement")
    numbers = np.array([[HEAVY * mass, k, c, 1.0]])
    tail = np.array([[x for e in effects for x in effect_row(e)]])
    batch = Batch.of(numbers, tail, np.ones((1, len(effects))))
    start = np.zeros(vehicles.states(batch))
    start[:2] = z[0], core.Spline(t, z)(0.0, 1)
    steps = vehicles.steps(batch, 1.0, 1.0, dt)[0]
    channels, table = ["v.rig.0", "az"], bench.table(0.0, steps)
    v, a = sound(*vehicles.simulate(batch.with_initial(start), table, dt, steps, channels))
    return np.stack([-HEAVY * mass * a, v])


def sound(series: FloatArray, lost: NDArray[np.int64]) -> FloatArray:
    """The series [channel, n] of the first vehicle; ValueError where it diverged."""
    if lost[0] >= 0:
        raise ValueError("the vehicle diverges")
    return np.asarray(series[0])


def mass_of(model: Model) -> float:
    """The mass that forces are set against: of the frame, or of the rig [kg]."""
    values = model.design.values
    return values.get("vehicle.frame.mass") or values["vehicle.rig.mass"]


def at_port(model: Model, at: str, wheelset: int) -> tuple[list[PlacedEffect], float, float]:
    """Effects, spring and damper of a model at one port."""
    here = [e for e in model.design.effects if e.at == at and e.wheelset in (None, wheelset)]
    k, c = model.vehicles().sites(model.single())[(at, wheelset)]
    return [e for e in here if "rig" in core.record(e.kind)["at"]], k, c


def port_of(scene: Scene, at: str, wheelset: int | None) -> tuple[int, FloatArray]:
    """The port of an effect (that which moves most, where it has two) and its motion z."""
    sites = scene.model.vehicles().sites(scene.model.single())
    linkage = wheelset is None and (at, LINKAGE) in sites
    ports = [w for a, w in sites if a == at and ((w == LINKAGE) if linkage else w != LINKAGE and wheelset in (None, w))]
    motion = scene.motion([f"z.{at}.{w}" for w in ports])
    best = int(np.argmax(motion.std(axis=1)))
    return ports[best], motion[best]


def whole_force(scene: Scene, at: str, w: int, z: FloatArray) -> tuple[dict[str, FloatArray], FloatArray]:
    """All that resists a motion z at a port, before and after [n], and the speed [n]."""
    dt, mass = scene.stretch.dt, mass_of(scene.model)
    whole, v = resisted(z, dt, mass, *at_port(scene.model, at, w))
    was, _ = resisted(z, dt, mass, *at_port(scene.before, at, w))
    return {"before": was, "after": whole}, v


def held(scene: Scene, model: Model, moved: bool) -> dict[str, FloatArray]:
    """Forces and moments [n] on both wheelsets of a vehicle too heavy to move: Y1, Y2, M1, M2.

    moved: the rails are moved under it so that e is what was seen; else they lie straight.
    """
    stretch, columns = scene.stretch, model.columns
    vehicles = model.vehicles(stretch.coach_forces)
    row = model.row.copy()
    masses = [p for p in columns if p.startswith("vehicle.") and p.endswith(("mass", "yaw_inertia"))]
    row[[columns[p] for p in masses]] *= HEAVY
    batch = model.batch(row[None])
    steps = vehicles.steps(batch, *stretch.speeds, stretch.dt)[0]
    table = stretch.table(model.half_wheelbase(), steps).copy()
    table[:, [2, 3, 4, 5, 7, 8, 9, 10]] = 0.0
    if moved:
        at = np.arange(len(table)) * (stretch.dt / (2 * steps))
        e = scene.motion(["e1", "e2"])
        spline = core.Spline(stretch.dt * np.arange(stretch.samples), -e.T)
        table[:, [2, 7]] = spline(at)
        table[:, [3, 8]] = spline(at, 1) / table[:, 1:2]
    channels = ["ay1", "ay2", "v.wheelset_yaw.1", "v.wheelset_yaw.2"]
    series = sound(*vehicles.simulate(batch, table, stretch.dt, steps, channels))
    m = row[columns["vehicle.wheelset.mass"]]
    inertia = row[columns["vehicle.wheelset.yaw_inertia"]]
    turned = inertia * np.gradient(series[2:], stretch.dt, axis=1)
    return {"Y1": m * series[0], "Y2": m * series[1], "M1": turned[0], "M2": turned[1]}


def gauge_under(scene: Scene, wheelset: int) -> FloatArray | None:
    """Gauge deviation [n] under a wheelset, None where none was measured."""
    gauge, s = scene.stretch.columns.get("gauge"), scene.stretch.columns.get("s")
    if gauge is None or s is None or not np.any(gauge):
        return None
    return np.interp(s - scene.model.behind()[wheelset - 1], s, gauge)


def explained(x: FloatArray, y: FloatArray, bins: int = 100) -> float:
    """Share of the variance of y that x rules, from quantile bins."""
    parts = np.array_split(y[np.argsort(x)], min(bins, len(x)))
    within = sum(float(np.sum((p - p.mean()) ** 2)) for p in parts)
    total = float(np.sum((y - y.mean()) ** 2))
    return 1.0 - within / total if total > 0 else 1.0


def rms(x: FloatArray) -> float:
    """Root mean square, in the unit of x."""
    return float(np.sqrt(np.mean(x**2)))


def force_word(unit: str) -> str:
    """What a force of this unit is called."""
    return "moment" if unit.endswith("*m") else "force"


def whole_title(scene: Scene, at: str, w: int) -> str:
    """The title of the force over the whole run, at a place."""
    return f"whole {force_word(scene.unit('F', at))}, {place(at, w if w in (1, 2) else None)}"


@dataclass(frozen=True, eq=False)
class Forces:
    """What resists the motion at the place of an effect: motion [n], force before and after [n], SI units of both."""

    title: str
    motion: FloatArray
    before: FloatArray
    after: FloatArray
    motion_unit: str
    force_unit: str


def suspension_forces(found: LoopResult, window: Window) -> list[Forces]:
    """Force against motion at every suspension where the loop placed an effect, over the motion actually seen."""
    scene, out = Scene.of(found, found.after.model, window), []
    for effect in found.after.model.effects:
        if "rig" in core.record(effect.kind)["at"] and effect.kind != "measured_force":
            w, z = port_of(scene, effect.at, effect.wheelset)
            whole, _ = whole_force(scene, effect.at, w, z)
            kept, at = scene.settled, effect.at
            before, after = whole["before"][kept], whole["after"][kept]
            title = whole_title(scene, at, w)
            out.append(Forces(title, z[kept], before, after, scene.unit("z", at), scene.unit("F", at)))
    return out
