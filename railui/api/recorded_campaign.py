"""Campaign from recordings: channels to sensors by a map, rails reconstructed, runs aligned and written."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from railui.capture.processing.campaign_files import CampaignRun
    from railui.capture.processing.sensor_map import SensorMap


@dataclass(frozen=True, eq=False)
class RecordedCampaign:
    """Campaign that was written from recordings: campaign.yaml, its runs, notes on their alignment."""

    path: Path
    runs: Sequence[CampaignRun]
    notes: Sequence[str]

    def report(self) -> dict[str, Any]:
        """Return campaign, runs (role, source, report of the import) and notes."""
        runs = [{"role": run.role, "source": run.source, **run.run.report()} for run in self.runs]
        return {"campaign": self.path, "runs": runs, "notes": list(self.notes)}


def write_recorded_campaign(
    map_file: str | Path,
    recordings: Mapping[str, Sequence[str | Path]],
    out: str | Path,
    *,
    name: str | None = None,
    on_progress: Callable[[str], None] | None = None,
) -> RecordedCampaign:
    """Build a campaign from recordings, as `railui capture campaign`.

    Parameters
    ----------
    map_file : str or Path
        Assignment of channels to sensors; it names the vehicle.
    recordings : mapping
        Directories of `railui capture`, or other files that `railui import` reads, by role: adjust, validate.
    out : str or Path
        Directory of campaign.yaml and its runs.
    name : str, optional
        Name of the campaign; that of its directory by default.
    on_progress : callable, optional
        Receiver of a line per step; may raise an exception to stop.

    Returns
    -------
    RecordedCampaign

    Raises
    ------
    FileProblems
        For faulty files, a directory that has a campaign, or one of the recordings as a run, a map that names no
        vehicle, and a recording that serves estimation and validation.
    ValueError
        If a role has no recording.
    """
    from railui.capture.processing.campaign_files import align_runs, run_file, run_letters, write_campaign
    from railui.capture.processing.sensor_map import load_map
    from railui.io.problems import file_problem, refuse_overwriting

    directory, say = Path(out), on_progress or (lambda text: None)
    if (directory / "campaign.yaml").exists():
        raise file_problem(directory / "campaign.yaml", "exists and is not overwritten", "name another directory")
    for role, words in (("adjust", "estimation"), ("validate", "validation")):
        if not recordings.get(role):
            raise ValueError(f"no recording for {words} ({role}): choose one")
    sensor_map = load_map(map_file)
    if sensor_map.design is None or sensor_map.design.source is None:
        raise file_problem(map_file, "names no vehicle", "add `vehicle: DESIGN.yaml`, the nominal model")
    runs = _build_runs(sensor_map, recordings, say)
    _refuse_overlap(runs)
    say("comparing the tracks of the runs")
    runs, notes = align_runs(runs)
    for letter in run_letters(len(runs)):
        refuse_overwriting(directory / run_file(letter), [path for paths in recordings.values() for path in paths])
    say("writing the runs")
    path = write_campaign(directory, name or directory.resolve().name, Path(sensor_map.design.source), runs)
    return RecordedCampaign(path, runs, notes)


def _build_runs(
    sensor_map: SensorMap, recordings: Mapping[str, Sequence[str | Path]], say: Callable[[str], None]
) -> list[CampaignRun]:
    """Build the runs of all recordings, by role."""
    from railui.capture.formats import read_recordings
    from railui.capture.processing.campaign_files import CampaignRun
    from railui.capture.processing.run_builder import build_measured_run
    from railui.capture.simulator.logger import DEMO_DEVICE

    runs = []
    for role, paths in recordings.items():
        for path in paths:
            for recording in read_recordings(path, sensor_map.clock, sensor_map.rate):
                say(f"reconstructing the rails of {recording.name}")
                run = build_measured_run(recording, sensor_map)
                is_simulated = recording.device == DEMO_DEVICE
                runs.append(CampaignRun(role, recording.name, run, is_simulated))
    return runs


def _refuse_overlap(runs: Sequence[CampaignRun]) -> None:
    """Refuse a recording that serves estimation and validation."""
    from railui.io.problems import file_problem
    from railui.runs.overlap import MAX_SHARED_SHARE, shared_share

    for first, second in combinations(runs, 2):
        if first.role != second.role and shared_share(first.run.columns, second.run.columns) > MAX_SHARED_SHARE:
            same = f"({second.role}) and {first.source} ({first.role}) share samples"
            remedy = "give another recording: a model is validated on one that no fit has used"
            raise file_problem(second.source, same, remedy)
