"""Riding quality of vehicles on a track at a speed: simulated, or streamed with the steps for many at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from railui.core import Vehicles
from railui.files.design import Design, load_design
from railui.files.designed import Riding
from railui.files.problems import FileProblems, Problem
from railui.files.study_model import read_speed
from railui.study.discretise import discretise
from railui.study.model import Model, placement
from railui.study.road import Laid, Road, lay
from railui.study.score import FLOOR_OF_FRAME, riding_quality
from railui.study.weighting import (
    W_D,
    brick_wall_1974,
    cascade,
    comfort_cascades,
    one_mass,
    weighted_rms,
)
from railui.track import Track

Floats = NDArray[np.float64]
Given = Design | Model | str | Path
TrackGiven = Track | Laid | str | Path

CHANNELS: Final = ("e1", "e2", "ayf")
ALL_CHANNELS: Final = (*CHANNELS, "ay1", "ay2", "rf", "d1", "d2", "psi1", "psi2")
BLOCK: Final = 5.0  # s, of the running rms of EN 12299
COACH: Final = "coach centre, its own mass on spring and damper"
BARELY: Final = 1e-6  # share of critical damping of an undamped coach, for its transfer to exist


def model_of(design: Given) -> Model:
    """The model of a design, a file of one or a model; FileProblems for a vehicle that rides no track."""
    if isinstance(design, str | Path):
        design = load_design(design)
    model = design if isinstance(design, Model) else Model(design)
    if model.design.kind != "bogie":
        raise _refused(model.design, "vehicle", f"a {model.design.kind} rides no track", "give a bogie")
    riding = model.design.riding
    if riding.use == "goods" and riding.rms_limit is None:
        what = "use: goods has a limit of the load's acceleration, without default"
        raise _refused(model.design, "riding.rms_limit", what, "add `rms_limit:`, such as 2.5 m/s^2")
    return model


def _refused(design: Design, key: str, what: str, remedy: str) -> FileProblems:
    return FileProblems([Problem(str(design.source or design.name), 0, 0, key, what, remedy)])


def road_of(track: TrackGiven, speed: float | str, seed: int | None = None) -> Road:
    """A track at a speed: m/s, or a quantity such as "144 km/h"; ValueError where either cannot be."""
    return Road(lay(track, seed), read_speed(speed) if isinstance(speed, str) else float(speed))


def simulate(
    design: Given, track: TrackGiven, speed: float | str, channels: Sequence[str] = ALL_CHANNELS
) -> dict[str, Floats]:
    """Arrays by channel name [samples], SI, with t [s] and s [m]; the vehicle starts at rest.

    A vehicle that diverges is NaN from there on. Raises ValueError for an unknown channel.

    >>> found = simulate("designs/test_bogie.yaml", "erri_b176_low length=200", 40.0, ["e1"])
    >>> found["e1"].shape, float(found["t"][1])
    ((2000,), 0.0025)
    """
    model, road = model_of(design), road_of(track, speed)
    vehicles, batch = model.vehicles(), model.single()
    steps = vehicles.steps(batch, road.speed, road.speed, road.dt)[0]
    table = road.table(model.half_wheelbase(), steps)
    series, lost = vehicles.simulate(batch, table, road.dt, steps, channels)
    if lost[0] >= 0:
        series[0, :, lost[0] :] = np.nan
    t = road.dt * np.arange(len(road.track))
    return {"t": t, "s": road.track.s.copy()} | dict(zip(channels, series[0], strict=True))


def statistics_many(model: Model, rows: Floats, road: Road, *, jobs: int | None = None) -> dict[str, Floats]:
    """Statistics of n vehicles of one structure and use, rows [n, row] of `Model`, streamed with the steps.

    As `score_many` takes them: mean_e, sd_e, flange_fractions [n, 2], the accelerations [n], wz [n] (rms
    weighted with B), diverged [n]; and block_rms [n, blocks of 5 s], lost_at [n] (s [m] where a vehicle was
    found diverged, else NaN), steps [n] per sample, clearance [n] [m]. A vehicle's digits depend on nothing
    but itself. Raises ValueError where a vehicle is too stiff to be stepped.
    """
    vehicles, batch = model.vehicles(), model.batch(rows)
    steps = np.array(vehicles.steps(batch, road.speed, road.speed, road.dt))
    wheelbase = rows[:, model.columns["vehicle.geometry.half_wheelbase"]]
    clearance = rows[:, model.columns["contact.flange_clearance"]]
    sections = comfort_sections(model, rows, road.dt)
    block = max(1, round(BLOCK / road.dt))
    found: dict[str, Floats] = {"steps": steps.astype(float), "clearance": clearance.copy()}
    lost = np.full(len(rows), -1)
    for a, n in sorted(set(zip(wheelbase.tolist(), steps.tolist(), strict=True))):
        here = np.flatnonzero((wheelbase == a) & (steps == n))
        table, group = road.table(a, n), batch.select(here)
        weights = [np.ascontiguousarray(each[here]) for each in sections.values()]
        rides = vehicles.score(
            group, table, road.dt, n, CHANNELS, clearance[here], weights, block=block, jobs=jobs
        )
        lost[here] = rides.diverged
        parts = {
            "mean_e": rides.displacement[:, :, 0],
            "sd_e": rides.displacement[:, :, 1],
            "flange_fractions": rides.displacement[:, :, 2],
            "block_rms": np.sqrt(rides.blocks),
            **{name: rides.rms[:, i] for i, name in enumerate(sections)},
        }
        if model.design.gauge_widens_clearance and np.any(road.track.gauge):
            parts |= _widened(vehicles, group, table, road.dt, n, clearance[here], parts, jobs)
        if model.design.riding.peak_limit is not None:
            parts["acceleration_peak"] = _peaks(vehicles, group, table, road.dt, n, sections["acceleration"][here])
        for name, values in parts.items():
            found.setdefault(name, np.zeros((len(rows), *values.shape[1:])))[here] = values
    found["diverged"] = (lost >= 0).astype(float)
    found["lost_at"] = np.where(lost >= 0, road.track.s[np.maximum(lost, 0)], np.nan)
    return found


def comfort_sections(model: Model, rows: Floats, dt: float) -> dict[str, Floats]:
    """Streaming filters [n, sections, 6] from the frame's acceleration to each weighted one.

    Without a coach the floor is that of `riding`. A coach on spring and damper above the frame passes on
    what its own mass, spring and damper do, so its numbers stand in the floor's place.
    """
    kinds: list[dict[str, Floats]] = []
    known: dict[tuple[float, float], int] = {}
    ridings = [_floor(model.design.riding, row, model) for row in rows] if _coach(model) is not None else []
    for riding in ridings or [model.design.riding]:
        key = (riding.floor_frequency, riding.floor_damping)
        if key not in known:
            known[key] = len(kinds)
            kinds.append(_sections(riding, dt))
    pick = [known[(r.floor_frequency, r.floor_damping)] for r in ridings] or [0] * len(rows)
    return {name: np.stack([kind[name] for kind in kinds])[pick] for name in kinds[0]}


def _sections(riding: Riding, dt: float) -> dict[str, Floats]:
    found = comfort_cascades(riding, dt)
    if riding.use == "goods":
        found["acceleration"] = discretise(cascade(*_before(riding)), dt)
    return found


def _before(riding: Riding) -> list[Any]:
    """The factors between frame and comfort point: floor, and the cushion where there is one."""
    factors = [one_mass(riding.floor_frequency, riding.floor_damping)]
    if riding.cushion_frequency is not None and riding.cushion_damping is not None:
        factors.append(one_mass(riding.cushion_frequency, riding.cushion_damping))
    return factors


def _coach(model: Model) -> int | None:
    return next((i for i, e in enumerate(model.design.effects) if e.kind == "coach_mode"), None)


def _floor(riding: Riding, row: Floats, model: Model) -> Riding:
    """The riding settings with the coach's own transfer, w0^2 = k/m and 2 z w0 = c/m, as the floor's."""
    m, k, c = (row[model.columns[f"effects.{_coach(model)}.{key}"]] for key in ("mass", "stiffness", "damping"))
    w0 = float(np.sqrt(k / m))
    return replace(
        riding, floor_frequency=w0 / (2 * np.pi), floor_damping=max(float(c / (2 * m * w0)), BARELY)
    )


def _widened(
    vehicles: Vehicles, group: Any, table: Floats, dt: float, n: int, clearance: Floats,
    parts: dict[str, Floats], jobs: int | None,
) -> dict[str, Floats]:  # fmt: skip
    """Shares against c + g/2, counted on the series, and the spread of abs(e) - g/2 in place of e's own."""
    series, _ = vehicles.simulate(group, table, dt, n, CHANNELS[:2], jobs=jobs)
    half = 0.5 * table[:: 2 * n, [6, 11]].T
    touching = np.abs(series) >= clearance[:, None, None] + half
    return {
        "flange_fractions": touching.mean(axis=2),
        # e and -e against g/2: their covariance cancels over both flanges
        "sd_e": np.sqrt(parts["sd_e"] ** 2 + half.var(axis=1)),
    }


