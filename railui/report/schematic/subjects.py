"""Schematics of a design, of a campaign and of a loop's result: their sensors and effects."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from typing import Any

from railui import core
from railui.campaign.campaign import Campaign
from railui.io.units import UnitError, quantity
from railui.report.figures.drawing import Picture
from railui.report.numbers import quantity_cells
from railui.report.schematic.highlights import Highlight
from railui.report.schematic.plan import draw_schematic
from railui.report.schematic.symbols import words
from railui.vehicle.design import Design


def schematic_of_design(design: Design) -> str:
    """Return the plan view of a design as SVG, with its effects."""
    return draw_schematic(design, (), _effects_of(design)).svg()


def schematic_of_campaign(campaign: Campaign, columns: Iterable[str]) -> str:
    """Return the plan view of a campaign's vehicle as SVG, with its effects and the sensors of these columns."""
    effects = _effects_of(campaign.design)
    return draw_schematic(campaign.design, tuple(columns), effects, lateral_positions(campaign)).svg()


def schematic_of_report(
    design: Design, campaign: Campaign, columns: Iterable[str], report: Mapping[str, Any]
) -> Picture:
    """Return the plan view of a loop: the sensors, and what was added to the nominal vehicle highlighted.

    Parameters
    ----------
    design : Design
        The nominal vehicle.
    campaign : Campaign
    columns : iterable of str
        Columns of its runs.
    report : mapping
        The loop report (loop.json).
    """
    found = [_reported(effect) for effect in report["effects"]]
    if outside := report["outside"]:
        places = [outside] if outside["at"] else outside.get("locations", ())
        found += [Highlight(place["at"], place["wheelset"], "discrepancy") for place in places]
    page = draw_schematic(design, tuple(columns), found, lateral_positions(campaign))
    text = "; ".join(dict.fromkeys(highlight.text for highlight in found))
    alt = f"Schematic of the vehicle from above with its sensors{f'; highlighted: {text}' if text else ''}"
    return Picture("schematic", alt, page.svg().encode("utf-8"), round(page.width))


def lateral_positions(campaign: Campaign) -> dict[str, float]:
    """Return the y [m] of the declared accelerometers that have one."""
    found = {}
    for name, entry in campaign.channels.items():
        with contextlib.suppress(UnitError, TypeError, ValueError):
            _, y, _ = (quantity(number, "m") for number in entry.get("at") or ())
            found[name] = y
    return found


def _effects_of(design: Design) -> list[Highlight]:
    found = []
    for i, effect in enumerate(design.effects):
        numbers = ((k, v, f"effects.{i}.{k}") for k, v in effect.parameters.items() if isinstance(v, float))
        cells = [f"{words(k)} {quantity_cells(v, None, design.unit(path))[0]}" for k, v, path in numbers]
        found.append(Highlight(effect.at, effect.wheelset, _text(effect.kind, cells)))
    return found


def _reported(effect: Mapping[str, Any]) -> Highlight:
    cells = [f"{words(k)} {quantity_cells(p['value'], p['sd'], p['unit'])[0]}" for k, p in effect["parameters"].items()]
    return Highlight(effect["at"], effect["wheelset"], _text(effect["kind"], cells))


def _text(kind: str, cells: list[str]) -> str:
    """Return the label of an effect: its name and its first parameter."""
    return ", ".join([str(core.effect_record(kind)["title"]), *cells[:1]])
