"""What holds for all tests: numpy as the command line has it, with one thread of BLAS; ctrl-c is heard."""

import os
import signal

from railui.__main__ import SINGLE_THREADED_BLAS
from tests.file_fixtures import *  # noqa: F403

for name, count in SINGLE_THREADED_BLAS.items():
    os.environ.setdefault(name, count)

# a shell without a terminal starts what runs behind it deaf to ctrl-c, and the commands that tests stop inherit it
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
