"""Writing designs and campaigns as new files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from railui.campaign.campaign import Campaign
from railui.io.atomic import relative_path, write_text
from railui.io.schema_line import schema_name
from railui.io.yaml_writer import YamlWriter, number_text
from railui.vehicle.contact_profiles import ContactProfiles
from railui.vehicle.design import Adjustment, Design
from railui.vehicle.division import joined_lists
from railui.vehicle.parameters import FORMS, PARAMETERS, nest


def design_text(design: Design, directory: str | Path | None = None) -> str:
    """Return a design as a complete YAML file.

    Every number is in SI with all its digits; comments give symbols and units. The adjustment names the parameters that
    still have their estimates.

    Parameters
    ----------
    design : Design
    directory : path, optional
        Directory of the file, to which the paths of wheel and rail profiles are relative. Absolute paths by default.
    """
    writer = YamlWriter()
    writer.entry("schema", schema_name("design"))
    writer.entry("name", design.name)
    _write_groups(writer, design, None if directory is None else Path(directory))
    _write_load_states(writer, design)
    if design.effects:
        writer.items("effects", [effect.entry() for effect in design.effects])
    if (adjustment := design.present_adjustment) is not None:
        _write_adjustment(writer, adjustment)
    return writer.text()


def _write_groups(writer: YamlWriter, design: Design, directory: Path | None) -> None:
    groups = nest(_vehicle_values(design) | dict(design.settings))
    for group in ("vehicle", "contact", "riding"):
        profiles = design.profiles if group == "contact" else None
        if group in groups:
            with writer.block(group):
                for key, value in groups[group].items():
                    writer.entry(key, value, comment=_symbols_and_units(f"{group}.{key}", value))
                if profiles is not None:
                    writer.entry("profiles", _profiles_entry(design, profiles, directory))


def _profiles_entry(design: Design, profiles: ContactProfiles, directory: Path | None) -> dict[str, Any]:
    return profiles.entry(directory, [effect.kind for effect in design.effects], design.values)


def _vehicle_values(design: Design) -> dict[str, Any]:
    """Return the words and numbers of the vehicle by path, without the changes of its load state."""
    if design.structure is None:
        values: dict[str, Any] = {p.path: design.values[p.path] for p in FORMS[design.form]}
        return values | _numbers_without_load_state(design)
    numbers = {path: design.values[path] for path in design.parameters} | _numbers_without_load_state(design)
    return _structure_words(design) | joined_lists(numbers, design.structure)


def _structure_words(design: Design) -> dict[str, Any]:
    assert design.structure is not None
    return {
        f"vehicle.{group}.{name}.{key}": word
        for group, parts in design.structure.words().items()
        for name, words in parts.items()
        for key, word in words.items()
    }


def _numbers_without_load_state(design: Design) -> dict[str, float]:
    if design.load_state is None:
        return {}
    return {path: design.unloaded_values[path] for changes in design.load_states.values() for path in changes}


def _write_load_states(writer: YamlWriter, design: Design) -> None:
    """Write the load states; the active one with the design's present numbers."""
    if not design.load_states:
        return
    with writer.block("load"):
        if design.load_state is not None:
            writer.entry("state", design.load_state)
        for name, changes in design.load_states.items():
            values = design.values if name == design.load_state else changes
            writer.entry(name, {path: values[path] for path in changes})


def _write_adjustment(writer: YamlWriter, adjustment: Adjustment) -> None:
    with writer.block("adjustment"):
        writer.entry("campaign", adjustment.campaign)
        writer.entry("sha256", adjustment.sha256)
        writer.entry("names", adjustment.names)
        writer.items("covariance", adjustment.covariance)
        if adjustment.samples:
            writer.items("samples", adjustment.samples)


def _symbols_and_units(path: str, value: Any) -> str:
    paths = [f"{path}.{key}" for key in value] if isinstance(value, Mapping) else [path]
    parameters = [PARAMETERS[path] for path in paths if path in PARAMETERS]
    return ", ".join(f"{p.symbol} [{p.unit}]" for p in parameters)


def save_design(design: Design, path: str | Path) -> Path:
    """Write a design as a complete new file, atomically; return the path."""
    return write_text(path, design_text(design, Path(path).parent))


def campaign_text(campaign: Campaign, directory: str | Path, vehicle: str | Path | None = None) -> str:
    """Return a campaign as a complete YAML file.

    Parameters
    ----------
    campaign : Campaign
    directory : path
        Directory of the file, to which the paths in it are relative.
    vehicle : path, optional
        Design file to name in place of the nominal model's; its numbers are divided as those of the campaign's design.
    """
    writer = YamlWriter()
    writer.entry("schema", schema_name("campaign"))
    writer.entry("name", campaign.name)
    if campaign.origin is not None:
        writer.entry("data", campaign.origin)
    design_file = vehicle if vehicle is not None else campaign.design.source
    if design_file is not None:
        writer.entry("vehicle", relative_path(design_file, directory))
    runs: list[dict[str, Any]] = []
    for run in campaign.runs:
        conditions = {"conditions": dict(run.conditions)} if run.conditions else {}
        load = {"load": run.load} if run.load else {}
        runs.append({"file": relative_path(run.file, directory), "role": run.role, **conditions, **load})
    writer.items("runs", runs)
    if campaign.channels:
        with writer.block("channels"):
            for name, entry in campaign.channels.items():
                writer.entry(name, entry)
    writer.entry("noise", campaign.noise)
    writer.entry("noise_band", campaign.noise_band)
    if vehicle is None and campaign.freed:
        writer.entry("adjust", _undivided_paths(campaign))
        writer.entry("free", campaign.freed)
    else:
        writer.entry("adjust", campaign.estimated_parameters)
    if campaign.band is not None:
        writer.entry("band", campaign.band)
    cut = f"{number_text(100 * campaign.cut_share)} %" if campaign.cut_share else campaign.cut
    writer.entry("cut", cut)
    writer.entry("material", campaign.min_relative_gain)
    _write_sensors(writer, campaign)
    writer.entry("track", campaign.track)
    if changed := campaign.settings.changed():
        writer.entry("settings", changed)
    return writer.text()


def _undivided_paths(campaign: Campaign) -> tuple[str, ...]:
    """Return the paths to estimate as those of the design file, whose numbers the campaign frees."""
    assert campaign.design.structure is not None  # else nothing is freed
    shared = {member: path for path in campaign.freed for member in campaign.design.structure.paths_of(path)}
    return tuple(dict.fromkeys(shared.get(path, path) for path in campaign.estimated_parameters))


def _write_sensors(writer: YamlWriter, campaign: Campaign) -> None:
    """Write the corrections of the columns, and the effects of the sensors."""
    effects = [sensor.entry() for sensor in campaign.sensors]
    if not campaign.corrections:
        if effects:
            writer.items("sensors", effects)
        return
    with writer.block("sensors"):
        for channel, entry in campaign.corrections.entry().items():
            writer.entry(channel, entry)
        if effects:
            writer.items("effects", effects)


def save_campaign(campaign: Campaign, path: str | Path, vehicle: str | Path | None = None) -> Path:
    """Write a campaign as a complete new file, atomically; paths in it are relative to its directory."""
    return write_text(path, campaign_text(campaign, Path(path).parent, vehicle))
