"""Settings of `riding` that the pages name are those of the files."""

from __future__ import annotations

import re

from railui.vehicle.parameters import SETTINGS
from tests.docs.transcript import ROOT


def test_the_pages_name_the_choices_of_guidance_as_files_have_them() -> None:
    pages = " ".join(page.read_text() for page in sorted((ROOT / "docs").glob("*.md")))
    named = set(re.findall(r"`(?:riding\.)?guidance: (\w+)`", pages))
    assert named and named <= set(SETTINGS["riding.guidance"])
