"""Job of the page of rides over speed: seed by seed, of the design and of its base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from textual.message import Message

from railui import ride_many
from railui.desk.messages import JobDone, ProgressEvent
from railui.desk.presenters.design_results import DesignResults, load_track
from railui.desk.presenters.speed_bands import BAND_SPEEDS, SEED_COUNT, band_key
from railui.desk.services.jobs import BackgroundJob
from railui.desk.services.stability_jobs import background_threads
from railui.track.excitation import TrackSource, resolve_track


@dataclass(frozen=True)
class SeedSimulated:
    """Rides of a design on one seed of its track, one per speed; is_last: of the last seed."""

    key: str
    number: int
    rides: list[dict[str, Any]]
    is_last: bool


def compute_bands(job: BackgroundJob, wanted: Sequence[DesignResults], done: dict[str, int]) -> Message:
    """Simulate designs at BAND_SPEEDS on seed after seed, the designs in turn; `done`: seeds known, by key."""
    sources = {band_key(each): track_seeds(each.conditions.track) for each in wanted}
    for number in range(SEED_COUNT):
        for each in wanted:
            key = band_key(each)
            if done.get(key, 0) <= number < len(sources[key]):
                rides = _rides(job, each, sources[key][number])
                is_last = number == len(sources[key]) - 1
                job.owner.post_message(ProgressEvent(job.name, SeedSimulated(key, number, rides, is_last)))
    return JobDone(job.name, None)


def track_seeds(track: str) -> list[TrackSource]:
    """Return a synthetic track with SEED_COUNT successive seeds, the first its own; a file as it is."""
    source = load_track(track)
    if source.seed is None:
        return [source]
    return [source, *(resolve_track(track, source.seed + k) for k in range(1, SEED_COUNT))]


def _rides(job: BackgroundJob, results: DesignResults, source: TrackSource) -> list[dict[str, Any]]:
    rides: list[dict[str, Any]] = []
    for speed in BAND_SPEEDS.tolist():
        job.checkpoint()
        rides += ride_many([results.design], source, speed, background_threads())
    return rides
