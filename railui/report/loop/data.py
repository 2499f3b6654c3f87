"""The loop report as data: the keys of railui.loop/1, SI units, every number finite or null."""

from __future__ import annotations

import dataclasses
from datetime import date
from typing import Any

import railui
from railui import core
from railui.identification.estimation.identifiability import parameter_flags
from railui.identification.estimation.validation import Validation
from railui.identification.result import IndependentTest, LoopResult
from railui.identification.structure.minimum_detectable import minimum_detectable_effects, without_unphysical_sizes
from railui.identification.structure.stage import indistinguishable_kinds
from railui.identification.verdict import Remainder
from railui.io.atomic import to_json_value
from railui.planning.rivals import rival_records
from railui.report.loop.catalogued_effects import catalogued_effects
from railui.report.loop.changes import prior_record
from railui.report.loop.conditions import condition_rows
from railui.report.loop.data_faults import (
    NO_EXPLAINED,
    NO_TEST,
    CheckedData,
    corrected_sentence,
    correction_rows,
)
from railui.report.loop.discrepancy_record import discrepancy_record
from railui.report.loop.groups import group_rows
from railui.report.loop.identifiability import identifiability
from railui.report.loop.model_comparison import rank_candidates, significant_below_threshold
from railui.report.loop.next_run import next_run_rows, rivals_of
from railui.report.loop.noise import noise_rows
from railui.report.loop.notes import report_notes, searched_pairs, verdict_notes, windowed_runs
from railui.report.loop.phases import phase_rows
from railui.report.loop.profiles import profile_parameters
from railui.report.loop.ride_quality import mean_errors, ride_quality
from railui.report.loop.rows import finding_row, run_rows
from railui.report.loop.sentence import sentence
from railui.report.loop.stop_positions import position_records
from railui.report.loop.wording import unit_location
from railui.vehicle.effects import parameter_unit


def loop_report(result: LoopResult, checked: CheckedData | None = None) -> dict[str, Any]:
    """Return the report of a loop as data, see docs/loop.md; checked: the diagnosis of its data."""
    campaign = result.dataset.campaign
    validations = result.validations
    report: dict[str, Any] = {
        "schema": "railui.loop/1",
        "version": railui.__version__,
        "inputs": [{"file": str(campaign.source), "sha256": campaign.sha256}],
        "seed": result.seed,
        "settings": result.context.settings.values(),
        "simd": core.simd_level(),
        "seconds": result.seconds,
        "out_of_time": result.is_out_of_time,
        "campaign": campaign.name,
        "date": date.today().isoformat(),
        "data": campaign.origin,
        "runs": run_rows(result.dataset),
        "declared": _errors(validations["declared"]),
        "before": _errors(validations["before"])
        | {"constrained": result.before.constrained, "failed": result.is_failed_fit},
        "after": _errors(validations["after"]),
        "floor": {
            "nrmse": result.noise_floor.nrmse,
            "sd": result.noise_floor.sd,
            "channels": result.noise_floor.channels,
            "sensors_only": result.noise_floor.sensors_only,
            "interval": list(result.noise_floor.interval),
            "source": result.noise_floor.source,
            "noise": noise_rows(result.context.noise),
        },
        "unexplained": result.error_to_noise,
        "verdict": result.verdict,
        "explained": _explained(result),
        "remainder": _remainder(result.remainder),
        "test": _independent_test(result.test),
        "leave_one_run_out": [dataclasses.asdict(run) for run in result.left_out],
        "sentence": sentence(result),
        "cautions": verdict_notes(result),
        "effects": _effects(result),
        "nominal_effects": _effects(result, of_nominal=True),
        "outside": discrepancy_record(result),
        "classes": [kinds for step in result.steps if (kinds := indistinguishable_kinds(result.context, step))],
        "ranking": rank_candidates(result),
        "traces": significant_below_threshold(result),
        "detectable": without_unphysical_sizes(
            minimum_detectable_effects(
                result.score_test, campaign.min_relative_gain, validations["after"].nrmse, result.predicted_gains
            ),
            result.nominal.design,
        ),
        "means": mean_errors(result),
        "conditions": condition_rows(result),
        "groups": group_rows(result),
        "riding": ride_quality(result),
        "parameters": _parameters(result),
        "prior": prior_record(result),
        "simulations": result.simulations,
        "windows": windowed_runs(result),
        "pairs": searched_pairs(result),
        "identifiability": identifiability(result),
        "gate": [finding_row(finding) for finding in result.findings],
        "notes": report_notes(result),
        "corrections": [] if checked is None else correction_rows(checked, result.withdrawn),
    }
    if checked is not None and checked.is_corrected:
        report["sentence"] = f"{corrected_sentence(checked)} {report['sentence']}"
    measured = report["riding"].get("measured", {})
    rivals = rivals_of(result)
    report["rivals"] = rival_records(rivals, result.nominal, result.context.settings.planning)
    report["next_runs"] = next_run_rows(result, rivals)
    report["profiles"] = profile_parameters(result.nominal.design, report["parameters"], measured)
    return dict(to_json_value(report))


