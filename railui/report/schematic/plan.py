"""Plan view of a vehicle as SVG: bodies, suspension, sensors and effects, with a label for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape

from railui.report.schematic.bodies import draw_bodies
from railui.report.schematic.canvas import SCALE, Box, Canvas
from railui.report.schematic.elements import DrawnElement, draw_elements
from railui.report.schematic.end_view import EndView, has_end_view
from railui.report.schematic.equivalent import drawn_topology
from railui.report.schematic.highlights import Highlight, concerned_parts
from railui.report.schematic.labels import ROW, Label, PlacedLabel, place_labels, text_width
from railui.report.schematic.page import Page
from railui.report.schematic.places import Places
from railui.report.schematic.rig import draw_rig
from railui.report.schematic.sensors import SensorPlace, sensor_places
from railui.report.schematic.symbols import SENSOR_MARKS, symbol_at, titled_group, words
from railui.vehicle.design import Design

MIN_WIDTH = 520.0  # px
MARGIN = 0.45  # m, left and right of the outermost wheelset's reach
HALF_END_VIEW = 210.0  # px, left of the middle of the end view
HALF_HEIGHT = 1.55  # m, drawn to either side of the middle
LEGEND = (
    ("acceleration", "accelerometer"),
    ("rate", "rate of yaw or roll"),
    ("displacement", "displacement"),
    ("angle", "angle"),
)


def draw_schematic(
    design: Design,
    channels: Sequence[str] = (),
    highlights: Sequence[Highlight] = (),
    lateral: Mapping[str, float] | None = None,
) -> Page:
    """Return the plan view of a design.

    Parameters
    ----------
    design : Design
        A bogie, a vehicle of bodies and elements, or a rig.
    channels : sequence of str
        Measured channels whose sensors are drawn.
    highlights : sequence of Highlight
        Effects, whose locations are marked.
    lateral : mapping of str to float, optional
        y [m] of accelerometers away from the middle of the vehicle, to the right.
    """
    if design.kind == "rig":
        return draw_rig(design, channels, highlights)
    places = Places(*drawn_topology(design))
    sensors = sensor_places(places, channels, lateral or {})
    return _Plan(places, design.name, sensors, highlights).page()


class _Plan:
    """Plan view under construction: layers of SVG from below, and labels above and below the drawing."""

    def __init__(
        self, places: Places, name: str, sensors: Sequence[SensorPlace], highlights: Sequence[Highlight]
    ) -> None:
        axis = places.axis
        self.places, self.name, self.sensors, self.highlights = places, name, sensors, highlights
        self.canvas = Canvas(axis.drawn[0] - MARGIN, HALF_HEIGHT * SCALE)
        self.width = self.canvas.x(axis.drawn[-1] + MARGIN)
        self.above: list[Label] = []
        self.below: list[Label] = []
        self.bodies = draw_bodies(places, self.canvas)
        self.elements = draw_elements(places, self.canvas)
        self.marks = {s.name: self._free_mark(s) for s in sensors}

    def _free_mark(self, sensor: SensorPlace) -> Box:
        box = self.canvas.free_place(self.canvas.x(sensor.x), self.canvas.y(sensor.y), 7.5)
        self.canvas.occupied.append(box)
        return box

    def page(self) -> Page:
        """Return the whole picture."""
        self._label_bodies()
        self._label_elements()
        halos = "".join(self._highlight(h) for h in self.highlights)
        sensors = "\n".join(self._sensor(s) for s in self.sensors)
        above, below = place_labels(self.above), place_labels(self.below)
        height = 2 * HALF_HEIGHT * SCALE
        leaders = [_leader(p, _text_line(p, -1.0, 0.0), 0.0) for p in above]
        leaders += [_leader(p, _text_line(p, 1.0, height), height) for p in below]
        elements = [titled_group("element", e.key, e.title, e.svg) for e in self.elements]
        texts = [_text(p, _text_line(p, -1.0, 0.0)) for p in above]
        texts += [_text(p, _text_line(p, 1.0, height) + 10.0) for p in below]
        drawing = "\n".join([self.bodies.svg, *leaders, *elements, halos, sensors, *texts])
        return self._page(drawing, above, below)

    def _label_bodies(self) -> None:
        for name, (x, y) in self.bodies.anchors.items():
            self.above.append(Label(name, x, y, "body"))

    def _label_elements(self) -> None:
        """Label one joint of every element, the one that is most to the front and to the right."""
        first: dict[str, DrawnElement] = {}
        for element in self.elements:
            best = first.get(element.part)
            if best is None or _anchor(element)[0] > _anchor(best)[0]:
                first[element.part] = element
        for part, element in first.items():
            self.below.append(Label(words(part), *_anchor(element), "name"))

    def _sensor(self, sensor: SensorPlace) -> str:
        box = self.marks[sensor.name]
        self.above.append(Label(sensor.name, box.x, box.y - 5.0, "sensor"))
        return titled_group(
            "sensor", sensor.name, sensor.caption, symbol_at(SENSOR_MARKS[sensor.quantity], box.x, box.y)
        )

    def _highlight(self, highlight: Highlight) -> str:
        """Return the halos of an effect and label one of them; an effect without a place in the drawing has none."""
        concerned = concerned_parts(self.places, highlight, self.marks)
        boxes = [b for e in self.elements if e.key in concerned.joints for b in e.boxes]
        boxes += [b for name in concerned.bodies for b in self.bodies.boxes[name]]
        boxes += [b for name in concerned.contacts for b in self.bodies.contacts[name]]
        boxes += [self.marks[name] for name in concerned.sensors]
        if not boxes:
            return ""
        front = max(boxes, key=lambda b: (round(b.y), b.x))
        self.below.append(Label(highlight.text, front.x, front.y + front.half_height + 4.0, "effect"))
        key = highlight.at + (f"_{highlight.number}" if highlight.number else "")
        return titled_group("halo", key, highlight.text, "".join(map(_halo, boxes)))

    def _page(self, drawing: str, above: Sequence[PlacedLabel], below: Sequence[PlacedLabel]) -> Page:
        """Return the drawing with its legend and, where bodies roll, the end view."""
        top = 30.0 + ROW * (1 + max((p.row for p in above), default=-1))
        foot = top + 2 * HALF_HEIGHT * SCALE + ROW * (1 + max((p.row for p in below), default=-1)) + 28.0
        width = max([self.width, MIN_WIDTH, *(p.x + p.label.width + 8.0 for p in (*above, *below))])
        end_view, end_height, end_width = self._end_view(foot + 36.0)
        width, height = max(width, end_width), foot + 28.0 + end_height
        content = f'<g transform="translate(0 {top:.1f})">\n{drawing}\n</g>\n{self._legend(foot)}\n{end_view}'
        return Page(self.name, "seen from above", self._description(), content, width, height)

    def _end_view(self, y: float) -> tuple[str, float, float]:
        """Return the view from behind with its height and width [px], of a vehicle whose bodies roll."""
        if not has_end_view(self.places):
            return "", 0.0, 0.0
        view = EndView(self.places)
        x, rails = HALF_END_VIEW, y + view.height + 8.0
        text = "from behind, heights not to scale; one of each element"
        caption = f'<text class="body" x="10" y="{rails + 28:.1f}">{text}</text>'
        svg = f'<g transform="translate({x:.1f} {rails:.1f})">{view.svg}</g>{caption}'
        return svg, view.height + 52.0, x + view.width

    def _description(self) -> str:
        """Return the picture in words, for readers who cannot see it."""
        structure = self.places.structure
        parts = [f"{len(structure.wheelsets)} wheelsets", *(words(p.name) for p in structure.bodies)]
        sentences = ["Bodies: " + ", ".join(parts), "elements: " + ", ".join(e.title for e in self.elements)]
        if self.sensors:
            sentences.append("sensors: " + ", ".join(f"{s.name} ({s.caption})" for s in self.sensors))
        sentences += [f"highlighted: {h.text}" for h in self.highlights]
        return "; ".join(sentences) + "."

    def _legend(self, y: float) -> str:
        shortened = ", the length between bogies shortened" if self.places.axis.breaks else ""
        text = f"from above, front to the right; elements at one place are drawn side by side{shortened}"
        legend, x, y = f'<text class="body" x="10" y="{y:.1f}">{text}</text>', 16.0, y + 18.0
        used = {s.quantity for s in self.sensors}
        for quantity, caption in LEGEND:
            if quantity in used:
                mark = f'<g class="sensor">{symbol_at(SENSOR_MARKS[quantity], x, y - 4.0)}</g>'
                legend += f'{mark}<text class="sensor" x="{x + 9:.1f}" y="{y:.1f}">{caption}</text>'
                x += 24.0 + text_width(caption)
        return legend


def _anchor(element: DrawnElement) -> tuple[float, float]:
    box = max(element.boxes, key=lambda b: b.y)
    return box.x, box.y + box.half_height


def _halo(box: Box) -> str:
    width, height = 2 * box.half_width + 8, 2 * box.half_height + 8
    corner = f'x="{box.x - width / 2:.1f}" y="{box.y - height / 2:.1f}"'
    return f'<rect {corner} width="{width:.1f}" height="{height:.1f}" rx="9"/>'


def _text_line(placed: PlacedLabel, way: float, edge: float) -> float:
    """Return the y [px] at which a leader line meets its text, in the margin beyond an edge of the drawing."""
    return edge + way * (8.0 + ROW * placed.row)


def _leader(placed: PlacedLabel, y: float, edge: float) -> str:
    """Return a leader line: straight through the margin, then to its place in the drawing."""
    label, x = placed.label, placed.x
    line = f'<path d="M{x:.1f} {y:.1f} V{edge:.1f} L{label.x:.1f} {label.y:.1f}"/>'
    return f'<g class="leader {label.style}">{line}<circle cx="{label.x:.1f}" cy="{label.y:.1f}" r="1.8"/></g>'


def _text(placed: PlacedLabel, baseline: float) -> str:
    label = placed.label
    return f'<text class="{label.style}" x="{placed.x + 3:.1f}" y="{baseline:.1f}">{escape(label.text)}</text>'
