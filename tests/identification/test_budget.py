"""Time budget of the loop: each stage ends where the clock says so, with the best answer so far."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from railui.arrays import FloatArray
from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.core import Batch, Vehicles
from railui.identification import context as context_module
from railui.identification.context import OutOfTimeError, create_context
from railui.identification.estimation.calibration import fit_without_iteration
from railui.identification.loop import close_loop
from railui.identification.unmodelled.condition_dependence import dependence_on_conditions
from railui.progress import Progress
from railui.report.loop.data import loop_report
from tests.identification.test_component_campaign import campaign

BUNDLED = Path(__file__).parents[2] / "designs" / "campaigns" / "worn_axle_box"
WHOLE_LOOP = 1e8  # input rows times vehicles that the kernel steps through in a loop without a budget
MAX_SHARE_AFTER_END = 0.05  # of these: noise floors, validations and the independent test


class CountingClock:
    """Clock that advances by a second at every reading, so that a budget ends at the same check on any machine."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        """Return the time [s]."""
        self.now += 1.0
        return self.now


@pytest.fixture(scope="module")
def dataset() -> Dataset:
    """The bundled campaign, read once."""
    return read_dataset(load_campaign(BUNDLED))


# in the calibration, in the score test, and after the effect was found
@pytest.mark.parametrize(("checks", "verdict"), [(3, "outside"), (100, "outside"), (155, "effect")])
def test_a_budget_ends_every_stage(dataset: Dataset, monkeypatch: pytest.MonkeyPatch, checks: int, verdict: str):
    clock = CountingClock()
    rows_after_end = 0
    simulate = Vehicles.simulate

    def counted(self: Vehicles, batch: Batch, table: FloatArray, *args: Any, **options: Any) -> Any:
        nonlocal rows_after_end
        rows_after_end += len(table) * len(batch) * (clock.now > 1.0 + checks)
        return simulate(self, batch, table, *args, **options)

    monkeypatch.setattr(context_module, "time", clock)
    monkeypatch.setattr(Vehicles, "simulate", counted)
    result = close_loop(dataset, jobs=1, budget=float(checks))
    assert result.is_out_of_time and result.verdict == verdict
    assert 0 < rows_after_end <= MAX_SHARE_AFTER_END * WHOLE_LOOP
    assert result.validations["after"].nrmse <= result.validations["declared"].nrmse
    report = loop_report(result)
    assert report["out_of_time"] and report["sentence"].startswith("The time budget ended before the search")


def test_estimates_that_the_budget_ends_are_no_dependence_on_a_condition(tmp_path: Path):
    texts: list[str] = []

    class Texts(Progress):
        def message(self, text: str) -> None:
            texts.append(text)

    bench = read_dataset(load_campaign(campaign(tmp_path / "bench", {"0 A": 40.0, "1 A": 150.0})))
    context = create_context(bench, jobs=1, progress=Texts(), budget=0.0)
    assert dependence_on_conditions(context, fit_without_iteration(context, context.nominal)) is None
    assert texts == ["no dependence on conditions estimated: the time budget is spent"]


def test_the_search_alone_has_a_deadline(dataset: Dataset):
    spent = create_context(dataset, budget=0.0)
    assert spent.is_out_of_time and not spent.without_deadline().is_out_of_time
    with pytest.raises(OutOfTimeError):
        spent.check_time()
    spent.without_deadline().check_time()
