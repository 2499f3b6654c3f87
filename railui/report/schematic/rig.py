"""Schematic of a rig: one mass on a spring and a damper, or a component whose motion is prescribed."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from railui.report.schematic.highlights import Highlight
from railui.report.schematic.labels import BOLD, text_width
from railui.report.schematic.page import Page
from railui.report.schematic.symbols import DASHPOT, LINE_SPRING, SENSOR_MARKS, symbol_at, titled_group
from railui.vehicle.design import Design

WALL, MASS, MASS_WIDTH, PLATE_WIDTH = 40.0, 270.0, 84.0, 12.0  # px along the drawing
FIRST, STEP = 34.0, 44.0  # px, of the rows of spring, damper and effects
INPUTS = {
    "force": "force",
    "base_displacement": "displacement of the base",
    "base_acceleration": "acceleration of the base",
    "motion": "prescribed motion",
}
QUANTITIES = {"z": "displacement", "vz": "rate", "az": "acceleration", "F": "angle", "u": "angle"}


def draw_rig(design: Design, channels: Sequence[str], highlights: Sequence[Highlight]) -> Page:
    """Return a rig: spring, damper and effects between base and mass, its input and sensors."""
    at_rig, others = [h for h in highlights if h.at == "rig"], [h for h in highlights if h.at != "rig"]
    names = ["stiffness", "damping"]
    rows = [("element", name, symbol) for name, symbol in zip(names, (LINE_SPRING, DASHPOT), strict=True)]
    drawing = "".join(_row(style, name, symbol, i) for i, (style, name, symbol) in enumerate(rows))
    drawing += "".join(_effect_row(highlight, len(rows) + i) for i, highlight in enumerate(at_rig))
    high = STEP * (len(rows) + len(at_rig)) + 14.0
    drawing = _base(high) + _mass(design, high) + drawing
    drawing += _sensors(channels, highlights, MASS + _width(design) + 20.0)
    kind = INPUTS[design.rig_input]
    words = f"One degree of freedom z, input: {kind}; elements: {', '.join(names)}"
    words += "".join(f"; highlighted: {h.text}" for h in highlights) + "."
    aside = max((text_width(h.text) * BOLD for h in others), default=0.0)
    widest = max((text_width(h.text) * BOLD for h in at_rig), default=0.0)
    width = max(460.0, MASS + MASS_WIDTH + 60.0 + aside, WALL + 20.0 + widest)
    caption = f'<text class="body" x="10" y="{high + 60:.1f}">input: {kind}; z to the right</text>'
    content = f'<g transform="translate(0 34)">{drawing}</g>{caption}'
    return Page(design.name, "", words, content, width, high + 74)


def _row(style: str, name: str, symbol: str, i: int) -> str:
    """Return a spring or a damper between base and mass, with its name."""
    y, middle = FIRST + STEP * i, (WALL + MASS) / 2
    rods = f'<path d="M{WALL:.1f} {y:.1f} H{middle - 19:.1f} M{middle + 19:.1f} {y:.1f} H{MASS:.1f}"/>'
    text = f'<text class="name" x="{middle:.1f}" y="{y - 12:.1f}" text-anchor="middle">{name}</text>'
    return titled_group(style, name, name, rods + symbol_at(symbol, middle, y)) + text


def _effect_row(highlight: Highlight, i: int) -> str:
    """Return an effect as a box between base and mass."""
    y = FIRST + STEP * i
    rods = f'<path d="M{WALL:.1f} {y:.1f} H{MASS:.1f}"/>'
    box = f'<rect x="{(WALL + MASS) / 2 - 24:.1f}" y="{y - 9:.1f}" width="48" height="18" rx="9"/>'
    halo = titled_group("halo", "rig", highlight.text, box)
    text = f'<text class="effect" x="{WALL + 6:.1f}" y="{y - 13:.1f}">{escape(highlight.text)}</text>'
    return f'<g class="leader effect">{rods}</g>{halo}{text}'


def _base(high: float) -> str:
    hatch = "".join(f"M{WALL:.1f} {y:.1f} l-10 10 " for y in range(0, int(high), 12))
    line = f'<path class="thick" d="M{WALL:.1f} 0 V{high:.1f}"/><path d="{hatch}"/>'
    return f'<g class="element"><title>base</title>{line}</g>'


def _width(design: Design) -> float:
    return MASS_WIDTH if "vehicle.rig.mass" in design.values else PLATE_WIDTH


def _mass(design: Design, high: float) -> str:
    """Return the mass, or the plate that moves a component."""
    width = _width(design)
    text = "mass" if width > PLATE_WIDTH else ""
    rect = f'<rect class="frame" x="{MASS:.1f}" y="0" width="{width:.1f}" height="{high:.1f}" rx="4"/>'
    label = f'<text class="body" x="{MASS + width / 2:.1f}" y="{high / 2:.1f}" text-anchor="middle">{text}</text>'
    return rect + label


def _sensors(channels: Sequence[str], highlights: Sequence[Highlight], x: float) -> str:
    """Return the measured channels as markers at the right of the mass, with what is highlighted of them."""
    svg, y = "", FIRST
    for name in (c for c in dict.fromkeys(channels) if c in QUANTITIES):
        svg += titled_group("sensor", name, name, symbol_at(SENSOR_MARKS[QUANTITIES[name]], x, y))
        svg += f'<text class="sensor" x="{x + 11:.1f}" y="{y + 4:.1f}">{name}</text>'
        for highlight in (h for h in highlights if h.at == name):
            box = f'<rect x="{x - 9:.1f}" y="{y - 9:.1f}" width="18" height="18" rx="6"/>'
            svg += titled_group("halo", name, highlight.text, box)
            svg += f'<text class="effect" x="{x + 30:.1f}" y="{y + 4:.1f}">{escape(highlight.text)}</text>'
        y += 22.0
    return svg
