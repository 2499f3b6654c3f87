"""Measured runs as a campaign: run files and campaign.yaml with nominal vehicle and noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from railui.capture.processing.align import MIN_CORRELATION, MIN_OVERLAP, find_shift
from railui.capture.processing.measured_run import MeasuredRun, save_run
from railui.io.atomic import relative_path, write_text
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter

NOISE_DIGITS = 3


@dataclass(frozen=True, eq=False)
class CampaignRun:
    """Run of a campaign: its role, its recording, its columns; is_simulated: of the simulated logger."""

    role: str
    source: str
    run: MeasuredRun
    is_simulated: bool = False


def align_runs(runs: Sequence[CampaignRun]) -> tuple[list[CampaignRun], list[str]]:
    """Give runs over the same line one distance: shift each to the first by the correlation of their tracks.

    Returns
    -------
    Runs, and a note for each that was shifted.
    """
    reference = runs[0]
    aligned = [reference]
    notes = []
    for run in runs[1:]:
        metres = _shift_between(reference.run, run.run)
        if metres is None:
            aligned.append(run)
            continue
        notes.append(f"{run.source} is on the line of {reference.source}: moved by {metres:+.2f} m along it")
        columns = {**run.run.columns, "s": run.run.columns["s"] + metres}
        aligned.append(replace(run, run=replace(run.run, columns=columns)))
    return aligned, notes


def _shift_between(reference: MeasuredRun, run: MeasuredRun) -> float | None:
    """Return the shift [m] of a run, None if it is too short or not on the same line."""
    a, b = reference.columns, run.columns
    if "yw" not in a or "yw" not in b or b["s"][-1] - b["s"][0] < MIN_OVERLAP:
        return None
    shift = find_shift(a["s"], a["yw"], b["s"], b["yw"])
    return None if shift.correlation < MIN_CORRELATION else shift.metres


def write_campaign(directory: Path, name: str, vehicle: Path, runs: Sequence[CampaignRun]) -> Path:
    """Write run_a.csv.gz, run_b.csv.gz, ... and campaign.yaml, which refers to the vehicle's file."""
    directory.mkdir(parents=True, exist_ok=True)
    entries = []
    for letter, run in zip(run_letters(len(runs)), runs, strict=True):
        file = run_file(letter)
        comments = (f"from {run.source}", *run.run.notes)
        save_run(directory / file, run.run, tuple(line.replace("\n", " ") for line in comments))
        entries.append({"file": file, "role": run.role})
    writer = YamlWriter()
    writer.line(f"schema: {schema_name('campaign')}")
    writer.entry("name", name)
    writer.entry("data", "simulated" if any(run.is_simulated for run in runs) else "measured")
    writer.entry("vehicle", relative_path(vehicle, directory))
    writer.items("runs", entries)
    writer.entry("noise", _largest_noise(runs))
    return write_text(directory / "campaign.yaml", writer.text())


def _largest_noise(runs: Sequence[CampaignRun]) -> dict[str, float]:
    """Return the largest noise of each column over the runs, rounded."""
    noise: dict[str, float] = {}
    for run in runs:
        for column, sd in run.run.noise.items():
            noise[column] = max(noise.get(column, 0.0), float(f"{sd:.{NOISE_DIGITS}g}"))
    return noise


def run_file(letter: str) -> str:
    """Return the name of the file of a run of a campaign."""
    return f"run_{letter}.csv.gz"


def run_letters(count: int) -> list[str]:
    """Return a, b, ..., z, aa, ab, ...

    >>> run_letters(3), run_letters(28)[-1]
    (['a', 'b', 'c'], 'ab')
    """
    words = []
    for number in range(1, count + 1):
        word = ""
        while number:
            number, digit = divmod(number - 1, 26)
            word = chr(97 + digit) + word
        words.append(word)
    return words
