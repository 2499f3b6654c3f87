"""Interrupting a long call of the kernel."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

LONG = """
import signal, time
import numpy as np
from railui.core import ZeroPhaseFilter
from tests.kernel.pairs import asymmetric_bogie, batch, interval, structure, table, tangent_run

signal.signal(signal.SIGINT, signal.default_int_handler)
run, vehicle = tangent_run(20.0, rate=400.0), asymmetric_bogie()
one = batch([vehicle])
some = one.select(np.zeros(20_000, int))
made, rows = structure(vehicle), table(run, vehicle.a, 2)
mean = ZeroPhaseFilter(np.zeros((0, 6)), np.zeros((0, 2)), 0, 0, np.ones(1), len(run.t))
print("ready", flush=True)
try:
    if CALL == "simulate":
        made.simulate(some, rows, interval(run), 2, ["e1"], filter=mean, jobs=2)
    else:
        made.ride_statistics(some, rows, interval(run), 2, ["e1", "e2"], np.full(len(some), 7e-3), jobs=2)
except KeyboardInterrupt:
    print("stopped", time.process_time(), flush=True)
else:
    print("finished", flush=True)
"""


def busy(pid: int) -> float:
    """Processor time of all threads of a process [s]: what others compute meanwhile does not count."""
    times = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("call", ["simulate", "score"])
def test_ctrl_c_ends_a_long_call_within_a_second_of_both_threads(call: str) -> None:
    words = [sys.executable, "-c", f"CALL = {call!r}\n{LONG}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None
            assert child.stdout.readline() == "ready\n", child.stderr and child.stderr.read()
            time.sleep(0.5)
            sent = busy(child.pid)
            child.send_signal(signal.SIGINT)
            word, *when = child.stdout.readline().split()
        finally:
            child.kill()
    assert word == "stopped"
    assert float(when[0]) - sent < 2.0
