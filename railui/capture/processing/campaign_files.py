"""Measured runs as a campaign: runs, the declared vehicle, campaign.yaml, and what to know of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railui.capture.processing.align import SAME_LINE, align
from railui.capture.processing.measured_run import MeasuredRun, save_run
from railui.io.atomic import relative_path, write_text
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import flow, scalar_text

DIGITS = 3


@dataclass(frozen=True, eq=False)
class Taken:
    """One run of a campaign: its role, where it comes from, what was measured."""

    role: str
    source: str
    run: MeasuredRun


def on_one_line(taken: Sequence[Taken]) -> tuple[list[Taken], list[str]]:
    """Runs over the same line with one distance: each laid on the first by the correlation of their tracks."""
    first, done, notes = taken[0].run.columns, [taken[0]], []
    for one in taken[1:]:
        columns = one.run.columns
        if "yw" not in first or "yw" not in columns or columns["s"][-1] - columns["s"][0] < 300:
            done.append(one)
            continue
        shift = align(*(x for c in (first, columns) for x in (c["s"], c["yw"])))
        if shift.correlation < SAME_LINE:
            done.append(one)
            continue
        notes.append(f"{one.source} is on the line of {taken[0].source}: moved by {shift.metres:+.2f} m along it")
        moved = {**columns, "s": columns["s"] + shift.metres}
        done.append(replace(one, run=replace(one.run, columns=moved)))
    return done, notes


def write_campaign(directory: Path, name: str, vehicle: Path, taken: Sequence[Taken]) -> Path:
    """Writes run_a.csv.gz, run_b.csv.gz, ... and campaign.yaml; the vehicle stays where it lies."""
    directory.mkdir(parents=True, exist_ok=True)
    entries = []
    for letter, one in zip(letters(len(taken)), taken, strict=True):
        file = f"run_{letter}.csv.gz"
        about = (f"from {one.source}", *one.run.notes)
        save_run(directory / file, one.run, tuple(line.replace("\n", " ") for line in about))
        entries.append(f"  - {flow({'file': file, 'role': one.role})}")
    noise: dict[str, float] = {}
    for one in taken:
        for column, sd in one.run.noise.items():
            noise[column] = max(noise.get(column, 0.0), float(f"{sd:.{DIGITS}g}"))
    lines = [
        f"schema: {schema_name('campaign')}",
        f"name: {scalar_text(name)}",
        f"vehicle: {scalar_text(relative_path(vehicle, directory))}",
    ]
    lines += ["runs:", *entries, f"noise: {flow(noise)}"]
    return write_text(directory / "campaign.yaml", "\n".join(lines) + "\n")


def letters(count: int) -> list[str]:
    """a, b, ..., z, aa, ab, ...

    >>> letters(3), letters(28)[-1]
    (['a', 'b', 'c'], 'ab')
    """
    found = []
    for i in range(count):
        word, i = "", i + 1
        while i:
            i, digit = divmod(i - 1, 26)
            word = chr(97 + digit) + word
        found.append(word)
    return found


def duration(run: MeasuredRun) -> float:
    """Duration of a run [s], gaps left out."""
    return float(run.columns["t"].size * np.median(np.diff(run.columns["t"])))