def _peaks(vehicles: Vehicles, group: Any, table: Floats, dt: float, n: int, sections: Floats) -> Floats:
    """The greatest acceleration [n] at the comfort point, of the series."""
    series, _ = vehicles.simulate(group, table, dt, n, ["ayf"])
    return np.array([np.max(np.abs(signal.sosfilt(sos, x[0]))) for sos, x in zip(sections, series, strict=True)])


def quality_of(model: Model, statistics: dict[str, Floats], i: int, road: Road) -> dict[str, Any]:
    """The riding quality of one of many rides, with what it rests on: finite values or None, reasons in notes."""
    one = {name: values[i] for name, values in statistics.items()}
    coach = _coach(model) is not None
    one["comfort_point"] = COACH if coach else FLOOR_OF_FRAME  # type: ignore[assignment]
    clearance = float(one["clearance"])
    notes = list(road.laid.notes)
    if model.design.gauge_widens_clearance:
        clearance += float(road.track.gauge.mean()) / 2
        notes.append("the clearance is widened by half the gauge deviation: flange_margin takes its mean and spread")
    if coach and sum(e.at == "secondary_lateral" for e in model.design.effects) > 1:
        notes.append("comfort: what other effects at secondary_lateral do to the coach itself is left out")
    found = riding_quality(one, model.design.riding, clearance)
    lost = bool(one["diverged"])
    found["notes"] = [*found["notes"], *notes]
    found["diverged"] = {"at_s": float(one["lost_at"])} if lost else None
    kept = {} if lost else {name: [float(x) for x in one[name]] for name in ("mean_e", "sd_e")}
    found["statistics"] = kept | {"samples": len(road.track), "duration": road.duration}
    return found | {"steps": int(one["steps"]), "speed": road.speed, "track": road.laid.name, "seed": road.laid.seed}


