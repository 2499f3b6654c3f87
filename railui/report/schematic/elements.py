"""Symbols of the elements of a vehicle at their places, side by side where places coincide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from railui.report.schematic import symbols
from railui.report.schematic.canvas import SCALE, Box, Canvas
from railui.report.schematic.places import Places, joint_key
from railui.vehicle.element_kinds import ROTATIONS
from railui.vehicle.multibody_parts import Joint, Part

STEP = 42.0  # px, between elements at one place
ROTATION_WAYS = frozenset(ROTATIONS)
UPRIGHT = ROTATION_WAYS | {"vertical"}
HALF_ROLL_BAR = 0.62  # m, half the drawn width of an anti-roll bar


@dataclass(frozen=True)
class DrawnElement:
    """One joint of an element: its symbols as SVG, the boxes that they fill, and what it is."""

    key: str
    part: str
    title: str
    svg: str
    boxes: tuple[Box, ...]


def draw_elements(places: Places, canvas: Canvas) -> list[DrawnElement]:
    """Return every joint of a vehicle with its symbols; those at the wheelsets take their places first."""
    joints = sorted(places.structure.joints, key=lambda j: _order(places, j))
    drawn = {joint_key(joint): _draw(places, canvas, joint) for joint in joints}
    return [drawn[joint_key(joint)] for joint in places.structure.joints]


def _order(places: Places, joint: Joint) -> tuple[bool, bool, int]:
    """Sort key: rods, whose places are given, then elements at wheelsets, then springs before the others."""
    is_low = any(end is not None and places.structure.members[end].is_wheelset for end in joint.ends)
    return joint.part.kind != "link", not is_low, joint.part.kind != "spring"


def _draw(places: Places, canvas: Canvas, joint: Joint) -> DrawnElement:
    part, title = joint.part, _title(joint)
    sides = places.sides_of_joint(joint)
    if part.kind == "link":
        svg, boxes = _link(places, canvas, joint, sides)
        return DrawnElement(joint_key(joint), part.name, title, svg, boxes)
    ways = acting_ways(part, places.values)
    half = _half_size(part, ways)
    x = canvas.x(places.axis(places.x_of_joint(joint)))
    shift = _free_shift(canvas, [Box(x, canvas.y(side), *half) for side in sides])
    boxes = tuple(Box(x + shift, canvas.y(side), *half) for side in sides)
    canvas.occupied += boxes
    return DrawnElement(joint_key(joint), part.name, title, "".join(_symbol(part, ways, b) for b in boxes), boxes)


def _title(joint: Joint) -> str:
    """Return the element in words: name, kind, and the two bodies that it joins."""
    ends = " and ".join("ground" if end is None else symbols.words(end) for end in joint.ends)
    return f"{symbols.words(joint_key(joint))}: {symbols.words(joint.part.kind)} between {ends}"


def _free_shift(canvas: Canvas, boxes: list[Box]) -> float:
    """Return the shift along the vehicle [px] with which no box covers another symbol."""
    for shift in _shifts():
        if not any(canvas.is_occupied(box.shifted(shift)) for box in boxes):
            return shift
    return 0.0


def _shifts() -> Iterator[float]:
    yield 0.0
    for i in range(1, 8):
        yield from (0.5 * i * STEP, -0.5 * i * STEP)


def acting_ways(part: Part, values: Mapping[str, float]) -> frozenset[str]:
    """Return the directions in which an element acts."""
    if part.kind in ("spring_damper", "stop"):
        return frozenset({part.word("direction", "lateral")})
    end = {"spring": "_stiffness", "damper": "_damping"}.get(part.kind, "")
    keys = [key for key in part.keys if end and key.endswith(end)]
    acting = [key for key in keys if values[part.number_path(key)]] or keys
    return frozenset(key.removesuffix(end) for key in acting)


def _half_size(part: Part, ways: frozenset[str]) -> tuple[float, float]:
    if part.kind == "anti_roll_bar":
        return 14.0, HALF_ROLL_BAR * SCALE + 3.0
    if part.kind == "spring_damper" and not ways & UPRIGHT:
        return (10.0, 28.0) if is_across(ways) else (28.0, 10.0)
    if is_coil(part, ways) or ways <= ROTATION_WAYS:
        return 15.0, 15.0
    if ways <= UPRIGHT:
        return 10.0, 10.0
    return (10.0, 21.0) if is_across(ways) else (21.0, 10.0)


def is_across(ways: frozenset[str]) -> bool:
    """True for an element that is drawn across the vehicle: all but one that acts along it only."""
    return "lateral" in ways or "longitudinal" not in ways


def is_coil(part: Part, ways: frozenset[str]) -> bool:
    """True for a spring that acts in several directions, or upright."""
    return part.kind == "spring" and ("vertical" in ways or len(ways - ROTATION_WAYS) > 1)


def _symbol(part: Part, ways: frozenset[str], box: Box) -> str:
    symbol, has_direction = _symbol_of_kind(part, ways)
    return symbols.symbol_at(symbol, box.x, box.y, across=has_direction and is_across(ways))


def _symbol_of_kind(part: Part, ways: frozenset[str]) -> tuple[str, bool]:
    """Return a symbol, and whether it is turned into the direction in which the element acts."""
    if part.kind == "anti_roll_bar":
        return symbols.roll_bar(HALF_ROLL_BAR * SCALE), False
    if is_coil(part, ways):
        return symbols.COIL, False
    if part.kind == "stop":
        return symbols.STOP, True
    if ways <= ROTATION_WAYS:
        return symbols.TORSION_SPRING if part.kind == "spring" else symbols.TORSION_DAMPER, False
    if ways <= UPRIGHT:
        return symbols.VERTICAL_DASHPOT, False
    if part.kind == "spring":
        return symbols.LINE_SPRING, True
    return symbols.DAMPER_ON_MOUNTING if part.kind == "spring_damper" else symbols.DASHPOT, True


def _link(places: Places, canvas: Canvas, joint: Joint, sides: list[float]) -> tuple[str, tuple[Box, ...]]:
    """Return a rod between its two ends, on each side where it has two."""
    part = joint.part

    def number(key: str, default: float) -> float:
        return places.values[part.number_path(key)] if key in part.keys else default

    x1 = places.x_of_joint(joint)
    svg, boxes = "", []
    for side in sides:
        y2 = number("y_to", abs(side)) * (-1.0 if side < 0 else 1.0)
        ends = [(canvas.x(places.axis(x)), canvas.y(y)) for x, y in ((x1, side), (number("x_to", x1), y2))]
        (ax, ay), (bx, by) = ends
        svg += symbols.link(ax, ay, bx, by)
        boxes.append(Box((ax + bx) / 2, (ay + by) / 2, abs(bx - ax) / 2 + 5, abs(by - ay) / 2 + 5))
    canvas.occupied += boxes
    return svg, tuple(boxes)
