"""Page of the verification, with the table of `railui doctor` as this version computes it."""

from pathlib import Path
from typing import Any

from markdown_text import plain, table

from railui.doctor import doctor

TEXT = Path(__file__).parents[1] / "validation.md"


def page() -> str:
    """Return the written page with the doctor's table in the place of its mark."""
    return TEXT.read_text().replace("<!-- doctor -->", _doctor())


def _doctor() -> str:
    rows = [
        (plain(c["name"]), _value(c["expected"]), _value(c["got"]), "yes" if c["ok"] else "**no**", plain(c["source"]))
        for c in doctor(jobs=2)["checks"]
    ]
    return table(("check", "expected", "computed", "agrees", "source"), rows)


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_value, value))
    return "" if value is None else f"{value:.7g}" if isinstance(value, float) else plain(str(value))
