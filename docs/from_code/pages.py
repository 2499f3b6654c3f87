"""Write the pages that are generated from the code when the site is built."""

import sys
from pathlib import Path

import mkdocs_gen_files

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import api  # noqa: E402
import commands  # noqa: E402
import effects  # noqa: E402
import file_list  # noqa: E402
import formats  # noqa: E402
import front  # noqa: E402
import notebooks  # noqa: E402
import settings  # noqa: E402
import validation  # noqa: E402

PAGES = {
    "index.md": front.page,
    "reference/files.md": formats.page,
    "reference/settings.md": settings.page,
    "reference/commands.md": commands.page,
    "reference/effects.md": effects.page,
    "reference/api.md": api.page,
    "reference/code.md": file_list.page,
    "validation.md": validation.page,
    "notebooks.md": notebooks.page,
}

for name, page in PAGES.items():
    with mkdocs_gen_files.open(name, "w") as file:
        file.write(page())
for name, svg in effects.pictures():
    with mkdocs_gen_files.open(f"reference/laws/{name}.svg", "wb") as file:
        file.write(svg)
