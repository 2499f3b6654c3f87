"""Files of a loop: report, calibrated design, campaign with its sensors, simulated channels of every run."""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.documents.saving import save_campaign, save_design
from railui.identification.estimation.validation import Validation, validate
from railui.identification.result import LoopResult
from railui.io.atomic import write_text
from railui.report.loop.page import write_page
from railui.vehicle.design_reader import Adjustment, Design

LOOP_FILES = ("loop.json", "adjusted.yaml", "campaign.yaml", "log.txt", "report.html")
NUMBER_FORMAT = "%.9g"
SAMPLE_DIGITS = 5
MODELS = ("declared", "before", "after")


class ForeignFilesError(ValueError):
    """Directory with files that a loop did not write."""


def check_directory(directory: Path) -> None:
    """Raise ForeignFilesError where a directory contains files that a loop did not write."""
    if not directory.exists():
        return
    if not directory.is_dir():
        raise ForeignFilesError(f"{directory} is a file: name a directory")
    foreign = [
        f.name for f in sorted(directory.iterdir()) if f.name not in LOOP_FILES and not _is_simulated_file(f.name)
    ]
    if foreign:
        names = ", ".join(foreign[:3])
        raise ForeignFilesError(f"{directory} contains other files ({names}): name a new directory with -o")


def _is_simulated_file(name: str) -> bool:
    return name.startswith("simulated_") and name.endswith(".csv.gz")


def calibrated_design(result: LoopResult) -> Design:
    """Return the final design, with the covariance and samples of the estimated parameters."""
    campaign, fit = result.dataset.campaign, result.after
    estimated = [i for i, p in enumerate(fit.free.paths) if p in set(fit.model.design.paths())]
    covariance = fit.covariance[np.ix_(estimated, estimated)]
    first = result.dataset.estimation[0].segment_key
    model = fit.model.on_segment(first.name, first.middle)  # phases of the first run, the design's load
    names = tuple(fit.free.paths[i] for i in estimated)
    adjustment = Adjustment(
        campaign.name,
        campaign.sha256,
        names,
        _as_rows(0.5 * (covariance + covariance.T)),
        _as_rows(_rounded(fit.samples[:, estimated])) if fit.samples.size else (),
        tuple(model.design.value(name) for name in names),
    )
    return replace(model.design, name=f"{campaign.design.name}, calibrated on {campaign.name}", adjustment=adjustment)


def _rounded(samples: FloatArray) -> FloatArray:
    """Return samples to the digits that a spread is worth in a file."""
    return np.array([[float(f"{x:.{SAMPLE_DIGITS}g}") for x in row] for row in samples])


def _as_rows(numbers: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in numbers)


def write_loop(result: LoopResult, report: Mapping[str, Any], directory: Path, log: Sequence[str]) -> None:
    """Write all files into a directory, each atomically; remove the series of runs that are not in the campaign.

    The page is last to be completed: where a figure fails, all other files are there.
    """
    directory.mkdir(parents=True, exist_ok=True)
    names = simulated_file_names([entry.name for entry in result.dataset.campaign.runs])
    for file in directory.iterdir():
        if _is_simulated_file(file.name) and file.name not in names:
            file.unlink()
    write_text(directory / "loop.json", json.dumps(report, indent=1, allow_nan=False) + "\n")
    save_design(calibrated_design(result), directory / "adjusted.yaml")
    campaign = replace(result.dataset.campaign, sensors=result.after.model.sensors)
    save_campaign(campaign, directory / "campaign.yaml", directory / "adjusted.yaml")
    write_text(directory / "log.txt", "\n".join(log) + "\n")
    with ThreadPoolExecutor(1) as pool:  # simulation and compression release the interpreter for the figures
        writing = pool.submit(write_simulated, result, directory)
        write_page(result, report, directory / "report.html")
        writing.result()


def write_simulated(result: LoopResult, directory: Path) -> None:
    """Write simulated_NAME.csv.gz of every run: t and declared, before, after of each channel."""
    dataset = result.dataset
    names = simulated_file_names([entry.name for entry in dataset.campaign.runs])
    by_role = {
        role: result.validations if role == "validate" else _validations(result, role)
        for role in dict.fromkeys(entry.role for entry in dataset.campaign.runs)
    }
    for entry, run, name in zip(dataset.campaign.runs, dataset.runs, names, strict=True):
        validations = by_role[entry.role]
        segments = [segment for segment in dataset.segments if segment.role == entry.role]
        columns: dict[str, FloatArray] = {"t": run.columns["t"]}
        for model in MODELS:
            for segment, series in zip(segments, validations[model].series, strict=True):
                if segment.file == entry.name:
                    last = run.segments[segment.number].stop  # it may begin later: where the track is known
                    rows = slice(last - segment.samples, last)
                    _insert(columns, model, segment.channels, rows, series)
        write_text(directory / name, _csv(columns))


def _validations(result: LoopResult, role: str) -> dict[str, Validation]:
    """Validate every model on the runs of a role."""
    segments = [segment for segment in result.dataset.segments if segment.role == role]
    return {
        "declared": validate(result.context, result.nominal, segments),
        "before": validate(result.context, result.before.model, segments),
        "after": result.validate(segments),
    }


def simulated_file_names(runs: Sequence[str]) -> list[str]:
    """Return the file name of each run; runs of one name in different folders are numbered _2, _3 in their order.

    >>> simulated_file_names(["mon/run.csv.gz", "tue/run.csv", "run_2.csv"])
    ['simulated_run.csv.gz', 'simulated_run_2.csv.gz', 'simulated_run_2_2.csv.gz']
    """
    names: list[str] = []
    for run in runs:
        stem = "simulated_" + Path(run).name.removesuffix(".gz").removesuffix(".csv")
        numbered = (f"{stem}{'' if i == 1 else f'_{i}'}.csv.gz" for i in itertools.count(1))
        names.append(next(name for name in numbered if name not in names))
    return names


def _insert(
    columns: dict[str, FloatArray], model: str, channels: Sequence[str], rows: slice, series: FloatArray
) -> None:
    """Insert the series [channel, n] of a segment at its rows; other rows stay NaN."""
    for channel, values in zip(channels, series, strict=True):
        column = columns.setdefault(f"{model}.{channel}", np.full(len(columns["t"]), np.nan))
        column[rows] = values


def _csv(columns: Mapping[str, FloatArray]) -> str:
    """Return columns as CSV, NaN as an empty cell."""
    table = np.stack(list(columns.values()), axis=1)
    has_gap = np.any(np.isnan(table), axis=1).tolist()
    row_format = ",".join([NUMBER_FORMAT] * table.shape[1])
    lines = [",".join(columns)]
    for values, is_gap in zip(table, has_gap, strict=True):
        if is_gap:
            lines.append(",".join("" if np.isnan(v) else NUMBER_FORMAT % v for v in values))
        else:
            lines.append(row_format % tuple(values))
    return "\n".join(lines) + "\n"
