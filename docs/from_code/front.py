"""The first page: the README, its links turned to the pages of the site."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def page() -> str:
    """README.md with links as the site has them; files that the site does not have are named only."""
    text = (ROOT / "README.md").read_text()
    text = text.replace("](docs/", "](")
    return re.sub(r"\[([^\]]+)\]\((LICENSE|CHANGELOG\.md)\)", r"`\1`", text)
