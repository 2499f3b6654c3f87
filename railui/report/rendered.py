"""Pages from their templates: one style for all of them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HOME = Path(__file__).parent
STYLE = re.compile(r"<style>(.*?)</style>", re.DOTALL)


def rendered(template: str, contents: Mapping[str, Any]) -> str:
    """A template of this folder with its contents; `style` is that of the loop's page."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    style = STYLE.search((HOME / "loop/page.html.j2").read_text("utf-8"))
    return environment.from_string((HOME / template).read_text("utf-8")).render(
        {**contents, "style": style[1] if style else ""}
    )
