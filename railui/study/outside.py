"""Outside the catalogue: where a missing force acts, and its measured curve against motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from railui import core
from railui.files.design import PlacedEffect
from railui.files.effect_records import PER_WHEELSET
from railui.study.adjust import Adjuster, Fit, adjust
from railui.study.candidates import driven_places
from railui.study.couplings import Coupling, couplings
from railui.study.drift import Drift, drifts, judge_course, refined
from railui.study.equivalent import Origin, origins
from railui.study.judge import Judgement, judge
from railui.study.measured import Measurement, Stretch, simulate
from railui.study.model import Model
from railui.study.target import Target, retarget
from railui.study.watch import Report, silent

Floats = NDArray[np.float64]
POINTS = 9  # of a measured curve
REACH = 2.5  # standard deviations of the motion that the curve spans to either side
SMOOTH = 3e-3  # penalty on the bends of a curve, in its own scale
TELLING = 0.19  # share of the squared misfit from which a change along the track decides by itself
SLIGHT = 0.02  # share from which a change along the track is worth a look
CLEAR = 0.5  # share that a curve explains from which its place is believed
PLACES = ("secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "wheelset", "wheelset_yaw", "rig")


@dataclass(frozen=True, eq=False)
class Outside:
    """The place, the measured curve (force [points] against motion [points]) and the model that carries it."""

    at: str
    wheelset: int | None
    against: str
    motion: Floats
    force: Floats
    sd: Floats
    motion_unit: str
    force_unit: str
    explained: float
    fit: Fit
    judgement: Judgement
    course: Drift | None = None
    coupled: Coupling | None = None  # with another place, whose motion it answers
    gains: bool = False  # does it lower the error on the validating runs by what counts?

    def judged(self, measurement: Measurement, stretches: Sequence[Stretch]) -> Judgement:
        """What was found judged on stretches."""
        if self.course is not None:
            return judge_course(self.fit.model, self.course, measurement, stretches)
        return judge(self.fit.model, measurement, stretches)


@dataclass(frozen=True)
class _Spot:
    at: str
    wheelset: int | None
    against: str
    grid: Floats
    size: float


def look_outside(
    fit: Fit,
    measurement: Measurement,
    declared: Model,
    changing: Outside | None,
    *,
    jobs: int | None = None,
    report: Report = silent,
) -> Outside | None:
    """Say where something acts that no entry of the catalogue makes, draw its force there, adjust all with it.

    changing: what a change along the track explains, kept unless a curve explains more.
    """
    if changing is not None and changing.explained >= CLEAR:
        return changing
    origin = origins(fit, measurement)[0]
    report(f"  the rest looks like forces at {origin.at} {origin.wheelset or ''}: share {origin.share:.2f}")
    adjuster = Adjuster(fit.model, fit.free, fit.targets, block=1.0, stable=False, jobs=jobs)
    bases = [adjuster.sensitivities(t, fit.x)[0] for t in fit.targets]
    seen = [(*_explained(fit, bases, spot), spot) for spot in _spots(fit)]
    seen = sorted((s for s in seen if s[0] > 0), key=lambda s: -s[0])
    if not seen:
        return changing
    if seen[0][0] < CLEAR and seen[0][0] < origin.share:
        near = [s for s in seen if _beside(s[2], origin)]
        seen = near or seen
    results = []
    for share, force, spot in seen[:2]:
        found = _fit_curve(fit, measurement, declared, spot, force, jobs)
        if found is not None:
            judged = judge(found.model, measurement, measurement.validate)
            report(f"  curve against {spot.against} at {spot.at}: explains {share:.2f}, nrmse {judged.nrmse:.4f}")
            results.append((found.normal.rss, share, spot, found, judged))
    if not results:
        return changing
    _, share, spot, found, judged = min(results, key=lambda r: r[0])
    if changing is not None and 1.0 - found.normal.rss / fit.normal.rss < changing.explained:
        return changing
    at, wheelset = (spot.at, spot.wheelset) if share >= CLEAR else (origin.at, origin.wheelset)
    coupled = next(iter(couplings(fit)), None)
    if coupled is not None and coupled.share >= max(CLEAR, share):
        report(f"  a coupling of {coupled.text} explains {coupled.share:.2f}")
        at, wheelset = coupled.at, coupled.wheelset
    else:
        coupled = None
    index = len(found.model.design.effects) - 1
    curve = found.model.design.effects[index]
    points = [j for j, p in enumerate(found.free.paths) if p.startswith(f"effects.{index}.force.")]
    yaw = spot.at.endswith("_yaw")
    z = "rad" if yaw else "m"
    return Outside(
        at,
        wheelset,
        spot.against,
        spot.grid,
        np.array(curve.parameters["force"]),
        np.insert(found.sd[points], len(spot.grid) // 2, 0.0),
        {"z": z, "v": f"{z}/s", "s": "m"}[spot.against],
        "N*m" if yaw else "N",
        max(share, origin.share),
        found,
        judged,
        coupled=coupled,
    )


def telling(seen: Outside | None) -> bool:
    """Does a change along the track explain so much that it needs no other run to believe it?"""
    return seen is not None and seen.course is not None and seen.explained >= TELLING


def look_along(fit: Fit, measurement: Measurement, report: Report = silent) -> Outside | None:
    """The parameter whose change along the track explains most, where that is more than chance."""
    seen = drifts(fit)
    if not seen or seen[0].share < SLIGHT:
        return None
    try:
        course = refined(fit, seen[0])
        judged = judge_course(fit.model, course, measurement, measurement.validate)
    except ValueError:
        return None
    report(f"  {course.path} along the track: explains {course.share:.2f}, nrmse {judged.nrmse:.4f}")
    at, wheelset = place_of(course)
    unit = fit.model.design.unit(course.path)
    return Outside(
        at, wheelset, "s", course.distance, course.values, course.sd, "m", unit, course.share, fit, judged, course
    )


def place_of(course: Drift) -> tuple[str, int | None]:
    """Place and wheelset of a parameter of the vehicle."""
    group, what, *rest = course.path.split(".")
    if group == "contact":
        single = len(course.ratios) == 1 and what in ("leading", "trailing")
        return "contact", ("leading", "trailing").index(what) + 1 if single else None
    yaw = rest and rest[0] in ("longitudinal_stiffness", "yaw_stiffness", "yaw_damping")
    return f"{what}_{'yaw' if yaw else 'lateral'}", None


def _beside(spot: _Spot, origin: Origin) -> bool:
    """Can a curve at the spot stand for forces at the origin?"""
    same = ("wheelset", "wheelset_yaw") if origin.at == "contact" else (origin.at,)
    return spot.at in same and (origin.wheelset is None or spot.wheelset in (None, origin.wheelset))


def _fit_curve(
    fit: Fit, measurement: Measurement, declared: Model, spot: _Spot, force: Floats, jobs: int | None
) -> Fit | None:
    """Everything adjusted with a free curve at a spot, from the linear estimate of its points."""
    middle = len(force) // 2  # a constant force is not seen in the band: the curve is pinned at rest
    points = {"motion": tuple(float(x) for x in spot.grid), "force": tuple(float(x - force[middle]) for x in force)}
    try:
        model = fit.model.with_effect(PlacedEffect("measured_force", spot.at, spot.wheelset, points, spot.against))
        more = [p for p in model.effect_paths() if p not in fit.free.paths and not p.endswith(f".force.{middle}")]
        paths = [*fit.free.paths, *more]
        return adjust(
            model, measurement, paths, declared, ready=retarget(model, fit.targets, measurement), tolerance=1e-5,
            most=15, jobs=jobs,
        )  # fmt: skip
    except ValueError:
        return None


def _spots(fit: Fit) -> list[_Spot]:
    """Places and what a curve there may stand against, with its grid of motion."""
    model, stretches = fit.model, [t.stretch for t in fit.targets]
    linear = model.vehicles().sites(model.single())
    barred = driven_places(stretches)
    out = []
    for at in PLACES:
        ports = [w for place, w in linear if place == at and w != core.LINKAGE]
        if not ports or at in barred:
            continue
        for wheelset in (None, 1, 2) if at in PER_WHEELSET else (None,):
            if at in ("wheelset", "wheelset_yaw") and wheelset is None:
                continue
            used = [w for w in ports if wheelset is None or w == wheelset]
            for against in ("z", "v"):
                sd = _motion(fit, at, used, against)
                k = linear[(at, used[0])][0]
                size = (k if k > 0 else 1e6) * _motion(fit, at, used, "z")
                out.append(_Spot(at, wheelset, against, sd * np.linspace(-REACH, REACH, POINTS), size))
    return out


def _motion(fit: Fit, at: str, wheelsets: Sequence[int], against: str) -> float:
    channels = [f"{against}.{at}.{w}" for w in wheelsets]
    sds = [simulate(fit.model, t.stretch, channels, steps=t.steps, initial=t.start)[0][0].std() for t in fit.targets]
    return float(np.mean(sds)) or 1e-6


def _explained(fit: Fit, bases: Sequence[Floats], spot: _Spot) -> tuple[float, Floats]:
    """Share of the squared residual that a free curve explains beyond the adjustable parameters, and its forces."""
    n = len(spot.grid)
    own = len(bases[0])
    size = own + n
    gram = np.zeros((size, size))
    for t, base in zip(fit.targets, bases, strict=True):
        hats = _hats(fit, spot, t)
        if hats is None:
            return 0.0, np.zeros(n)
        rows = np.vstack([base.reshape(own, -1), hats.reshape(n, -1)])
        gram += rows @ rows.T
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    gram = gram * np.outer(scale, scale)
    inner = gram[1:own, 1:own] + 1e-9 * np.eye(own - 1)
    whole = gram[1:, 1:] + 1e-9 * np.eye(size - 1)
    bend = np.diff(np.eye(n), 2, axis=0) / scale[own:]
    whole[own - 1 :, own - 1 :] += SMOOTH * bend.T @ bend / np.mean(bend**2)
    rest = gram[0, 0] - gram[0, 1:own] @ linalg.solve(inner, gram[1:own, 0], assume_a="pos")
    solution = linalg.solve(whole, gram[1:, 0], assume_a="pos")
    left = gram[0, 0] - gram[0, 1:] @ solution
    force = solution[own - 1 :] * scale[own:] / scale[0]
    return float(1.0 - left / rest), np.asarray(force)


def _hats(fit: Fit, spot: _Spot, target: Target) -> Floats | None:
    """Output difference per unit of each point of the curve [point, channel, n]."""
    n = len(spot.grid)
    unit = 1e-3 * spot.size
    rows = [
        core.effect_numbers(
            "measured_force",
            {"against": spot.against, "motion": spot.grid, "force": unit * np.eye(n)[i] if i < n else np.zeros(n)},
        )
        for i in [n, *range(n)]
    ]
    place = core.Placement("measured_force", spot.at, spot.wheelset, len(rows[0]))
    try:
        vehicles = fit.model.vehicles(target.stretch.coach_forces, [place])
        here = fit.model.on(*target.stretch.place)
        batch = here.batch(np.tile(here.row, (n + 1, 1)), np.array(rows), np.ones((n + 1, 1)))
        series, lost = simulate(
            fit.model, target.stretch, target.stretch.channels, batch=batch, vehicles=vehicles, steps=target.steps,
            filter=target.filter, initial=target.start,
        )  # fmt: skip
    except ValueError:
        return None
    return None if np.any(lost >= 0) else target.free_of((series[1:] - series[0]) / unit)
