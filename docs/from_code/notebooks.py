"""Pages of the notebooks: every cell is executed, and followed by its output and figures."""

import ast
import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[2]
CELL = re.compile(r"^# %%(?P<kind>.*)$", re.MULTILINE)


class Cell(NamedTuple):
    """Cell of a notebook: text in Markdown, or code."""

    is_text: bool
    source: str


class Rendered(NamedTuple):
    """Page of a notebook and its figures (SVG) by file name."""

    page: str
    figures: dict[str, bytes]


def notebooks() -> list[Path]:
    """Return the notebooks of examples/."""
    return sorted((ROOT / "examples").glob("*.py"))


def cells(text: str) -> Iterator[Cell]:
    """Yield the cells of a notebook in the percent format."""
    marks = list(CELL.finditer(text))
    ends = [*(mark.start() for mark in marks[1:]), len(text)]
    for mark, end in zip(marks, ends, strict=True):
        body = text[mark.end() : end].strip("\n")
        is_text = mark["kind"].strip() == "[markdown]"
        yield Cell(is_text, re.sub(r"^# ?", "", body, flags=re.MULTILINE) if is_text else body)


def render(name: str, text: str) -> Rendered:
    """Execute a notebook and return its page; the exception of a cell is raised."""
    import matplotlib

    matplotlib.use("Agg")
    namespace: dict[str, Any] = {"__name__": "__main__"}
    parts: list[str] = []
    figures: dict[str, bytes] = {}
    for cell in cells(text):
        if cell.is_text:
            parts.append(cell.source)
            continue
        parts += [f"```python\n{cell.source}\n```", *_outputs(cell.source, f"{name}.py", namespace)]
        for svg in _new_figures():
            file = f"{name}_{len(figures) + 1}.svg"
            figures[file] = svg
            parts.append(f"![figure {len(figures)} of the notebook]({file})")
    link = f"The notebook is the file `examples/{name}.py`; its cells were executed when this page was built."
    heading, _, introduction = parts[0].partition("\n\n")
    return Rendered("\n\n".join([heading, link, introduction, *parts[1:]]) + "\n", figures)


def _outputs(source: str, file: str, namespace: dict[str, Any]) -> list[str]:
    """Execute a cell; return what it printed, and its last value as HTML where that has a form for notebooks."""
    tree = ast.parse(source, file)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    value, printed = None, io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, file, "exec"), namespace)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), file, "eval"), namespace)
    found = [f"```text\n{printed.getvalue().rstrip()}\n```"] if printed.getvalue() else []
    return found + ([f"<div>{value._repr_html_()}</div>"] if hasattr(value, "_repr_html_") else [])


def _new_figures() -> list[bytes]:
    """Return the figures that are open, and close them."""
    import matplotlib
    from matplotlib import pyplot

    found = []
    for number in pyplot.get_fignums():
        out = io.BytesIO()
        with matplotlib.rc_context({"svg.hashsalt": "notebook"}):
            pyplot.figure(number).savefig(out, format="svg", metadata={"Date": None})
        found.append(out.getvalue())
    pyplot.close("all")
    return found
