"""Formulas of the written pages are valid LaTeX that becomes MathML."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests.docs.transcript import ROOT

pytest.importorskip("latex2mathml")
sys.path.insert(0, str(ROOT / "docs" / "from_code"))

from mathematics import mathml, on_page_content

CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.M | re.S)
FORMULA = re.compile(r"\$\$(.+?)\$\$|\$([^\s$](?:[^$\n]*[^\s$])?)\$", re.S)
PAGES = sorted((ROOT / "docs").glob("*.md"))


def formulas(page: Path) -> list[tuple[str, str]]:
    """Return the formulas of a page with their display."""
    text = CODE.sub("", page.read_text("utf-8"))
    return [(block or inline, "block" if block else "inline") for block, inline in FORMULA.findall(text)]


def test_the_theory_states_its_equations_as_formulas() -> None:
    assert sum(display == "block" for _, display in formulas(ROOT / "docs" / "theory.md")) >= 8


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_formula_becomes_complete_mathml(page: Path) -> None:
    for latex, display in formulas(page):
        root = ElementTree.fromstring(mathml(latex, display))
        text = "".join(root.itertext())
        assert root.tag.endswith("math") and "\\" not in text, f"{page.name}: {latex}"


def test_the_hook_converts_only_formulas() -> None:
    page = '<p>a <span class="arithmatex">\\(x &lt; 1\\)</span> b</p><pre>\\(x\\)</pre>'
    found = on_page_content(page)
    assert found.startswith("<p>a <math") and found.endswith("b</p><pre>\\(x\\)</pre>")
