"""Print the requirements of railui and of one of its extras, one per line, in the format of pip."""

import sys
import tomllib
from pathlib import Path
from typing import Any


def extra_requirements(project: dict[str, Any], extra: str) -> list[str]:
    """Return the requirements of an extra; `railui[name, ...]` is replaced by those of the named extras."""
    requirements = []
    for line in project["optional-dependencies"][extra]:
        name, _, others = line.partition("[")
        if name == "railui":
            for other in others.rstrip("]").split(","):
                requirements += extra_requirements(project, other.strip())
        else:
            requirements.append(line)
    return requirements


if __name__ == "__main__":
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    print(*project["dependencies"], *extra_requirements(project, sys.argv[1]), sep="\n")
