"""Measurement campaign: nominal model, runs with their roles, noise; built of files or of runs."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from railui.api.campaign_files import RunLike, roled_runs, write_campaign_files
from railui.api.design import Design, as_design
from railui.api.display import Summarised, SummaryRow
from railui.campaign.campaign import Campaign as MeasuredCampaign
from railui.campaign.campaign import load_campaign
from railui.io.problems import FileProblems
from railui.progress import SILENT, Progress
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    from railui.api.fit import Fit
    from railui.api.loop import Loop
    from railui.campaign.dataset import Dataset
    from railui.campaign.noise.model import NoiseModel
    from railui.io.problems import Problem


@dataclass(frozen=True)
class Campaign(MeasuredCampaign, Summarised):
    """Measurement campaign: a nominal vehicle and its measured runs.

    It is built by `load` or `from_runs`.

    Attributes
    ----------
    name : str
    directory : Path
        Directory of campaign.yaml.
    design : Design
        Nominal vehicle.
    runs : tuple of RunEntry
        File, role and conditions of each run.
    noise : mapping
        Stated standard deviation per column.
    estimated_parameters : tuple of str
        Paths of the parameters to estimate.
    band : (float, float) or None
        Band [Hz] of the comparison.
    settings : LoopSettings
        Thresholds of the loop.
    warnings : tuple of Problem

    Examples
    --------
    >>> campaign = Campaign.load("designs/campaigns/worn_axle_box")
    >>> campaign.name, [run.role for run in campaign.runs], campaign.band
    ('worn axle box', ['adjust', 'validate'], (0.3, 40.0))
    """

    _folder: object = field(default=None, compare=False, repr=False)  # removed with the campaign

    @classmethod
    def of(cls, campaign: MeasuredCampaign) -> Self:
        """Return a campaign as this class."""
        if isinstance(campaign, cls):
            return campaign
        values = {item.name: getattr(campaign, item.name) for item in fields(MeasuredCampaign)}
        return cls(**values | {"design": Design.of(campaign.design)})

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a campaign and the vehicle that it names.

        Parameters
        ----------
        path : str or Path
            campaign.yaml or its directory.

        Raises
        ------
        FileProblems
            With every problem of both files.
        """
        from railui.campaign.directory import campaign_file
        from railui.documents.recognise import expect_kind

        source = campaign_file(path)
        expect_kind(source, "campaign")
        return cls.of(load_campaign(source))

    @classmethod
    def from_runs(
        cls,
        design: VehicleDesign | str | Path,
        *,
        estimation: Iterable[RunLike] | RunLike,
        validation: Iterable[RunLike] | RunLike,
        test: Iterable[RunLike] | RunLike = (),
        noise: Mapping[str, float | str] | None = None,
        name: str = "campaign",
        directory: str | Path | None = None,
        estimated_parameters: Sequence[str] | None = None,
        free: Sequence[str] | None = None,
        band: tuple[float | str, float | str] | None = None,
        cut: float | str | None = None,
        min_relative_gain: float | None = None,
        noise_band: float | str | None = None,
        channels: Mapping[str, Mapping[str, Any]] | None = None,
        sensors: Any = None,
        track: str | None = None,
        settings: Mapping[str, float | str] | None = None,
    ) -> Self:
        """Build a campaign of runs.

        The campaign is written as files, in which `railui loop` finds the same campaign: campaign.yaml, vehicle.yaml
        and the runs that were built of arrays. Without a directory they are temporary, and are removed with the object.

        Parameters
        ----------
        design : Design, str or Path
            Nominal vehicle.
        estimation, validation : runs
            Runs, or paths of runs, from which parameters are estimated and on which models are validated.
        test : runs, optional
            Runs of the independent test.
        noise : mapping, optional
            Standard deviation of each column: SI numbers, or quantities such as "0.05 mm".
        name : str
        directory : str or Path, optional
            Directory that the files are written to; it must not contain a campaign.
        estimated_parameters : sequence of str, optional
            Paths of the parameters to estimate (`adjust` in the file).
        free : sequence of str, optional
            Numbers that may differ between the joints of an element or the wheelsets of a contact.
        band : (float, float), optional
            Band [Hz] of the comparison.
        cut : float or str, optional
            Length [s] to leave out at both ends of a segment, or a share such as "2 %".
        min_relative_gain : float, optional
            Share by which an effect must lower the validation error (`material` in the file).
        noise_band : float or str, optional
            Shortest wavelength of the track noise [m].
        channels : mapping, optional
            Sensors of a vehicle of bodies by the names of their columns.
        sensors : mapping or list, optional
            Corrections of columns, and effects of sensors.
        track : {"unloaded", "loaded"}, optional
            State in which the track was measured.
        settings : mapping, optional
            Thresholds of the loop by name.

        Raises
        ------
        FileProblems
            With every problem, as of campaign.yaml.

        Examples
        --------
        >>> home = "designs/campaigns/worn_axle_box/"
        >>> runs = {"estimation": [home + "run_a.csv.gz"], "validation": [home + "run_b.csv.gz"]}
        >>> campaign = Campaign.from_runs(home + "vehicle.yaml", **runs, noise={"e1": "0.05 mm", "ay1": 0.05})
        >>> campaign.noise["e1"], [run.role for run in campaign.runs]
        (5e-05, ['adjust', 'validate'])
        """
        keys = {
            "noise": noise,
            "noise_band": noise_band,
            "adjust": None if estimated_parameters is None else list(estimated_parameters),
            "free": None if free is None else list(free),
            "band": band,
            "cut": cut,
            "material": min_relative_gain,
            "channels": channels,
            "sensors": sensors,
            "track": track,
            "settings": settings,
        }
        folder = tempfile.TemporaryDirectory(prefix="railui-campaign-") if directory is None else None
        home = Path(directory if folder is None else folder.name)  # type: ignore[arg-type]
        vehicle = as_design(design)
        runs = roled_runs(estimation=estimation, validation=validation, test=test)
        file = write_campaign_files(home, name, vehicle, runs, keys)
        try:
            return replace(cls.of(load_campaign(file)), _folder=folder)
        except FileProblems:
            file.unlink()  # so that the corrected call may use the directory
            raise

    def with_prior(self, directory: str | Path) -> Self:
        """Return the campaign with the calibrated vehicle and the estimates of an earlier loop as prior.

        Parameters
        ----------
        directory : str or Path
            Results of that loop.

        Raises
        ------
        FileProblems
            For a directory without a calibrated design, and for one of another vehicle.
        """
        from railui.campaign.prior import with_prior

        changed = with_prior(self, directory)
        return replace(self.of(changed), design=Design.of(changed.design))

    @cached_property
    def dataset(self) -> Dataset:
        """The runs as read, with their corrections, segments and noise; FileProblems for one that cannot be used."""
        from railui.campaign.dataset import read_dataset

        return read_dataset(self)

    @property
    def noise_model(self) -> NoiseModel:
        """Noise of every column as the identification uses it: stated, estimated from the data, or both."""
        from railui.campaign.noise.model import as_noise_model

        return as_noise_model(self.dataset.noise)

    def check(self) -> tuple[Problem, ...]:
        """Return every problem and warning of the campaign, its vehicle and its runs, as `railui check`."""
        from railui.api.files import check

        return check(self.source)

    def adjust(
        self,
        *,
        method: str = "least-squares",
        coefficients: bool = False,
        section_length: float | None = None,
        profile: Sequence[str] = (),
        seed: int = 0,
        jobs: int | None = None,
        progress: Progress = SILENT,
    ) -> Fit:
        """Estimate the parameters of the nominal vehicle, as `railui adjust`; parameters as of the function."""
        from railui.api.fit import estimate

        return estimate(
            self,
            method=method,
            coefficients=coefficients,
            section_length=section_length,
            profile=profile,
            seed=seed,
            jobs=jobs,
            progress=progress,
        )

    def loop(
        self,
        *,
        without: Collection[str] = (),
        seed: int = 0,
        jobs: int | None = None,
        correct: bool = False,
        accept_data: bool = False,
        progress: Progress = SILENT,
        budget: float | None = None,
    ) -> Loop:
        """Calibrate the nominal vehicle and identify unmodelled effects, as `railui loop`.

        Parameters and exceptions are those of `railui.loop`.
        """
        from railui.api.loop import run_loop

        return run_loop(
            self,
            without=without,
            seed=seed,
            jobs=jobs,
            correct=correct,
            accept_data=accept_data,
            progress=progress,
            budget=budget,
        )

    def save(self, path: str | Path) -> Path:
        """Write the campaign as a complete YAML file, whose paths are relative to its directory; return the path."""
        from railui.documents.saving import save_campaign

        return save_campaign(self, path)

    def summary_title(self) -> str:
        """Return the name."""
        return f"campaign {self.name}"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the vehicle, the runs, the band and the parameters to estimate."""
        runs = [SummaryRow(entry.role, entry.name) for entry in self.runs]
        band = None if self.band is None else list(self.band)
        paths = SummaryRow("estimated parameters", list(self.estimated_parameters))
        return [SummaryRow("vehicle", self.design.name), *runs, SummaryRow("band", band, "Hz"), paths]

    def summary_notes(self) -> Sequence[str]:
        """Return the warnings."""
        return [str(problem) for problem in self.warnings]


def as_campaign(campaign: MeasuredCampaign | str | Path) -> Campaign:
    """Return a campaign, or that of a file or directory, as the class of this package."""
    return Campaign.of(campaign) if isinstance(campaign, MeasuredCampaign) else Campaign.load(campaign)
