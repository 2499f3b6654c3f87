"""Run measured by a logger: columns, noise, quality of its track, report, file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.processing.rail_quality import RailQuality
from railui.io.table import write_table

DIGITS = 12
DIGITS_OF_SECOND = 6


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """Run built of a recording.

    Attributes
    ----------
    columns, units
        Values [n] and units by column name.
    noise
        Standard deviations by column name.
    rail_quality
        Quality of the reconstructed track, None if it was measured.
    counts
        Counts of rows, gaps and segments.
    natural_frequency
        Natural frequency of the integrating filter [Hz].
    standstill
        "mean" and "sd" of the sensors at a standstill.
    notes
        Remarks for the user.
    """

    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    noise: Mapping[str, float]
    rail_quality: RailQuality | None
    counts: Mapping[str, int]
    natural_frequency: float | None
    standstill: Mapping[str, Mapping[str, float]]
    notes: tuple[str, ...]

    @property
    def duration(self) -> float:
        """Duration [s] without gaps."""
        return float(self.columns["t"].size * np.median(np.diff(self.columns["t"])))

    def report(self) -> dict[str, Any]:
        """Return the run without its values, for JSON."""
        return {
            "columns": list(self.columns),
            "rows": int(self.columns["t"].size) if "t" in self.columns else 0,
            "counts": dict(self.counts),
            "noise": dict(self.noise),
            "standstill": {name: dict(x) for name, x in self.standstill.items()},
            "natural_frequency": self.natural_frequency,
            "rails": None if self.rail_quality is None else _quality_report(self.rail_quality),
            "notes": list(self.notes),
        }


def _quality_report(quality: RailQuality) -> dict[str, Any]:
    return {
        "bands": [
            {"from": a, "to": b, "sd_yw": sd, "difference": d, "error": error}
            for (a, b, sd, d), error in zip(quality.bands, quality.errors, strict=True)
        ],
        "correlation": quality.correlation,
        "lag": quality.lag,
        "valid": None if quality.valid is None else list(quality.valid),
        "coherence": {"wavelength": quality.wavelength, "value": quality.coherence},
    }


def save_run(path: str | Path, run: MeasuredRun, comments: tuple[str, ...] = ()) -> Path:
    """Write a run, completely or not at all; its times to the microsecond."""
    headers = {name: f"{name} [{run.units[name]}]" for name in run.columns}
    digits = dict.fromkeys(headers.values(), DIGITS)
    if "t" in headers and run.columns["t"].size:
        whole = len(str(int(np.max(np.abs(run.columns["t"])))))
        digits[headers["t"]] = max(DIGITS, whole + DIGITS_OF_SECOND)
    return write_table(path, {headers[name]: x for name, x in run.columns.items()}, comments, digits)
