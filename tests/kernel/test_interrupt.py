"""Ctrl-c stops a long call of the kernel."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

LONG = """
import signal, time
import numpy as np
from railui.core import Filter
from tests.kernel.pairs import batch, interval, straight, structure, table, uneven

signal.signal(signal.SIGINT, signal.default_int_handler)
run, vehicle = straight(20.0, rate=400.0), uneven()
one = batch([vehicle])
some = one.select(np.zeros(20_000, int))
made, rows = structure(vehicle), table(run, vehicle.a, 2)
mean = Filter(np.zeros((0, 6)), np.zeros((0, 2)), 0, 0, np.ones(1), len(run.t))
print("ready", flush=True)
try:
    if CALL == "simulate":
        made.simulate(some, rows, interval(run), 2, ["e1"], filter=mean, jobs=2)
    else:
        made.score(some, rows, interval(run), 2, ["e1", "e2"], np.full(len(some), 7e-3), jobs=2)
except KeyboardInterrupt:
    print("stopped", time.time(), flush=True)
else:
    print("finished", flush=True)
"""


@pytest.mark.parametrize("call", ["simulate", "score"])
def test_ctrl_c_ends_a_long_call_within_a_second(call: str) -> None:
    words = [sys.executable, "-c", f"CALL = {call!r}\n{LONG}"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None
            assert child.stdout.readline() == "ready\n", child.stderr and child.stderr.read()
            time.sleep(0.5)
            sent = time.time()
            child.send_signal(signal.SIGINT)
            word, *when = child.stdout.readline().split()
        finally:
            child.kill()
    assert word == "stopped"
    assert 0.0 <= float(when[0]) - sent < 1.0
