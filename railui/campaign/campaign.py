"""A measured campaign: the declared vehicle, its runs and their roles, the noise of the sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from railui.campaign.directory import campaign_file
from railui.campaign.schema import ROLES, CampaignModel
from railui.campaign.settings.loop_settings import LoopSettings
from railui.io.atomic import sha256_file
from railui.io.fields import check_group
from railui.io.problems import FileProblems, Findings, Problem, nearest
from railui.io.schema_line import check_schema
from railui.io.table import read_header
from railui.io.units import UnitError, convert, quantity, split
from railui.io.yaml_document import load
from railui.runs.columns import columns_of
from railui.runs.units import RATES, rate_factor
from railui.vehicle.design_reader import Design
from railui.vehicle.effect_reader import read_effects
from railui.vehicle.effect_records import Catalogue, kernel_catalogue
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameters import DEFAULT_ADJUST
from railui.vehicle.reference import neighbour, vehicle_of

BAND = (0.3, 40.0)  # Hz
CUT, CUT_RIG = 2.0, 0.02  # s; share of the run
FREE = ("vehicle.rig.mass", "vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.gain")


@dataclass(frozen=True)
class RunEntry:
    """A run of a campaign: where it lies, its role, its name as the campaign writes it."""

    file: Path
    role: str
    name: str


@dataclass(frozen=True)
class Campaign:
    """A campaign with its defaults filled in: SI, `adjust` and `noise` by paths and columns.

    `band` [Hz] is None where only the mean is removed (rig); of each stretch `cut` [s] plus `cut_share`
    of its length is left out at both ends.
    """

    name: str
    directory: Path
    design: Design
    runs: tuple[RunEntry, ...]
    noise: Mapping[str, float]
    noise_band: float
    adjust: tuple[str, ...]
    band: tuple[float, float] | None
    cut: float
    cut_share: float
    material: float
    sensors: tuple[PlacedEffect, ...]
    track: str
    source: Path
    sha256: str
    warnings: tuple[Problem, ...] = field(default=(), compare=False)
    settings: LoopSettings = field(default_factory=LoopSettings)

    def cut_of(self, duration: float) -> float:
        """Seconds to leave out at each end of a stretch of so many seconds."""
        return self.cut + self.cut_share * duration


def load_campaign(path: str | Path, catalogue: Catalogue | None = None) -> Campaign:
    """Reads a campaign (its directory or file) and the vehicle it names; FileProblems with every fault."""
    source = campaign_file(path)
    document = load(source)
    findings = document.findings()
    data = document.value if isinstance(document.value, dict) else {}
    if not data:
        findings.add("", "is no campaign", "write `vehicle:` and `runs:`")
        findings.stop()
    check_schema(data, "campaign", findings)
    model = check_group(CampaignModel, data, findings)
    design = _estimable(vehicle_of(source, data, findings, catalogue), findings)
    form = design.kind if design else "bogie"
    runs = _runs(source.parent, data.get("runs"), findings)
    noise = _noise(data.get("noise"), form, runs, findings)
    adjust = _adjust(data.get("adjust"), design, findings)
    sensors = _sensors(data.get("sensors"), findings, catalogue, form)
    _band_rises(data.get("band"), findings)
    if findings.errors() or design is None or model is None:
        raise FileProblems(findings.errors())
    cut = model.cut or ((0.0, CUT_RIG) if form == "rig" else (CUT, 0.0))
    return Campaign(
        name=model.name or source.resolve().parent.name,
        directory=source.parent,
        design=design,
        runs=runs,
        noise=noise,
        noise_band=model.noise_band,
        adjust=adjust,
        band=model.band or (None if form == "rig" else BAND),
        cut=cut[0],
        cut_share=cut[1],
        material=model.material,
        sensors=sensors,
        track=model.track,
        source=source,
        sha256=sha256_file(source),
        warnings=(*findings.warnings(), *design.warnings),
        settings=LoopSettings().with_values(model.model_dump()["settings"]),
    )


def _estimable(design: Design | None, findings: Findings) -> Design | None:
    """The design of a campaign, None where no parameter of its kind of vehicle can be estimated."""
    if design is None or design.kind in DEFAULT_ADJUST:
        return design
    findings.add(
        "vehicle",
        "describes a vehicle of bodies, and a campaign can estimate the parameters of a bogie or a rig only",
        "name a design with the groups frame, wheelset, primary, secondary and geometry, or with rig",
    )
    return None


def _runs(home: Path, raw: Any, findings: Findings) -> tuple[RunEntry, ...]:
    runs: list[RunEntry] = []
    seen: dict[Path, int] = {}
    for i, entry in enumerate(raw if isinstance(raw, list) else []):
        name = entry.get("file") if isinstance(entry, dict) else None
        if name is None or isinstance(name, list | dict | float):
            continue  # told by the model
        name = str(name)
        path = home / name
        if not path.is_file():
            findings.add(f"runs.{i}.file", f"no file {name!r}", neighbour(path, home))
        first = seen.setdefault(path.resolve(), i)
        if first != i:
            findings.add(
                f"runs.{i}.file",
                f"{name} stands at runs.{first} already",
                "a run that adjusts must not judge: give another one",
            )
        runs.append(RunEntry(path, str(entry.get("role")), name))
    roles = [run.role for run in runs]
    if runs and all(role in ROLES for role in roles):
        for role, what in (("adjust", "adjust the model on"), ("validate", "judge it on")):
            if role not in roles:
                findings.add(
                    "runs",
                    f"no run has the role {role}: there is nothing to {what}",
                    f"give one the role {role}",
                )
    elif isinstance(raw, list) and not raw:
        findings.add("runs", "is empty", "add {file: run_a.csv.gz, role: adjust} and one of role validate")
    return tuple(runs)


def _noise(raw: Any, form: str, runs: tuple[RunEntry, ...], findings: Findings) -> dict[str, float]:
    noise: dict[str, float] = {}
    columns = columns_of(form)
    for name, value in (raw if isinstance(raw, dict) else {}).items():
        path = f"noise.{name}"
        known = [n for n, c in columns.items() if c.part != "clock"]
        if name in columns and name not in known:
            findings.add(path, f"{name} has no noise here: it is the clock of the run", "leave it out", key=True)
        elif name not in columns:
            findings.add(path, "unknown column", nearest(name, known), key=True)
        else:
            try:
                noise[name] = _deviation(value, name, form, runs)
            except UnitError as error:
                findings.add(path, error.message, error.remedy)
    return noise


def _deviation(value: Any, name: str, form: str, runs: tuple[RunEntry, ...]) -> float:
    number = _of_rig(value, name, runs) if form == "rig" else quantity(value, columns_of(form)[name].unit)
    if number < 0:
        raise UnitError(f"{value!r} is no standard deviation", "give 0 or more")
    return number


def _of_rig(value: Any, name: str, runs: tuple[RunEntry, ...]) -> float:
    """A deviation in the units in which the columns of a rig's run are read."""
    labels: Mapping[str, str | None] = {}
    for run in runs[:1]:
        try:
            header = read_header(run.file)
            labels = dict(zip(header.names, header.units, strict=True))
        except FileProblems:
            break  # the run tells its own problems
    label = labels.get(name) or ""
    number, unit = split(value) if isinstance(value, str) else (quantity(value, "1"), "")
    if unit and label and unit != label:
        number = convert(number, unit, label)
    return number * rate_factor(labels.get("z") or "", label, RATES[name]) if name in RATES else number


