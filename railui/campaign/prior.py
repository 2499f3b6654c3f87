"""Posterior of an earlier campaign as the prior of a new one: calibrated vehicle, estimates and noise."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.campaign.campaign import Campaign
from railui.io.atomic import sha256_file
from railui.io.problems import file_problem
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design
from railui.vehicle.model import Model

DESIGN_FILE: Final = "adjusted.yaml"
REPORT_FILE: Final = "loop.json"


@dataclass(frozen=True)
class Prior:
    """Estimates of an earlier campaign.

    Attributes
    ----------
    campaign
        Its name.
    verdict
        Of its loop.
    values, sd
        Estimates and standard deviations by path, effects included.
    file, sha256
        The calibrated design that they come from.
    """

    campaign: str
    verdict: str
    values: Mapping[str, float]
    sd: Mapping[str, float]
    file: Path = field(compare=False)
    sha256: str = ""


def with_prior(campaign: Campaign, directory: str | Path) -> Campaign:
    """Return a campaign whose nominal vehicle is that of an earlier loop, with its estimates as priors.

    Effects that the earlier loop added belong to the nominal vehicle, and their parameters are estimated again. Its
    noise counts as stated for the columns whose noise the campaign does not state.

    Raises
    ------
    FileProblems
        For a directory without a calibrated design, and for one of another vehicle.
    """
    file = Path(directory) / DESIGN_FILE
    if not file.is_file():
        raise file_problem(directory, f"has no {DESIGN_FILE}", "name the directory of a finished loop")
    design = _with_sensors_of(load_design(file), campaign.design)
    adjustment = design.adjustment
    if adjustment is None:
        raise file_problem(file, "has no `adjustment:`: no loop wrote it", "name the directory of a finished loop")
    other = [p for p in campaign.estimated_parameters if p not in design.values]
    if design.kind != campaign.design.kind or other:
        which = f" without {other[0]}" if other else ""
        raise file_problem(
            file, f"is a {design.kind}{which}, not the vehicle of {campaign.source}", "name its own loop"
        )
    model = Model(design)
    sd = np.sqrt(np.maximum(np.diag(np.array(adjustment.covariance, dtype=float)), 0.0))
    report = _report(Path(directory) / REPORT_FILE)
    prior = Prior(
        adjustment.campaign,
        str(report.get("verdict", "")),
        {name: model.value(name) for name in adjustment.names},
        dict(zip(adjustment.names, sd.tolist(), strict=True)),
        file,
        sha256_file(file),
    )
    of_effects = [name for name in adjustment.names if name.startswith("effects.")]
    noise = {name: row["used"] for name, row in report.get("floor", {}).get("noise", {}).items()}
    return replace(
        campaign,
        design=replace(design, adjustment=None),
        estimated_parameters=tuple(dict.fromkeys([*campaign.estimated_parameters, *of_effects])),
        noise={**noise, **campaign.noise},
        prior=prior,
    )


def _with_sensors_of(design: Design, declared: Design) -> Design:
    """Return the design with the sensors that a campaign declares."""
    if design.structure is None or declared.structure is None:
        return design
    return replace(design, structure=replace(design.structure, sensors=declared.structure.sensors))


def _report(path: Path) -> Mapping[str, Any]:
    try:
        report = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise file_problem(path, f"cannot be read: {error}", "name the directory of a finished loop") from None
    return report if isinstance(report, dict) else {}
