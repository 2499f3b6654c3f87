"""Rows of the loop report that need no fit: runs and findings."""

from __future__ import annotations

from typing import Any

from railui.campaign.dataset import Dataset
from railui.campaign.finding import Finding


def run_rows(dataset: Dataset) -> list[dict[str, Any]]:
    """Return a row per run: file, role, hash and counts."""
    return [
        {
            "file": entry.name,
            "role": entry.role,
            "conditions": dict(entry.conditions),
            "sha256": run.sha256,
            "samples": len(run),
            "stretches": len(run.segments),
            "counts": dict(run.counts),
            "ignored": list(run.unknown_columns),
            "notes": list(run.notes),
        }
        for entry, run in zip(dataset.campaign.runs, dataset.runs, strict=True)
    ]


def finding_row(finding: Finding) -> dict[str, Any]:
    """Return a finding of the data checks as a row of the key `gate`."""
    return {
        "check": finding.check,
        "file": finding.file,
        "channel": finding.channel,
        "value": finding.value,
        "unit": finding.unit,
        "text": finding.text,
        "serious": finding.serious,
        "from_s": finding.start,
        "to_s": finding.end,
    }
