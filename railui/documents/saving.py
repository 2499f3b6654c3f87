"""Writing designs and campaigns as new files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from railui.campaign.campaign import Campaign
from railui.io.atomic import relative_path, write_text
from railui.io.schema_line import schema_name
from railui.io.yaml_scalars import flow, number_text, scalar_text
from railui.vehicle.design import Design
from railui.vehicle.effects import PlacedEffect
from railui.vehicle.parameters import FORMS, PARAMETERS, nested


def design_text(design: Design, directory: str | Path | None = None) -> str:
    """A design as a complete file: every number in SI with all its digits, symbols and units in comments.

    Profiles are named as from `directory`, by their whole paths where none is given.
    """
    lines = [f"schema: {schema_name('design')}", f"name: {scalar_text(design.name)}"]
    tree = nested(_vehicle(design) | dict(design.settings))
    for top in ("vehicle", "contact", "riding"):
        if top in tree:
            lines.append(f"{top}:")
            lines += [f"  {key}: {flow(value)}{_remark(f'{top}.{key}', value)}" for key, value in tree[top].items()]
        if top == "contact" and design.profiles is not None:
            home = None if directory is None else Path(directory)
            lines.append(f"  profiles: {flow(design.profiles.entry(home, [e.kind for e in design.effects]))}")
    lines += _loads(design)
    lines += _entries("effects", design.effects)
    if design.adjustment is not None:
        a = design.adjustment
        lines += [
            "adjustment:",
            f"  campaign: {scalar_text(a.campaign)}",
            f"  sha256: {scalar_text(a.sha256)}",
            f"  names: {flow(list(a.names))}",
            "  covariance:",
        ]
        lines += [f"    - {flow(list(row))}" for row in a.covariance]
    return "\n".join(lines) + "\n"


def _vehicle(design: Design) -> dict[str, Any]:
    """The words and numbers of the vehicle by path, as they are without a state of loading."""
    numbers: dict[str, Any]
    if design.structure is None:
        numbers = {p.path: design.values[p.path] for p in FORMS[design.kind]}
    else:
        words = design.structure.words().items()
        named = {f"vehicle.{g}.{n}.{k}": w for g, parts in words for n, own in parts.items() for k, w in own.items()}
        numbers = named | dict(design.values)
    return numbers | _unloaded(design)


def _unloaded(design: Design) -> dict[str, float]:
    if design.load_state is None:
        return {}
    return {path: design.declared[path] for changes in design.loads.values() for path in changes}


def _loads(design: Design) -> list[str]:
    """The states of loading; the one that the design is in has its numbers as they are now."""
    if not design.loads:
        return []
    lines = ["load:"] if design.load_state is None else ["load:", f"  state: {design.load_state}"]
    for name, changes in design.loads.items():
        now = design.values if name == design.load_state else changes
        lines.append(f"  {name}: {flow({path: now[path] for path in changes})}")
    return lines


def save_design(design: Design, path: str | Path) -> Path:
    """Writes a design as a complete new file, whole or not at all. Returns the path."""
    return write_text(path, design_text(design, Path(path).parent))


def campaign_text(campaign: Campaign, directory: str | Path, vehicle: str | Path | None = None) -> str:
    """A campaign as a file to stand in `directory`; `vehicle` (a path) takes the declared one's place."""
    declared = vehicle if vehicle is not None else campaign.design.source
    lines = [f"schema: {schema_name('campaign')}", f"name: {scalar_text(campaign.name)}"]
    if declared is not None:
        lines.append(f"vehicle: {scalar_text(relative_path(declared, directory))}")
    lines.append("runs:")
    lines += [f"  - {flow({'file': relative_path(run.file, directory), 'role': run.role})}" for run in campaign.runs]
    lines += [f"noise: {flow(dict(campaign.noise))}", f"noise_band: {number_text(campaign.noise_band)}"]
    lines += [f"adjust: {flow(list(campaign.adjust))}"]
    if campaign.band is not None:
        lines.append(f"band: {flow(list(campaign.band))}")
    cut = f"{number_text(100 * campaign.cut_share)} %" if campaign.cut_share else campaign.cut
    lines += [f"cut: {flow(cut)}", f"material: {number_text(campaign.material)}"]
    lines += _entries("sensors", campaign.sensors)
    return "\n".join([*lines, f"track: {campaign.track}"]) + "\n"


def save_campaign(campaign: Campaign, path: str | Path, vehicle: str | Path | None = None) -> Path:
    """Writes a campaign as a complete new file; paths in it are relative to where it stands."""
    return write_text(path, campaign_text(campaign, Path(path).parent, vehicle))


def _entries(key: str, effects: Iterable[PlacedEffect]) -> list[str]:
    entries = [f"  - {flow(effect.entry())}" for effect in effects]
    return [f"{key}:", *entries] if entries else []


def _remark(path: str, value: Any) -> str:
    names = [path] if not isinstance(value, Mapping) else [f"{path}.{key}" for key in value]
    told = [PARAMETERS[name] for name in names if name in PARAMETERS]
    return "  # " + ", ".join(f"{p.symbol} [{p.unit}]" for p in told) if told else ""
