"""Page of the notebooks in examples/: their text and code, one section for each."""

import re
from collections.abc import Iterator
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"
CELL = re.compile(r"^# %%(?P<kind> \[markdown\])?\n(?P<body>.*?)(?=^# %%|\Z)", re.M | re.S)
INTRODUCTION = """# Notebooks

The notebooks of `examples/` as text and code. They are Python files with cells (jupytext, percent format): open them in Jupyter or
an editor to see tables and figures, or run them, `python examples/first_ride.py`, in the checkout.
"""


def page() -> str:
    """Return one section for each notebook, their headings one level below the page's."""
    return "\n".join([INTRODUCTION, *(part for path in sorted(EXAMPLES.glob("*.py")) for part in _section(path))])


def _section(path: Path) -> Iterator[str]:
    for cell in CELL.finditer(path.read_text("utf-8")):
        body = cell["body"].strip("\n")
        if not cell["kind"]:
            yield f"```python\n{body}\n```\n"
            continue
        text = "\n".join(line.removeprefix("#").removeprefix(" ") for line in body.splitlines())
        yield re.sub(r"^#", "##", text, flags=re.M) + "\n"
    yield f"Source: `examples/{path.name}`.\n"
