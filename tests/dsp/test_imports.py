"""Import time: quick commands do not import scipy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parents[2]


RIDE = ("ride", "designs/test_bogie.yaml", "--track", "erri_b176_high length=300", "--speed", "40")


ASSESS = ("assess", "erri_b176_high length=600", "designs/test_bogie.yaml", "--speed", "40")


STABILITY = ("stability", "designs/check_bogie.yaml", "--speeds", "20:40:20")


HEAVY = {"scipy", "pymoo", "matplotlib", "numpy.ma", "railui.optimisation.study", "railui.campaign.campaign"}


@pytest.mark.parametrize("command", [RIDE, ASSESS, STABILITY], ids=lambda words: words[0])
def test_quick_commands_do_not_import_scipy(command: tuple[str, ...]) -> None:
    run = "import sys; from railui.cli import cli; cli(sys.argv[1:], standalone_mode=False)"
    report = f"print('read:', *sorted({HEAVY!r} & set(sys.modules)))"
    words = [sys.executable, "-c", f"{run}; {report}", *command]
    done = subprocess.run(words, cwd=HOME, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "read:"


def test_loop_and_desk_import_no_filters_or_statistics_of_scipy(short_campaign: Path, tmp_path: Path) -> None:
    run = "import sys, railui.desk.app; from railui.cli import cli; cli(sys.argv[1:], standalone_mode=False)"
    report = "print('read:', *sorted({'scipy.signal', 'scipy.stats', 'scipy.interpolate'} & set(sys.modules)))"
    words = [sys.executable, "-c", f"{run}; {report}", "loop", str(short_campaign), "-o", str(tmp_path / "loop")]
    done = subprocess.run(words, cwd=HOME, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "read:"
