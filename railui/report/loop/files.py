"""What a loop leaves behind: report, adjusted design, campaign with its sensors, simulated channels of every run."""

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
from railui.identification.estimation.validation import validate
from railui.identification.loop import LoopResult
from railui.io.atomic import write_text
from railui.report.loop.page import write_page
from railui.vehicle.design_reader import Adjustment, Design

OURS = ("loop.json", "adjusted.yaml", "campaign.yaml", "log.txt", "report.html")
DIGITS = "%.9g"


class ForeignFiles(ValueError):
    """The directory holds files that a loop did not write."""


def check_directory(directory: Path) -> None:
    """Raises ForeignFiles where a directory holds files that are not ours: nothing of others is overwritten."""
    if not directory.exists():
        return
    if not directory.is_dir():
        raise ForeignFiles(f"{directory} is a file: name a directory")
    foreign = [f.name for f in sorted(directory.iterdir()) if f.name not in OURS and not _simulated(f.name)]
    if foreign:
        names = ", ".join(foreign[:3])
        raise ForeignFiles(f"{directory} holds files of others ({names}): name a new directory with -o")


def _simulated(name: str) -> bool:
    return name.startswith("simulated_") and name.endswith(".csv.gz")


def adjusted_design(found: LoopResult) -> Design:
    """The design as found, with the covariance of what was adjusted."""
    campaign, fit = found.measurement.campaign, found.after
    kept = [i for i, p in enumerate(fit.free.paths) if p in set(fit.model.design.paths())]
    covariance = fit.covariance[np.ix_(kept, kept)]
    adjustment = Adjustment(
        campaign.name,
        campaign.sha256,
        tuple(fit.free.paths[i] for i in kept),
        tuple(tuple(float(x) for x in row) for row in 0.5 * (covariance + covariance.T)),
    )
    model = fit.model.on(*found.measurement.estimation[0].segment_key)  # what turns, as on the first run
    return replace(model.design, name=f"{campaign.design.name}, adjusted to {campaign.name}", adjustment=adjustment)


def write_loop(found: LoopResult, report: Mapping[str, Any], directory: Path, log: Sequence[str]) -> None:
    """Write everything into a directory; each file appears whole or not at all."""
    directory.mkdir(parents=True, exist_ok=True)
    write_text(directory / "loop.json", json.dumps(report, indent=1, allow_nan=False) + "\n")
    save_design(adjusted_design(found), directory / "adjusted.yaml")
    campaign = replace(found.measurement.campaign, sensors=found.after.model.sensors)
    save_campaign(campaign, directory / "campaign.yaml", directory / "adjusted.yaml")
    with ThreadPoolExecutor(1) as pool:  # to simulate and to compress leaves the interpreter to the figures
        simulated = pool.submit(write_simulated, found, directory)
        write_page(found, report, directory / "report.html")
        simulated.result()
    write_text(directory / "log.txt", "\n".join(log) + "\n")


def write_simulated(found: LoopResult, directory: Path) -> None:
    """simulated_NAME.csv.gz of every run: t and declared, before, after of each channel."""
    measurement = found.measurement
    names = simulated_names([entry.name for entry in measurement.campaign.runs])
    adjusting = {
        "declared": validate(found.nominal, measurement, measurement.estimation),
        "before": validate(found.before.model, measurement, measurement.estimation),
        "after": found.judge(measurement.estimation),
    }
    for entry, run, name in zip(measurement.campaign.runs, measurement.runs, names, strict=True):
        judged = found.validations if entry.role == "validate" else adjusting
        stretches = [s for s in measurement.stretches if s.role == entry.role]
        columns: dict[str, FloatArray] = {"t": run.columns["t"]}
        for which in ("declared", "before", "after"):
            for stretch, z in zip(stretches, judged[which].series, strict=True):
                if stretch.file == entry.name:
                    _lay(columns, which, stretch.channels, run.stretches[stretch.number], z)
        write_text(directory / name, _csv(columns))


def simulated_names(runs: Sequence[str]) -> list[str]:
    """The file of each run; of runs that share a name in different folders the second is _2, in their order.

    >>> simulated_names(["mon/run.csv.gz", "tue/run.csv", "run_2.csv"])
    ['simulated_run.csv.gz', 'simulated_run_2.csv.gz', 'simulated_run_2_2.csv.gz']
    """
    names: list[str] = []
    for run in runs:
        stem = "simulated_" + Path(run).name.removesuffix(".gz").removesuffix(".csv")
        among = (f"{stem}{'' if i == 1 else f'_{i}'}.csv.gz" for i in itertools.count(1))
        names.append(next(name for name in among if name not in names))
    return names


def _lay(columns: dict[str, FloatArray], which: str, channels: Sequence[str], rows: slice, z: FloatArray) -> None:
    for channel, values in zip(channels, z, strict=True):
        column = columns.setdefault(f"{which}.{channel}", np.full(len(columns["t"]), np.nan))
        column[rows] = values


def _csv(columns: Mapping[str, FloatArray]) -> str:
    table = np.stack(list(columns.values()), axis=1)
    lines = [",".join(columns)]
    empty = np.isnan(table)
    row = ",".join([DIGITS] * table.shape[1])
    for values, gap in zip(table, empty, strict=True):
        if gap.any():
            lines.append(",".join("" if g else DIGITS % v for v, g in zip(values, gap, strict=True)))
        else:
            lines.append(row % tuple(values))
    return "\n".join(lines) + "\n"