def structure_of(model: Model) -> tuple[Any, ...]:
    """What vehicles must share to ride in the lanes of one kernel call."""
    design = model.design
    return (tuple(map(placement, model.effects)), design.riding, design.gauge_widens_clearance)


def ride_many(
    designs: Iterable[Given], track: TrackGiven | Road, speed: float | str = 0.0, jobs: int | None = None
) -> list[dict[str, Any]]:
    """The riding quality of many designs on one track at one speed, in the order given.

    Designs of one structure ride side by side; each result is the same to the last digit as alone, on any
    number of threads. Keys as `riding_quality`, and `diverged`, `statistics`, `steps`, `speed`, `track`,
    `seed`. Raises ValueError, FileProblems as `ride`.
    """
    road = track if isinstance(track, Road) else road_of(track, speed)
    models = [model_of(design) for design in designs]
    structures: dict[tuple[Any, ...], list[int]] = {}
    for i, model in enumerate(models):
        structures.setdefault(structure_of(model), []).append(i)
    found: dict[int, dict[str, Any]] = {}
    for members in structures.values():
        rows = np.stack([models[i].row for i in members])
        statistics = statistics_many(models[members[0]], rows, road, jobs=jobs)
        found |= {i: quality_of(models[i], statistics, k, road) for k, i in enumerate(members)}
    return [found[i] for i in range(len(models))]


def ride(
    design: Given, track: TrackGiven, speed: float | str, *, seed: int | None = None, jobs: int | None = None
) -> dict[str, Any]:
    """The riding quality of a design (or its file) on a track (or its spec or file) at a speed [m/s].

    As `ride_many`, and `reference`: the weighted accelerations in the frequency domain, with the brick wall
    of the 1970s, beside which the streaming form of the result stands. Raises FileProblems for faulty
    files, ValueError for a faulty spec or speed. Source: Broersen 1976, chapter 2.

    >>> found = ride("designs/test_bogie.yaml", "erri_b176_low length=500", "144 km/h")
    >>> found["class"]
    'good'
    """
    model, road = model_of(design), road_of(track, speed, seed)
    found = ride_many([model], road, jobs=jobs)[0]
    return found | {"reference": reference(model, road) if found["diverged"] is None else None}


def reference(model: Model, road: Road) -> dict[str, float]:
    """The weighted accelerations [m/s^2] of one vehicle in the frequency domain, see `weighted_rms`."""
    x = simulate(model, road.laid, road.speed, ["ayf"])["ayf"]
    riding = model.design.riding if _coach(model) is None else _floor(model.design.riding, model.row, model)
    before = cascade(*_before(riding))
    weights = {"weighted_acceleration": W_D.modulus, "weighted_acceleration_1974": brick_wall_1974}
    return {
        name: weighted_rms(x, road.dt, lambda f, w=weight: before.modulus(f) * w(f))  # type: ignore[misc]
        for name, weight in weights.items()
    }
