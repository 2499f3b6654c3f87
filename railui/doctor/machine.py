"""Checks of the machine: SIMD level, output, serial ports, identical results for any number of lanes and threads."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from railui.arrays import FloatArray
from railui.core import LANES, resolve_thread_count, simd_level, source_hash
from railui.doctor.check import Check
from railui.doctor.vehicles import check_bogie
from railui.ride_quality.evaluation import excitation_of
from railui.ride_quality.statistics import ride_statistics
from railui.vehicle.model import Model

# the best first: flags of the processor that a level needs
SIMD_FLAGS: Final = {"v4": {"avx512f", "avx512dq", "avx2", "fma"}, "v3": {"avx2", "fma"}}
CPU_INFO: Final = Path("/proc/cpuinfo")
HERE: Final = "this installation"
PORT_PATTERNS: Final = ("ttyUSB*", "ttyACM*")


def lanes_and_threads(jobs: int | None) -> Iterator[Check]:
    """Yield that results are bit-identical alone, in batches of sixteen and on any number of threads."""
    model = Model(check_bogie())
    excitation = excitation_of("erri_b176_low length=300 seed=1", 40.0)
    rows = np.repeat(model.row[None], 2 * LANES + 1, axis=0)
    rows[:, model.columns["vehicle.primary.lateral_stiffness"]] *= np.linspace(0.8, 1.2, len(rows))
    many = ride_statistics(model, rows, excitation, jobs=1)["sd_e"]
    single = np.concatenate([ride_statistics(model, row[None], excitation, jobs=1)["sd_e"] for row in rows])
    threads = max(2, resolve_thread_count(jobs))
    threaded = ride_statistics(model, rows, excitation, jobs=threads)["sd_e"]
    yield Check("one lane and sixteen agree", "to the last digit", _agreement(many, single), HERE)
    yield Check(f"1 and {threads} threads agree", "to the last digit", _agreement(many, threaded), HERE)


def _agreement(first: FloatArray, second: FloatArray) -> str:
    if np.array_equal(first, second):
        return "to the last digit"
    return f"within {float(np.max(np.abs(first - second) / np.abs(first))):.1e}"


def simd_checks(jobs: int | None) -> Iterator[Check]:
    """Yield that the SIMD level is the requested one, or the best of this processor."""
    best = best_simd_level(CPU_INFO.read_text()) if CPU_INFO.is_file() else None
    expected = os.environ.get("RAILUI_SIMD") or best or simd_level()
    yield Check("SIMD level", expected, simd_level(), HERE)


def best_simd_level(cpu_info: str) -> str:
    """Return the SIMD level that a processor supports, from the text of /proc/cpuinfo.

    >>> best_simd_level("flags : fpu avx2 fma avx512f"), best_simd_level("flags : sse2")
    ('v3', 'portable')
    """
    flags = {word for line in cpu_info.splitlines() if line.startswith("flags") for word in line.split()}
    return next((level for level, needed in SIMD_FLAGS.items() if needed <= flags), "portable")


def output_checks(jobs: int | None) -> Iterator[Check]:
    """Yield that standard output can print the frames of tables."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    try:
        "\u250f\u2501\u2503".encode(encoding)
        result = "printable"
    except (UnicodeEncodeError, LookupError):
        result = f"not in {encoding}: set PYTHONIOENCODING=utf-8"
    yield Check("frames of tables on standard output", "printable", result, HERE)


def port_checks(jobs: int | None) -> Iterator[Check]:
    """Yield that the serial ports of the machine can be opened; nothing without a port."""
    ports = serial_ports()
    if not ports:
        return
    closed = [str(port) for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    result = f"no permission for {', '.join(closed)}: join their group" if closed else "all that are there"
    yield Check("serial ports can be opened", "all that are there", result, f"{len(ports)} ports")


def serial_ports() -> list[Path]:
    """Return the serial ports of the machine."""
    return [port for pattern in PORT_PATTERNS for port in Path("/dev").glob(pattern)]


def skipped_checks() -> list[dict[str, str]]:
    """Return the checks that this machine gives no occasion for."""
    return [] if serial_ports() else [{"name": "serial ports can be opened", "reason": "the machine has none"}]


def describe_machine(jobs: int | None) -> dict[str, Any]:
    """Return SIMD level, threads, platform and versions."""
    return {
        "simd": simd_level(),
        "lanes": LANES,
        "threads": resolve_thread_count(jobs),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "kernel_sources": source_hash(),
    }


GROUPS: Final = (simd_checks, lanes_and_threads, output_checks, port_checks)
