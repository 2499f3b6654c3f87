"""Measurement campaigns: nominal model, runs with their roles, sensor noise."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railui.campaign.corrections.correction import Corrections
from railui.campaign.corrections.reading import effects_of, read_corrections
from railui.campaign.directory import campaign_file
from railui.campaign.estimated import read_estimated
from railui.campaign.schema import ROLES, CampaignModel, MeasurementModel, read_conditions
from railui.campaign.sensors import read_sensors
from railui.campaign.settings.loop_settings import LoopSettings, SettingsConflict
from railui.campaign.stated_noise import read_stated_noise
from railui.io.atomic import sha256_file
from railui.io.problems import FileProblems, Findings, Problem, suggest_name
from railui.io.units import UnitError, quantity
from railui.io.yaml_file import load_fields
from railui.runs.columns import RIG_FORMS, Form
from railui.vehicle.design_reader import Design
from railui.vehicle.division import newly_divided
from railui.vehicle.effect_reader import read_effects
from railui.vehicle.effects import Catalogue, PlacedEffect, kernel_catalogue
from railui.vehicle.load_states import changed_paths
from railui.vehicle.reference import load_named_design, suggest_file

if TYPE_CHECKING:
    from railui.campaign.prior import Prior

DEFAULT_BAND = (0.3, 40.0)  # Hz
DEFAULT_CUT = 2.0  # s, left out at both ends of a segment
DEFAULT_RIG_CUT_SHARE = 0.02  # of a segment, left out at both of its ends on a rig


@dataclass(frozen=True)
class RunEntry:
    """A run of a campaign: its file, its role, its name as the campaign file writes it, its conditions by name.

    load: state of the design in which the vehicle runs; None: that of the design.
    """

    file: Path
    role: str
    name: str
    conditions: Mapping[str, str] = field(default_factory=dict)
    load: str | None = None


@dataclass(frozen=True)
class Campaign:
    """A measurement campaign in SI units, with its defaults filled in.

    Attributes
    ----------
    design
        The nominal vehicle, with a number for each joint or wheelset where the campaign frees it.
    noise
        Standard deviation per column.
    noise_band
        Shortest wavelength of the track noise [m].
    estimated_parameters
        Paths of the parameters to estimate.
    band
        Band [Hz] of the comparison; None if only the mean is removed (rig), or nothing (component on a bench).
    cut, cut_share
        Length [s] and share of a segment to leave out at both of its ends; the two add up.
    min_relative_gain
        Share by which an effect must lower the validation error.
    corrections
        Faults of the measured columns that the reader undoes.
    track
        Whether the track was measured "unloaded" or "loaded".
    channels
        Declared sensors of a vehicle of bodies, as the file has them.
    prior
        Estimates of an earlier campaign, from which the estimation starts.
    origin
        "measured" or "simulated" runs; None if the file does not state it.
    freed
        Paths of shared numbers that the campaign, not the design file, gives each joint or wheelset.
    """

    name: str
    directory: Path
    design: Design
    runs: tuple[RunEntry, ...]
    noise: Mapping[str, float]
    noise_band: float
    estimated_parameters: tuple[str, ...]
    band: tuple[float, float] | None
    cut: float
    cut_share: float
    min_relative_gain: float
    sensors: tuple[PlacedEffect, ...]
    track: str
    source: Path
    sha256: str
    warnings: tuple[Problem, ...] = field(default=(), compare=False)
    settings: LoopSettings = field(default_factory=LoopSettings)
    corrections: Corrections = field(default_factory=Corrections)
    channels: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    prior: Prior | None = None
    origin: str | None = None
    freed: tuple[str, ...] = ()

    @property
    def min_gain(self) -> float:
        """Share by which an effect must lower the squared validation error."""
        return 1.0 - (1.0 - self.min_relative_gain) ** 2

    def cut_length(self, duration: float) -> float:
        """Compute the length [s] to leave out at each end of a segment of a duration [s]."""
        return self.cut + self.cut_share * duration


def load_campaign(path: str | Path, catalogue: Catalogue | None = None) -> Campaign:
    """Read a campaign and the vehicle that it names.

    Parameters
    ----------
    path
        The campaign file or its directory.
    catalogue
        Records of the effects; by default those of the kernel.

    Raises
    ------
    FileProblems
        With every fault of both files.
    """
    source = campaign_file(path)
    data, model, findings = load_fields(source, "campaign", CampaignModel, "write `vehicle:` and `runs:`")
    design = with_declared_sensors(load_named_design(source, data, findings, catalogue), data.get("channels"), findings)
    kind: Form = design.run_form if design else "bogie"
    runs = _runs(source.parent, data.get("runs"), findings)
    noise = read_stated_noise(data.get("noise"), kind, [run.file for run in runs], findings)
    paths: tuple[str, ...] = ()
    freed: tuple[str, ...] = ()
    if design is not None:
        undivided = design
        design, paths = read_estimated(data.get("adjust"), data.get("free"), undivided, findings)
        freed = newly_divided(undivided, design)
        _check_loads(runs, design, paths, findings)
    sensors = _sensors(data.get("sensors"), findings, catalogue, kind)
    corrections = read_corrections(data.get("sensors"), kind, [run.name for run in runs], findings)
    check_band(data.get("band"), findings)
    check_settings(model, findings)
    if findings.errors() or design is None or model is None:
        raise FileProblems(findings.errors())
    return Campaign(
        name=model.name or source.resolve().parent.name,
        directory=source.parent,
        design=design,
        runs=runs,
        noise=noise,
        estimated_parameters=paths,
        sensors=sensors,
        source=source,
        sha256=sha256_file(source),
        warnings=(*findings.warnings(), *design.warnings),
        corrections=corrections,
        channels=data.get("channels") or {},
        origin=model.data,
        freed=freed,
        **comparison_options(model, is_rig=kind in RIG_FORMS),
    )


def comparison_options(model: MeasurementModel, *, is_rig: bool = False) -> dict[str, Any]:
    """Return band, cut, noise band and thresholds of a recorded or a planned campaign, with their defaults."""
    cut, cut_share = model.cut or ((0.0, DEFAULT_RIG_CUT_SHARE) if is_rig else (DEFAULT_CUT, 0.0))
    return {
        "noise_band": model.noise_band,
        "band": model.band or (None if is_rig else DEFAULT_BAND),
        "cut": cut,
        "cut_share": cut_share,
        "min_relative_gain": model.material,
        "track": model.track,
        "settings": _settings(model),
    }


def _settings(model: MeasurementModel) -> LoopSettings:
    return LoopSettings().with_values(model.model_dump()["settings"])


def with_declared_sensors(design: Design | None, raw: Any, findings: Findings) -> Design | None:
    """Return the design with the sensors that a campaign declares, which only a vehicle of bodies has."""
    if design is None or design.structure is None:
        if design is not None and raw:
            remedy = "leave the key out: its channels have names of their own"
            findings.add("channels", f"a {design.kind} takes no declared channels", remedy, key=True)
        return design
    return replace(design, structure=replace(design.structure, sensors=read_sensors(raw, design.structure, findings)))


def _runs(directory: Path, raw: Any, findings: Findings) -> tuple[RunEntry, ...]:
    runs: list[RunEntry] = []
    first_use: dict[Path, int] = {}
    for i, entry in enumerate(raw if isinstance(raw, list) else []):
        name = entry.get("file") if isinstance(entry, dict) else None
        if name is None or isinstance(name, list | dict | float):
            continue  # reported by CampaignModel
        name = str(name)
        path = directory / name
        if not path.is_file():
            findings.add(f"runs.{i}.file", f"no file {name!r}", suggest_file(path, directory))
        first = first_use.setdefault(path.resolve(), i)
        if first != i:
            findings.add(
                f"runs.{i}.file",
                f"{name} is already listed at runs.{first}",
                "list each run once: validation needs a run that was not used for estimation",
            )
        with contextlib.suppress(UnitError):  # reported by CampaignModel
            conditions = read_conditions(entry.get("conditions"))
            load = entry.get("load")
            runs.append(RunEntry(path, str(entry.get("role")), name, conditions, str(load) if load else None))
    _check_conditions(runs, findings)
    _check_roles([run.role for run in runs], findings)
    if isinstance(raw, list) and not raw:
        findings.add("runs", "is empty", "add {file: run_a.csv.gz, role: adjust} and one of role validate")
    return tuple(runs)


def _check_conditions(runs: Sequence[RunEntry], findings: Findings) -> None:
    """Report runs that lack a condition which others state."""
    names = list(dict.fromkeys(name for run in runs for name in run.conditions))
    for i, run in enumerate(runs):
        for name in names:
            if name not in run.conditions:
                remedy = "state it for every run, or for none"
                findings.add(f"runs.{i}", f"has no condition {name!r}, which other runs state", remedy)


def _check_loads(runs: Sequence[RunEntry], design: Design, estimated: Collection[str], findings: Findings) -> None:
    """Report load states that the design lacks, and estimated parameters that a load state changes."""
    loaded = {i: run.load for i, run in enumerate(runs) if run.load is not None}
    for i, state in loaded.items():
        if state not in design.load_states:
            known = suggest_name(state, design.load_states)
            remedy = known if design.load_states else "add a `load:` block to the design"
            findings.add(f"runs.{i}.load", f"no load state {state!r}", remedy)
    for path in sorted(changed_paths(design) & set(estimated)) if loaded else ():
        findings.add("adjust", f"{path} is estimated and changes with the load", "leave it out of `adjust:`")


def _check_roles(roles: Sequence[str], findings: Findings) -> None:
    """Report a role that no run has; an unknown role is reported by CampaignModel."""
    if not roles or not all(role in ROLES for role in roles):
        return
    for role, use in (("adjust", "estimate the parameters from"), ("validate", "validate the model on")):
        if role not in roles:
            findings.add("runs", f"no run has the role {role}: there is nothing to {use}", f"give one the role {role}")


def check_band(raw: Any, findings: Findings) -> None:
    """Report a band whose ends are in the wrong order."""
    try:
        low, high = (quantity(end, "Hz") for end in raw)
    except (UnitError, TypeError, ValueError):
        return  # reported by CampaignModel
    if low >= high:
        findings.add(
            "band", f"its lower limit {low:g} Hz is not below its upper limit {high:g} Hz", "give [lowest, highest]"
        )


def check_settings(model: MeasurementModel | None, findings: Findings) -> None:
    """Report settings that do not go together; None: a file whose fields are reported already."""
    try:
        if model is not None:
            _settings(model)
    except SettingsConflict as error:
        findings.add(f"settings.{error.name}", error.message, error.remedy)


def _sensors(raw: Any, findings: Findings, catalogue: Catalogue | None, kind: Form) -> tuple[PlacedEffect, ...]:
    effects, path = effects_of(raw)
    if not effects:
        return ()
    known = kernel_catalogue() if catalogue is None else catalogue
    form = "rig" if kind in RIG_FORMS else str(kind)
    return read_effects(effects, findings, path, known, {}, form=form, sensors=True)


__all__ = [
    "Campaign",
    "RunEntry",
    "check_band",
    "check_settings",
    "comparison_options",
    "load_campaign",
    "with_declared_sensors",
]
