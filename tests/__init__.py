"""Tests, benchmarks and trials: one thread of BLAS as on the command line, set before numpy is loaded."""

import os

from railui.__main__ import SINGLE_THREADED_BLAS

for name, count in SINGLE_THREADED_BLAS.items():
    os.environ.setdefault(name, count)
