"""Checks of the machine: SIMD level, locale, serial ports, identical results for any number of lanes and threads."""

from __future__ import annotations

import json
import locale
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
from railui.io.units import quantity
from railui.ride_quality.evaluation import excitation_of
from railui.ride_quality.statistics import ride_statistics
from railui.vehicle.model import Model

SIMD_LEVELS: Final = ("v4", "v3", "portable")
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
    """Yield that the SIMD level is a known one, and the requested one."""
    requested = os.environ.get("RAILUI_SIMD")
    yield Check(
        "SIMD level",
        requested or simd_level(),
        simd_level() if simd_level() in SIMD_LEVELS else f"unknown {simd_level()}",
        HERE,
    )


def locale_checks(jobs: int | None) -> Iterator[Check]:
    """Yield that numbers are read and written with a point in the locale of the machine."""
    written = json.dumps(quantity("0.5 mm", "m"))
    yield Check(
        "numbers of files and JSON have a decimal point",
        "0.0005",
        written,
        f"locale {locale.setlocale(locale.LC_NUMERIC)}",
    )
    yield Check("text is UTF-8", "utf-8", sys.getdefaultencoding(), HERE)


def port_checks(jobs: int | None) -> Iterator[Check]:
    """Yield that the serial ports of the machine can be opened."""
    ports = [port for pattern in PORT_PATTERNS for port in Path("/dev").glob(pattern)]
    closed = [str(port) for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    result = f"no permission for {', '.join(closed)}: join their group" if closed else "all that are there"
    yield Check("serial ports can be opened", "all that are there", result, f"{len(ports)} ports")


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


GROUPS: Final = (simd_checks, lanes_and_threads, locale_checks, port_checks)
