"""Reference pages: a formula for every effect, an example for every command, generated pages."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import click
import pytest

from railui.cli import COMMANDS, cli
from railui.core import effect_catalogue
from tests.docs.transcript import ROOT


@pytest.mark.parametrize("record", effect_catalogue(), ids=lambda record: record["kind"])
def test_the_law_of_an_effect_is_a_formula_with_the_symbols_of_its_parameters(record: dict[str, Any]) -> None:
    law = record["law"]
    assert re.search(r"=|->", law)
    absent = [
        p["symbol"] for p in record["parameters"] if not re.search(rf"(?<!\w){re.escape(p['symbol'])}(?!\w)", law)
    ]
    assert absent == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_subcommand_has_an_example(name: str) -> None:
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    subcommands = [f"{name}_{sub}" for sub in command.commands] if isinstance(command, click.Group) else []
    for example in (name, *subcommands):
        assert f"railui {example.replace('_', ' ', 1)}" in (ROOT / "docs/examples" / f"{example}.md").read_text()


GENERATED_PAGES = ("front", "formats", "settings", "commands", "effects", "api", "file_list", "validation")


@pytest.mark.parametrize("name", GENERATED_PAGES)
def test_a_reference_page_is_generated_from_the_code(name: str) -> None:
    program = f"import sys; sys.path.insert(0, 'docs/from_code'); import {name}; print({name}.page())"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("# ") and len(done.stdout) > 1000
