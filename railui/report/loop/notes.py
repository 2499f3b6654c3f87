"""Notes of the loop report: data, windows, divergence, noise, residuals."""

from __future__ import annotations

from typing import Any

import numpy as np

from railui.campaign.dataset import Dataset
from railui.campaign.segment import TRACK_COLUMNS
from railui.identification.estimation.multiple_shooting import windowed_files
from railui.identification.result import LoopResult
from railui.identification.structure.candidate_scores import has_structure
from railui.identification.unmodelled.search import is_at_noise_floor
from railui.report.loop.conditions import condition_notes
from railui.report.loop.motion_notes import gradual_slip_notes, sensitive_motion_notes, unreached_motion_notes
from railui.report.loop.noise import known_noise_text, noise_notes
from railui.report.loop.rig_notes import (
    filter_notes,
    held_input_notes,
    late_force_notes,
    late_input_notes,
    unstated_input_noise_notes,
)
from railui.report.loop.stop_positions import one_sided_notes
from railui.report.loop.wording import MODEL_LABELS

MAX_NAMED_CHANNELS = 3


def report_notes(result: LoopResult) -> list[str]:
    """Return all notes of a loop."""
    runs = zip(result.dataset.campaign.runs, result.dataset.runs, strict=True)
    notes = [f"{entry.name}: {note}" for entry, run in runs for note in run.notes]
    notes += [f"the final model needs no such gain, its correction is withdrawn: {f.text}" for f in result.withdrawn]
    if windows := windowed_runs(result):
        notes.append(
            f"{windows['reason']} on {', '.join(windows['runs'])}: estimated there on windows of "
            f"{windows['seconds']:.3g} s, together with the initial state of each window (multiple shooting)"
        )
    if pairs := searched_pairs(result):
        notes.append(f"single effects left a structure: {pairs['scored']} pairs scored, {pairs['refitted']} refitted")
    is_calibrated_only = result.before is result.after and result.discrepancy is None
    for model, validation in result.validations.items():
        if model == "after" and is_calibrated_only:
            continue  # the same model as before
        notes += [divergence_note(model, file, time) for file, time in validation.diverged]
    notes += condition_notes(result)
    return [
        *notes,
        *noise_notes(result.context.noise),
        *filter_notes(result.dataset),
        *notes_on_errors(result),
        *verdict_notes(result),
    ]


def verdict_notes(result: LoopResult) -> list[str]:
    """Return the notes that qualify the verdict: other causes of what it names, and motions that it does not cover."""
    return [
        *sensitive_motion_notes(result),
        *unstated_input_noise_notes(result),
        *late_input_notes(result),
        *held_input_notes(result),
        *late_force_notes(result),
        *unreached_motion_notes(result),
        *gradual_slip_notes(result),
        *one_sided_notes(result),
    ]


def notes_on_errors(result: LoopResult) -> list[str]:
    """Return the notes without which the errors of a loop may be misread."""
    return [
        *absent_cross_level_notes(result.dataset),
        *track_noise_notes(result),
        *no_agreement_notes(result),
        *overstated_noise_notes(result),
        *unstructured_residual_notes(result),
    ]


def divergence_note(model: str, file: str, time: float) -> str:
    """Return the note on a model (key of the report) that diverges on a run."""
    return f"{MODEL_LABELS[model]}: the simulation diverges on {file} at {time:.2f} s, its error is null"


def windowed_runs(result: LoopResult) -> dict[str, Any] | None:
    """Return the runs that were fitted on windows, the length of a window [s] and the reason; None without any."""
    files = windowed_files(result.after) + (windowed_files(result.windowed) if result.windowed else [])
    if not files:
        return None
    seconds, reason = result.context.settings.windows.window_duration, "the linear vehicle hunts"
    if result.windowed is not None and result.windowed.slips:
        reason = "the model falls out of step with the motion"
        seconds = max(t.segment.samples * t.segment.dt for t in result.windowed.segments)
    return {"seconds": seconds, "runs": list(dict.fromkeys(files)), "reason": reason}


def searched_pairs(result: LoopResult) -> dict[str, int] | None:
    """Return how many pairs of effects were scored and refitted; None where single effects sufficed."""
    searches = [step.pairs for step in result.steps if step.pairs is not None]
    if not searches:
        return None
    return {"scored": sum(s.scored for s in searches), "refitted": sum(s.refitted for s in searches)}


