"""Bodies of a plan view: rails, carbody, frames, wheelsets with their axle boxes."""

from __future__ import annotations

from dataclasses import dataclass, field

from railui.report.schematic.canvas import SCALE, Box, Canvas
from railui.report.schematic.places import Places
from railui.report.schematic.symbols import titled_group, words
from railui.vehicle.multibody_parts import Member

BEAM = 0.09  # m, half the width of a side beam
OVERHANG = 0.28  # m, of a side beam beyond an axle
CARBODY = (0.95, 1.47)  # m, beyond the outermost wheelset or element, and half the width
WHEEL = 0.06  # m, half the drawn thickness


@dataclass
class DrawnBodies:
    """Bodies as SVG, the boxes to highlight by name (of contacts by wheelset), and the places of their labels."""

    svg: str = ""
    boxes: dict[str, list[Box]] = field(default_factory=dict)
    contacts: dict[str, list[Box]] = field(default_factory=dict)
    anchors: dict[str, tuple[float, float]] = field(default_factory=dict)

    def add(self, style: str, key: str, title: str, svg: str) -> None:
        """Append a part on top of the others."""
        self.svg += f"{titled_group(style, key, title, svg)}\n"


def draw_bodies(places: Places, canvas: Canvas) -> DrawnBodies:
    """Draw all bodies, the highest ones below, since one looks through them."""
    drawn = DrawnBodies()
    bodies = [m for m in places.structure.members.values() if not m.is_wheelset]
    top = max((places.levels[m.name] for m in bodies), default=0)
    if places.has_ground:
        _carbody(places, canvas, drawn, None)
    carbodies = [m for m in bodies if places.levels[m.name] == top and (top > 1 or not places.has_ground)]
    for member in carbodies:
        _carbody(places, canvas, drawn, member)
    _rails(places, canvas, drawn)
    for member in sorted((m for m in bodies if m not in carbodies), key=lambda m: -places.levels[m.name]):
        if places.levels[member.name] <= 1:
            _frame(places, canvas, drawn, member)
        else:
            _bolster(places, canvas, drawn, member)
    for wheelset in places.structure.wheelsets:
        _wheelset(places, canvas, drawn, wheelset)
    return drawn


def _rails(places: Places, canvas: Canvas, drawn: DrawnBodies) -> None:
    b = places.half_gauge(places.structure.wheelsets[0])
    left, right = canvas.x(places.axis.drawn[0]) - 30, canvas.x(places.axis.drawn[-1]) + 30
    lines = "".join(f'<path d="M{left:.1f} {canvas.y(y):.1f} H{right:.1f}"/>' for y in (-b, b))
    drawn.add("rail", "rails", "rails", lines)


def _carbody(places: Places, canvas: Canvas, drawn: DrawnBodies, member: Member | None) -> None:
    """Draw a carbody as an outline, broken where its length is shortened; None: a carbody that stands still."""
    if member is None:
        ends, key, title, style = (places.axis.drawn[0], places.axis.drawn[-1]), "ground", places.ground_title, " fixed"
    else:
        (first, last), key = places.extent(member.name), member.name
        ends, title, style = (first - CARBODY[0], last + CARBODY[0]), words(member.name), ""
    x1, x2 = (canvas.x(x) for x in ends)
    y1, y2 = canvas.y(-CARBODY[1]), canvas.y(CARBODY[1])
    svg = (
        f'<rect class="carbody{style}" x="{x1:.1f}" y="{y1:.1f}" width="{x2 - x1:.1f}" height="{y2 - y1:.1f}" rx="10"/>'
    )
    for place in places.axis.breaks:
        svg += _break(canvas.x(place), y1, y2)
    drawn.add("body", key, title, svg)
    drawn.boxes[key] = [Box((x1 + x2) / 2, (y1 + y2) / 2, (x2 - x1) / 2, (y2 - y1) / 2)]
    drawn.anchors[title] = (x1 + 14, y1)


