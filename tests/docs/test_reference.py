"""What the reference pages need from the code: a formula for every effect, an example for every command."""

from __future__ import annotations

import re
import subprocess
import sys

import click
import pytest

from railui.cli import COMMANDS, cli
from railui.core import catalogue
from tests.docs.transcript import ROOT

FORMULA = re.compile(r"//[/ ].*(?:=|->).*\n(?: *//.*\n)*(?: *#\[.*\n)*(?: *fn (?:force|forces|roll)|pub struct)")


@pytest.mark.parametrize("kind", [record["kind"] for record in catalogue()])
def test_a_formula_stands_above_the_law_of_every_effect(kind: str) -> None:
    assert FORMULA.search((ROOT / "rust_core/src/effects" / f"{kind}.rs").read_text())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_part_of_it_has_an_example(name: str) -> None:
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    parts = [f"{name}_{part}" for part in command.commands] if isinstance(command, click.Group) else []
    for example in (name, *parts):
        assert f"railui {example.replace('_', ' ', 1)}" in (ROOT / "docs/examples" / f"{example}.md").read_text()


@pytest.mark.parametrize("name", ["front", "formats", "settings", "commands", "effects", "api", "house", "validation"])
def test_a_page_of_the_site_is_written_from_the_code(name: str) -> None:
    write = f"import sys; sys.path.insert(0, 'docs/from_code'); import {name}; print({name}.page())"
    done = subprocess.run([sys.executable, "-c", write], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("# ") and len(done.stdout) > 1000
