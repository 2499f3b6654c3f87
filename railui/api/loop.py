"""Loop: calibration of a nominal vehicle and identification of unmodelled effects."""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from railui.api.campaign import as_campaign
from railui.api.design import Design
from railui.api.display import Summarised, SummaryRow, draw_on, shown_value
from railui.api.fit import Fit, adjust_report
from railui.api.residual import Residual
from railui.campaign.campaign import Campaign as MeasuredCampaign
from railui.identification.loop import METHODS, close_loop
from railui.identification.result import LoopResult
from railui.progress import SILENT, Progress
from railui.report.loop.data import loop_report
from railui.report.loop.data_faults import CheckedData, data_fault_report, examine_data

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

    from railui.campaign.noise.model import NoiseModel


class EffectParameter(NamedTuple):
    """Parameter of an identified effect: value and standard deviation (None: not estimated) in a unit."""

    value: float
    sd: float | None
    unit: str


class IdentifiedEffect(NamedTuple):
    """Effect that the loop added: kind, location, wheelset (None: all) and parameters by key."""

    kind: str
    at: str
    wheelset: int | None
    parameters: Mapping[str, EffectParameter]


class RankedCandidate(NamedTuple):
    """Candidate effect: kind, location, partial correlation, cross-validation NRMSE and bootstrap selection frequency.

    is_refitted: False where the NRMSE is a linear estimate. kind "none": the model without an effect.
    """

    kind: str
    at: str | None
    wheelset: int | None
    rho: float | None
    nrmse: float | None
    is_refitted: bool
    weight: float | None


@dataclass(frozen=True, eq=False)
class Loop(Summarised):
    """Calibrated vehicle, identified effects and verdict of a campaign; `Campaign.loop` computes it.

    Attributes
    ----------
    data : mapping
        The report of `railui.loop`.
    checked : CheckedData or None
        Diagnosis of the data; None of a loop that was stored without it.
    result : LoopResult or None
        Everything that the identification computed; None where a data fault stopped it.
    """

    data: Mapping[str, Any] = field(repr=False)
    checked: CheckedData | None = field(repr=False)
    result: LoopResult | None = field(repr=False)

    @property
    def verdict(self) -> str:
        """none, effect, partial, outside or data."""
        return str(self.data["verdict"])

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        return str(self.data["sentence"])

    @property
    def effects(self) -> tuple[IdentifiedEffect, ...]:
        """Effects that were added to the nominal vehicle."""
        return tuple(
            IdentifiedEffect(
                effect["kind"],
                effect["at"],
                effect["wheelset"],
                {key: EffectParameter(p["value"], p["sd"], p["unit"]) for key, p in effect["parameters"].items()},
            )
            for effect in self.data["effects"]
        )

    @property
    def discrepancy(self) -> Mapping[str, Any] | None:
        """Discrepancy that no effect of the catalogue explains: location, force curve, variation; None without one."""
        outside: Mapping[str, Any] | None = self.data["outside"]
        return outside

    @property
    def candidates(self) -> tuple[RankedCandidate, ...]:
        """Candidate effects and the model without an effect, the added one and then the best first."""
        keys = ("kind", "at", "wheelset", "rho", "nrmse", "refitted", "weight")
        return tuple(RankedCandidate(*(row[key] for key in keys)) for row in self.data["ranking"])

    @property
    def nrmse(self) -> float | None:
        """NRMSE of the final model on the validation runs."""
        return shown_value(self.data["after"], "nrmse")

    @property
    def nrmse_before(self) -> float | None:
        """NRMSE of the calibrated model without effects on the validation runs."""
        return shown_value(self.data["before"], "nrmse")

    @property
    def nominal_nrmse(self) -> float | None:
        """NRMSE of the nominal vehicle on the validation runs."""
        return shown_value(self.data["declared"], "nrmse")

    @property
    def noise_floor(self) -> float | None:
        """NRMSE that noise alone leaves on the validation runs."""
        return shown_value(self.data["floor"], "nrmse")

    @property
    def noise_model(self) -> NoiseModel:
        """Noise of every column: stated and estimated level, and colour; as a mapping, the level used."""
        return self._result().context.noise

    @cached_property
    def fit(self) -> Fit:
        """Estimates with the selected effects; RuntimeError where a data fault stopped the loop."""
        return Fit(self._result(), adjust_report(self.data, METHODS[0]), "after")

    @cached_property
    def fit_before(self) -> Fit:
        """Estimates without effects; RuntimeError where a data fault stopped the loop."""
        return Fit(self._result(), adjust_report(self.data, METHODS[0]), "before")

    @property
    def design(self) -> Design:
        """The calibrated vehicle with the identified effects and the covariance of its parameters."""
        return self.fit.design

    def residuals(self, role: str = "validation") -> tuple[Residual, ...]:
        """Return the residual series of the final model; parameters and exceptions as `Fit.residuals`."""
        return self.fit.residuals(role)

    def save(self, directory: str | Path, log: Sequence[str] = ()) -> Path:
        """Write the files of `railui loop -o DIR`: report, calibrated design, campaign, simulated channels.

        Raises
        ------
        ForeignFilesError
            Where the directory contains files that a loop did not write (a ValueError).
        """
        from railui.report.loop.data_faults import write_data_fault
        from railui.report.loop.files import check_directory, write_loop

        home = Path(directory)
        check_directory(home)
        if self.result is None and self.checked is not None:
            write_data_fault(self.checked, self.data, home, [*log, self.sentence])
        else:
            write_loop(self._result(), self.data, home, [*log, self.sentence])
        return home

    def save_element(self, path: str | Path) -> Path:
        """Write the component of a bench campaign as an element that a design mounts; return the path.

        Raises
        ------
        NoElementError
            Where the runs have other units than a motion and its force (a ValueError).
        RuntimeError
            Where a data fault stopped the loop.
        """
        from railui.report.loop.element_file import write_element

        return write_element(self._result(), path)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON document that `railui loop` writes: every number finite or None."""
        return dict(self.data)

    def to_frame(self) -> pandas.DataFrame:
        """Return the candidates, one row each; ImportError without pandas."""
        from railui.api.frames import frame_of_rows

        return frame_of_rows([candidate._asdict() for candidate in self.candidates])

    def plot_errors(self, ax: Axes | None = None) -> Axes:
        """Draw the NRMSE of every channel: nominal, calibrated, with effects, noise floor."""
        from railui.report.loop.figures import draw_error_bars

        self._result()
        return draw_on(ax, lambda on: draw_error_bars(on, self.data))

    def plot_series(self, channel: str, ax: Axes | None = None) -> Axes:
        """Draw the excerpt of a validation run on which the effects lower the error most: measured, before, after."""
        from railui.report.loop.figures import series_drawing

        return self._draw_channel(series_drawing, channel, ax)

    def plot_spectrum(self, channel: str, ax: Axes | None = None) -> Axes:
        """Draw the power spectral density of a channel on a validation run: measured, before, after."""
        from railui.report.loop.figures import spectrum_drawing

        return self._draw_channel(spectrum_drawing, channel, ax)

    def _draw_channel(self, drawing: Any, channel: str, ax: Axes | None) -> Axes:
        from railui.io.problems import suggest_name
        from railui.report.loop.figures import compared_series, most_informative_window

        result = self._result()
        window = most_informative_window(result)
        if channel not in window.segment.channels:
            raise KeyError(f"{channel!r} is not measured: {suggest_name(channel, window.segment.channels)}")
        _, _, draw = drawing(result, window, compared_series(result, window.index), channel)
        return draw_on(ax, draw)

    def _result(self) -> LoopResult:
        if self.result is None:
            raise RuntimeError(f"the loop stopped before any fit: {self.sentence}")
        return self.result

    def summary_title(self) -> str:
        """Return campaign and verdict."""
        return f"loop of {self.data['campaign']}: {self.verdict}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the sentence, the errors and the effects."""
        errors = {
            "NRMSE, nominal": self.nominal_nrmse,
            "NRMSE, calibrated": self.nrmse_before,
            "NRMSE, with effects": self.nrmse,
            "noise floor": self.noise_floor,
        }
        rows = [SummaryRow("verdict", self.sentence), *(SummaryRow(name, value) for name, value in errors.items())]
        for effect in self.effects:
            place = effect.at if effect.wheelset is None else f"{effect.at} {effect.wheelset}"
            for key, parameter in effect.parameters.items():
                rows.append(SummaryRow(f"{effect.kind} at {place}, {key}", parameter.value, parameter.unit))
        return rows

    def summary_notes(self) -> Sequence[str]:
        """Return the notes of the report."""
        return [str(note) for note in self.data["notes"]]


