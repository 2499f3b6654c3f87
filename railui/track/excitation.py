"""The road: a track at one speed, as the tables that drive vehicles along it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from railui.arrays import FloatArray
from railui.track import Wheelbase, Track, equally_spaced, parse_spec, track_table

FILE = re.compile(r"\.(csv|txt)(\.gz)?\Z", re.IGNORECASE)
MOST_TABLES = 8  # of one road; a search over the wheelbase needs one per design


@dataclass(frozen=True, eq=False)
class TrackSource:
    """A track and where it comes from: a file with its hash, or a synthetic one with its seed."""

    track: Track
    name: str
    file: Path | None = None
    sha256: str = ""
    seed: int | None = None
    notes: tuple[str, ...] = ()


def is_track_file(track: object) -> bool:
    """Does this name a file (a track or a run), not the spec of a synthetic track?

    >>> is_track_file("line.csv"), is_track_file("erri_b176_low length=2000")
    (True, False)
    """
    if isinstance(track, Path):
        return True
    return isinstance(track, str) and bool(FILE.search(track) or (len(track) < 400 and Path(track).is_file()))


def resolve_track(track: Track | TrackSource | str | Path, seed: int | None = None) -> TrackSource:
    """The track that an argument names: a Track, a spec, the path of a track or of a run.

    `seed` takes the place of the spec's own. A run's longest stretch is laid anew at equal spacing. Raises
    FileProblems for a faulty file, ValueError for a faulty spec or a seed that a track cannot have.

    >>> laid = lay("erri_b176_low length=500", seed=3)
    >>> laid.name, len(laid.track)
    ('erri_b176_low length=500 seed=3 spacing=0.1 shortest=3 longest=150 scale=1', 5000)
    """
    if isinstance(track, str) and not is_track_file(track):
        spec = parse_spec(track)
        spec = spec if seed is None else replace(spec, seed=seed)
        return TrackSource(spec.build(), str(spec), seed=spec.seed)
    if seed is not None:
        raise ValueError(f"{_named(track)} is no synthetic track: it has no seed")
    if isinstance(track, TrackSource):
        return track
    if isinstance(track, Track):
        return TrackSource(track, _named(track))
    return _from_file(Path(track))


def _named(track: Track | TrackSource | str | Path) -> str:
    if isinstance(track, TrackSource):
        return track.name
    return f"a track of {track.length:g} m" if isinstance(track, Track) else Path(track).name


def _from_file(path: Path) -> TrackSource:
    from railui.track.reader import MAX_SPACING, MIN_SPACING, load_track

    columns = load_track(path)
    lines = (columns.yw, columns.phiw, columns.gauge)
    if not columns.from_run:
        track = Track(columns.s, *lines, columns.conventions)
        return TrackSource(track, path.name, path, columns.sha256)
    spacing = float(np.clip(round(float(np.median(np.diff(columns.s))), 3), MIN_SPACING, MAX_SPACING))
    track = equally_spaced(columns.s, *lines, spacing=spacing, conventions=columns.conventions)
    stretch = f"its longest stretch, {track.length:.6g} m, laid anew every {spacing:g} m"
    return TrackSource(track, path.name, path, columns.sha256, notes=(f"track of the run {path.name}: {stretch}",))


@dataclass(frozen=True, eq=False)
class Excitation:
    """A track at a speed [m/s]; its input tables are made once per wheelbase and step count."""

    source: TrackSource
    speed: float
    _tables: dict[tuple[Wheelbase, int], FloatArray] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if not 0 < self.speed < np.inf:
            raise ValueError(f"speed must be positive: {self.speed:g} m/s")

    @property
    def track(self) -> Track:
        """What the wheelsets meet."""
        return self.source.track

    @property
    def dt(self) -> float:
        """Time between two samples [s]."""
        return self.track.spacing / self.speed

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.track.length / self.speed

    def table(self, half_wheelbase: Wheelbase, steps: int) -> FloatArray:
        """The input table, see `track_table`, for half a wheelbase [m] or distances behind the first wheelset."""
        behind = float(half_wheelbase) if isinstance(half_wheelbase, int | float) else tuple(half_wheelbase)
        key = (behind, int(steps))
        table = self._tables.get(key)
        if table is None:  # several threads may come here at once: each makes the same
            table = track_table(self.track, self.speed, *key)[0]
            for oldest in list(self._tables)[: 1 - MOST_TABLES]:
                self._tables.pop(oldest, None)
            self._tables[key] = table
        return table

    def distance_at(self, sample: int) -> float:
        """Distance s [m] at a sample."""
        return float(self.track.s[sample])