def track_noise_notes(result: LoopResult) -> list[str]:
    """Return notes on noise of the track columns that was not known before the fit."""
    if not result.has_track_noise:
        return unstated_track_noise_notes(result.dataset)
    yw = 1e3 * result.context.noise["yw"]
    return [
        f"the residual is that of noise of the track columns, {yw:.2g} mm in yw, whose level was not known as closely; "
        "an unmeasured force at the contact that follows no law would leave the same"
    ]


def absent_cross_level_notes(dataset: Dataset) -> list[str]:
    """Return a warning where runs over an irregular track have no cross-level, which excites the vehicle too.

    None on a roller rig, whose rollers have none.
    """
    if dataset.campaign.design.is_on_rollers:
        return []
    files = {s.file for s in dataset.segments if not s.is_rig and not s.is_free and not np.any(s.columns.get("phiw"))}
    if not files:
        return []
    runs = "the runs" if files == {s.file for s in dataset.segments} else ", ".join(sorted(files))
    return [
        f"no cross-level (phiw) in {runs}: taken as zero. The motion that cross-level causes then counts as that of an "
        "effect or remains in the residual; record it, unless the track has none"
    ]


def unstated_track_noise_notes(dataset: Dataset) -> list[str]:
    """Return a warning where the noise of a track column is neither stated nor determined: it counts as zero."""
    recorded = {name for segment in dataset.segments for name, x in segment.columns.items() if np.any(x)}
    known = {**dataset.campaign.noise, **dataset.noise}
    missing = [name for name in TRACK_COLUMNS if name in recorded and name not in known]
    if not missing:
        return []
    return [
        f"no noise stated for {', '.join(missing)}, and the channels do not determine it: taken as zero. Noise of the "
        "track columns passes through the vehicle into every channel; where it is not zero the noise floor is too low "
        "and the verdict can change"
    ]


def overstated_noise_notes(result: LoopResult) -> list[str]:
    """Return a note where the error is clearly below the noise floor."""
    floor, ratio = result.noise_floor, result.error_to_noise
    if not ratio < 1.0 / result.context.settings.selection.adequate_ratio:
        return []
    inputs = "the input" if result.nominal.design.kind == "rig" else "the track columns"
    source = "the channels" if floor.sensors_only**2 > 0.5 * floor.nrmse**2 else inputs
    return [
        f"the error is {ratio:.2f} times the noise floor: the noise of {source} is smaller in the compared band than "
        f"{known_noise_text(floor.source)}; effects below the floor stay undetected"
    ]


def no_agreement_notes(result: LoopResult) -> list[str]:
    """Return a note where the final model is no better than one that does not move."""
    if not result.validations["after"].nrmse > 1.0:
        return []
    return [
        "the final model is worse on the validation runs than one that does not move: its effects, locations and "
        "parameters mean nothing; check signs, units, channels and synchronisation of these runs"
    ]


def unstructured_residual_notes(result: LoopResult) -> list[str]:
    """Return the possible causes of a residual above the noise floor in which the score test detects no structure."""
    settings = result.context.settings
    is_unstructured = result.score_test.results and not has_structure(settings.score_test, result.score_test)
    is_adequate = not result.error_to_noise > settings.selection.adequate_ratio
    if result.discrepancy or result.is_by_condition or not is_unstructured or is_adequate:
        return []
    errors, floors = result.validations["after"].channels, result.noise_floor.channels
    ratios = sorted(((errors[c] / floors[c], c) for c in floors if floors[c] > 0 and c in errors), reverse=True)
    largest = ", ".join(f"{channel} {ratio:.2f}" for ratio, channel in ratios[:MAX_NAMED_CHANNELS])
    if is_at_noise_floor(result.context, result.after, result.error_to_noise):
        cause = (
            f"on the estimation runs the ratio is {result.after.error_to_noise:.2f}, which the validation runs do not "
            "reach: the vehicle may differ from run to run, or the model has adapted to its estimation runs (a track "
            "reconstructed from the same sensors, errors of its record); no single parameter explains it"
        )
    else:
        known = known_noise_text(result.noise_floor.source)
        cause = f"an unmeasured force, or noise that is larger than {known} or not white as the noise floor assumes"
    return [
        f"the error is {result.error_to_noise:.2f} times the noise floor, and the score test detects no structure in "
        f"the residual: {cause} (largest ratios: {largest})"
    ]
