"""Data faults of a rig that its response to the input shows."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Fault
from railui.documents.check import check
from railui.report.loop.data_faults import examine_data
from tests.truth.laws import Array
from tests.truth.rig import Bench, Rig, write

Change = Callable[[dict[str, Array]], dict[str, Array]]
FORCE = Bench(seconds=(10.0, 8.0), rate=500.0, seed=1)
BASE = Bench(
    seconds=(10.0, 8.0), rate=500.0, seed=1, declared=Rig(input="base_acceleration"), columns=("z", "az"), noise=0.005
)


def rewrite(
    folder: Path, change: Change, files: Sequence[str] = ("a", "b"), units: dict[str, str] | None = None
) -> None:
    """Change the columns of runs, and the units of their header."""
    for name in files:
        path = folder / f"run_{name}.csv.gz"
        header, *lines = gzip.decompress(path.read_bytes()).decode().splitlines()
        labels = dict(word.rstrip("]").split(" [") for word in header.split(","))
        values = np.array([[float(x) for x in line.split(",")] for line in lines])
        columns = change(dict(zip(labels, values.T, strict=True)))
        labels = {"F": "N"} | labels | (units or {})
        head = ",".join(f"{c} [{labels[c]}]" for c in columns)
        rows = [",".join(f"{x:.9g}" for x in row) for row in np.array(list(columns.values())).T]
        path.write_bytes(gzip.compress("\n".join([head, *rows]).encode()))


def scale(**gains: float) -> Change:
    return lambda columns: {c: gains.get(c, 1.0) * x for c, x in columns.items()}


def faults(folder: Path) -> list[Fault]:
    return list(diagnose(read_dataset(load_campaign(folder))).faults)


def set_gain(folder: Path, gain: float) -> None:
    design = folder / "rig.yaml"
    design.write_text(design.read_text().replace("gain: 1,", f"gain: {gain:g},"))


@pytest.mark.parametrize("bench", [FORCE, BASE])
def test_a_sound_rig_has_no_fault(tmp_path: Path, bench: Bench) -> None:
    write(bench, tmp_path)
    assert faults(tmp_path) == []


@pytest.mark.parametrize("files", [("b",), ("a", "b")])
@pytest.mark.parametrize(("channel", "gain"), [("z", 1e3), ("az", -1.0), ("z", -1.0)])
def test_the_response_decides_which_channel_is_wrong(
    tmp_path: Path, files: tuple[str, ...], channel: str, gain: float
) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, scale(**{channel: gain}), files)
    [fault] = faults(tmp_path)
    assert fault.channels == (channel,) and fault.value == gain and fault.is_correctable
    checked = examine_data(read_dataset(load_campaign(tmp_path)), correct=True)
    assert checked.is_corrected and not checked.is_stopped


def test_header_units_of_two_systems_are_reported(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, scale(z=1e3), units={"z": "mm"})
    [fault] = faults(tmp_path)
    [warning] = check([tmp_path])
    assert warning.remedy.startswith("add `sensors: {u: {gain: 0.001}}`")
    assert warning.remedy.endswith("or write the columns in SI units, or `gain: 1000` in the design")
    assert warning.message.endswith("; the loop stops here unless `--correct` makes the correction")
    assert fault.serious and "u in N and z in mm" in fault.text and fault.yaml == "sensors: {u: {gain: 0.001}}"
    assert not examine_data(read_dataset(load_campaign(tmp_path)), correct=True).is_stopped
    set_gain(tmp_path, 1e3)
    assert faults(tmp_path) == []


def test_numbers_that_the_nominal_model_fits_need_no_unit(tmp_path: Path) -> None:
    """With the mass in t and the stiffness in N/mm, N and mm go together."""
    write(FORCE, tmp_path)
    rewrite(tmp_path, scale(z=1e3), units={"z": "mm"})
    keys = "mass: 0.095, stiffness: 60, damping: 0.15, gain: 1, input: force"
    (tmp_path / "rig.yaml").write_text(f"name: rig\nvehicle: {{rig: {{{keys}}}}}\n")
    assert faults(tmp_path) == []


def test_an_acceleration_in_g_is_converted_to_go_with_the_motion(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    az = read_dataset(load_campaign(tmp_path)).runs[0].columns["az"]
    rewrite(tmp_path, scale(az=1.0 / 9.80665), units={"az": "g"})
    run = read_dataset(load_campaign(tmp_path)).runs[0]
    assert run.units["az"] == "m/s^2" and run.columns["az"] == pytest.approx(az, rel=1e-6)
    assert faults(tmp_path) == []


def test_noise_of_an_acceleration_in_g_is_converted_too(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, scale(az=1.0 / 9.80665), units={"az": "g"})
    campaign = tmp_path / "campaign.yaml"
    text = campaign.read_text()
    for stated in ("0.1 m/s^2", "0.010197162 g", "0.010197162"):
        lines = [f"noise: {{az: {stated}}}" if x.startswith("noise:") else x for x in text.splitlines()]
        campaign.write_text("\n".join(lines))
        assert load_campaign(tmp_path).noise["az"] == pytest.approx(0.1)


def test_an_absolute_acceleration_is_recognised(tmp_path: Path) -> None:
    write(BASE, tmp_path)
    rewrite(tmp_path, lambda c: c | {"az": c["az"] + c["u"]})
    [fault] = faults(tmp_path)
    assert fault.serious and fault.kind == "absolute" and fault.yaml == "sensors: {az: {leave_out: true}}"
    assert "absolute acceleration" in fault.text
    assert not examine_data(read_dataset(load_campaign(tmp_path)), correct=True).is_stopped


def test_a_driven_rig_without_its_input_is_reported(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, lambda c: {k: x for k, x in c.items() if k != "u"})
    [fault] = faults(tmp_path)
    assert fault.kind == "input" and fault.serious
    design = tmp_path / "rig.yaml"
    design.write_text(design.read_text().replace(", input: force", ""))
    [fault] = faults(tmp_path)
    assert fault.kind == "input" and not fault.serious
    [problem] = check([tmp_path])
    assert problem.severity == "warning" and "no run has an input u" in problem.message
    assert problem.remedy == "record what drives the rig as the column u"


def test_a_force_that_no_model_uses_stops_the_loop(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, lambda c: {("F" if k == "u" else k): x for k, x in c.items()})
    checked = examine_data(read_dataset(load_campaign(tmp_path)))
    assert checked.is_stopped and "input: motion" in checked.remaining.faults[0].remedy


def test_a_free_decay_needs_no_input(tmp_path: Path) -> None:
    write(Bench(free=True, seconds=(4.0, 3.0), rate=500.0, seed=1), tmp_path)
    assert faults(tmp_path) == []


def test_a_record_of_a_part_of_a_cycle_is_warned_of(tmp_path: Path) -> None:
    write(FORCE, tmp_path)
    rewrite(tmp_path, lambda c: {k: x[:60] for k, x in c.items()}, ("b",))
    [fault] = [f for f in faults(tmp_path) if f.kind == "duration"]
    assert fault.files == ("run_b.csv.gz",) and not fault.serious and "less than 2 periods" in fault.text


def test_sample_times_that_jitter_are_no_unit(tmp_path: Path) -> None:
    """No correction cures that the motion and its acceleration contradict each other."""
    write(Bench(seconds=(20.0, 16.0), rate=500.0, seed=1, noise=0.003), tmp_path)
    rng = np.random.default_rng(3)

    def jitter(columns: dict[str, Array]) -> dict[str, Array]:
        at = columns["t"] + 6e-4 * rng.standard_normal(len(columns["t"]))
        return columns | {c: np.interp(at, columns["t"], columns[c]) for c in ("z", "az")}

    rewrite(tmp_path, jitter)
    for fault in faults(tmp_path):
        assert not fault.serious and fault.yaml is None and not fault.alternatives
        assert "no correction makes them agree" in fault.text
    assert faults(tmp_path)
    assert not examine_data(read_dataset(load_campaign(tmp_path))).is_stopped
