"""The page of validation: the doctor's table as this version computes it, and where the other proofs stand."""

from pathlib import Path
from typing import Any

from words import plain, table

from railui.doctor import doctor

TEXT = Path(__file__).parents[1] / "validation.md"


def page() -> str:
    """The written page with the doctor's table where it says so."""
    return TEXT.read_text().replace("<!-- doctor -->", _doctor())


def _doctor() -> str:
    found = doctor(jobs=2)
    rows = [(plain(c["name"]), _told(c["expected"]), _told(c["got"]), "yes" if c["ok"] else "**no**", plain(c["source"]))
            for c in found["checks"]]  # fmt: skip
    return table(("check", "expected", "computed", "agrees", "source"), rows)


def _told(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(map(_told, value))
    return "" if value is None else f"{value:.7g}" if isinstance(value, float) else plain(str(value))
