"""Every panel as text at 80x24 and 120x40, beside what it looked like when somebody last looked at it.

RAILUI_SNAPSHOTS=renew writes them anew. Dots of lines and scroll bars are left out: they depend on the machine.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from tests.desk.conftest import REPOSITORY, Keys, Sitting

pytestmark = pytest.mark.asyncio
KEPT = Path(__file__).parent / "snapshots"
DOTS = re.compile("[\u2800-\u28ff┈┬▁▂▃▄▅▆▇█]")


def shown(keys: Keys) -> str:
    """The screen as text."""
    strips = keys.desk.screen._compositor.render_strips()
    return "\n".join(DOTS.sub(" ", strip.text).rstrip() for strip in strips).replace("─", "-") + "\n"


def compare(name: str, text: str) -> None:
    """Beside the kept text; written where it is to be renewed."""
    path = KEPT / f"{name}.txt"
    if os.environ.get("RAILUI_SNAPSHOTS") == "renew":
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, "utf-8")
    assert text == path.read_text("utf-8"), f"{name} looks otherwise: look at it, then RAILUI_SNAPSHOTS=renew"


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
async def test_every_panel_looks_as_it_did(
    sit: Sitting, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(REPOSITORY / "designs")
    end = f"{size[0]}x{size[1]}"
    async with sit(Path("test_bogie.yaml"), size=size) as keys:
        await keys.press("down", "down", "right", "right")
        compare(f"design-{end}", shown(keys))
        for key, name in (("f3", "campaign"), ("f4", "optimise"), ("f5", "track"), ("f6", "capture")):
            await keys.press(key)
            compare(f"{name}-{end}", shown(keys))
        await keys.press("f2", "f1")
        compare(f"help-{end}", shown(keys))


async def test_letters_alone_suffice(sit: Sitting, bogie: Path) -> None:
    async with sit(bogie, size=(100, 30), plain=True) as keys:
        await keys.press("down", "right")
        text = shown(keys)
    strange = set(re.sub("[\x20-\x7e\n]", "", text))
    # symbols of the trade and the arrows of hints have no letters to stand for them
    assert strange <= set("λκεδσψφ₁₂·²±←→↑↓⌫⁻⁰¹³⁴⁵⁶⁷⁸⁹▲▼")
