"""Write the tables of docs/columns.md from the columns that the program knows: python docs/columns.py."""

from collections.abc import Mapping
from pathlib import Path

from railui.runs.columns import BENCH_COLUMNS, COLUMNS, RIG_COLUMNS, Column

PAGE = Path(__file__).with_suffix(".md")
TABLES: Mapping[str, Mapping[str, Column]] = {"bogie": COLUMNS, "rig": RIG_COLUMNS, "bench": BENCH_COLUMNS}


def table(columns: Mapping[str, Column]) -> str:
    """Return the table of some columns."""
    rows = [f"| `{c.name}` | {c.unit or 'any'} | {c.role} | {c.caption} |" for c in columns.values()]
    return "\n".join(["| column | unit | role | meaning |", "| --- | --- | --- | --- |", *rows])


def page(text: str) -> str:
    """Return the page with its tables as the program has them."""
    for name, columns in TABLES.items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        before, rest = text.split(begin, 1)
        text = f"{before}{begin}\n{table(columns)}\n{end}{rest.split(end, 1)[1]}"
    return text


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text("utf-8")), "utf-8")
