"""Runs whose numbers are wrong: `check` finds each fault and names the remedy; sound runs have none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from railui.documents.check import check
from railui.io.table import read_table, write_table
from railui.runs.clipping import ClippingWatch, clipped_samples
from railui.runs.overlap import MIN_SAME_NOISE, same_noise, shared_share
from railui.runs.plausibility import find_spikes

CAMPAIGNS = Path(__file__).parents[2] / "designs/campaigns"
RUN = CAMPAIGNS / "worn_axle_box/run_b.csv.gz"
Columns = dict[str, np.ndarray]


def changed_run(path: Path, change: Callable[[Columns], object]) -> Path:
    table = read_table(RUN)
    columns = {name: table.column(name) for name in table.names}
    change(columns)
    units = dict(zip(table.names, table.units, strict=True))
    return write_table(path, {f"{name} [{units[name]}]": x for name, x in columns.items()}, digits=12)


def set_value(name: str, row: int, value: float) -> Callable[[Columns], object]:
    return lambda columns: columns[name].__setitem__(row, value)


def scale(name: str, factor: float, offset: float = 0.0) -> Callable[[Columns], object]:
    return lambda columns: columns.__setitem__(name, columns[name] * factor + offset)


def clip(name: str, share: float) -> Callable[[Columns], object]:
    return lambda columns: columns.update({name: np.minimum(columns[name], np.quantile(columns[name], share))})


@pytest.mark.parametrize(
    ("change", "severity", "key", "remedy"),
    [
        (scale("v", 4.5), "warning", "v", "write `v [km/h]`"),
        (scale("v", 3.6), "warning", "s", "v is 3.6 times s"),
        (scale("s", 1.5), "warning", "s", "correct the unit of v or s"),
        (set_value("v", 700, 1e308), "error", "v", "write `v [km/h]`"),
        (scale("gauge", 1.0, 1.435), "error", "gauge", "subtract 1.435 m"),
        (scale("phiw", 1500.0), "error", "phiw", "divide it by the distance of the running circles"),
        (scale("ay1", 1000.0), "warning", "ay1", "correct the unit in the header"),
        (set_value("ay1", 700, 5000.0), "warning", "ay1", "empty the cell"),
        (set_value("e1", 700, 1e6), "error", "e1", "empty the cell"),
        (
            lambda c: c.update(ay1=np.minimum(c["ay1"], np.quantile(c["ay1"], 0.995))),
            "warning",
            "ay1",
            "widen the range",
        ),
    ],
)
def test_a_wrong_number_is_found(
    tmp_path: Path, change: Callable[[Columns], object], severity: str, key: str, remedy: str
) -> None:
    path = changed_run(tmp_path / "run.csv", change)
    found = [p for p in check([path]) if p.key == key and p.severity == severity and remedy in p.remedy]
    assert found and found[0].file == str(path) and found[0].line >= 1


def test_a_wrong_number_is_found_in_its_line(tmp_path: Path) -> None:
    path = changed_run(tmp_path / "run.csv", set_value("ay1", 700, 5000.0))
    (problem,) = check([path])
    assert problem.line == 702 and path.read_text().splitlines()[701].split(",")[problem.column - 1 :] is not None
    assert path.read_text().splitlines()[701][problem.column - 1 :].startswith("5000,")


@pytest.mark.parametrize("path", sorted(CAMPAIGNS.glob("*/campaign.yaml")), ids=lambda p: p.parent.name)
def test_the_bundled_campaigns_are_plausible(path: Path) -> None:
    assert check([path]) == []


def test_a_recording_that_serves_estimation_and_validation_is_found(tmp_path: Path) -> None:
    changed_run(tmp_path / "run_a.csv", lambda columns: None)

    def second_half(columns: Columns) -> None:
        for name in columns:
            columns[name] = columns[name][4000:]

    changed_run(tmp_path / "run_b.csv", second_half)
    runs = "[{file: run_a.csv, role: adjust}, {file: run_b.csv, role: validate}]"
    vehicle = CAMPAIGNS.parent / "test_bogie.yaml"
    (tmp_path / "campaign.yaml").write_text(f"name: a\nvehicle: {vehicle}\nruns: {runs}\n")
    (problem,) = [p for p in check([tmp_path / "campaign.yaml"]) if p.severity == "error"]
    assert "shares 100 % of its samples with run_a.csv" in problem.message


def test_a_recording_of_half_the_rate_is_no_second_one(tmp_path: Path) -> None:
    changed_run(tmp_path / "run_a.csv", lambda columns: None)
    changed_run(tmp_path / "run_b.csv", lambda columns: columns.update({k: x[1::2] for k, x in columns.items()}))
    runs = "[{file: run_a.csv, role: adjust}, {file: run_b.csv, role: validate}]"
    vehicle = CAMPAIGNS.parent / "test_bogie.yaml"
    (tmp_path / "campaign.yaml").write_text(f"name: a\nvehicle: {vehicle}\nruns: {runs}\n")
    (problem,) = [p for p in check([tmp_path / "campaign.yaml"]) if p.severity == "error"]
    assert problem.key == "runs.1.file" and "is run_a.csv, whose role is adjust, resampled" in problem.message


def test_coarse_numbers_alone_are_no_shared_samples() -> None:
    random = np.random.default_rng(1)
    a, b = ({"e1": np.round(random.normal(size=5000), 1)} for _ in range(2))
    assert shared_share(a, b) == 0.0
    assert shared_share(a, {"e1": a["e1"][1000:]}) == 1.0


def noisy_pass(seed: int, noise: float = 3e-5, rate: float = 200.0, n: int = 6000, track: int = 0) -> Columns:
    """Two motions of a track below 14 Hz, with hum and noise of their own."""
    t, tones = np.arange(n) / rate, np.random.default_rng(track)
    sensors = np.random.default_rng([1, seed])
    hum = 1e-4 * np.sin(2 * np.pi * 60.0 * t)
    columns = {"t": t}
    for name in ("e1", "ay1"):
        f, phase = tones.uniform(0.3, 14.0, (100, 1)), tones.uniform(0.0, 7.0, (100, 1))
        columns[name] = 1e-3 * np.sin(2 * np.pi * f * t + phase).mean(axis=0) + hum * (noise > 0)
        columns[name] += noise * sensors.standard_normal(n)
    return columns


@pytest.mark.parametrize(
    "copied",
    [
        lambda c: {k: x[1::2] for k, x in c.items()},
        lambda c: {k: np.round(x, 3 if k == "t" else 5) for k, x in c.items()},
        lambda c: {"t": (t := c["t"][:-1] + 1.3e-3), **{k: np.interp(t, c["t"], c[k]) for k in ("e1", "ay1")}},
    ],
    ids=["half rate", "rounded", "resampled"],
)
def test_one_recording_is_known_by_its_noise(copied: Callable[[Columns], Columns]) -> None:
    first = noisy_pass(1)
    assert shared_share(first, copied(first), "bogie") < 0.05
    assert same_noise(first, copied(first), "bogie") > MIN_SAME_NOISE
    assert same_noise(first, copied(noisy_pass(2)), "bogie") == 0.0


def test_neither_one_track_nor_shocks_nor_smooth_motions_are_one_recording() -> None:
    first, second = noisy_pass(1), noisy_pass(2)
    for run in (first, second):
        for name in ("e1", "ay1"):
            run[name][3000] += 10.0
    assert same_noise(first, second, "bogie") == 0.0
    smooth = [noisy_pass(1, noise=0.0, track=k) for k in (3, 4)]
    assert same_noise(*smooth, "bogie") < MIN_SAME_NOISE


def test_one_commanded_motion_of_two_runs_on_a_bench_is_no_shared_recording() -> None:
    random = np.random.default_rng(1)
    z = random.normal(size=2000)
    a, b = ({"z": z, "vz": np.gradient(z), "F": random.normal(size=2000)} for _ in range(2))
    assert shared_share(a, b, "bench") == 0.0
    assert shared_share(a, a, "bench") == 1.0
    assert shared_share({"u": z, "z": z}, {"u": z, "z": z[1000:]}, "rig") == 1.0


def test_clipping_does_not_depend_on_the_division_of_the_stream() -> None:
    random = np.random.default_rng(2)
    x = np.clip(np.convolve(random.normal(size=9000), np.ones(6) / 2.4, "same"), -2.5, 1.5)
    whole = clipped_samples(x)
    assert whole is not None and whole[1] == 1.5
    watch = ClippingWatch(1)
    for part in np.split(x[:, None], np.sort(random.integers(0, x.size, 300))):
        watch.add(part)
    assert watch.clipped() == {0: whole}


@pytest.mark.parametrize(
    "x",
    [
        np.round(40 + np.sin(np.arange(4000) / 300), 2),
        np.zeros(4000),
        np.round(1000 * np.sin(np.arange(4000) / 40)),
        np.random.default_rng(1).normal(size=4000),
        np.repeat(np.arange(40.0), 100),
    ],
    ids=["speed", "zero", "slow sine", "noise", "stairs"],
)
def test_sound_signals_are_neither_clipped_nor_spiked(x: np.ndarray) -> None:
    assert clipped_samples(x) is None and find_spikes(x) is None
