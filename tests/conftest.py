"""What holds for all tests: numpy as the command line has it, with one thread of BLAS."""

import os

from railui.__main__ import ALONE

for name, count in ALONE.items():
    os.environ.setdefault(name, count)
