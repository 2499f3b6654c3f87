"""YAML text: scalars with the fewest digits that read back as the same number, flow style, lines and blocks."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from railui.io.units import UnitError, parse_unit, quantity, split_quantity
from railui.io.yaml_nodes import parse_scalar

PLAIN = re.compile(r"[A-Za-z_./][\w ./*^+-]*\Z")
INDENT = "  "


class YamlWriter:
    """Writer of a YAML document, line by line.

    Examples
    --------
    >>> writer = YamlWriter()
    >>> writer.entry("name", "test: 1")
    >>> with writer.block("variables"):
    ...     writer.entry("vehicle.frame.mass", [1e3, 5e3], comment="kg")
    ...     writer.comment("vehicle.wheel_load: 1 kN")
    >>> writer.items("objectives", [{"minimise": "comfort", "over": "mean"}])
    >>> print(writer.text(), end="")
    name: "test: 1"
    variables:
      vehicle.frame.mass: [1000, 5000]  # kg
      # vehicle.wheel_load: 1 kN
    objectives:
      - {minimise: comfort, over: mean}
    """

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._depth = 0

    def line(self, text: str) -> None:
        """Append a line of YAML as it is, at the current indentation."""
        self._lines.append(f"{INDENT * self._depth}{text}")

    def comment(self, text: str) -> None:
        """Append a line of comment."""
        self.line(f"# {text}")

    def entry(self, key: str, value: Any, comment: str = "") -> None:
        """Append `key: value`, groups and lists in flow style."""
        self.line(f"{scalar_text(key)}: {flow_text(value)}" + (f"  # {comment}" if comment else ""))

    @contextmanager
    def block(self, key: str) -> Iterator[None]:
        """Append `key:`; what is written in the context is indented below it."""
        self.line(f"{scalar_text(key)}:")
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1

    def items(self, key: str, values: Iterable[Any]) -> None:
        """Append a list with one line per item; an empty list as `[]`."""
        items = list(values)
        if not items:
            self.entry(key, [])
            return
        with self.block(key):
            for item in items:
                self.line(f"- {flow_text(item)}")

    def text(self) -> str:
        """Return the document."""
        return "\n".join(self._lines) + "\n"


def number_text(value: float) -> str:
    """Return the shortest text of a number.

    >>> number_text(3e6), number_text(0.0007), number_text(1.5e-7), number_text(2900.0)
    ('3000000', '0.0007', '1.5e-07', '2900')
    """
    is_whole = float(value).is_integer() and abs(value) < 1e15
    return str(int(value)) if is_whole else repr(float(value))


def scalar_text(value: object) -> str:
    """Return a word, number or switch as a YAML scalar.

    >>> scalar_text("4 kN/m"), scalar_text("a: b"), scalar_text(True), scalar_text(None)
    ('4 kN/m', '"a: b"', 'true', 'null')
    """
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int | float):
        return number_text(value)
    text = str(value)
    is_quantity = re.match(r"[-+]?[\d.]+(e[-+]?\d+)? [\w*/^]+\Z", text)
    if is_quantity or (PLAIN.match(text) and text == text.strip() and parse_scalar(text) == text):
        return text
    return json.dumps(text, ensure_ascii=False)


def text_in_unit_of(value: float, before: object) -> str:
    """Return a number in the unit of the quantity that it replaces, if that unit holds it exactly, else in SI.

    >>> text_in_unit_of(3.2e6, "3.0 MN/m"), text_in_unit_of(3.2e6, 3e6)
    ('3.2 MN/m', '3200000')
    """
    if isinstance(before, str):
        try:
            _, unit = split_quantity(before)
            text = f"{number_text(float(f'{value / parse_unit(unit).factor:.15g}'))} {unit}".strip()
            if unit and quantity(text, unit) == value:
                return text
        except UnitError:
            pass
    return number_text(value)


def flow_text(value: Any) -> str:
    """Return a value in flow style, on one line.

    >>> flow_text({"kind": "free_play", "half_width": 3e-4, "on": [1, 2.5]})
    '{kind: free_play, half_width: 0.0003, on: [1, 2.5]}'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{scalar_text(key)}: {flow_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow_text(item) for item in value) + "]"
    return scalar_text(value)
