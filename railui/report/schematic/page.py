"""A schematic as an SVG file: title and description for readers who cannot see it, style, white ground."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from pathlib import Path

STYLE_SHEET = Path(__file__).with_name("schematic.css")


@dataclass(frozen=True)
class Page:
    """Drawing with its name, the view, a description in words, and its size [px]."""

    name: str
    view: str
    description: str
    drawing: str
    width: float
    height: float

    def svg(self) -> str:
        """Return the file."""
        name, size = escape(self.name), f'width="{self.width:.0f}" height="{self.height:.0f}"'
        box = f'viewBox="0 0 {self.width:.0f} {self.height:.0f}"'
        view = f", {self.view}" if self.view else ""
        return f"""\
<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-labelledby="title desc" {size} {box}
 font-family="Helvetica, Arial, 'DejaVu Sans', sans-serif" font-size="12">
<title id="title">Schematic of {name}{view}</title>
<desc id="desc">{escape(self.description)}</desc>
<style>
{STYLE_SHEET.read_text("utf-8")}</style>
<rect class="ground" {size}/>
<text x="10" y="17" class="title">{name}</text>
{self.drawing}
</svg>
"""
