"""File of a plan: the sensors that may be mounted with their noise, the parameters to determine, costs and budget.

It has the keys of a campaign file, without a vehicle and runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field

from railui.campaign.campaign import Campaign, check_band, check_settings, comparison_options, with_declared_sensors
from railui.campaign.estimated import read_estimated
from railui.campaign.schema import MeasurementModel
from railui.campaign.stated_noise import read_stated_noise
from railui.io.atomic import sha256_file
from railui.io.fields import Text, ValueReader, quantity_reader
from railui.io.problems import FileProblems, Findings, suggest_name
from railui.io.units import UnitError, quantity
from railui.io.yaml_file import load_fields
from railui.runs.columns import column_names, is_compared
from railui.vehicle.design import Design

RUN: Final = "run"  # key of the cost of a run among those of the sensors
DEFAULT_COST: Final = 1.0
REMEDY: Final = "write `noise:` with the sensors that may be mounted"


def read_costs(value: Any) -> dict[str, float]:
    """Read the costs by the name of a sensor, or `run`.

    >>> read_costs({"run": 5, "ayf": 1.5})
    {'run': 5.0, 'ayf': 1.5}
    """
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise UnitError("is not a group of costs", "write {run: 5, ayf: 1}")
    costs = {str(name): quantity(cost, "1") for name, cost in value.items()}
    if negative := [name for name, cost in costs.items() if cost < 0]:
        raise UnitError(f"the cost of {negative[0]} is negative", "give 0 or more")
    return costs


COSTS = ValueReader(
    read_costs, {"type": "object", "additionalProperties": {"type": "number", "minimum": 0}, "title": "cost of each"}
)


class PlanModel(MeasurementModel):
    """Schema of a plan file."""

    schema_: Text = Field(default="railui.plan/1", alias="schema")
    costs: Annotated[dict[str, float], COSTS] = Field(
        default_factory=dict, title="cost of each sensor, and of a run as `run`; 1 where it is left out"
    )
    budget: Annotated[float, quantity_reader("1", 0.0, above=True)] | None = Field(
        default=None, title="largest sum of the costs; all sensors and runs by default"
    )


@dataclass(frozen=True)
class PlanFile:
    """Sensors that may be mounted, costs, and the campaign without its runs.

    Attributes
    ----------
    sensors
        Names of the channels, those with a stated noise.
    costs
        Cost of each sensor, and of a run as "run".
    budget
        Largest sum; None: unlimited.
    """

    campaign: Campaign
    sensors: tuple[str, ...]
    costs: Mapping[str, float]
    budget: float | None

    @property
    def noise_levels(self) -> dict[str, float]:
        """Standard deviation [SI] of the noise of each sensor."""
        return {c: self.campaign.noise[c] for c in self.sensors}

    def cost(self, name: str) -> float:
        """Cost of a sensor, or of a run as "run"."""
        return self.costs.get(name, DEFAULT_COST)


def read_plan_fields(path: str | Path) -> PlanModel:
    """Read the fields of a plan file without a vehicle; FileProblems with every fault that shows without one."""
    data, model, findings = load_fields(path, "plan", PlanModel, REMEDY)
    check_band(data.get("band"), findings)
    check_settings(model, findings)
    if findings.errors() or model is None:
        raise FileProblems(findings.errors())
    return model


def load_plan(path: str | Path, design: Design, noise: Mapping[str, Any] | None = None) -> PlanFile:
    """Read a plan file for a design.

    Parameters
    ----------
    noise
        Standard deviations that replace or join those of the file.

    Raises
    ------
    FileProblems
        With every fault of the file.
    """
    source = Path(path)
    data, model, findings = load_fields(source, "plan", PlanModel, REMEDY)
    checked = with_declared_sensors(design, data.get("channels"), findings)
    assert checked is not None
    kind = checked.run_form
    stated = {**(data.get("noise") or {}), **(noise or {})}
    levels = read_stated_noise(stated, kind, [], findings)
    sensors = tuple(c for c in column_names(kind, "response") if c in levels and is_compared(c))
    checked, paths = read_estimated(data.get("adjust"), data.get("free"), checked, findings)
    check_band(data.get("band"), findings)
    check_settings(model, findings)
    _check_sensors(checked, sensors, levels, data.get("costs"), findings)
    if findings.errors() or model is None:
        raise FileProblems(findings.errors())
    campaign = Campaign(
        name=model.name or f"plan for {checked.name}",
        directory=source.parent,
        design=checked,
        runs=(),
        noise=levels,
        estimated_parameters=paths,
        sensors=(),
        source=source,
        sha256=sha256_file(source),
        warnings=tuple(findings.warnings()),
        channels=data.get("channels") or {},
        **comparison_options(model),
    )
    return PlanFile(campaign, sensors, model.costs, model.budget)


def _check_sensors(
    design: Design, sensors: tuple[str, ...], noise: Mapping[str, float], costs: Any, findings: Findings
) -> None:
    """Report a vehicle without a track, a plan without sensors, sensors without noise and costs of other names."""
    if not design.is_on_track:
        findings.add("", f"{design.name} is a {design.kind}, which no track excites", "plan for a vehicle on a track")
        return
    if not sensors:
        known = ", ".join(column_names(design.run_form, "response"))
        findings.add("noise", "names no sensor", f"state the standard deviation of each that may be mounted: {known}")
    for name in sensors:
        if noise[name] == 0.0:
            findings.add(f"noise.{name}", "a sensor without noise would detect everything", "state its noise")
    for name in costs if isinstance(costs, dict) else ():
        if name != RUN and name not in sensors:
            remedy = suggest_name(str(name), [RUN, *sensors])
            findings.add(f"costs.{name}", "is no sensor with a stated noise", remedy, key=True)