def loop(
    campaign: MeasuredCampaign | str | Path,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    correct: bool = False,
    accept_data: bool = False,
    progress: Progress = SILENT,
    budget: float | None = None,
) -> dict[str, Any]:
    """Calibrate the model of a campaign, identify an unmodelled effect and return the loop report as data.

    Parameters
    ----------
    campaign : str, Path or Campaign
        Directory or file of the campaign, or the campaign as loaded.
    without : collection of str, optional
        Kinds of effects that are excluded from the structure detection.
    seed : int, optional
        Seed of the random signs of the tests and of the ranking; noise realisations have fixed seeds.
    jobs : int, optional
        Number of threads; all processors by default.
    correct : bool, optional
        Correct data faults and go on, where each has one correction.
    accept_data : bool, optional
        Go on despite data faults.
    progress : Progress, optional
        Receiver of messages and intermediate results.
    budget : float, optional
        Time [s] after which the search ends with the best answer so far; none by default.

    Returns
    -------
    dict
        The keys of railui.loop/1, documented in docs/results.md.

    Raises
    ------
    FileProblems
        If a file cannot be used.

    References
    ----------
    Broersen 1976.
    """
    return run_loop(
        campaign,
        without=without,
        seed=seed,
        jobs=jobs,
        correct=correct,
        accept_data=accept_data,
        progress=progress,
        budget=budget,
    ).to_dict()


def run_loop(
    campaign: MeasuredCampaign | str | Path,
    *,
    without: Collection[str] = (),
    seed: int = 0,
    jobs: int | None = None,
    correct: bool = False,
    accept_data: bool = False,
    progress: Progress = SILENT,
    budget: float | None = None,
) -> Loop:
    """Calibrate the model of a campaign and identify unmodelled effects; parameters and exceptions as `railui.loop`."""
    started = time.perf_counter()
    dataset = as_campaign(campaign).dataset
    checked = examine_data(dataset, correct=correct, accept_data=accept_data, jobs=jobs, progress=progress)
    if checked.is_stopped:
        return Loop(data_fault_report(checked, seed), checked, None)
    result = close_loop(
        checked.dataset,
        without=without,
        seed=seed,
        jobs=jobs,
        progress=progress,
        budget=None if budget is None else max(started + budget - time.perf_counter(), 0.0),
        diagnosis=checked.remaining,
    )
    return Loop(loop_report(result, checked), checked, result)
