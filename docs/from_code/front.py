"""First page: the README with the links of the site."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def page() -> str:
    """Return README.md with links to the pages of the site; files outside the site become plain names."""
    text = (ROOT / "README.md").read_text()
    text = text.replace("](docs/", "](")
    return re.sub(r"\[([^\]]+)\]\((LICENSE|CHANGELOG\.md|CONTRIBUTING\.md|CITATION\.cff)\)", r"`\1`", text)
