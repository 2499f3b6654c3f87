"""A vehicle as an FMU: valid for FMPy, and simulated there as by the kernel."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import railui
from railui.core import kernel_library
from railui.io.elf import with_optional_symbols
from tests.cli.runner import ROOT, document, run

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")

TRACK = "erri_b176_low length=60 seed=3"
CHANNELS = ["e1", "e2", "ay1", "psi2", "Y1", "Y2.left"]
EFFECTS = [
    {"kind": "free_play", "at": "primary_lateral", "half_width": "0.4 mm"},
    {"kind": "maxwell_damper", "at": "secondary_yaw", "stiffness": "3 MN*m/rad", "damping": "200 kN*m*s/rad"},
    {"kind": "flange_contact", "at": "contact", "clearance": "3 mm", "stiffness": "50 MN/m"},
    {
        "kind": "measured_force",
        "at": "secondary_lateral",
        "motion": ["-5 mm", "0 mm", "5 mm"],
        "force": ["2 kN", "0 N", "-1 kN"],
    },
    {"kind": "run_out", "at": "wheelset", "wheelset": 1, "force": "2 kN", "rolling_radius": "0.46 m"},
]


def with_effects(name: str, effects: list[dict[str, Any]]) -> railui.Design:
    design = railui.Design.load(ROOT / "designs" / name)
    content = yaml.safe_load(design.to_yaml())
    content["effects"] = [*content.get("effects", []), *effects]
    return railui.Design.from_dict(content)


def simulate(file: Path, inputs: Any, outputs: list[str], **start: float) -> Any:
    """Return the series [sample] of an FMU whose communication step is the time between two samples."""
    step = float(inputs["time"][1])
    return fmpy.simulate_fmu(
        str(file),
        stop_time=step * len(inputs),
        output_interval=step,
        step_size=step,
        input=inputs,
        output=outputs,
        start_values=start,
        fmi_type="CoSimulation",
    )


def largest_difference(found: Any, expected: Any, channels: list[str]) -> float:
    """Return the largest deviation of all channels, relative to the largest value of each."""
    pairs = [(found[c][1:], expected[c]) for c in channels]
    return max(float(np.max(np.abs(ours - theirs[: len(ours)])) / np.max(np.abs(theirs))) for ours, theirs in pairs)


@pytest.mark.parametrize(
    ("design", "effects"),
    [("check_bogie.yaml", []), ("check_bogie.yaml", EFFECTS), ("manchester_coach.yaml", EFFECTS[2:3])],
)
def test_fmpy_finds_the_fmu_valid_and_simulates_it_as_the_kernel_does(
    design: str, effects: list[dict[str, Any]], tmp_path: Path
) -> None:
    vehicle = with_effects(design, effects)
    file = tmp_path / "vehicle.fmu"
    railui.export_fmu(vehicle, file, 40.0, CHANNELS)
    assert validation.validate_fmu(str(file)) == []
    found = simulate(file, railui.fmu_inputs(TRACK, 40.0), CHANNELS)
    expected = vehicle.simulate(TRACK, 40.0, CHANNELS)
    assert len(found) == len(expected["t"]) + 1
    assert largest_difference(found, expected, CHANNELS) < 1e-9


def test_the_fmu_of_a_calibrated_vehicle_has_its_parameters_and_its_effect(tmp_path: Path) -> None:
    """The result of a loop on the bundled simulated campaign, exported by the command."""
    found = railui.Campaign.load(ROOT / "designs/campaigns/worn_axle_box").loop(jobs=2)
    adjusted = found.save(tmp_path / "loop") / "adjusted.yaml"
    file = tmp_path / "adjusted.fmu"
    run("export", "--fmu", str(adjusted), "-o", str(file), "--speed", "40", "--channels", ",".join(CHANNELS))
    assert validation.validate_fmu(str(file)) == []
    vehicle = railui.Design.load(adjusted)
    assert [effect.kind for effect in vehicle.effects] == ["free_play"]
    series = simulate(file, railui.fmu_inputs(TRACK, 40.0), CHANNELS)
    assert largest_difference(series, vehicle.simulate(TRACK, 40.0, CHANNELS), CHANNELS) < 1e-9


def test_speed_and_numbers_of_the_vehicle_are_parameters_of_the_fmu(tmp_path: Path) -> None:
    design = railui.Design.load(ROOT / "designs/check_bogie.yaml")
    file = tmp_path / "bogie.fmu"
    railui.export_fmu(design, file, 40.0, ["e1"])
    changes = {"vehicle.primary.lateral_stiffness": 2.0e6, "vehicle.geometry.half_wheelbase": 1.1}
    found = simulate(file, railui.fmu_inputs(TRACK, 25.0), ["e1"], speed=25.0, **changes)
    expected = design.with_values(changes).simulate(TRACK, 25.0, ["e1"])
    assert largest_difference(found, expected, ["e1"]) < 1e-9
    as_exported = simulate(file, railui.fmu_inputs(TRACK, 25.0), ["e1"], speed=25.0)
    assert largest_difference(as_exported, expected, ["e1"]) > 1e-3


def test_outputs_are_one_communication_step_late_and_start_at_rest(tmp_path: Path) -> None:
    file = tmp_path / "bogie.fmu"
    railui.export_fmu(ROOT / "designs/check_bogie.yaml", file, 40.0, ["e1"])
    inputs = railui.fmu_inputs(TRACK, 40.0)
    found = simulate(file, inputs, ["e1"])
    assert found["e1"][0] == found["e1"][1] != found["e1"][2]


def test_a_state_of_the_fmu_can_be_taken_up_again(tmp_path: Path) -> None:
    file = tmp_path / "bogie.fmu"
    railui.export_fmu(ROOT / "designs/check_bogie.yaml", file, 40.0, ["ay1"])
    description = fmpy.read_model_description(str(file))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    unit = fmpy.fmi3.FMU3Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(file), str(tmp_path / "unzipped")),
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="bogie",
    )
    unit.instantiate()
    unit.enterInitializationMode()
    unit.exitInitializationMode()

    def steps(first: int) -> float:
        for k in range(first, first + 20):
            unit.setFloat64([reference["yw"], reference["dyw_ds"]], [1e-3 * np.sin(k / 5), 2e-3 * np.cos(k / 5)])
            unit.doStep(0.0025 * k, 0.0025)
        return float(unit.getFloat64([reference["ay1"]])[0])

    steps(0)
    state = unit.getFMUState()
    first = steps(20)
    unit.setFMUState(state)
    assert steps(20) == first != 0.0
    unit.freeFMUState(state)
    with pytest.raises(fmpy.fmi1.FMICallException):
        unit.setFloat64([reference["speed"]], [30.0])
    unit.terminate()
    unit.freeInstance()


def test_a_vehicle_that_leaves_the_track_is_an_error_of_the_step(tmp_path: Path) -> None:
    file = tmp_path / "bogie.fmu"
    design = railui.Design.load(ROOT / "designs/check_bogie.yaml").with_values(
        {"contact.leading.conicity": 0.5, "contact.trailing.conicity": 0.5}
    )
    railui.export_fmu(design, file, 100.0, ["e1"])
    inputs = railui.fmu_inputs("erri_b176_low length=1500", 100.0)
    with pytest.raises(fmpy.fmi1.FMICallException):
        simulate(file, inputs, ["e1"])


def test_the_library_of_an_fmu_loads_in_a_program_without_python(tmp_path: Path) -> None:
    file = tmp_path / "bogie.fmu"
    railui.export_fmu(ROOT / "designs/check_bogie.yaml", file)
    with zipfile.ZipFile(file) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".so")]
        (tmp_path / "kernel.so").write_bytes(archive.read(name))
    required: list[str] = []
    with_optional_symbols((tmp_path / "kernel.so").read_bytes(), lambda name: bool(required.append(name)))
    assert required and not [name for name in required if "Py" in name]
    preloaded = {"LD_PRELOAD": str(tmp_path / "kernel.so"), "LD_BIND_NOW": "1"}
    done = subprocess.run(["/bin/true"], env=preloaded, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    preloaded["LD_PRELOAD"] = str(kernel_library())
    assert subprocess.run(["/bin/true"], env=preloaded, capture_output=True).returncode != 0


def test_equal_designs_give_equal_bytes_and_the_command_writes_them(tmp_path: Path) -> None:
    design = ROOT / "designs/check_bogie.yaml"
    railui.export_fmu(design, tmp_path / "api.fmu", 40.0)
    written = document(run("export", "--fmu", str(design), "-o", str(tmp_path / "cli.fmu"), "--json", "-"))
    assert (tmp_path / "api.fmu").read_bytes() == (tmp_path / "cli.fmu").read_bytes()
    assert [one["name"] for one in written["input"]][:2] == ["yw", "dyw_ds"]


def test_refusals_name_the_cause(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"\.fmu"):
        railui.export_fmu(ROOT / "designs/check_bogie.yaml", tmp_path / "bogie.zip")
    with pytest.raises(ValueError, match="curves"):
        railui.fmu_inputs(ROOT / "designs/lines/reverse_curves.yaml", 30.0)
    with pytest.raises(railui.FileProblems):
        railui.export_fmu(ROOT / "designs/elements/mr_damper.yaml", tmp_path / "damper.fmu")
    with pytest.raises(ValueError, match="library"):
        with_optional_symbols(b"MZ" + bytes(60), lambda name: True)
