"""Data faults of a bogie without displacements of its wheelsets, found by the response of the vehicle to the track."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from railui.campaign.faults.diagnose import diagnose
from tests.blind.faults import PlantedFault, exchanged, moved_track, retimed, scaled, with_faults, with_gravity
from tests.blind.simulated import simulated_campaign

DISPLACEMENTS = ("e1", "e2", "d1", "d2")
PLAY = "free_play at=primary_lateral half_width=4e-4"


@pytest.mark.parametrize("effect", ["", PLAY])
def test_sound_accelerations_have_no_fault(effect: str) -> None:
    dataset = with_faults(simulated_campaign(*([effect] if effect else [])).dataset, [], DISPLACEMENTS)
    assert diagnose(dataset).faults == ()


@pytest.mark.parametrize(
    ("plant", "kind", "channels", "value"),
    [
        (scaled("rf", gain=-1.0), "sign", {"rf"}, -1.0),
        (scaled("yw", gain=-1.0), "sign", {"yw"}, -1.0),
        (scaled("ay2", gain=1 / 9.80665), "unit", {"ay2"}, 1 / 9.80665),
        (scaled("ayf", gain=3.0), "gain", {"ayf"}, 3.0),
        (retimed("rf", delay=0.12), "delay", {"rf"}, 0.12),
        (moved_track(2.0), "track_offset", {"track"}, 2.0),
        (exchanged("ay1", "ayf"), "exchanged", {"ay1", "ayf"}, None),
        (with_gravity("ayf", 9.80665), "gravity", {"ayf"}, 9.80665),
    ],
)
def test_a_fault_is_found_by_the_response_to_the_track(
    plant: Any, kind: str, channels: set[str], value: float | None
) -> None:
    dataset = with_faults(simulated_campaign().dataset, [PlantedFault("", (), "", plant)], DISPLACEMENTS)
    (fault,) = diagnose(dataset).faults
    assert (fault.kind, set(fault.channels), fault.serious, fault.alternatives) == (kind, channels, True, ())
    assert "response to the track" in fault.text and fault.yaml
    if value is not None:
        assert fault.value is not None and np.isclose(fault.value, value, rtol=0.15)


@pytest.mark.parametrize("channels", [("ay1",), ("ay1", "ayf")])
def test_accelerations_in_g_in_one_run_are_found_there(channels: tuple[str, ...]) -> None:
    sound = simulated_campaign().dataset
    run = sound.validation[0].file
    in_g = PlantedFault("", (), "", scaled(*channels, gain=1 / 9.80665))
    faults = diagnose(with_faults(sound, [in_g], DISPLACEMENTS, [run])).faults
    assert {c for fault in faults for c in fault.channels} == set(channels)
    for fault in faults:
        assert (fault.kind, fault.files, fault.serious) == ("unit", (run,), True)
        assert f"unit: g, runs: [{run}]" in fault.yaml
