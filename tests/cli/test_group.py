"""The command group: lazy imports, help, unknown commands, exit codes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

from railui.cli import COMMANDS
from tests.cli.runner import BOGIE, TRACK, run


def test_an_unknown_command_suggests_the_nearest() -> None:
    result = run("optimize")
    assert result.exit_code == 2 and "did you mean 'optimise'?" in result.stderr


def test_help_lists_every_command_and_imports_none() -> None:
    script = (
        "import sys\nfrom railui.cli import cli\n"
        "cli(['--help'], standalone_mode=False)\n"
        "print([m for m in sys.modules if m.startswith(('numpy', 'pydantic', 'rich', 'railui.cli.'))])"
    )
    out = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout
    assert all(f"  {name} " in out for name in COMMANDS)
    assert out.rstrip().endswith("[]")


def test_the_list_of_commands_has_one_line_each_in_80_columns() -> None:
    lines = run("--help").stdout.splitlines()
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines[lines.index("Commands:") + 1 :]] == list(COMMANDS)


def test_errors_and_ctrl_c_have_their_exit_codes() -> None:
    railui = [sys.executable, "-m", "railui"]
    wrong = subprocess.run([*railui, "ride", BOGIE, "--track", TRACK, "--speed", "144"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "write 144 km/h" in wrong.stderr and "Traceback" not in wrong.stderr
    words = [*railui, "ride", BOGIE, "--track", "erri_b176_low length=2000", "--speeds", "30:60:0.01"]
    long = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONUNBUFFERED": "1"})
    assert long.stderr is not None
    long.stderr.readline()  # the first status line
    time.sleep(0.2)
    long.send_signal(signal.SIGINT)
    assert "to run the same again: railui ride" in long.communicate(timeout=20)[1]
    assert long.returncode == 130