def _break(x: float, y1: float, y2: float) -> str:
    """Return the two parallel zigzag lines at which a length is left out."""
    middle = (y1 + y2) / 2
    line = f"M{{x:.1f}} {y1 - 6:.1f} V{middle - 14:.1f} l-9 9 l18 10 l-9 9 V{y2 + 6:.1f}"
    sides = "".join(f'<path class="break-line" d="{line.format(x=x + dx)}"/>' for dx in (-4.5, 4.5))
    return f'<path class="break" d="{line.format(x=x)}"/>{sides}'


def _frame(places: Places, canvas: Canvas, drawn: DrawnBodies, member: Member) -> None:
    """Draw a bogie frame: two side beams over its wheelsets, and a transom."""
    carried = [w for w in places.structure.wheelsets if w.carrier == member.name]
    y = places.box_distance(carried[0]) if carried else 1.0
    first, last = places.extent(member.name)
    x1, x2, middle = canvas.x(first - OVERHANG), canvas.x(last + OVERHANG), canvas.x((first + last) / 2)
    beam, transom = BEAM * SCALE, 22.0
    yo, yi = y * SCALE + beam, y * SCALE - beam
    m = canvas.middle
    path = (
        f"M{x1:.1f} {m - yo:.1f} H{x2:.1f} V{m - yi:.1f} H{middle + transom:.1f} V{m + yi:.1f} H{x2:.1f} V{m + yo:.1f} "
        f"H{x1:.1f} V{m + yi:.1f} H{middle - transom:.1f} V{m - yi:.1f} H{x1:.1f} Z"
    )
    drawn.add("frame", member.name, words(member.name), f'<path d="{path}"/>')
    drawn.boxes[member.name] = [Box((x1 + x2) / 2, m, (x2 - x1) / 2, yo)]
    drawn.anchors[words(member.name)] = (x1 + 8, m - yo)


def _bolster(places: Places, canvas: Canvas, drawn: DrawnBodies, member: Member) -> None:
    """Draw a body between frame and carbody as a beam across the vehicle."""
    box = Box(canvas.x(places.axis(places.x_of_member(member))), canvas.middle, 30.0, 1.2 * SCALE)
    x, y = box.x - box.half_width, box.y - box.half_height
    size = f'width="{2 * box.half_width:.1f}" height="{2 * box.half_height:.1f}"'
    drawn.add("frame", member.name, words(member.name), f'<rect x="{x:.1f}" y="{y:.1f}" {size} rx="4"/>')
    drawn.boxes[member.name] = [box]
    drawn.anchors[words(member.name)] = (x + 6, y)


def _wheelset(places: Places, canvas: Canvas, drawn: DrawnBodies, wheelset: Member) -> None:
    """Draw axle, wheels and axle boxes; the number in the middle counts from the front."""
    x, m = canvas.x(places.axis(places.x_of_member(wheelset))), canvas.middle
    b, box = places.half_gauge(wheelset) * SCALE, places.box_distance(wheelset) * SCALE
    r, thick = places.rolling_radius(wheelset) * SCALE, WHEEL * SCALE
    axle = max(b, box)
    svg = f'<rect x="{x - 4:.1f}" y="{m - axle:.1f}" width="8" height="{2 * axle:.1f}"/>'
    drawn.contacts[wheelset.name] = []
    for side in (-1, 1):
        size = f'width="{2 * r:.1f}" height="{2 * thick:.1f}"'
        svg += f'<rect x="{x - r:.1f}" y="{m + side * b - thick:.1f}" {size} rx="3"/>'
        svg += f'<rect x="{x - 13:.1f}" y="{m + side * box - 6:.1f}" width="26" height="12" rx="2"/>'
        canvas.occupied.append(Box(x, m + side * b, r, thick + 1))
        drawn.contacts[wheelset.name].append(Box(x, m + side * b, r, thick))
    svg += f'<circle cx="{x:.1f}" cy="{m:.1f}" r="10"/>'
    svg += f'<text class="number" x="{x:.1f}" y="{m + 4.2:.1f}" text-anchor="middle">{wheelset.number}</text>'
    canvas.occupied.append(Box(x, m, 11.0, 11.0))
    drawn.add("wheelset", wheelset.name, f"wheelset {wheelset.number}", svg)
    drawn.boxes[wheelset.name] = [Box(x, m, 14.0, axle)]
