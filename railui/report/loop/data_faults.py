"""Data faults in the loop: the diagnosis before any fit, and the report of a loop that stops at one."""

from __future__ import annotations

import json
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import railui
from railui import core
from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Diagnosis, Fault
from railui.campaign.finding import Finding
from railui.documents.saving import save_campaign
from railui.io.atomic import to_json_value, write_text
from railui.progress import SILENT, Progress
from railui.report.loop.rows import finding_row, run_rows
from railui.report.templates import render_template

DATA = "data"
VERDICT_LABEL = "data fault"
NO_ERRORS: Mapping[str, Any] = {"nrmse": None, "channels": {}}
NO_EXPLAINED: Mapping[str, Any] = {"value": None, "standard_error": None}
NO_REMAINDER: Mapping[str, Any] = dict.fromkeys(
    ("ratio", "coherent", "coherent_share", "structured", "resembles", "at", "wheelset", "surface", "vibration")
)
NO_TEST: Mapping[str, Any] = {
    "nrmse_before": None,
    "nrmse_after": None,
    "floor": None,
    "files": [],
    "held_back": False,
    "contradicts": False,
}
NO_FLOOR: Mapping[str, Any] = {
    "nrmse": None,
    "sd": None,
    "channels": {},
    "sensors_only": None,
    "interval": [None, None],
    "source": None,
    "noise": {},
}


@dataclass(frozen=True, eq=False)
class CheckedData:
    """Dataset of a loop after its diagnosis.

    Attributes
    ----------
    dataset
        With corrected columns where the faults were corrected.
    found
        Faults of the data as recorded.
    remaining
        Faults of `dataset`.
    is_stopped
        True if no fit should begin.
    seconds
        Duration of the diagnosis.
    """

    dataset: Dataset
    found: Diagnosis
    remaining: Diagnosis
    is_corrected: bool
    is_stopped: bool
    seconds: float


def examine_data(
    dataset: Dataset,
    *,
    correct: bool = False,
    accept_data: bool = False,
    jobs: int | None = 1,
    progress: Progress = SILENT,
) -> CheckedData:
    """Diagnose the data of a campaign, and correct or accept its faults if asked to.

    Parameters
    ----------
    correct
        Make the corrections of serious faults; the loop stops where a fault has none, or several that fit alike.
    accept_data
        Go on despite serious faults.
    jobs
        Number of threads; None for all.
    """
    started = time.perf_counter()
    found = remaining = diagnose(dataset, jobs)
    is_corrected = bool(correct and found.serious and found.is_correctable)
    if is_corrected:
        for fault in found.serious:
            progress.message(f"corrected: {fault.text}: {fault.yaml}")
        campaign = dataset.campaign
        corrected = replace(campaign, corrections=campaign.corrections.joined(found.corrections))
        dataset = read_dataset(corrected)
        remaining = diagnose(dataset, jobs)
    is_stopped = bool(remaining.serious) and not accept_data
    return CheckedData(dataset, found, remaining, is_corrected, is_stopped, time.perf_counter() - started)


def correction_rows(checked: CheckedData, withdrawn: Collection[Finding] = ()) -> list[dict[str, Any]]:
    """Return the faults that a correction undoes, and whether it was made (JSON key `corrections`).

    withdrawn: findings that the final model contradicts, of which no correction is proposed.
    """
    return [
        _correction_row(f, checked.is_corrected and f.serious)
        for f in checked.found.faults
        if (f.serious or f.yaml) and f.finding() not in withdrawn
    ]


def _correction_row(fault: Fault, is_applied: bool) -> dict[str, Any]:
    return {
        "channel": ", ".join(fault.channels),
        "kind": fault.kind,
        "value": fault.value,
        "sd": fault.sd,
        "unit": fault.unit,
        "files": list(fault.files),
        "text": fault.text,
        "serious": fault.serious,
        "yaml": fault.yaml,
        "alternatives": list(fault.alternatives),
        "applied": is_applied,
    }


