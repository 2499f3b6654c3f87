"""Run commands in this process and read their JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from railui.cli import cli

ROOT = Path(__file__).parents[2]
BOGIE = str(ROOT / "designs/test_bogie.yaml")
TRACK = "erri_b176_low length=300 seed=1"


def run(*words: str) -> Result:
    """Run a command with these words."""
    return CliRunner().invoke(cli, list(words))


def run_ride(*words: str) -> Result:
    """Run `ride` with the test bogie on a short track."""
    return run("ride", BOGIE, "--track", TRACK, *words)


def document(result: Result) -> dict[str, Any]:
    """Return the JSON on stdout; fail where stdout contains anything else."""
    found: dict[str, Any] = json.loads(result.stdout, parse_constant=lambda word: pytest.fail(word))
    return found
