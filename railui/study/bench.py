"""The standard job: how many nanoseconds a step of one design takes on this machine, whole and reduced."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from railui.core import LANES, jobs_or_all, simd
from railui.files.design import parse_design
from railui.study.comfort_point import comfort_sections
from railui.study.model import Model
from railui.study.ride import BLOCK, SCORED
from railui.study.road import Laid, Road, lay
from railui.study.score import score_many
from railui.track import Track

Floats = NDArray[np.float64]

DESIGNS: Final = 64
SPREAD: Final = 0.10
SEED: Final = 1
REPETITIONS: Final = 5  # of which the quickest counts: the others were disturbed
SPEED: Final = 40.0  # m/s
TRACK: Final = "erri_b176_high length=2000 seed=1"
REDUCED_TO_ZERO: Final = (
    *("contact.leading.contact_angle", "contact.trailing.contact_angle", "contact.spin_creep"),
    *("vehicle.wheelset.spin_inertia", "contact.leading.roll", "contact.trailing.roll"),
)
SPREAD_OVER: Final = ("vehicle.primary.", "vehicle.secondary.", "contact.leading.", "contact.trailing.", "contact.spin")

# the check values of the model, with creep saturation and flange contact (Kaas-Petersen's rail)
BOGIE: Final = """\
name: standard job
vehicle:
  frame: {mass: 2900, yaw_inertia: 3300}
  wheelset: {mass: 1850, yaw_inertia: 1050, spin_inertia: 120}
  geometry: {half_wheelbase: 1.28, half_gauge: 0.75, half_spring_base: 1.0, rolling_radius: 0.46}
  wheel_load: 55e3
  primary: {lateral_stiffness: 3.0e6, longitudinal_stiffness: 8e6}
  secondary: {lateral_damping: 3e4, yaw_damping: 3e4}
contact:
  leading: {conicity: 0.18, longitudinal_creep: 130, lateral_creep: 120, gravitational_stiffness: 8}
  trailing: {conicity: 0.18, longitudinal_creep: 130, lateral_creep: 120, gravitational_stiffness: 8}
  flange_clearance: 7 mm
effects:
  - {kind: creep_saturation, at: contact, friction: 0.35}
  - {kind: flange_contact, at: contact, clearance: 7 mm, stiffness: 14.6 MN/m}
"""


def bogie(reduced: bool = False) -> Model:
    """The bogie of the standard job; reduced: without contact angle, roll, spin creep and gyroscopic moments."""
    design = parse_design(BOGIE, "standard job")
    return Model(design.with_values(dict.fromkeys(REDUCED_TO_ZERO, 0.0)) if reduced else design)


def spread(model: Model, count: int = DESIGNS) -> Floats:
    """Rows [count, row]: suspension and contact parameters spread evenly by +/-10 %, seeded."""
    rng = np.random.default_rng(np.random.SeedSequence([SEED]))
    rows = np.tile(model.row, (count, 1))
    columns = [column for path, column in model.columns.items() if path.startswith(SPREAD_OVER)]
    rows[:, columns] *= 1 + SPREAD * rng.uniform(-1, 1, (count, len(columns)))
    return rows


def road(reduced: bool = False) -> Road:
    """The road of the standard job; reduced: without cross-level."""
    laid = lay(TRACK)
    if reduced:
        laid = Laid(Track(laid.track.s, laid.track.yw), f"{laid.name}, no cross-level")
    return Road(laid, SPEED)


def full_job(rows: Floats, jobs: int) -> Callable[[], Floats]:
    """The whole score [n] of designs, comfort included, one step of RK4 per sample."""
    model, way = bogie(), road()
    vehicles, batch, table = model.vehicles(), model.batch(rows), way.table(model.half_wheelbase(), 1)
    clearance = np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]])
    sections = comfort_sections(model, rows, way.dt)
    block = round(BLOCK / way.dt)
    riding = model.design.riding

    def run() -> Floats:
        found = vehicles.score(
            batch, table, way.dt, 1, SCORED, clearance, list(sections.values()), block=block, jobs=jobs
        )
        e = found.displacement
        statistics = {name: found.rms[:, 0, i] for i, name in enumerate(sections)}
        statistics |= {"mean_e": e[..., 0], "sd_e": e[..., 1], "flange_fractions": e[..., 2]}
        scored = score_many(statistics | {"diverged": found.diverged >= 0}, riding, float(clearance[0]))
        return scored["score"]

    return run


def reduced_job(rows: Floats, jobs: int) -> Callable[[], Floats]:
    """The rms [n] of e_1 alone."""
    model, way = bogie(reduced=True), road(reduced=True)
    vehicles, batch, table = model.vehicles(), model.batch(rows), way.table(model.half_wheelbase(), 1)
    clearance = np.ascontiguousarray(rows[:, model.columns["contact.flange_clearance"]])

    def run() -> Floats:
        e = vehicles.score(batch, table, way.dt, 1, SCORED[:1], clearance, jobs=jobs).displacement[:, 0]
        return np.hypot(e[:, 0], e[:, 1])

    return run


def quickest(run: Callable[[], object], repetitions: int = REPETITIONS) -> float:
    """The least time [s] of some repetitions, after one to warm up."""
    run()
    times: list[float] = []
    for _ in range(max(1, repetitions)):
        begun = time.perf_counter()
        run()
        times.append(time.perf_counter() - begun)
    return min(times)


def rate(
    job: Callable[[Floats, int], Callable[[], Floats]], rows: Floats, jobs: int, repetitions: int
) -> dict[str, float]:
    """Nanoseconds per design and step, and designs per second, of a job on so many threads."""
    seconds = quickest(job(rows, jobs), repetitions)
    steps = round(2000 / 0.1) - 1
    return {"ns_per_design_step": 1e9 * seconds / (len(rows) * steps), "designs_per_second": len(rows) / seconds}


def bench(jobs: int | None = None, repetitions: int = REPETITIONS, designs: int = DESIGNS) -> dict[str, Any]:
    """The standard job, full and reduced, on one thread and (`all_threads`) on all; lanes, simd, threads.

    >>> sorted(bench(jobs=1, repetitions=1, designs=16))
    ['designs', 'full', 'lanes', 'reduced', 'simd', 'threads']
    """
    threads = jobs_or_all(jobs)
    found: dict[str, Any] = {}
    for name, job in (("full", full_job), ("reduced", reduced_job)):
        rows = spread(bogie(reduced=name == "reduced"), designs)
        found[name] = rate(job, rows, 1, repetitions) | {"all_threads": rate(job, rows, threads, repetitions)}
    return found | {"designs": designs, "lanes": LANES, "simd": simd(), "threads": threads}


def told(found: dict[str, Any]) -> Sequence[tuple[str, str, str, str]]:
    """The rows of a table: job, ns per design-step on one thread, designs/s on one thread and on all."""
    return [
        (
            name,
            f"{found[name]['ns_per_design_step']:.1f}",
            f"{found[name]['designs_per_second']:.0f}",
            f"{found[name]['all_threads']['designs_per_second']:.0f}",
        )
        for name in ("full", "reduced")
    ]
