"""The machine: SIMD, threads, locale, ports, and that one lane, sixteen lanes and any number of threads agree."""

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

from railui.core import LANES, resolve_thread_count, simd_level, source_hash
from railui.doctor.check import Check
from railui.doctor.vehicles import check_bogie
from railui.io.units import quantity
from railui.ride_quality.evaluation import excitation_of
from railui.ride_quality.statistics import ride_statistics
from railui.vehicle.model import Model

KNOWN: Final = ("v4", "v3", "portable")
HERE: Final = "this installation"
PORTS: Final = ("ttyUSB*", "ttyACM*")


def lanes_and_threads(jobs: int | None) -> Iterator[Check]:
    """The same digits alone, among sixteen and on any number of threads."""
    model = Model(check_bogie())
    road = excitation_of("erri_b176_low length=300 seed=1", 40.0)
    rows = np.repeat(model.row[None], 2 * LANES + 1, axis=0)
    rows[:, model.columns["vehicle.primary.lateral_stiffness"]] *= np.linspace(0.8, 1.2, len(rows))
    many = ride_statistics(model, rows, road, jobs=1)["sd_e"]
    alone = np.concatenate([ride_statistics(model, row[None], road, jobs=1)["sd_e"] for row in rows])
    threads = max(2, resolve_thread_count(jobs))
    spread = ride_statistics(model, rows, road, jobs=threads)["sd_e"]
    yield Check("one lane and sixteen agree", "to the last digit", _agree(many, alone), HERE)
    yield Check(f"1 and {threads} threads agree", "to the last digit", _agree(many, spread), HERE)


def _agree(one: Any, other: Any) -> str:
    if np.array_equal(one, other):
        return "to the last digit"
    return f"within {float(np.max(np.abs(one - other) / np.abs(one))):.1e}"


def the_kernel(jobs: int | None) -> Iterator[Check]:
    """The SIMD level is one of ours, and the one that was asked for."""
    asked = os.environ.get("RAILUI_SIMD")
    yield Check("SIMD level", asked or simd_level(), simd_level() if simd_level() in KNOWN else f"unknown {simd_level()}", HERE)


def the_locale(jobs: int | None) -> Iterator[Check]:
    """Numbers are read and written with a point, whatever the locale of the machine."""
    told = json.dumps(quantity("0.5 mm", "m"))
    yield Check(
        "numbers of files and JSON have a decimal point",
        "0.0005",
        told,
        f"locale {locale.setlocale(locale.LC_NUMERIC)}",
    )
    yield Check("text is UTF-8", "utf-8", sys.getdefaultencoding(), HERE)


def the_ports(jobs: int | None) -> Iterator[Check]:
    """Serial ports that are there can be opened."""
    ports = [port for pattern in PORTS for port in Path("/dev").glob(pattern)]
    closed = [str(port) for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    told = f"no permission for {', '.join(closed)}: join their group" if closed else "all that are there"
    yield Check("serial ports can be opened", "all that are there", told, f"{len(ports)} ports")


def told(jobs: int | None) -> dict[str, Any]:
    """What the machine is."""
    return {
        "simd": simd_level(),
        "lanes": LANES,
        "threads": resolve_thread_count(jobs),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "kernel_sources": source_hash(),
    }


GROUPS: Final = (the_kernel, lanes_and_threads, the_locale, the_ports)