def _band_rises(raw: Any, findings: Findings) -> None:
    try:
        low, high = (quantity(end, "Hz") for end in raw)
    except (UnitError, TypeError, ValueError):
        return  # told by the model
    if low >= high:
        findings.add("band", f"begins at {low:g} Hz and ends at {high:g} Hz", "give [lowest, highest]")


def _adjust(given: Any, design: Design | None, findings: Findings) -> tuple[str, ...]:
    if design is None:
        return ()
    found: list[str] = []
    for i, name in enumerate(given if isinstance(given, list) else DEFAULT_ADJUST[design.kind]):
        try:
            found += [path for path in design.expand(str(name)) if path not in found]
        except FileProblems as error:
            findings.add(f"adjust.{i}", f"no such parameter {name!r}", error.problems[0].remedy)
    if given == []:
        findings.add("adjust", "is empty", "name a path, or leave the key out for the default list")
    if set(FREE) <= set(found):
        findings.add(
            "adjust",
            "mass, stiffness, damping and gain share one free factor",
            "leave vehicle.rig.mass or vehicle.rig.gain out",
        )
    return tuple(found)


def _sensors(raw: Any, findings: Findings, catalogue: Catalogue | None, form: str) -> tuple[PlacedEffect, ...]:
    if not isinstance(raw, list) or not raw:
        return ()
    known = kernel_catalogue() if catalogue is None else catalogue
    return read_effects(raw, findings, "sensors", known, {}, form=form, sensors=True)


__all__ = ["Campaign", "RunEntry", "load_campaign"]
