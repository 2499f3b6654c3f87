"""Start of the desk from Python."""

from __future__ import annotations

from pathlib import Path


def open_desk(path: str | Path | None = None, *, plain: bool = False) -> int:
    """Open the terminal user interface, as `railui desk`.

    Parameters
    ----------
    path : str or Path, optional
        Design or campaign.
    plain : bool
        Use letters and the terminal's own colours only.

    Returns
    -------
    int
        Exit code.
    """
    from railui.desk.app import run

    return run(None if path is None else Path(path), plain=plain)
