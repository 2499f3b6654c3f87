"""The loop: bundled campaign, no effect, excluded effects; its numbers recomputed with numpy and scipy."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import read_dataset
from railui.identification.loop import calibrate_only, close_loop
from railui.identification.result import LoopResult
from railui.report.loop.data import loop_report
from railui.report.loop.files import write_simulated
from tests.blind.simulated import simulated_campaign
from tests.docs.results import rows_of, superfluous_rows, undocumented_keys

ROOT = Path(__file__).parents[2]
BUNDLED = ROOT / "designs" / "campaigns" / "worn_axle_box"
SHARED = ROOT.parent / "shared" / "runs"
CLEARANCE = "free_play at=primary_lateral half_width=4e-4"
CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")
KEYS = {
    "schema", "version", "seed", "simd", "seconds", "campaign", "runs", "declared", "before", "after", "floor",
    "unexplained", "verdict", "effects", "outside", "classes", "ranking", "traces", "detectable", "means", "riding",
    "parameters", "explained", "remainder", "test", "conditions", "corrections", "prior", "rivals", "next_runs",
}  # fmt: skip
# for the reader: provenance, summary, cost and notes
READER_KEYS = {
    "profiles",
    "settings",
    "windows",
    "pairs",
    "inputs",
    "date",
    "data",
    "sentence",
    "cautions",
    "simulations",
    "notes",
    "gate",
    "identifiability",
    "leave_one_run_out",
    "out_of_time",
    "nominal_effects",
    "groups",
}


@dataclass(frozen=True)
class ClosedLoop:
    """Result of the loop on the bundled campaign, its report, and the directory of its simulated channels."""

    result: LoopResult
    report: dict[str, Any]
    directory: Path


@pytest.fixture(scope="module")
def closed(tmp_path_factory: pytest.TempPathFactory) -> ClosedLoop:
    result = close_loop(read_dataset(load_campaign(BUNDLED)), jobs=2)
    directory = tmp_path_factory.mktemp("loop")
    write_simulated(result, directory)
    report = json.loads(json.dumps(loop_report(result), allow_nan=False))
    return ClosedLoop(result, report, directory)


def numbers(data: Any) -> Iterator[float]:
    if isinstance(data, dict):
        data = list(data.values())
    if isinstance(data, list):
        for x in data:
            yield from numbers(x)
    elif isinstance(data, float):
        yield data


def test_the_worn_axle_box_has_clearance_on_both_wheelsets(closed: ClosedLoop):
    assert closed.report["verdict"] == "effect"
    (effect,) = closed.report["effects"]
    assert (effect["kind"], effect["at"], effect["wheelset"]) == ("free_play", "primary_lateral", None)
    half_width = effect["parameters"]["half_width"]
    assert half_width["unit"] == "m"
    assert 0.0 < half_width["sd"] < 0.05 * half_width["value"]


def test_with_the_clearance_the_error_reaches_the_noise_floor(closed: ClosedLoop):
    r = closed.report
    assert r["after"]["nrmse"] <= 1.10 * r["floor"]["nrmse"]
    assert r["after"]["nrmse"] < 0.5 * r["before"]["nrmse"] < 0.5 * r["declared"]["nrmse"]
    assert r["unexplained"] == pytest.approx(r["after"]["nrmse"] / r["floor"]["nrmse"])


def test_the_clearance_explains_the_error_beyond_noise(closed: ClosedLoop):
    r = closed.report
    squares = {key: r[key]["nrmse"] ** 2 for key in ("before", "after", "floor")}
    share = (squares["before"] - squares["after"]) / (squares["before"] - squares["floor"])
    assert r["explained"]["value"] == pytest.approx(min(share, 1.0))
    assert 0.0 < r["explained"]["standard_error"] < 0.05
    assert r["remainder"]["ratio"] == pytest.approx(max(1.0 - share, 0.0), abs=1e-9)


def test_the_last_third_of_the_validation_run_is_an_independent_test(closed: ClosedLoop):
    dataset, test = closed.result.dataset, closed.report["test"]
    assert test["held_back"] and test["files"] == ["run_b.csv.gz"]
    assert sum(s.samples for s in dataset.test) == pytest.approx(dataset.validation[0].samples / 3, abs=1)
    assert test["nrmse_after"] < 1.2 * test["floor"] < 0.3 * test["nrmse_before"]


def test_the_report_has_the_documented_keys(closed: ClosedLoop):
    r = closed.report
    assert set(r) == KEYS | READER_KEYS
    assert r["schema"] == "railui.loop/1"
    assert set(r["declared"]) == set(r["after"]) == {"nrmse", "channels"}
    assert set(r["before"]) == {"nrmse", "channels", "constrained", "failed"}
    assert set(r["floor"]) == {"nrmse", "sd", "channels", "sensors_only", "source", "interval", "noise"}
    assert {"file", "role", "sha256", "samples", "stretches"} <= set(r["runs"][0])
    assert all(set(x) == {"declared", "before", "value", "sd", "unit", "flag"} for x in r["parameters"].values())
    assert all(set(x) == {"kind", "at", "wheelset", "rho", "nrmse", "refitted", "weight"} for x in r["ranking"])
    assert all({"kind", "at", "wheelset", "parameter", "value", "unit", "power"} <= set(x) for x in r["detectable"])
    assert set(r["riding"]) == {"measured", "declared", "before", "after"}


def test_keys_of_the_report_and_rows_of_the_docs_agree(closed: ClosedLoop):
    rows = rows_of("loop")
    assert undocumented_keys([closed.report], rows) == []
    assert superfluous_rows([closed.report], rows) == []


def test_every_number_of_the_report_is_finite(closed: ClosedLoop):
    result = list(numbers(closed.report))
    assert len(result) > 300
    assert all(math.isfinite(x) for x in result)


def test_the_ranking_includes_no_effect_and_its_weights_sum_to_one(closed: ClosedLoop):
    rows = closed.report["ranking"]
    assert [r["kind"] for r in rows].count("none") == 1
    assert rows[0]["kind"] == "free_play"
    assert sum(r["weight"] for r in rows) == pytest.approx(1.0)
    assert len({(r["kind"], r["at"], r["wheelset"]) for r in rows}) == len(rows)


def test_the_class_of_indistinguishable_kinds_contains_clearance(closed: ClosedLoop):
    classes = closed.report["classes"]
    assert classes and all("free_play" in kinds for kinds in classes)


def recompute_nrmse(simulated: Path, run: Path, which: str) -> float:
    """Compute the NRMSE from the written files with numpy and scipy only."""
    x, z = (np.genfromtxt(path, delimiter=",", names=True, deletechars="") for path in (run, simulated))
    rate = 1.0 / np.median(np.diff(z["t"]))
    sos = signal.butter(4, [0.3, min(40.0, 0.45 * rate)], "bandpass", fs=rate, output="sos")
    cut = round(2.0 * rate)
    squares = []
    for channel in CHANNELS:
        name = next(n for n in x.dtype.names if n.split("[")[0].strip(" _") == channel)
        measured, model = (signal.sosfiltfilt(sos, y)[cut:-cut] for y in (x[name], z[f"{which}.{channel}"]))
        squares.append(np.sum((measured - model) ** 2) / np.sum(measured**2))
    return float(np.sqrt(np.mean(squares)))


@pytest.mark.parametrize("which", ["declared", "before", "after"])
def test_the_error_can_be_recomputed_from_the_written_files(closed: ClosedLoop, which: str):
    simulated = closed.directory / "simulated_run_b.csv.gz"
    assert recompute_nrmse(simulated, BUNDLED / "run_b.csv.gz", which) == pytest.approx(
        closed.report[which]["nrmse"], rel=1e-6
    )


def test_the_estimation_run_is_written_as_well(closed: ClosedLoop):
    simulated = closed.directory / "simulated_run_a.csv.gz"
    assert recompute_nrmse(simulated, BUNDLED / "run_a.csv.gz", "after") < 0.5 * recompute_nrmse(
        simulated, BUNDLED / "run_a.csv.gz", "before"
    )


def test_without_an_unmodelled_effect_none_is_reported():
    case = simulated_campaign()
    result = close_loop(case.dataset, jobs=2)
    report = loop_report(result)
    assert result.verdict == report["verdict"] == "none"
    assert report["effects"] == [] and report["outside"] is None and report["classes"] == []
    assert report["after"] == {k: report["before"][k] for k in ("nrmse", "channels")}
    assert report["after"]["nrmse"] < 1.02 * case.true_error
    assert {r["kind"] for r in report["detectable"]} >= {"free_play", "dry_friction"}


def test_a_calibration_alone_has_the_estimates_of_a_loop_that_adds_nothing():
    dataset = simulated_campaign().dataset
    alone, loop = (calibrate_only(dataset, jobs=2).after, close_loop(dataset, jobs=2).after)
    assert np.array_equal(alone.x, loop.x) and np.array_equal(alone.covariance, loop.covariance)


@pytest.mark.slow
def test_with_the_effect_excluded_a_discrepancy_remains():
    result = close_loop(
        simulated_campaign(CLEARANCE).dataset, without=("free_play", "bump_stop", "cubic_stiffness"), jobs=2
    )
    outside = (
        result.verdict == "outside" and result.discrepancy is not None and result.discrepancy.at == "primary_lateral"
    )
    assert outside or result.error_to_noise > 1.5
    assert not any(e.kind in ("free_play", "bump_stop", "cubic_stiffness") for e in result.after.model.effects)
    assert undocumented_keys([loop_report(result)], rows_of("loop")) == []


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="no shared campaigns next to the repository")
@pytest.mark.parametrize(
    "name", ["blind_a", "blind_b", "low_adhesion", "nothing_missing", "stiff_friction", "worn_axle_box"]
)
def test_the_shared_campaigns_end_at_their_noise_floor(name: str):
    result = close_loop(read_dataset(load_campaign(SHARED / name)), jobs=2)
    if name == "nothing_missing":
        assert result.verdict == "none"
    assert result.validations["after"].nrmse <= 1.10 * result.noise_floor.nrmse


def test_a_time_budget_ends_the_search_with_a_marked_answer():
    dataset = read_dataset(load_campaign(BUNDLED))
    report = loop_report(close_loop(dataset, jobs=2, budget=0.5))
    assert report["out_of_time"] and report["effects"] == [] and report["outside"] is None
    assert report["verdict"] == "outside" and report["before"]["nrmse"] > 2.0 * report["floor"]["nrmse"]
    assert report["sentence"].startswith("The time budget ended before the search: best answer so far.")
