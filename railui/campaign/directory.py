"""The file of a campaign that stands in a directory."""

from __future__ import annotations

from pathlib import Path

from railui.io.problems import one_problem


def campaign_file(path: str | Path) -> Path:
    """The campaign.yaml of a directory, or the file itself; FileProblems where a directory holds none."""
    path = Path(path)
    if not path.is_dir():
        return path
    file = path / "campaign.yaml"
    if not file.exists():
        raise one_problem(path, "holds no campaign.yaml", "name a file, or the directory of a campaign")
    return file
