"""Designed line as a YAML file: straights, transitions and curves, with irregularities on them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from railui.arrays import FloatArray
from railui.core import Spline
from railui.io.atomic import sha256_file
from railui.io.fields import LIST, Group, Text, choice_reader, quantity_reader
from railui.io.problems import FileProblems, Findings, file_problem
from railui.io.schema_line import document_kind
from railui.io.yaml_document import load_yaml
from railui.io.yaml_file import load_fields
from railui.track.line import MIN_SAMPLES, Track, equally_spaced
from railui.track.line_checks import twist_warnings
from railui.track.mean_line import along_mean_line
from railui.track.reader import MAX_CANT, MAX_SPACING, MIN_RADIUS, MIN_SPACING, TrackColumns, load_track
from railui.track.synthetic import parse_spec

KINDS: Final = ("straight", "transition", "curve")
MAX_LENGTH: Final = 200e3  # m of a line
MAX_WIDENING: Final = 0.05  # m of the gauge
TABLE_FILE: Final = re.compile(r"\.(csv|txt)(\.gz)?\Z", re.IGNORECASE)
LENGTH_TOLERANCE: Final = 1e-6  # m, within which irregularities of a file reach the end of the line


class SegmentModel(Group):
    """Segment of a line: a straight, a transition between its neighbours, or a curve."""

    kind: Annotated[str, choice_reader(KINDS)] = Field(json_schema_extra={"sample": "kind: curve"})
    length: Annotated[float, quantity_reader("m", 0.0, above=True, maximum=MAX_LENGTH)] = Field(
        json_schema_extra={"sample": "length: 300 m"}
    )
    radius: Annotated[float, quantity_reader("m")] | None = Field(
        default=None, title="radius of a curve, positive for a centre on the right, negative on the left"
    )
    cant: Annotated[float, quantity_reader("m", -MAX_CANT, maximum=MAX_CANT)] | None = Field(
        default=None, title="cant of a curve, positive where the outer rail is higher"
    )
    gauge: Annotated[float, quantity_reader("m", -MAX_WIDENING, maximum=MAX_WIDENING)] | None = Field(
        default=None, title="gauge widening of a curve, a deviation from the nominal gauge"
    )


class LineModel(Group):
    """Schema of a line."""

    schema_: Text = Field(default="railui.line/1", alias="schema")
    name: Text = ""
    spacing: Annotated[float, quantity_reader("m", MIN_SPACING, maximum=MAX_SPACING)] = Field(
        default=0.1, title="distance between two samples"
    )
    segments: Annotated[list[SegmentModel], LIST] = Field(
        json_schema_extra={"sample": "segments: [{kind: straight, length: 200 m}]"}
    )
    irregularity: Text = Field(
        default="", title="spectrum and seed, such as erri_b176_low seed=1, or the file of a track"
    )


def load_line(path: str | Path, seed: int | None = None) -> TrackColumns:
    """Read a line; the seed replaces that of its irregularities. FileProblems with every fault."""
    remedy = "write `segments: [{kind: straight, length: 200 m}]`"
    kind = document_kind(load_yaml(path).value)
    if kind not in ("line", None):
        raise file_problem(path, f"is a {kind}, but a track or a line is required", remedy)
    _, model, findings = load_fields(path, "line", LineModel, remedy)
    if model is not None:
        _check_segments(model.segments, findings)
    findings.raise_errors()
    assert model is not None  # else `findings` had an error
    nodes, curvature, cant, widening = alignment(model.segments)
    samples = int(np.floor(nodes[-1] / model.spacing + LENGTH_TOLERANCE)) + 1
    if samples < MIN_SAMPLES:
        findings.add("segments", f"the line is {nodes[-1]:g} m long", f"give at least {MIN_SAMPLES} spacings")
        findings.raise_errors()
    s = model.spacing * np.arange(samples, dtype=np.float64)
    irregular, own_seed = _irregularity(model, s, Path(path), seed, findings)
    findings.raise_errors()
    assert irregular is not None  # else `findings` had an error
    line = (_at(s, nodes, curvature), _at(s, nodes, cant))
    about = (f"line {model.name or Path(path).stem}: {len(model.segments)} segments, {nodes[-1]:g} m",)
    irregularities = (irregular.yw, irregular.phiw, irregular.gauge + _at(s, nodes, widening))
    conventions = (*about, *irregular.conventions)
    _warn_of_twist(model.segments, s, line[1], findings)
    values = (s, *irregularities, *line)
    warnings = findings.warnings()
    return TrackColumns(Path(path), sha256_file(path), *values, conventions, seed=own_seed, warnings=warnings)


def _warn_of_twist(segments: list[SegmentModel], s: FloatArray, cant: FloatArray, findings: Findings) -> None:
    """Warn of the segment at which the cant changes as on no track."""
    ends = np.cumsum([segment.length for segment in segments])
    for each in twist_warnings(s, cant):
        i = min(int(np.searchsorted(ends, s[each.sample] + LENGTH_TOLERANCE)), len(segments) - 1)
        findings.warn(f"segments.{i}", f"the {each.column} {each.message}", each.remedy)


def _check_segments(segments: list[SegmentModel], findings: Findings) -> None:
    """Report segments without their numbers, numbers without use, and a line that is none."""
    if not segments:
        findings.add("segments", "is empty", "add `- {kind: straight, length: 200 m}`")
    for i, segment in enumerate(segments):
        at = f"segments.{i}"
        if segment.kind == "curve":
            if segment.radius is None:
                findings.add(at, "the curve has no radius", "add `radius: 500 m`, negative for a centre on the left")
            elif not abs(segment.radius) >= MIN_RADIUS:
                remedy = f"give {MIN_RADIUS:g} m or more, negative for a centre on the left"
                findings.add(f"{at}.radius", f"{segment.radius:g} m is no radius of a line", remedy)
            continue
        for key in ("radius", "cant", "gauge"):
            if getattr(segment, key) is not None:
                remedy = "leave it out: a transition leads from the segment before it to the one behind it"
                remedy = remedy if segment.kind == "transition" else "leave it out, or write `kind: curve`"
                findings.add(f"{at}.{key}", f"a {segment.kind} has no {key}", remedy, key=True)
        if segment.kind == "transition" and i + 1 < len(segments) and segments[i + 1].kind == "transition":
            findings.add(f"segments.{i + 1}", "a transition follows a transition", "put a straight or a curve between")


def alignment(segments: list[SegmentModel]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return nodes s [m] of a line and curvature [1/m], cant and gauge widening [m] there, linear between them.

    A jump is two nodes. Curvature and cant are positive for a centre on the right and a higher left rail. A transition
    at an end of the line leads to straight track.
    """
    ends = [0.0, *np.cumsum([segment.length for segment in segments]).tolist()]
    values = [_steady(segment) for segment in segments]
    straight = (0.0, 0.0, 0.0)
    rows: list[tuple[float, float, float, float]] = []
    for i, segment in enumerate(segments):
        first = last = values[i]
        if segment.kind == "transition":
            first = values[i - 1] if i else straight
            last = values[i + 1] if i + 1 < len(segments) else straight
        rows += [(ends[i], *first), (ends[i + 1], *last)]
    nodes, curvature, cant, widening = np.array(rows).T
    return nodes, curvature, cant, widening


