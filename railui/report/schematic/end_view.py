"""End view of a vehicle whose bodies roll: wheelset, bodies above each other, one of each element between them."""

from __future__ import annotations

from dataclasses import dataclass, field
from html import escape

from railui.report.schematic import symbols
from railui.report.schematic.canvas import Box
from railui.report.schematic.elements import acting_ways, is_coil
from railui.report.schematic.labels import text_width
from railui.report.schematic.places import Places
from railui.vehicle.multibody_parts import Joint, Member

GAP, BEAM, CARBODY = 62.0, 20.0, 74.0  # px, heights of the space between two bodies, of a beam, of a carbody
WHEEL = 78.0  # px, drawn diameter
SCALE = 125.0  # px per m across
HALF_WIDTH, HALF_FRAME = 1.47, 1.34  # m, of the highest body, and of the others
ROLL_BAR = 0.42  # m, half the drawn width of an anti-roll bar
LABELS = 206.0  # px right of the middle, where the labels begin
LINE = 16.0  # px, least distance of two labels
_ORDER = {"anti_roll_bar": 0, "spring": 1}  # these take their places first


@dataclass
class EndView:
    """End view as SVG about the middle of the track on top of the rails, y downwards; its size [px]."""

    places: Places
    shown: dict[int, Member | None] = field(default_factory=dict)  # body by level; None: one that stands still
    labels: list[tuple[str, float, float]] = field(default_factory=list)
    occupied: dict[int, list[Box]] = field(default_factory=dict)
    svg: str = ""

    def __post_init__(self) -> None:
        members, levels = self.places.structure.members, self.places.levels
        for name, level in levels.items():
            self.shown.setdefault(level, members[name])
        if self.places.has_ground:
            self.shown[max(self.shown) + 1] = None
        self._draw_wheelset(self.places.structure.wheelsets[0])
        for level in sorted(self.shown)[1:]:
            self._draw_body(level)
        drawn: set[str] = set()
        for joint in sorted(self.places.structure.joints, key=lambda j: _ORDER.get(j.part.kind, 2)):
            if joint.part.name not in drawn:
                self._draw_joint(joint)
                drawn.add(joint.part.name)
        self._draw_labels()

    @property
    def height(self) -> float:
        """Height of the drawing above the rails [px]."""
        return self.bottom(max(self.shown)) + CARBODY

    @property
    def width(self) -> float:
        """Width of the drawing with its labels right of the middle [px]."""
        return LABELS + 12.0 + max((text_width(t) for t, _, _ in self.labels), default=0.0)

    def bottom(self, level: int) -> float:
        """Return the height [px] of the lower edge of a body above the rails."""
        return WHEEL / 2 + 8.0 + GAP * level + BEAM * (level - 1)

    def top(self, level: int) -> float:
        """Return the height [px] of the upper edge of a body, of a wheelset that of its axle boxes."""
        return WHEEL / 2 + 8.0 if level == 0 else self.bottom(level) + BEAM

    def _draw_wheelset(self, wheelset: Member) -> None:
        b, box = self.places.half_gauge(wheelset) * SCALE, self.places.box_distance(wheelset) * SCALE
        axle = max(b, box)
        svg = f'<rect x="{-axle:.1f}" y="{-WHEEL / 2 - 4:.1f}" width="{2 * axle:.1f}" height="8"/>'
        rails = ""
        for side in (-1, 1):
            svg += f'<rect x="{side * b - 6:.1f}" y="{-WHEEL:.1f}" width="12" height="{WHEEL:.1f}" rx="3"/>'
            svg += f'<rect x="{side * box - 27:.1f}" y="{-WHEEL / 2 - 8:.1f}" width="54" height="16" rx="2"/>'
            rails += f'<path d="M{side * b - 16:.1f} 2 h32"/>'
        self.svg += f'<g class="rail">{rails}</g><g class="wheelset">{svg}</g>'

    def _draw_body(self, level: int) -> None:
        member, is_top = self.shown[level], level == max(self.shown)
        half = HALF_WIDTH * SCALE if is_top else HALF_FRAME * SCALE
        high = CARBODY if is_top else BEAM
        y = -self.bottom(level) - high
        style = "carbody" + (" fixed" if member is None else "") if is_top else "frame"
        self.svg += (
            f'<rect class="{style}" x="{-half:.1f}" y="{y:.1f}" width="{2 * half:.1f}" height="{high:.1f}" rx="4"/>'
        )
        text = self.places.ground_title if member is None else symbols.words(member.part.name)
        if member is not None and "height" in member.part.keys:
            height = self.places.values[member.part.number_path("height")]
            text += f", centre of mass {height:g} m above the rails"
        self.labels.append((text, half, y + high / 2))

    def _draw_joint(self, joint: Joint) -> None:
        """Draw one joint of an element in the space between its two bodies."""
        low, high = sorted(max(self.shown) if end is None else self.places.levels[end] for end in joint.ends)
        lower, upper = -self.top(low), -self.bottom(high)
        if joint.part.kind == "anti_roll_bar":
            x = ROLL_BAR * SCALE
            self.occupied.setdefault(low, []).extend(Box(side * x, 0.0, 5.0, 1.0) for side in (-1, 1))
            arms = f"M{-x:.1f} {upper:.1f} V{lower - 8:.1f} H{x:.1f} V{upper:.1f}"
            self.svg += f'<g class="element end"><path class="thick" d="{arms}"/></g>'
            self.labels.append((symbols.words(joint.part.name), x, upper + 12.0))
            return
        half = self._half_width(joint)
        sides = [y * SCALE for y in self.places.sides_of_joint(joint)]
        shift = self._free_shift(low, sides, half)
        for y in sides:
            x = y + (shift if y >= 0 else -shift)
            self.occupied.setdefault(low, []).append(Box(x, 0.0, half, 1.0))
            self.svg += f'<g class="element end">{self._symbol(joint, x, lower, upper)}</g>'
        self.labels.append(
            (symbols.words(joint.part.name), max(y + (shift if y >= 0 else -shift) for y in sides), (lower + upper) / 2)
        )

    def _free_shift(self, level: int, sides: list[float], half: float) -> float:
        """Return the shift outwards [px] with which an element covers no other and stays below the carbody."""
        taken = self.occupied.get(level, [])
        for i in range(40):
            for shift in (3.0 * i, -3.0 * i):
                boxes = [Box(y + (shift if y >= 0 else -shift), 0.0, half, 1.0) for y in sides]
                is_inside = all(abs(box.x) + half < HALF_WIDTH * SCALE for box in boxes)
                if is_inside and not any(box.overlaps(other) for box in boxes for other in taken):
                    return shift
        return 0.0

    def _half_width(self, joint: Joint) -> float:
        ways = acting_ways(joint.part, self.places.values)
        if self._is_level(joint):
            return 24.0
        if is_coil(joint.part, ways) or "vertical" in ways:
            return 12.0
        return 9.0 if "longitudinal" in ways or not ways else 13.0

    def _is_level(self, joint: Joint) -> bool:
        """True for an element that lies across the vehicle."""
        ways = acting_ways(joint.part, self.places.values)
        return "lateral" in ways and not is_coil(joint.part, ways)

    def _symbol(self, joint: Joint, x: float, lower: float, upper: float) -> str:
        """Return the symbol of an element with its connections to the bodies below and above."""
        ways, middle = acting_ways(joint.part, self.places.values), (lower + upper) / 2
        if self._is_level(joint):
            symbol = {"stop": symbols.STOP, "spring": symbols.LINE_SPRING}.get(joint.part.kind, symbols.DASHPOT)
            symbol = symbols.DAMPER_ON_MOUNTING if joint.part.kind == "spring_damper" else symbol
            reach = {"stop": 13.0, "spring_damper": 26.0}.get(joint.part.kind, 19.0)
            ends = f'<path d="M{x - reach:.1f} {lower:.1f} V{middle:.1f} M{x + reach:.1f} {middle:.1f} V{upper:.1f}"/>'
            return ends + symbols.symbol_at(symbol, x, middle)
        upright = is_coil(joint.part, ways) or "vertical" in ways
        is_torsion = bool(ways) and not ways - {"yaw", "roll"}
        reach = 19.0 if upright else 12.0 if is_torsion else 7.0
        ends = f'<path d="M{x:.1f} {lower:.1f} V{middle + reach:.1f} M{x:.1f} {middle - reach:.1f} V{upper:.1f}"/>'
        if upright:
            symbol = symbols.LINE_SPRING if joint.part.kind == "spring" else symbols.DASHPOT
            return ends + symbols.symbol_at(symbol, x, middle, across=True)
        if is_torsion:
            symbol = symbols.TORSION_SPRING if joint.part.kind == "spring" else symbols.TORSION_DAMPER
            return ends + symbols.symbol_at(symbol, x, middle)
        return ends + symbols.symbol_at(symbols.OUT_OF_PLANE, x, middle)

    def _draw_labels(self) -> None:
        """Write the labels below each other at the right, each with a line to its place."""
        ordered = sorted(self.labels, key=lambda label: (label[2], -label[1]))
        lines: list[float] = []
        for _, _, y in ordered:
            lines.append(max(y, lines[-1] + LINE) if lines else y)
        excess = max(0.0, lines[-1] - 4.0) if lines else 0.0
        for (text, x, y), line in zip(ordered, (line - excess for line in lines), strict=True):
            path = f'<path d="M{LABELS:.1f} {line:.1f} L{x:.1f} {y:.1f}"/><circle cx="{x:.1f}" cy="{y:.1f}" r="1.8"/>'
            self.svg = f'{self.svg}<g class="leader end">{path}</g>'
            self.svg += f'<text class="end" x="{LABELS + 4:.1f}" y="{line + 4:.1f}">{escape(text)}</text>'


def has_end_view(places: Places) -> bool:
    """True where a body may roll."""
    return any(member.has_rotation("roll") for member in places.structure.members.values())
