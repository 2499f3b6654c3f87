"""Every panel as text at 80x24 and 120x40, compared with a stored snapshot.

RAILUI_SNAPSHOTS=renew writes the snapshots. Braille dots and scroll bars are omitted: they depend on the machine.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.desk.conftest import REPOSITORY, Keyboard, OpenDesk

pytestmark = pytest.mark.asyncio
SNAPSHOTS = Path(__file__).parent / "snapshots"
DOTS = re.compile("[\u2800-\u28ff┈┬▁▂▃▄▅▆▇█]")


def screen_text(keys: Keyboard) -> str:
    """Return the screen as text."""
    strips = keys.desk.screen._compositor.render_strips()
    return "\n".join(DOTS.sub(" ", strip.text).rstrip() for strip in strips).replace("─", "-") + "\n"


def compare(name: str, text: str) -> None:
    """Compare a screen with its snapshot, or write the snapshot."""
    path = SNAPSHOTS / f"{name}.txt"
    if os.environ.get("RAILUI_SNAPSHOTS") == "renew":
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, "utf-8")
    assert text == path.read_text("utf-8"), (
        f"{name} differs from its snapshot: inspect it, then set RAILUI_SNAPSHOTS=renew"
    )


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_every_panel_matches_its_snapshot(
    open_desk: OpenDesk, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(REPOSITORY / "designs")
    end = f"{size[0]}x{size[1]}"
    async with open_desk(Path("test_bogie.yaml"), size=size) as keys:
        await keys.press("down", "down", "right", "right")
        compare(f"design-{end}", screen_text(keys))
        for key, name in (("f3", "campaign"), ("f4", "optimise"), ("f5", "track"), ("f6", "capture")):
            await keys.press(key)
            compare(f"{name}-{end}", screen_text(keys))
        await keys.press("f2", "f1")
        compare(f"help-{end}", screen_text(keys))


async def test_the_plain_screen_uses_ascii_and_symbols_only(open_desk: OpenDesk, bogie: Path) -> None:
    async with open_desk(bogie, size=(100, 30), plain=True) as keys:
        await keys.press("down", "right")
        text = screen_text(keys)
    other = set(re.sub("[\x20-\x7e\n]", "", text))
    # symbols of parameters and units and the arrows of hints have no ASCII form
    assert other <= set("λκεδσψφ₁₂·²±←→↑↓⌫⁻⁰¹³⁴⁵⁶⁷⁸⁹▲▼")
