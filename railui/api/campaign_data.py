"""Data of a campaign before any fit: the runs as read, the findings of the data checks, the diagnosis of faults."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from railui.campaign.campaign import Campaign, load_campaign
from railui.campaign.data_checks import check_data
from railui.campaign.dataset import Dataset, read_dataset
from railui.campaign.directory import campaign_file
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Diagnosis
from railui.campaign.finding import Finding


class CampaignData(NamedTuple):
    """Runs of a campaign as read, findings of their checks, and the diagnosis of data faults."""

    dataset: Dataset
    findings: Sequence[Finding]
    diagnosis: Diagnosis


def examine_campaign(campaign: Campaign | str | Path) -> CampaignData:
    """Read the runs of a campaign and check their data, as `railui loop` does before any fit.

    Raises
    ------
    FileProblems
        For a file that cannot be used.
    """
    loaded = campaign if isinstance(campaign, Campaign) else load_campaign(campaign_file(campaign))
    dataset = read_dataset(loaded)
    diagnosis = diagnose(dataset)
    return CampaignData(dataset, check_data(dataset, diagnosis), diagnosis)
