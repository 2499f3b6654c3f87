"""Pages from templates, with one style sheet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

TEMPLATES = Path(__file__).parent
STYLE_SHEET = TEMPLATES / "page.css"


def render_template(template: str, contents: Mapping[str, Any]) -> str:
    """Render a template of this folder; its variable `style` is the style sheet."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATES, encoding="utf-8"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render({**contents, "style": STYLE_SHEET.read_text("utf-8")})
