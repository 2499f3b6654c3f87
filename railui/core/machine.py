"""Kernel build, SIMD level and threads."""

from __future__ import annotations

import os
from pathlib import Path

from railui import _core

LANES: int = _core.LANES  # vehicles in one SIMD batch


def simd_level() -> str:
    """Return the SIMD level in use: v4 (AVX-512), v3 (AVX2) or portable."""
    return _core.simd()


def source_hash() -> str:
    """Return the SHA-256 of the sources from which the kernel was built."""
    return _core.sources()


def kernel_library() -> Path:
    """Return the file of the kernel, a shared library."""
    return Path(str(_core.__file__))


def run_operation_chains(roots: bool, rounds: int) -> int:
    """Run chains of fused products, or of square roots, in registers; return the number of operations of all lanes.

    >>> run_operation_chains(False, 200) == 2 * run_operation_chains(False, 100)
    True
    """
    return _core.chains(roots, rounds)


def resolve_thread_count(jobs: int | None) -> int:
    """Return the given number of threads, or the number of processors for None or 0."""
    return jobs if jobs else (os.cpu_count() or 1)
