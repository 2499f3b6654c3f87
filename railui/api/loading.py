"""Loading of files of any kind as the classes of this package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from railui.api.campaign import Campaign
from railui.api.design import Design
from railui.api.run import Run
from railui.api.study import Study
from railui.campaign.campaign import Campaign as MeasuredCampaign
from railui.documents.check import load as load_document
from railui.optimisation.study import Study as SearchStudy
from railui.runs.run import Run as MeasuredRun
from railui.track import parse_spec
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    from railui.documents.check import LoadedFile


def load(path: str | Path) -> LoadedFile:
    """Load a file of any kind: a design, a campaign, a study, a run, a track or a profile.

    Returns
    -------
    Design, Campaign, Study, Run, or another object
        The first four as the classes of this package.

    Raises
    ------
    FileProblems
        With every problem of the file.

    Examples
    --------
    >>> load("designs/test_bogie.yaml").value("contact.flange_clearance")
    0.007
    """
    loaded = load_document(path, check_track=parse_spec)
    if isinstance(loaded, VehicleDesign):
        return Design.of(loaded)
    if isinstance(loaded, MeasuredCampaign):
        return Campaign.of(loaded)
    if isinstance(loaded, SearchStudy):
        return Study.of(loaded)
    return Run.of(loaded) if isinstance(loaded, MeasuredRun) else loaded
