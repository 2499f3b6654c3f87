"""Hook of mkdocs: formulas in LaTeX become MathML, which browsers show without a script or a network."""

import html
import re
from typing import Any

from latex2mathml.converter import convert

FORMULA = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.S)


def mathml(latex: str, display: str) -> str:
    """Return a formula as MathML; display: "inline" or "block"."""
    aligned = html.unescape(latex).strip().replace("{aligned}", "{align*}")  # the name that the converter knows
    return convert(aligned, display=display)


def on_page_content(content: str, **_: Any) -> str:
    """Convert the formulas of a page."""
    return FORMULA.sub(lambda m: mathml(m[3], "inline" if m[2] == "(" else "block"), content)
