"""Excitation of a vehicle: a track at one speed, as the input tables of the kernel."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from railui.arrays import FloatArray
from railui.memo import IdentityCache
from railui.track import LinePositions, Spacing, Track, equally_spaced, parse_spec, track_table
from railui.track.line_checks import sign_warnings, twist_warnings
from railui.track.mean_line import along_mean_line

if TYPE_CHECKING:
    from railui.track.reader import TrackColumns

TRACK_FILE = re.compile(r"\.((csv|txt)(\.gz)?|ya?ml)\Z", re.IGNORECASE)
LINE_FILES = (".yaml", ".yml")
MAX_PATH_LENGTH = 400  # characters of a text that may be the path of a file
MAX_TABLES = 8  # of one excitation; a search over the wheelbase needs one table per design


@dataclass(frozen=True, eq=False)
class TrackSource:
    """Track with its origin: a file with its hash, or a synthetic track with its seed."""

    track: Track
    name: str
    file: Path | None = None
    sha256: str = ""
    seed: int | None = None
    notes: tuple[str, ...] = ()


def is_track_file(track: object) -> bool:
    """Return True for the path of a file (a track or a run), False for the spec of a synthetic track.

    >>> is_track_file("line.csv"), is_track_file("erri_b176_low length=2000")
    (True, False)
    """
    if isinstance(track, Path):
        return True
    if not isinstance(track, str):
        return False
    return bool(TRACK_FILE.search(track)) or (len(track) < MAX_PATH_LENGTH and Path(track).is_file())


def resolve_track(track: Track | TrackSource | str | Path, seed: int | None = None) -> TrackSource:
    """Return the track of an argument, in coordinates along the mean line of its lateral deviation.

    Parameters
    ----------
    track : Track, TrackSource, str or Path
        A track, a spec, the path of a track, of a designed line (YAML), or of a run, whose longest segment is resampled
        at equal spacing.
    seed : int, optional
        Seed that replaces that of the spec.

    Raises
    ------
    FileProblems
        For a faulty file.
    ValueError
        For a faulty spec, and for a seed of a track that is not synthetic.

    Examples
    --------
    >>> source = resolve_track("erri_b176_low length=500", seed=3)
    >>> source.name, len(source.track)
    ('erri_b176_low length=500 seed=3 spacing=0.1 shortest=3 longest=150 scale=1', 5000)
    """
    if isinstance(track, str) and not is_track_file(track):
        spec = parse_spec(track)
        spec = spec if seed is None else replace(spec, seed=seed)
        return TrackSource(spec.build(), str(spec), seed=spec.seed)
    if isinstance(track, str | Path) and Path(track).suffix.lower() in LINE_FILES:
        return _source_of_line(Path(track), seed)
    if seed is not None:
        fixed = track.seed if isinstance(track, TrackSource) else None
        state = "is not a synthetic track: it has no seed" if fixed is None else f"has its seed {fixed} already"
        raise ValueError(f"{_name_of(track)} {state}, leave out --seed and --seeds")
    if isinstance(track, TrackSource):
        return track
    if isinstance(track, Track):
        return TrackSource(along_mean_line(track), _name_of(track), notes=line_notes(track))
    return _source_of_file(Path(track))


def _name_of(track: Track | TrackSource | str | Path) -> str:
    if isinstance(track, TrackSource):
        return track.name
    return f"a track of {track.length:g} m" if isinstance(track, Track) else Path(track).name


def _track_of(columns: TrackColumns) -> Track:
    irregularities = (columns.yw, columns.phiw, columns.gauge)
    return Track(columns.s, *irregularities, columns.conventions, curvature=columns.curvature, cant=columns.cant)


def _source_of_line(path: Path, seed: int | None) -> TrackSource:
    from railui.track.line_file import load_line

    columns = load_line(path, seed)
    if seed is not None and columns.seed is None:
        raise ValueError(f"{path.name} has no synthetic irregularities: it has no seed")
    return TrackSource(_track_of(columns), path.name, path, columns.sha256, columns.seed, columns.notes)


def _source_of_file(path: Path) -> TrackSource:
    from railui.track.reader import MAX_SPACING, MIN_SPACING, load_track

    columns = load_track(path)
    absent = () if columns.phiw.any() else (f"cross-level: taken as zero, {path.name} has no phiw",)
    if not columns.from_run:
        notes = (*columns.notes, *absent)
        return TrackSource(along_mean_line(_track_of(columns)), path.name, path, columns.sha256, notes=notes)
    irregularities = (columns.yw, columns.phiw, columns.gauge)
    spacing = float(np.clip(round(float(np.median(np.diff(columns.s))), 3), MIN_SPACING, MAX_SPACING))
    line = {"curvature": columns.curvature, "cant": columns.cant}
    even = equally_spaced(columns.s, *irregularities, spacing=spacing, conventions=columns.conventions, **line)
    track = along_mean_line(even)
    segment = f"its longest segment, {track.length:.6g} m, resampled every {spacing:g} m"
    notes = (f"track of the run {path.name}: {segment}", *absent, *line_notes(track))
    return TrackSource(track, path.name, path, columns.sha256, notes=notes)


def line_notes(track: Track) -> tuple[str, ...]:
    """Return notes on implausible places of a line with curves."""
    return tuple(map(str, (*twist_warnings(track.s, track.cant), *sign_warnings(track.curvature, track.cant))))


@dataclass(frozen=True, eq=False)
class Excitation:
    """Track at a speed [m/s]; each input table is computed once per wheelbase and number of steps."""

    source: TrackSource
    speed: float
    _tables: IdentityCache[FloatArray] = field(default_factory=lambda: IdentityCache(MAX_TABLES), repr=False)

    def __post_init__(self) -> None:
        if not 0 < self.speed < np.inf:
            raise ValueError(f"speed must be positive: {self.speed:g} m/s")

    @property
    def track(self) -> Track:
        """Track irregularities under the wheelsets."""
        return self.source.track

    @property
    def dt(self) -> float:
        """Time between two samples [s]."""
        return self.track.spacing / self.speed

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return self.track.length / self.speed

    def table(self, spacing: Spacing, steps: int) -> FloatArray:
        """Return the input table of `track_table`.

        `spacing`: half a wheelbase [m], the distances of all wheelsets [m], or the positions on a line with curves, as
        `railui.vehicle.on_track.spacings` returns them.
        """
        if not isinstance(spacing, LinePositions):
            spacing = float(spacing) if isinstance(spacing, int | float) else tuple(spacing)
        key = (spacing, int(steps))
        return self._tables.get(key, lambda: track_table(self.track, self.speed, *key)[0])

    @property
    def start(self) -> float:
        """Lateral deviation [m] of the first sample, at which vehicles start."""
        return float(self.track.yw[0])

    def distance_at(self, sample: int) -> float:
        """Return the distance s [m] at a sample."""
        return float(self.track.s[sample])