def _errors(validation: Validation) -> dict[str, Any]:
    errors: dict[str, Any] = {"nrmse": validation.nrmse, "channels": dict(validation.channels)}
    if validation.diverged:
        file, time = validation.diverged[0]
        errors["diverged"] = {"file": file, "at_s": time}
    return errors


def _effects(result: LoopResult, *, of_nominal: bool = False) -> list[dict[str, Any]]:
    """Rows of the effects that were added, or of those that the nominal vehicle has already."""
    fit = result.after
    sd = dict(zip(fit.free.paths, fit.sd, strict=True))
    on_bound = {path for path, x in zip(fit.free.paths, fit.free.are_on_bound(fit.x), strict=True) if x}
    rows = []
    for group, i, effect in catalogued_effects(result, of_nominal=of_nominal):
        parameters = {
            p["key"]: {
                "value": effect.parameters[p["key"]],
                "sd": sd.get(f"{group}.{i}.{p['key']}"),
                "unit": parameter_unit(p, unit_location(result, effect.at)),
                "is_on_bound": f"{group}.{i}.{p['key']}" in on_bound,
            }
            for p in core.effect_record(effect.kind)["parameters"]
            if effect.parameters.get(p["key"]) is not None and p["role"] != "run"
        }
        rows.append(
            {
                "kind": effect.kind,
                "at": effect.at,
                "wheelset": effect.wheelset,
                "parameters": parameters,
                "phases": phase_rows(result, i) if group == "effects" else [],
                "positions": position_records(result, effect, f"{group}.{i}"),
            }
        )
    return rows


def _explained(result: LoopResult) -> dict[str, float | None]:
    explained = result.explained
    if explained is None:
        return dict(NO_EXPLAINED)
    return {"value": explained.value, "standard_error": explained.standard_error}


def _remainder(remainder: Remainder) -> dict[str, Any]:
    candidate = remainder.candidate
    return {
        "ratio": remainder.ratio,
        "coherent": remainder.coherent,
        "coherent_share": remainder.coherent_share,
        "structured": remainder.structured,
        "resembles": candidate and dict(zip(("kind", "at", "wheelset"), candidate, strict=True)),
        "at": remainder.at,
        "wheelset": remainder.wheelset,
        "surface": remainder.surface and remainder.surface._asdict(),
        "vibration": remainder.vibration,
    }


def _independent_test(test: IndependentTest | None) -> dict[str, Any]:
    if test is None:
        return dict(NO_TEST)
    return {
        "nrmse_before": test.nrmse_before,
        "nrmse_after": test.nrmse_after,
        "floor": test.floor,
        "files": list(test.files),
        "held_back": test.is_held_back,
        "contradicts": test.is_contradicted,
    }


def _parameters(result: LoopResult) -> dict[str, dict[str, Any]]:
    before, after, design = result.before, result.after, result.nominal.design
    calibrated = dict(zip(before.free.paths, zip(before.x, before.sd, strict=True), strict=True))
    flags = dict(zip(after.free.paths, parameter_flags(after, result.context.settings.identifiability), strict=True))
    rows = {}
    for path, value, sd in zip(after.free.paths, after.x, after.sd, strict=True):
        if path not in calibrated or path not in design.values:  # phases, and effects of the nominal vehicle
            continue
        value_before, sd_before = calibrated[path]
        flag = flags[path]
        is_shifted = after is not before and abs(value - value_before) > 2.0 * max(sd_before, sd)
        if is_shifted and flag in (None, "correlated"):
            flag = "moved"
        rows[path] = {
            "declared": design.values[path],
            "before": value_before,
            "value": value,
            "sd": sd,
            "unit": design.unit(path),
            "flag": flag,
        }
    return rows
