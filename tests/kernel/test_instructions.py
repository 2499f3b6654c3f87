"""Vector instructions of the compiled kernel: none is a call in the code of a step."""

import re
import shutil
import subprocess

import pytest

from railui import _core

STEP = re.compile(r"on_v[34]$|::apart$|railui_core::(wheel_rail|effects|integrate|rate)::")
PREPARATION = re.compile(r"::(new|part|of|contact_at)(::\{\{closure\}\})?$")


@pytest.mark.skipif(shutil.which("objdump") is None, reason="needs objdump")
def test_a_step_calls_no_vector_instruction() -> None:
    """A closure inside a step is not compiled for the level: each of its instructions would become a call."""
    command = ["objdump", "--disassemble", "--demangle", "--no-show-raw-insn", _core.__file__]
    callers = set()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as listing:
        assert listing.stdout is not None
        name = ""
        for line in listing.stdout:
            if line.endswith(">:\n"):
                name = line[line.index("<") + 1 : -3]
            elif "call" in line and "core_arch::x86::" in line:
                callers.add(name)
    assert not {c for c in callers if STEP.search(c) and not PREPARATION.search(c)}
