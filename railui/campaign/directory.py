"""Campaign file of a directory."""

from __future__ import annotations

from pathlib import Path

from railui.io.problems import file_problem


def campaign_file(path: str | Path) -> Path:
    """Return the campaign.yaml of a directory, or the file itself; FileProblems if the directory has none."""
    path = Path(path)
    if not path.is_dir():
        return path
    file = path / "campaign.yaml"
    if not file.exists():
        raise file_problem(path, "holds no campaign.yaml", "name a file, or the directory of a campaign")
    return file
