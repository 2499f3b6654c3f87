"""Texts of a loop: runs, data checks, identifiability, hunting."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from rich.text import Text

from railui.api.fit import COMBINED, DETERMINED, ROUGH, UNSEEN
from railui.campaign.campaign import Campaign
from railui.campaign.dataset import Dataset
from railui.campaign.finding import Finding
from railui.desk.presenters.loop_history import LoopHistory
from railui.report.loop.summary import summary_lines

COHERENCE_CHECK: Final = "ceiling"  # check of the fraction that no linear model explains, for every channel and run
MAX_INCOHERENT_FRACTION: Final = 0.5  # larger fractions are highlighted
CLASS_COLOURS: Final = {DETERMINED: "green", ROUGH: "yellow", COMBINED: "yellow", UNSEEN: "red"}
SHORT_CLASSES: Final = {
    DETERMINED: "determined",
    ROUGH: "roughly",
    COMBINED: "in combination",
    UNSEEN: "not identifiable",
}
ROLE_NAMES: Final = {"adjust": "estimation", "validate": "validation", "test": "test"}
REPORTED_COUNTS: Final = {  # of a run: singular and plural
    "gaps": ("gap", "gaps"),
    "stuck": ("stuck part", "stuck parts"),
    "short_stretches": ("short segment", "short segments"),
    "missing_rows": ("missing row", "missing rows"),
}


# runs and names


def runs_text(campaign: Campaign, dataset: Dataset | None) -> Text:
    """List the runs of a campaign: name, role and, once they are read, length and data losses."""
    text = Text(no_wrap=True, overflow="ellipsis")
    for i, run in enumerate(campaign.runs):
        text.append(f"{run.name:20} {ROLE_NAMES.get(run.role, run.role):11}")
        if dataset is not None:
            text.append_text(run_text(dataset, i))
        text.append("\n")
    text.rstrip()
    return text


def run_text(dataset: Dataset, index: int) -> Text:
    """Return duration, sampling rate, number of channels and data losses of a run."""
    run = dataset.runs[index]
    text = Text(f"{len(run) / run.rate:6.0f} s  {run.rate:.4g} Hz  {len(run.responses)} channels  ")
    losses = [f"{n} {REPORTED_COUNTS[key][n != 1]}" for key, n in run.counts.items() if n and key in REPORTED_COUNTS]
    text.append(", ".join(losses) or "no gaps", "yellow" if losses else "dim")
    if run.notes:
        text.append(f"  {run.notes[0]}", "yellow")
    return text


def error_text(value: float | None) -> str:
    """Return a normalised error as text; `div.` if the simulation diverged, which a report has as None."""
    return "div." if value is None or not np.isfinite(value) else f"{value:.3f}"


def short_path(path: str) -> str:
    """Return the name of a parameter with its group.

    >>> short_path("vehicle.primary.lateral_stiffness"), short_path("vehicle.wheel_load")
    ('lateral stiffness primary', 'wheel load')
    """
    *groups, name = path.split(".")
    group = groups[-1] if groups and groups[-1] not in ("contact", "vehicle") else ""
    return f"{name.replace('_', ' ')} {group}".strip()


# data checks


def data_checks_text(findings: Sequence[Finding]) -> Text:
    """Return the findings of the data checks and the fraction of each channel that no linear model explains."""
    text = Text()
    faults = [f for f in findings if f.check != COHERENCE_CHECK]
    if not faults:
        text.append("No faults in clocks, gains, signs or gaps.\n", "green")
    for f in faults:
        if f.serious:
            text.append("check this first: ", "bold red")
        text.append(f"{f.file}: {f.text}{_interval_text(f)}\n", "" if f.serious else "yellow")
    coherence = [f for f in findings if f.check == COHERENCE_CHECK]
    if coherence:
        text.append("\nNot coherent with the track (nonlinearity, other inputs, noise, varying speed):\n", "dim")
        text.append_text(_incoherence_table(coherence))
    text.rstrip()
    return text


def _interval_text(f: Finding) -> str:
    """Return the affected time interval unless the text of the finding contains it."""
    if f.start is None or f.end is None or f"{f.start:.0f}" in f.text:
        return ""
    return f" (from {f.start:.1f} to {f.end:.1f} s)"


def _incoherence_table(findings: Sequence[Finding]) -> Text:
    """Return a table with a row per channel and a column per run, in per cent."""
    files = list(dict.fromkeys(f.file for f in findings))
    fractions = {(f.channel, f.file): f.value for f in findings}
    text = Text("  % " + "".join(f"{file.split('.')[0][:7]:>8}" for file in files) + "\n", "dim")
    for channel in dict.fromkeys(f.channel for f in findings):
        text.append(f"{channel:4}")
        for file in files:
            fraction = fractions.get((channel, file))
            cell = "-" if fraction is None else f"{100 * fraction:.0f}"
            text.append(f"{cell:>8}", "yellow" if (fraction or 0) > MAX_INCOHERENT_FRACTION else "")
        text.append("\n")
    return text


def details_title(history: LoopHistory) -> str:
    """Return the title of the details: data checks, after the loop also identifiability."""
    if history.finished is not None:
        return "Test · identifiability · data checks"
    serious = sum(f.serious for f in history.findings)
    return f"Data checks: {serious} serious" if serious else "Data checks"


def details_text(history: LoopHistory) -> Text:
    """Return the data checks, after the loop preceded by the independent test and the identifiability."""
    if history.dataset is not None:
        checks = data_checks_text(history.findings)
    elif history.read_error:
        checks = Text(history.read_error, "red")
    else:
        checks = Text("reading the runs", "dim")
    if history.finished is None:
        return checks
    return evidence_text(history.finished.report).append("\n\n").append_text(checks)


def evidence_text(report: Mapping[str, Any]) -> Text:
    """Return the lines below a verdict: independent test, rivals, identifiability, notes."""
    summary = Text("\n".join(summary_lines(report)) + "\n\n")
    return summary.append_text(identifiability_text(report))


# identifiability and hunting


def identifiability_text(report: Mapping[str, Any]) -> Text:
    """Return the parameters by class of identifiability, and the notes of the report."""
    text = Text()
    rows = report["identifiability"]["parameters"]
    for word, colour in CLASS_COLOURS.items():
        names = [_parameter_text(path, row) for path, row in rows.items() if row["word"] == word]
        if names:
            text.append(f"{word}: ", f"bold {colour}")
            text.append(", ".join(names) + "\n")
    for note in report["notes"]:
        text.append(f"{note}\n", "yellow")
    text.rstrip()
    return text


def identifiability_summary(report: Mapping[str, Any]) -> str:
    """Return the number of parameters in each class of identifiability."""
    words = [row["word"] for row in report["identifiability"]["parameters"].values()]
    return ", ".join(f"{words.count(word)} {short}" for word, short in SHORT_CLASSES.items() if word in words)


def multiple_shooting_note(report: Mapping[str, Any]) -> str:
    """Return a sentence on the runs that were fitted by multiple shooting, with the reason; empty if there are none."""
    windows = report["windows"]
    if windows is None:
        return ""
    runs = ", ".join(windows["runs"])
    reason = windows.get("reason", "the linear vehicle hunts")  # reports of earlier versions have none
    sentence = f"{reason} on {runs}: calibrated there by multiple shooting on windows of {windows['seconds']:g} s."
    return sentence[0].upper() + sentence[1:]


def _parameter_text(path: str, row: Mapping[str, Any]) -> str:
    """Return a parameter with its standard deviation, or with the parameters it is combined with."""
    if row["word"] == COMBINED:
        return f"{_quantity_name(path)} (with {' and '.join(_quantity_name(p) for p in row['with'])})"
    sd = row["relative_sd"]
    name = _quantity_name(path)
    return name if sd is None or row["word"] == UNSEEN else f"{name}: {100 * sd:.2g} %"


def _quantity_name(path: str) -> str:
    """Return the name of a parameter, that of an effect with its number from 1.

    >>> _quantity_name("effects.0.half_width"), _quantity_name("vehicle.wheel_load")
    ('half-width of effect 1', 'wheel load')
    """
    group, number, key = [*path.split(".", 2), "", ""][:3]
    if group != "effects" or not number.isdecimal():
        return short_path(path)
    return f"{key.replace('_', ' ').replace('half width', 'half-width')} of effect {int(number) + 1}"