def data_fault_sentence(diagnosis: Diagnosis) -> str:
    """Return the verdict `data` in words."""
    parts = []
    for fault in diagnosis.serious:
        text = fault.text
        if fault.alternatives:
            other = " or ".join(f"`{line}`" for line in fault.alternatives[:3])
            text += f"; correct it by `{fault.yaml}` or {other}: these data do not determine which"
        elif fault.yaml:
            text += f"; correct it by `{fault.yaml}`" + (f", or {fault.remedy}" if fault.remedy else "")
        elif fault.remedy:
            text += f": {fault.remedy}"
        parts.append(text)
    noun = "Data fault" if len(parts) == 1 else "Data faults"
    return f"{noun}: {'. Also: '.join(parts)}. No model was fitted."


def corrected_sentence(checked: CheckedData) -> str:
    """Return the corrections that were made, in words."""
    return f"Corrected: {'; '.join(fault.text for fault in checked.found.serious)}."


def data_fault_report(checked: CheckedData, seed: int = 0) -> dict[str, Any]:
    """Return the report of a loop that stops at a data fault: every key of railui.loop/1, empty without a fit."""
    campaign = checked.dataset.campaign
    report: dict[str, Any] = {
        "schema": "railui.loop/1",
        "version": railui.__version__,
        "inputs": [{"file": str(campaign.source), "sha256": campaign.sha256}],
        "seed": seed,
        "settings": campaign.settings.values(),
        "simd": core.simd_level(),
        "seconds": checked.seconds,
        "out_of_time": False,
        "campaign": campaign.name,
        "date": date.today().isoformat(),
        "data": campaign.origin,
        "runs": run_rows(checked.dataset),
        "declared": dict(NO_ERRORS),
        "before": {**NO_ERRORS, "constrained": False, "failed": False},
        "after": dict(NO_ERRORS),
        "floor": dict(NO_FLOOR),
        "unexplained": None,
        "explained": dict(NO_EXPLAINED),
        "remainder": dict(NO_REMAINDER),
        "test": dict(NO_TEST),
        "leave_one_run_out": [],
        "verdict": DATA,
        "sentence": data_fault_sentence(checked.remaining),
        "cautions": [],
        "effects": [],
        "nominal_effects": [],
        "outside": None,
        "classes": [],
        "ranking": [],
        "traces": [],
        "detectable": [],
        "prior": None,
        "rivals": [],
        "next_runs": [],
        "means": {},
        "conditions": None,
        "groups": [],
        "riding": {"measured": {}, "declared": {}, "before": {}, "after": {}},
        "parameters": {},
        "simulations": 0,
        "windows": None,
        "pairs": None,
        "identifiability": None,
        "gate": [finding_row(f) for f in check_data(checked.dataset, checked.remaining)],
        "notes": [],
        "profiles": None,
        "corrections": correction_rows(checked),
    }
    return dict(to_json_value(report))


def write_data_fault(checked: CheckedData, report: Mapping[str, Any], directory: Path, log: Sequence[str]) -> None:
    """Write loop.json, report.html and log.txt; campaign.yaml with the corrections if each fault has one."""
    directory.mkdir(parents=True, exist_ok=True)
    for name in ("adjusted.yaml", "campaign.yaml"):  # of an earlier loop, which this verdict revokes
        (directory / name).unlink(missing_ok=True)
    for file in directory.glob("simulated_*.csv.gz"):
        file.unlink()
    write_text(directory / "loop.json", json.dumps(report, indent=1, allow_nan=False) + "\n")
    if checked.remaining.is_correctable:
        campaign = checked.dataset.campaign
        corrected = replace(campaign, corrections=campaign.corrections.joined(checked.remaining.corrections))
        save_campaign(corrected, directory / "campaign.yaml")
    page = render_template("loop/data_faults.html.j2", {"report": report, "verdict": VERDICT_LABEL})
    write_text(directory / "report.html", page)
    write_text(directory / "log.txt", "\n".join(log) + "\n")
