"""The loop report as data: the keys of railui.loop/1, SI, finite or null."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

import railui
from railui import core
from railui.arrays import FloatArray
from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.dataset import TRACK, Dataset, Segment, cut_samples, read_dataset
from railui.campaign.finding import Finding
from railui.identification.estimation.multiple_shooting import WINDOW, windowed_files
from railui.identification.estimation.validation import Validation
from railui.identification.loop import LoopResult, close_loop, indistinguishable_kinds, is_at_noise_floor
from railui.identification.structure.evidence import ScoreResult
from railui.identification.structure.refit import (
    FOLDS,
    Refit,
    bootstrap_weights,
    cross_validation_errors,
    cross_validation_nrmse,
)
from railui.identification.structure.stepwise import ADEQUATE, UNEXPLAINED, SelectionStep, has_structure
from railui.identification.unmodelled.locate import Discrepancy
from railui.identification.unmodelled.run_dependence import RunDependence
from railui.io.atomic import finite
from railui.io.number_format import display
from railui.progress import Report, silent
from railui.report.loop.detectable import detectable
from railui.report.loop.identifiability import identifiability
from railui.report.loop.phases import phases
from railui.report.loop.profiles import of_profiles
from railui.ride_quality.comfort import before
from railui.ride_quality.weighting import W_D, cascade, weighted_rms
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effect_reader import unit_of


def loop(
    campaign: str | Path | Campaign,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    report: Report = silent,
) -> dict[str, Any]:
    """Close the loop on a campaign (its directory, its file, or as loaded); returns the loop report as data.

    `without` bars kinds of effects, `report` is told how far the work is. Raises FileProblems where a file cannot be
    used. Source: Broersen 1976.
    """
    loaded = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    return loop_report(close_loop(read_dataset(loaded), without=without, seed=seed, jobs=jobs, report=report))


def loop_report(found: LoopResult) -> dict[str, Any]:
    """The loop report of a campaign, as data: docs/loop.md."""
    campaign = found.measurement.campaign
    report: dict[str, Any] = {
        "schema": "railui.loop/1",
        "version": railui.__version__,
        "inputs": [{"file": str(campaign.source), "sha256": campaign.sha256}],
        "seed": found.seed,
        "simd": core.simd(),
        "seconds": found.seconds,
        "campaign": campaign.name,
        "runs": _runs(found),
        "declared": _judged(found.validations["declared"]),
        "before": _judged(found.validations["before"]) | {"constrained": found.before.constrained},
        "after": _judged(found.validations["after"]),
        "floor": {
            "nrmse": found.floor.nrmse,
            "sd": found.floor.sd,
            "channels": found.floor.channels,
            "sensors_only": found.floor.sensors_only,
            "source": "declared" if campaign.noise else "estimated",
        },
        "unexplained": found.unexplained,
        "verdict": found.verdict,
        "sentence": sentence(found),
        "effects": _effects(found),
        "outside": _outside(found),
        "classes": [alike for step in found.steps if (alike := indistinguishable_kinds(step))],
        "ranking": ranking(found),
        "traces": _traces(found),
        "detectable": detectable(found.last, campaign.material, found.validations["after"].nrmse, found.foreseen),
        "means": _means(found),
        "riding": _riding(found),
        "parameters": _parameters(found),
        "simulations": found.before.simulations + found.after.simulations,
        "windows": _windows(found),
        "identifiability": identifiability(found.after),
        "gate": [_finding(f) for f in found.gate],
        "notes": _notes(found),
    }
    profiles, measured = found.nominal.design.profiles, report["riding"].get("measured", {})
    report["profiles"] = of_profiles(profiles, report["parameters"], measured)
    return dict(finite(report))


def sentence(found: LoopResult) -> str:
    """The verdict in one sentence."""
    before, after = found.validations["before"].nrmse, found.validations["after"].nrmse
    ratio = found.unexplained
    if found.verdict == "none":
        text = f"No unmodelled effect detected: error {after:.3f}, noise floor {found.floor.nrmse:.3f}"
    elif found.verdict == "effect":
        names = " and ".join(_name(e) for e in found.after.model.effects if e.kind not in core.CURVES)
        text = f"Missing was {names}: error {before:.3f} before, {after:.3f} after, noise floor {found.floor.nrmse:.3f}"
    else:
        o = found.outside
        where = f"{o.at}" + (f" of wheelset {o.wheelset}" if o and o.wheelset else "") if o else "an unknown place"
        where += f" (a coupling of {o.coupled.text})" if o and o.coupled else ""
        text = f"Something is missing that is not in the catalogue; it acts at {where}: "
        if o and o.change:
            text += f"{run_by_run(found, o.change)}; error {after:.3f} is left, noise floor {found.floor.nrmse:.3f}"
        else:
            text += f"error {before:.3f} before, {after:.3f} with the identified force curve, "
            text += f"noise floor {found.floor.nrmse:.3f}"
    if ratio > UNEXPLAINED:
        return f"The stated noise does not explain the residual ({ratio:.1f} times the noise floor). {text}."
    return f"{text}."


def run_by_run(found: LoopResult, change: RunDependence) -> str:
    """A parameter that differs from run to run in one sentence: as adjusted, and as each validating run asks for it."""
    unit = found.after.model.design.unit(change.path)
    where: dict[float, list[str]] = {}
    for r in change.runs:
        where.setdefault(r.value, []).append(f"{r.file} ({display(r.speed, 'm/s', 3)})")
    told = [f"{display(value, unit)} on {', '.join(runs)}" for value, runs in where.items()]
    others = [p for p in change.ratios if p != change.path]
    also = f" ({', '.join(others)} in proportion)" if others else ""
    group, *of = change.path.split(".")
    name = f"{of[1]} of {_name(found.after.model.effects[int(of[0])])}" if group == "effects" else change.path
    return f"the vehicle is not the same from run to run, {name}{also} would be {' and '.join(told)}"


def _name(effect: PlacedEffect) -> str:
    title = core.record(effect.kind)["title"]
    return f"{title} at {effect.at}" + (f" of wheelset {effect.wheelset}" if effect.wheelset else "")


def _runs(found: LoopResult) -> list[dict[str, Any]]:
    return [
        {
            "file": entry.name,
            "role": entry.role,
            "sha256": run.sha256,
            "samples": len(run),
            "stretches": len(run.stretches),
            "counts": dict(run.counts),
            "ignored": list(run.ignored),
            "notes": list(run.notes),
        }
        for entry, run in zip(found.measurement.campaign.runs, found.measurement.runs, strict=True)
    ]


def _windows(found: LoopResult) -> dict[str, Any] | None:
    """The runs that were adjusted on windows, and how long those are."""
    cut = list(dict.fromkeys([*windowed_files(found.after), *(windowed_files(found.hunting) if found.hunting else [])]))
    return {"seconds": WINDOW, "runs": cut} if cut else None


def _judged(judgement: Validation) -> dict[str, Any]:
    out: dict[str, Any] = {"nrmse": judgement.nrmse, "channels": dict(judgement.channels)}
    if judgement.diverged:
        file, at = judgement.diverged[0]
        out["diverged"] = {"file": file, "at_s": at}
    return out


def _effects(found: LoopResult) -> list[dict[str, Any]]:
    fit = found.after
    sd = dict(zip(fit.free.paths, fit.sd, strict=True))
    rows = []
    for group, effects in (("effects", fit.model.design.effects), ("sensors", fit.model.sensors)):
        for i, effect in enumerate(effects):
            if effect.kind in core.CURVES:
                continue
            parameters = {}
            for p in core.record(effect.kind)["parameters"]:
                value = effect.parameters.get(p["key"])
                if value is None or p["role"] == "run":
                    continue
                spread = sd.get(f"{group}.{i}.{p['key']}")
                parameters[p["key"]] = {"value": value, "sd": spread, "unit": unit_of(p, effect.at)}
            place = {"kind": effect.kind, "at": effect.at, "wheelset": effect.wheelset}
            rows.append(place | {"parameters": parameters, "phases": phases(found, i) if group == "effects" else []})
    return rows


def _outside(found: LoopResult) -> dict[str, Any] | None:
    o = found.outside
    if o is None:
        return None
    return {
        "at": o.at,
        "wheelset": o.wheelset,
        "against": o.against,
        "motion": list(o.motion),
        "force": list(o.force),
        "sd": list(o.sd),
        "motion_unit": o.motion_unit,
        "force_unit": o.force_unit,
    } | _stranger(o)


def _stranger(o: Discrepancy) -> dict[str, Any]:
    """What is known of a fault that no curve of force against motion describes."""
    if o.change is not None:
        keys = ("file", "role", "speed", "value", "sd")
        runs = [{key: getattr(r, key) for key in keys} for r in o.change.runs]
        told = {"parameter": o.change.path, "parameters": list(o.change.ratios), "runs": runs, "p": o.change.p}
        return told | {"nrmse": o.change.judged.nrmse}
    if o.course is not None:
        return {"parameter": o.course.path, "parameters": list(o.course.ratios)}
    if o.coupled is not None:
        pairs = [[{"at": at, "wheelset": w} for at, w in pair] for pair in o.coupled.pairs]
        return {"coupling": {"pairs": pairs, "per": o.coupled.against, "share": o.coupled.share}}
    return {}


def _telling(found: LoopResult) -> SelectionStep:
    """The step whose ranking tells most: the one that added the first effect, else the last."""
    return next((s for s in found.steps if s.added), found.steps[-1])


def ranking(found: LoopResult) -> list[dict[str, Any]]:
    """One row per candidate, best first, nothing added among them."""
    step = _telling(found)
    plain = found.hunting or found.before
    base = Refit(None, plain, cross_validation_errors(plain))
    nothing = cross_validation_nrmse(base)
    refits = [*step.refits, base]
    weights = bootstrap_weights(refits, found.seed)
    none = {"kind": "none", "at": None, "wheelset": None, "rho": 0.0, "nrmse": nothing, "refitted": True}
    rows: list[dict[str, Any]] = [none | {"weight": float(weights[-1])}]
    fitted = {}
    for refit, weight in zip(step.refits, weights, strict=False):
        fitted[refit.candidate] = (cross_validation_nrmse(refit), float(weight))
    for s in step.trace.best:
        nrmse, weight = fitted.get(s.candidate, (nothing * _left(s, step.trace.rss), 0.0))
        c = s.candidate
        rows.append({"kind": c.kind, "at": c.at, "wheelset": c.wheelset, "rho": s.rho, "nrmse": nrmse,
                     "refitted": c in fitted, "weight": weight})  # fmt: skip
    rows.sort(key=lambda r: float(r["nrmse"]))
    added = step.added.candidate if step.added else None
    if added is not None:
        rows.sort(key=lambda r: (r["kind"], r["at"], r["wheelset"]) != (added.kind, added.at, added.wheelset))
    return rows


def _left(s: ScoreResult, rss: float) -> float:
    """Error with the candidate over that without, its amount estimated on four fifths and judged on the other."""
    if s.candidate.one_sided and s.rho < 0:
        return 1.0
    folds = np.array([part.sum() for part in np.array_split(s.scores, FOLDS)])
    norm = s.norm / FOLDS
    amount = (folds.sum() - folds) / (s.norm - norm)
    gain = float(np.sum(2.0 * amount * folds - amount**2 * norm))
    return float(np.sqrt(max(1.0 - gain / rss, 0.0)))


def _traces(found: LoopResult) -> list[dict[str, Any]]:
    """What is significant but gains less than is material: the best of every turn that added nothing."""
    rows = []
    for step in found.steps:
        for refit in step.refits[:3] if step.added is None else ():
            c = refit.candidate
            if c is not None:
                rows.append({"kind": c.kind, "at": c.at, "wheelset": c.wheelset, "p": step.trace.p,
                             "rho": refit.sighting.rho if refit.sighting else None,
                             "nrmse": cross_validation_nrmse(refit)})  # fmt: skip
    return rows


def _trimmed(found: LoopResult, stretch: Segment, x: FloatArray) -> FloatArray:
    """Series [..., n] without what the comparison cuts off at both ends."""
    cut = cut_samples(found.measurement.campaign, stretch)
    return np.asarray(x[..., cut : x.shape[-1] - cut])


def _means(found: LoopResult) -> dict[str, float]:
    sums: dict[str, list[float]] = {}
    stretches = found.measurement.validation
    for stretch, z in zip(stretches, found.validations["after"].series, strict=True):
        difference = _trimmed(found, stretch, stretch.measured(stretch.channels) - z)
        for c, d in zip(stretch.channels, difference, strict=True):
            sums.setdefault(c, []).append(float(d.mean()))
    return {c: float(np.mean(v)) for c, v in sums.items()}


def _riding(found: LoopResult) -> dict[str, dict[str, float | None]]:
    """The model as judge of riding quality (thesis 2.3): measured, declared, before, after on the validating runs."""
    stretches = found.measurement.validation
    measured = [s.measured(s.channels) for s in stretches]
    series = {"measured": measured} | {k: list(found.validations[k].series) for k in ("declared", "before", "after")}
    return {k: _ride_of(found, stretches, v) for k, v in series.items()}


def _ride_of(found: LoopResult, stretches: list[Segment], series: list[FloatArray]) -> dict[str, float | None]:
    design = found.nominal.design
    if design.kind != "bogie":
        return {}
    clearance = design.values["contact.flange_clearance"]
    weight = cascade(before(design.riding), W_D)
    out: dict[str, list[float]] = {}
    for stretch, x in zip(stretches, series, strict=True):
        columns = dict(zip(stretch.channels, _trimmed(found, stretch, x), strict=True))
        for i in (1, 2):
            if f"e{i}" in columns:
                out.setdefault(f"sd_e{i}", []).append(float(columns[f"e{i}"].std()))
        e = [columns[c] for c in ("e1", "e2") if c in columns]
        if e:  # of a vehicle that diverged nothing is known
            share = np.mean(np.abs(e) >= clearance, axis=1).max() if np.all(np.isfinite(e)) else np.nan
            out.setdefault("flange_fraction", []).append(float(share))
        if "ayf" in columns:
            out.setdefault("weighted_acceleration", []).append(weighted_rms(columns["ayf"], stretch.dt, weight))
    keys = ("sd_e1", "sd_e2", "flange_fraction", "weighted_acceleration")
    return {k: float(np.mean(out[k])) if out.get(k) else None for k in keys}


def _parameters(found: LoopResult) -> dict[str, dict[str, Any]]:
    before = dict(zip(found.before.free.paths, zip(found.before.x, found.before.sd, strict=True), strict=True))
    flags = dict(zip(found.after.free.paths, found.after.flags(), strict=True))
    rows = {}
    for path, value, sd in zip(found.after.free.paths, found.after.x, found.after.sd, strict=True):
        if path not in before or "@" in path:
            continue
        was, was_sd = before[path]
        flag = flags[path]
        moved = found.after is not found.before and abs(value - was) > 2.0 * max(was_sd, sd)
        if moved and flag in (None, "correlated"):
            flag = "moved"
        rows[path] = {
            "declared": found.nominal.design.values[path],
            "before": was,
            "value": value,
            "sd": sd,
            "unit": found.nominal.design.unit(path),
            "flag": flag,
        }
    return rows


def _finding(f: Finding) -> dict[str, Any]:
    return {"check": f.check, "file": f.file, "channel": f.channel, "value": f.value, "unit": f.unit, "text": f.text,
            "serious": f.serious, "from_s": f.start, "to_s": f.end}  # fmt: skip


def _notes(found: LoopResult) -> list[str]:
    notes = [f"{entry.name}: {note}" for entry, run in zip(found.measurement.campaign.runs, found.measurement.runs,
                                                           strict=True) for note in run.notes]  # fmt: skip
    if cut := _windows(found):
        notes.append(
            f"the linear vehicle hunts on {', '.join(cut['runs'])}: adjusted there on windows of {WINDOW:g} s, "
            "the initial state of each estimated along"
        )
    for name, judgement in found.validations.items():
        for file, at in judgement.diverged:
            notes.append(f"{name}: the vehicle diverges on {file} at {at:.2f} s, its error is null")
    return [*notes, *unstated_track_noise(found.measurement), *shapeless(found)]


def unstated_track_noise(measurement: Dataset) -> list[str]:
    """A warning where a campaign states no noise of a track column of its runs, which then counts as zero."""
    recorded = {name for stretch in measurement.stretches for name in stretch.columns}
    missing = [name for name in TRACK if name in recorded and name not in measurement.campaign.noise]
    if not missing:
        return []
    return [
        f"no noise stated for {', '.join(missing)}: taken as zero. Noise of the track columns passes through "
        "the vehicle into every channel; where it is not zero the noise floor is too low and the verdict can change"
    ]


def shapeless(found: LoopResult) -> list[str]:
    """What a rest above the floor may be where the trace sees nothing in it, none where it has a shape."""
    quiet = found.last.results and not has_structure(found.last)
    if found.outside or not quiet or not found.unexplained > ADEQUATE:
        return []
    error, floor = found.validations["after"].channels, found.floor.channels
    ratios = sorted(((error[c] / floor[c], c) for c in floor if floor[c] > 0 and c in error), reverse=True)
    worst = ", ".join(f"{c} {ratio:.2f}" for ratio, c in ratios[:3])
    own = found.after.error_to_noise
    cause = (
        f"the runs that it was adjusted to leave {own:.2f} times theirs, so the vehicle is not the same from run to "
        "run: something changes with speed, heat, load or time, and no one parameter takes off what counts"
        if is_at_noise_floor(found.after, found.unexplained)
        else "an unmeasured force or noise that is larger than declared or not white, as the floor takes it"
    )
    return [
        f"{found.unexplained:.2f} times the floor is left, and no candidate sees a shape in it: {cause} "
        f"(most above their floor: {worst})"
    ]
