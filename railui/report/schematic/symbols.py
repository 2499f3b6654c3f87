"""Symbols of a plan view as SVG: springs, dampers, stops, links, anti-roll bars and sensors."""

from __future__ import annotations

from html import escape
from math import atan2, cos, hypot, sin
from typing import Final

EYE: Final = 4.0  # px, radius of the eyes of a rod
# drawn along the vehicle about the origin [px]; turned by a quarter for elements across it
LINE_SPRING: Final = '<path d="M-19 0 h3 l2 -7 l4 14 l4 -14 l4 14 l4 -14 l4 14 l4 -14 l2 7 h7"/>'
DASHPOT: Final = '<path d="M9 -7 H-8 V7 H9 M-19 0 H-8 M2 -5 V5 M2 0 H19"/>'
DAMPER_ON_MOUNTING: Final = (
    '<path d="M-2 -7 H-17 V7 H-2 M-26 0 H-17 M-8 -5 V5 M-8 0 H6 l2 -5 l4 10 l4 -10 l4 10 l2 -5 h4"/>'
)
STOP: Final = '<path class="thick" d="M-13 -8 V8 M13 -8 V8"/><path d="M-6 0 H6 M-6 -5 V5 M6 -5 V5"/>'
# seen from above or about an axis, the same in every direction
COIL: Final = '<circle r="13"/><circle r="8.5"/><circle class="ink" r="2"/>'
VERTICAL_DASHPOT: Final = '<circle r="8"/><path d="M-5 0 H5 M0 -5 V5"/>'
TORSION_SPRING: Final = '<path d="M0 0 a3 3 0 0 1 6 0 a6 6 0 0 1 -12 0 a9 9 0 0 1 18 0 a12 12 0 0 1 -12 12"/>'
TORSION_DAMPER: Final = '<path d="M-12 0 a12 12 0 1 1 12 12 M-5 12 h10 M-12 -5 v10"/><circle class="ink" r="2"/>'
OUT_OF_PLANE: Final = '<circle r="7"/><circle class="ink" r="2"/>'  # acts along the vehicle, seen from its end
SENSOR_MARKS: Final = {
    "acceleration": '<rect x="-4.5" y="-4.5" width="9" height="9"/>',
    "rate": '<circle r="5"/>',
    "displacement": '<path d="M0 -6 l5.5 10 h-11 z"/>',
    "angle": '<path d="M0 -6 l6 6 l-6 6 l-6 -6 z"/>',
}


def words(name: str) -> str:
    """Return a name of a file in words."""
    return name.replace("_", " ")


def titled_group(style: str, key: str, title: str, svg: str) -> str:
    """Return a part of a drawing with its name, which a browser shows under the pointer."""
    return f'<g class="{style}" data-key="{escape(key)}"><title>{escape(title)}</title>{svg}</g>'


def symbol_at(symbol: str, x: float, y: float, across: bool = False) -> str:
    """Return a symbol at a place [px], across the vehicle if asked for."""
    turn = " rotate(90)" if across else ""
    return f'<g transform="translate({x:.1f} {y:.1f}){turn}">{symbol}</g>'


def roll_bar(half_width: float) -> str:
    """Return an anti-roll bar: a bar across the vehicle with an arm at each end."""
    return f'<path class="thick" d="M-13 {-half_width:.1f} H3 V{half_width:.1f} H-13"/>'


def link(x1: float, y1: float, x2: float, y2: float) -> str:
    """Return a rod with an eye at each end."""
    angle, shortened = atan2(y2 - y1, x2 - x1), min(EYE, hypot(x2 - x1, y2 - y1) / 4)
    dx, dy = shortened * cos(angle), shortened * sin(angle)
    eyes = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{EYE:g}"/>' for x, y in ((x1, y1), (x2, y2)))
    return f'<path class="thick" d="M{x1 + dx:.1f} {y1 + dy:.1f} L{x2 - dx:.1f} {y2 - dy:.1f}"/>{eyes}'
