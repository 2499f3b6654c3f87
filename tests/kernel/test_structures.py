"""Every bundled vehicle has a form of the kernel of its own; files of structures are those of their vehicles."""

from __future__ import annotations

import pytest

from railui.bench.cost_breakdown import bundled_forms
from railui.core import simd_level
from tests.kernel.structures import FILES, STRUCTURES, file_of, model_of


@pytest.mark.parametrize("name", STRUCTURES)
def test_a_file_has_the_rows_of_its_vehicle(name: str) -> None:
    if simd_level() == "portable":
        pytest.skip("forms that are compiled for AVX2")
    assert (FILES / f"{name}.txt").read_text(encoding="utf-8") == file_of(name)
    model = model_of(name)
    assert model.vehicles().form(model.single_batch()) == name.replace("_", " ")


def test_no_bundled_vehicle_needs_loops_over_its_rows() -> None:
    if simd_level() == "portable":
        pytest.skip("forms that are compiled for AVX2")
    assert {path.stem for path in FILES.iterdir()} == set(STRUCTURES)
    assert not set(bundled_forms().values()) & {"general", "bodies"}
