"""A channel of a rig or a component with another unit in one run."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.faults import units_of_runs as module
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Fault
from railui.campaign.segment import Segment
from railui.campaign.settings.faults import FaultSettings
from tests.truth.rig import Bench, write

Records = dict[str, list[Segment]]


def units_of_runs(runs: Records) -> list[Fault]:
    return module.units_of_runs(runs, FaultSettings())


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    """Simulated rig with two runs."""
    folder = tmp_path_factory.mktemp("rig")
    write(Bench(seconds=(8.0, 6.0), rate=500.0, seed=1), folder)
    return read_dataset(load_campaign(folder))


def three_runs(dataset: Dataset) -> Records:
    """The runs of a rig, and a third that repeats the first with 1.5 times the motion, as a law may have it."""
    first, second = (next(s for s in dataset.segments if s.run_index == i) for i in (0, 1))
    more = changed(first, lambda c, x: 1.5 * x if c in first.channels else x)
    return {"a.csv": [first], "b.csv": [second], "c.csv": [more]}


def changed(segment: Segment, change: Callable[[str, FloatArray], FloatArray]) -> Segment:
    return replace(segment, columns={c: change(c, x) for c, x in segment.columns.items()}, tables={})


def scaled(runs: Records, run: str, gains: Mapping[str, float]) -> Records:
    return runs | {run: [changed(s, lambda c, x: gains.get(c, 1.0) * x) for s in runs[run]]}


def test_runs_of_equal_units_have_no_fault(rig: Dataset) -> None:
    assert units_of_runs(three_runs(rig)) == []
    assert not diagnose(rig).serious


@pytest.mark.parametrize(("gain", "size"), [(1e3, "1000 times too large"), (1e-2, "100 times too small")])
def test_the_unit_of_a_channel_in_one_of_three_runs_is_named(rig: Dataset, gain: float, size: str) -> None:
    runs = three_runs(rig)
    channel, *others = runs["a.csv"][0].channels
    [fault] = units_of_runs(scaled(runs, "b.csv", {channel: gain}))
    assert fault.serious and fault.kind == "unit" and size in fault.text and fault.files == ("b.csv",)
    assert fault.yaml == f"sensors: {{{channel}: {{gain: {gain:g}, runs: [b.csv]}}}}"
    assert fault.is_correctable is bool(others)  # of a single channel the input may be wrong as well


def test_channels_that_are_off_alike_blame_their_input(rig: Dataset) -> None:
    runs = three_runs(rig)
    assert len(runs["a.csv"][0].channels) == 2
    [fault] = units_of_runs(scaled(runs, "a.csv", {"u": 1e-3}))
    assert fault.yaml == "sensors: {u: {gain: 0.001, runs: [a.csv]}}" and fault.is_correctable


def test_of_two_runs_either_may_be_wrong(rig: Dataset) -> None:
    runs = {name: some for name, some in three_runs(rig).items() if name != "c.csv"}
    channel = runs["a.csv"][0].channels[0]
    [fault] = units_of_runs(scaled(runs, "a.csv", {channel: 1e3}))
    assert fault.files == ("b.csv",) and not fault.is_correctable
    assert f"sensors: {{{channel}: {{gain: 1000, runs: [a.csv]}}}}" in fault.alternatives


def test_inputs_without_a_common_frequency_are_not_compared(rig: Dataset) -> None:
    t = np.arange(4000) * 0.002
    template = three_runs(rig)["a.csv"][0]

    def sine(f: float, gain: float) -> list[Segment]:
        u = np.sin(2.0 * np.pi * f * t)
        return [replace(template, columns={"t": t, "u": u} | {c: gain * u for c in template.channels}, tables={})]

    assert units_of_runs({"a": sine(2.0, 1.0), "b": sine(40.0, 1e-3)}) == []
    assert len(units_of_runs({"a": sine(2.0, 1.0), "b": sine(2.0, 1e-3)})) == 1


def test_a_run_in_another_unit_is_a_fault_of_the_data(tmp_path: Path) -> None:
    write(Bench(seconds=(8.0, 6.0), rate=500.0, seed=1, columns=("z",)), tmp_path)
    path = max(tmp_path.glob("*.csv.gz"))
    header, *lines = gzip.decompress(path.read_bytes()).decode().splitlines()
    at = next(i for i, name in enumerate(header.split(",")) if name.split()[0] == "z")
    rows = [line.split(",") for line in lines]
    for row in rows:
        row[at] = repr(1e3 * float(row[at]))
    path.write_bytes(gzip.compress("\n".join([header, *map(",".join, rows)]).encode()))
    [fault] = diagnose(read_dataset(load_campaign(tmp_path))).serious
    assert (fault.kind, fault.channels) == ("unit", ("z",))
