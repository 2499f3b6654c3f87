"""Numbers as text: the fewest digits that read back as the same number."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from railui.io.units import UnitError, parse_unit, quantity, split
from railui.io.yaml_nodes import scalar

PLAIN = re.compile(r"[A-Za-z_./][\w ./*^+-]*\Z")


def number_text(value: float) -> str:
    """The shortest text of a number.

    >>> number_text(3e6), number_text(0.0007), number_text(1.5e-7), number_text(2900.0)
    ('3000000', '0.0007', '1.5e-07', '2900')
    """
    whole = float(value).is_integer() and abs(value) < 1e15
    return str(int(value)) if whole else repr(float(value))


def scalar_text(value: object) -> str:
    """A word, number or switch as it stands in YAML.

    >>> scalar_text("4 kN/m"), scalar_text("a: b"), scalar_text(True), scalar_text(None)
    ('4 kN/m', '"a: b"', 'true', 'null')
    """
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int | float):
        return number_text(value)
    text = str(value)
    quantity_like = re.match(r"[-+]?[\d.]+(e[-+]?\d+)? [\w*/^]+\Z", text)
    if quantity_like or (PLAIN.match(text) and text == text.strip() and scalar(text) == text):
        return text
    return json.dumps(text, ensure_ascii=False)


def like(value: float, before: object) -> str:
    """The value in the unit in which the old one was written, where that loses nothing.

    >>> like(3.2e6, "3.0 MN/m"), like(3.2e6, 3e6)
    ('3.2 MN/m', '3200000')
    """
    if isinstance(before, str):
        try:
            _, unit = split(before)
            text = f"{number_text(float(f'{value / parse_unit(unit).factor:.15g}'))} {unit}".strip()
            if unit and quantity(text, unit) == value:
                return text
        except UnitError:
            pass
    return number_text(value)


def flow(value: Any) -> str:
    """A value in one line.

    >>> flow({"kind": "free_play", "half_width": 3e-4, "on": [1, 2.5]})
    '{kind: free_play, half_width: 0.0003, on: [1, 2.5]}'
    """
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow(item) for item in value) + "]"
    return scalar_text(value)
