"""Files that come with the package: designs, campaigns, studies, profiles."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from railui.io.problems import file_problem, suggest_name

HOME: Final = Path(__file__).parents[1] / "designs"


def bundled(name: str | Path = "") -> Path:
    """Return the path of a file or directory that comes with the package, the folder `designs` of its source.

    Parameters
    ----------
    name : str or Path
        Path below `designs`; the folder itself by default.

    Raises
    ------
    FileProblems
        For a name that is not there.

    Examples
    --------
    >>> bundled("test_bogie.yaml").name
    'test_bogie.yaml'
    >>> sorted(path.name for path in bundled("campaigns").iterdir())
    ['mr_damper', 'worn_axle_box', 'worn_centre_guide']
    """
    path = (HOME / name).resolve()
    if not path.exists():
        known = [str(each.relative_to(HOME)) for each in sorted(HOME.glob("*/*")) + sorted(HOME.glob("*.yaml"))]
        raise file_problem(str(name), "is not among the bundled files", suggest_name(str(name), known))
    return path
