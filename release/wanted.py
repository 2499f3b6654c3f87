"""The packages that railui and one of its extras ask for, one a line, as pip reads them."""

import sys
import tomllib
from pathlib import Path
from typing import Any


def of_extra(project: dict[str, Any], extra: str) -> list[str]:
    """The requirements of an extra; `railui[name, ...]` stands for those of other extras."""
    found = []
    for line in project["optional-dependencies"][extra]:
        name, _, others = line.partition("[")
        if name == "railui":
            found += [one for other in others.rstrip("]").split(",") for one in of_extra(project, other.strip())]
        else:
            found.append(line)
    return found


if __name__ == "__main__":
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    print(*project["dependencies"], *of_extra(project, sys.argv[1]), sep="\n")
