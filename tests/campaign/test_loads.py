"""Runs of a campaign in load states of their design: an empty and a laden run of one vehicle of bodies."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.documents.saving import campaign_text
from railui.identification.context import create_context
from railui.identification.estimation.validation import validate
from railui.identification.loop import calibrate_only
from railui.identification.prediction import Predictor
from railui.identification.result import LoopResult
from railui.io.problems import FileProblems
from railui.report.loop.files import write_simulated
from tests.truth.files import write_run
from tests.truth.tracks import met

DESIGN = Path(__file__).parents[2] / "designs" / "bogie_under_coach.yaml"
LADEN = {"vehicle.bodies.body.mass": 24000.0, "vehicle.elements.wheelset.wheel_load": 75e3}
LOAD = "load:\n  empty: {}\n  laden: {vehicle.bodies.body.mass: 24 t, vehicle.elements.wheelset.wheel_load: 75 kN}\n"
DAMPING = "vehicle.elements.secondary_damper.lateral_damping"
TRUE_DAMPING = 21e3  # N*s/m; 16e3 declared
UNITS = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad", "ay.body": "m/s^2", "ayf": "m/s^2", "d1": "m"}
NOISE = {"ay.body": 0.02, "ayf": 0.05, "d1": 2e-5, "yw": 1e-6, "phiw": 1e-6}


def write_texts(folder: Path, *, loads: bool) -> None:
    (folder / "vehicle.yaml").write_text(DESIGN.read_text("utf-8") + LOAD, "utf-8")
    runs = [
        ("run_a.csv.gz", "adjust", "laden"),
        ("run_b.csv.gz", "adjust", "empty"),
        ("run_c.csv.gz", "validate", "laden"),
    ]
    entries = [{"file": f, "role": role, **({"load": state} if loads else {})} for f, role, state in runs]
    text = {"vehicle": "vehicle.yaml", "runs": entries, "adjust": [DAMPING], "noise": NOISE}
    (folder / "campaign.yaml").write_text(yaml.safe_dump(text, sort_keys=False), "utf-8")


def read(folder: Path) -> Dataset:
    return read_dataset(load_campaign(folder))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs simulated by the vehicle in its state of each, a laden, an empty and a laden one, with noise."""
    folder = tmp_path_factory.mktemp("loads")
    rng = np.random.default_rng(3)
    for k, letter in enumerate("abc"):
        run = met((34.0, 38.0, 30.0)[k], 16.0, 40 + k, "low", rate=200.0, before=0.0, spread=0.5)
        columns = {"t": run.t, "s": run.s, "v": run.v, "yw": run.yw, "phiw": run.phiw}
        empty = {name: 1e-3 * rng.standard_normal(len(run.t)) for name in ("ay.body", "ayf", "d1")}
        write_run(folder / f"run_{letter}.csv.gz", columns | empty, UNITS)
    write_texts(folder, loads=True)
    dataset = read(folder)
    true = create_context(dataset).nominal.with_path_values([DAMPING], [TRUE_DAMPING])
    for letter, segment, state in zip("abc", dataset.segments, (LADEN, {}, LADEN), strict=True):
        # the numbers of the state are given here one by one, not by its name
        model = true.with_path_values(list(state), list(state.values()))
        names = ["ay.body", "ayf", "d1"]
        series = Predictor(model, replace(segment, load=None)).simulate(names).series[0]
        noisy = {c: x + NOISE[c] * rng.standard_normal(len(x)) for c, x in zip(names, series, strict=True)}
        columns = {c: segment.columns[c] for c in ("t", "s", "v", "yw", "phiw")}
        write_run(folder / f"run_{letter}.csv.gz", columns | noisy, UNITS)
    return folder


@pytest.fixture(scope="module")
def result(folder: Path) -> LoopResult:
    write_texts(folder, loads=True)
    return calibrate_only(read(folder))


def test_an_empty_and_a_laden_run_give_one_damping_at_the_noise_floor(result: LoopResult) -> None:
    (damping, sd), floor = (result.after.x[0], result.after.sd[0]), result.noise_floor.nrmse
    assert damping == pytest.approx(TRUE_DAMPING, abs=4 * sd) and sd < 0.02 * TRUE_DAMPING
    assert result.validations["after"].nrmse < 1.1 * floor


def test_simulated_channels_begin_where_the_track_is_known(result: LoopResult, tmp_path: Path) -> None:
    write_simulated(result, tmp_path)
    for run, segment in zip(result.dataset.runs, result.dataset.segments, strict=True):
        lines = gzip.decompress((tmp_path / f"simulated_{run.file.name}").read_bytes()).decode().splitlines()[1:]
        missing = len(lines) - segment.samples
        assert missing > 0 and segment.columns["t"][0] == pytest.approx(float(lines[missing].split(",")[0]))
        assert all(set(line.split(",")[1:]) == {""} for line in lines[:missing])
        assert all(all(line.split(",")) for line in lines[missing:])


def test_without_their_load_states_the_same_runs_do_not_fit(folder: Path) -> None:
    write_texts(folder, loads=True)
    context = create_context(read(folder))
    stated = validate(context, context.nominal, context.dataset.validation).nrmse
    write_texts(folder, loads=False)
    context = create_context(read(folder))
    assert validate(context, context.nominal, context.dataset.validation).nrmse > 1.2 * stated


def test_a_load_state_is_kept_in_the_file_that_the_loop_writes(folder: Path) -> None:
    write_texts(folder, loads=True)
    entries = yaml.safe_load(campaign_text(load_campaign(folder), folder))["runs"]
    assert [entry["load"] for entry in entries] == ["laden", "empty", "laden"]


def test_a_load_state_that_the_design_lacks_is_named(folder: Path) -> None:
    write_texts(folder, loads=True)
    text = (folder / "campaign.yaml").read_text("utf-8")
    (folder / "campaign.yaml").write_text(text.replace("load: laden", "load: ladn", 1), "utf-8")
    with pytest.raises(FileProblems, match="no load state 'ladn'"):
        load_campaign(folder)


def test_a_number_that_the_load_changes_is_not_estimated(folder: Path) -> None:
    write_texts(folder, loads=True)
    text = (folder / "campaign.yaml").read_text("utf-8")
    mass = "vehicle.bodies.body.mass"
    (folder / "campaign.yaml").write_text(text.replace(f"- {DAMPING}", f"- {DAMPING}\n- {mass}"), "utf-8")
    with pytest.raises(FileProblems, match="changes with the load"):
        load_campaign(folder)