def _steady(segment: SegmentModel) -> tuple[float, float, float]:
    """Return curvature, cant and gauge widening of a segment; those of a transition are its neighbours'."""
    if segment.kind != "curve" or not segment.radius:
        return 0.0, 0.0, 0.0
    cant = float(np.sign(segment.radius)) * (segment.cant or 0.0)
    return 1.0 / segment.radius, cant, segment.gauge or 0.0


def _at(s: FloatArray, nodes: FloatArray, values: FloatArray) -> FloatArray:
    """Return values at locations, linear between nodes; at a jump the value behind it."""
    i = np.clip(np.searchsorted(nodes, s, side="right") - 1, 0, len(nodes) - 2)
    width = np.maximum(nodes[i + 1] - nodes[i], np.finfo(float).tiny)
    share = np.clip((s - nodes[i]) / width, 0.0, 1.0)
    return np.asarray(values[i] + share * (values[i + 1] - values[i]))


def _irregularity(
    model: LineModel, s: FloatArray, path: Path, seed: int | None, findings: Findings
) -> tuple[Track | None, int | None]:
    """Return the irregularities at the samples of a line, None where they are faulty, and the seed of a spectrum."""
    text = model.irregularity
    if not text:
        return Track(s, np.zeros_like(s)), None
    file = path.parent / text
    if TABLE_FILE.search(text) or file.is_file():
        return _from_file(file, s, findings), None
    try:
        spec = parse_spec(text)
        if "length=" in text or "spacing=" in text:
            raise ValueError("length and spacing are those of the line: leave them out")
        spec = replace(spec, length=model.spacing * len(s), spacing=model.spacing)
        spec = spec if seed is None else replace(spec, seed=seed)
        track = spec.build()
    except ValueError as error:
        findings.add("irregularity", str(error), 'write for example "erri_b176_low seed=1", or the file of a track')
        return None, None
    return Track(s, track.yw, track.phiw, track.gauge, track.conventions), spec.seed


def _from_file(file: Path, s: FloatArray, findings: Findings) -> Track | None:
    """Return the irregularities of a track file along a line, from the start of both."""
    try:
        table = load_track(file)
    except FileProblems as error:
        findings.problems += error.problems
        return None
    track = _straight_track(table)
    if np.any(table.curvature) or np.any(table.cant):
        findings.add("irregularity", f"{file.name} has curves itself", "leave its columns curvature and cant out")
        return None
    if track.length < s[-1] - LENGTH_TOLERANCE:
        remedy = "shorten the line, or give a longer track"
        findings.add("irregularity", f"{file.name} is {track.length:g} m long, the line {s[-1]:g} m", remedy)
        return None
    yw, phiw, gauge = Spline(track.s - track.s[0], np.stack([track.yw, track.phiw, track.gauge], axis=1))(s).T
    return Track(s, yw, phiw, gauge, track.conventions)


def _straight_track(columns: TrackColumns) -> Track:
    """Return the irregularities of a file along their mean line."""
    irregularities = (columns.yw, columns.phiw, columns.gauge)
    if not columns.from_run:
        return along_mean_line(Track(columns.s, *irregularities, columns.conventions))
    spacing = float(np.median(np.diff(columns.s)))
    return along_mean_line(equally_spaced(columns.s, *irregularities, spacing=spacing, conventions=columns.conventions))
