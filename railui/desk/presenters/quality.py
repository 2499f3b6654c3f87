"""Riding quality in a few lines: now, and what it is compared with."""

from __future__ import annotations

from typing import Any

from rich.text import Text

from railui.desk.presenters.look import RADII, Look
from railui.io.number_format import display, pretty

COLOURS = {
    "very good": "green",
    "good": "green",
    "satisfactory": "yellow",
    "just admissible": "dark_orange",
    "not admissible": "red",
    "dangerous": "bold red",
}
# key, words, few words, unit, 1 where less is better
ROWS = (
    ("score", "score", "score", "1", -1),
    ("comfort_hours", "reduced comfort after", "comfort", "h", -1),
    ("weighted_acceleration", "weighted acceleration", "weighted acc", "m/s^2", 1),
    ("flange_margin", "flange margin", "flange margin", "sd", -1),
    ("flange_fraction", "flange contact", "flange share", "%", 1),
    ("linear_critical_speed", "linear critical speed", "critical V", "m/s", -1),
    ("linear_damping", "least damping here", "least damping", "1", -1),
)
MORE = (
    ("weighted_acceleration_1974", "weighted as of 1974", "", "m/s^2", 1),
    ("wz", "ride value Wz", "", "1", 1),
    ("n_mv", "N_mv, lateral part", "", "1", 1),
    ("sd_e1", "e₁ standard deviation", "", "m", 1),
    ("sd_e2", "e₂ standard deviation", "", "m", 1),
    ("flange_fraction_gaussian", "flange share, Gaussian", "", "%", 1),
    ("guiding_force", "guiding force, R 600 m", "", "N", 1),
)
NARROW, WIDE = 48, 92  # columns below which words are few, from which there are two tables


def numbers(look: Look) -> dict[str, Any]:
    """The values of all rows by key."""
    q = look.quality
    sd = q["statistics"].get("sd_e", (None, None))
    own = {"linear_critical_speed": look.critical_speed, "linear_damping": look.linear_damping}
    own |= {"sd_e1": sd[0], "sd_e2": sd[1], "guiding_force": None}
    if look.guiding_force is not None:
        own["guiding_force"] = float(abs(look.guiding_force[RADII.index(600.0), 0]))
    return {key: own[key] if key in own else q.get(key) for key, *_ in (*ROWS, *MORE)}


def comparison(now: Look, base: Look, width: int) -> Text:
    """The class, what decided it, and the numbers beside those of the base."""
    text = Text(no_wrap=True, overflow="ellipsis")
    word = str(now.quality["class"])
    text.append(word.upper(), f"bold {COLOURS.get(word, '')}")
    if base is not now and base.quality["class"] != word:
        text.append(f"  was {base.quality['class']}", "dim")
    text.append("\n" + str(now.quality["decided_by"])[: max(0, width)] + "\n", "dim")
    mine, theirs = numbers(now), numbers(base) if base is not now else None
    for i, row in enumerate(ROWS):
        _row(text, row, mine, theirs, width < NARROW)
        if width >= WIDE:
            text.append("   ")
            _row(text, MORE[i], mine, theirs, False)
        text.append("\n")
    text.rstrip()
    return text


def _row(text: Text, row: tuple[str, str, str, str, int], mine: Any, theirs: Any, narrow: bool) -> None:
    key, words, few, unit, sense = row
    text.append(f"{few:13}" if narrow else f"{words:22}")
    wide = 10 if narrow else 11
    text.append(f"{_text(mine[key], unit):>{wide}}", "bold")
    if theirs is None:
        text.append("" if narrow else " " * (wide + 2))
        return
    told = _text(theirs[key], unit)
    text.append(f"{told.split(' ')[0] if narrow else told:>{7 if narrow else wide}}", "dim")
    text.append(*_arrow(mine[key], theirs[key], sense))


def _text(value: Any, unit: str) -> str:
    if value is None:
        return "none"
    if unit == "%":
        return f"{100 * value:.3g} %"
    if unit in ("1", "sd", "h"):
        return f"{value:.3g}" + (f" {unit}" if unit != "1" else "")
    return pretty(display(float(value), unit, 3))


def _arrow(now: Any, base: Any, sense: int) -> tuple[str, str]:
    """Which way it went, green where that is better."""
    if now is None or base is None or abs(now - base) <= 1e-3 * max(abs(now), abs(base)):
        return "  ", ""
    better = sense * (now - base) < 0
    return (" ▲" if now > base else " ▼"), ("green" if better else "red") if sense else "dim"
