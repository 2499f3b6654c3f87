"""Interface to the compiled kernel: catalogue of effects, vehicles, batches, numerical routines.

Only the modules of this package import `railui._core`, and the other packages import from here only.
"""

from __future__ import annotations

from railui._core import NoResultError
from railui.core.batch import Batch, RideStatistics, ZeroPhaseFilter
from railui.core.catalogue import (
    CURVE_KINDS,
    LINKAGE_NUMBER,
    Placement,
    Record,
    adds_body,
    common_kinds,
    creep_forces,
    effect_catalogue,
    effect_numbers,
    effect_record,
    parameter_paths,
)
from railui.core.layout import (
    AccelerometerLayout,
    BodyLayout,
    FloorLayout,
    JointLayout,
    KernelPoint,
    Layout,
    LinearSum,
    WheelsLayout,
)
from railui.core.machine import (
    LANES,
    kernel_library,
    resolve_thread_count,
    run_operation_chains,
    simd_level,
    source_hash,
)
from railui.core.numerics import Spline, matrix_eigenvalues, sosfilt
from railui.core.vehicles import MAX_STEPS_PER_SAMPLE, Vehicles

__all__ = [
    "CURVE_KINDS",
    "LANES",
    "LINKAGE_NUMBER",
    "MAX_STEPS_PER_SAMPLE",
    "AccelerometerLayout",
    "Batch",
    "BodyLayout",
    "FloorLayout",
    "JointLayout",
    "KernelPoint",
    "Layout",
    "LinearSum",
    "NoResultError",
    "Placement",
    "Record",
    "RideStatistics",
    "Spline",
    "Vehicles",
    "WheelsLayout",
    "ZeroPhaseFilter",
    "adds_body",
    "common_kinds",
    "creep_forces",
    "effect_catalogue",
    "effect_numbers",
    "effect_record",
    "kernel_library",
    "matrix_eigenvalues",
    "parameter_paths",
    "resolve_thread_count",
    "run_operation_chains",
    "simd_level",
    "sosfilt",
    "source_hash",
]
