"""Candidates of structure detection: every effect of the library at every location, each with a grid of shapes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.segment import CARBODY_FORCES, Segment
from railui.identification.prediction import Predictor
from railui.identification.structure.locations import candidate_locations
from railui.runs.columns import is_compared
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effects import evaluate_product
from railui.vehicle.model import Model
from railui.vehicle.track_geometry import track_geometry

W = 10.0  # rad/s, corner frequency to which the shapes of dampers refer
QUADRATURE = 0.5 * np.pi  # rad, between the two phases in which a periodic effect is simulated
# on a bench, of a kind at one location: rubber relaxes on more than one time scale
BRANCHES: Mapping[str, int] = {"maxwell_damper": 3}
PACKED = 2  # shapes of a kind up to which its locations are simulated together


@dataclass(frozen=True)
class Candidate:
    """An effect at a location, with its shapes: one mapping of parameters in SI units each."""

    kind: str
    at: str
    wheelset: int | None
    shapes: tuple[Mapping[str, float], ...] = field(default=(), compare=False)

    @property
    def is_one_sided(self) -> bool:
        """True if its strength has only one sign."""
        strengths = [p for p in core.effect_record(self.kind)["parameters"] if p["role"] == "strength"]
        if core.effect_record(self.kind)["acts"] == "sensor":
            return False
        return all(p["minimum"] >= 0 for p in strengths)

    @property
    def is_linear(self) -> bool:
        """True for a spring or damper: other values of the estimated parameters may replace it."""
        return bool(core.effect_record(self.kind)["linear"])

    @property
    def has_phase(self) -> bool:
        """True if it has a phase: every second shape is then in quadrature to the one before."""
        return any(p["role"] == "run" for p in core.effect_record(self.kind)["parameters"])

    @property
    def strength(self) -> str | None:
        """Key of the parameter to which the force is proportional; None if there is none."""
        keys = [p["key"] for p in core.effect_record(self.kind)["parameters"] if p["role"] == "strength"]
        return keys[0] if keys else None

    @property
    def has_own_force(self) -> bool:
        """True for a force that is proportional to its strength, whatever the elements of the vehicle."""
        record = core.effect_record(self.kind)
        units = [str(p["unit"]) for p in record["parameters"] if p["key"] == self.strength]
        return record["acts"] == "force" and any(unit.startswith("F") for unit in units)

    def is_related(self, other: Candidate) -> bool:
        """True for two laws of one family at one location."""
        family = core.effect_record(self.kind)["family"]
        place = other.at, other.wheelset
        return bool(family) and family == core.effect_record(other.kind)["family"] and place == (self.at, self.wheelset)

    def scale_force(self, shape: Mapping[str, float], amount: float) -> dict[str, float]:
        """Scale the force of a shape at unchanged motion.

        Stiffness, damping and yield scale with the strength, so that an effect with memory keeps its time constant or
        its length of slip.
        """
        record = core.effect_record(self.kind)["parameters"]
        forces = {p["key"] for p in record if p["role"] == "strength" or p["unit"].startswith("F")}
        return {key: value * amount if key in forces else value for key, value in shape.items()}

    def effect_with(self, parameters: Mapping[str, float]) -> PlacedEffect:
        """Return the effect at this location with parameters in SI units."""
        return PlacedEffect(self.kind, self.at, self.wheelset, dict(parameters))


def list_candidates(
    model: Model,
    segments: Sequence[Segment],
    *,
    without: Collection[str] = (),
    loaded: bool = False,
    starts: Sequence[FloatArray | None] | None = None,
) -> list[Candidate]:
    """List all candidates for a model and its segments.

    without: kinds to exclude. loaded: whether the track was measured under load, which excludes the rail's flexibility.
    starts: initial states of the segments, from which the usual motions are computed; None: at rest.
    """
    sites = _sites(model, segments, starts)
    measured = {c for s in segments for c in s.channels if is_compared(c)}
    prescribed = driven_locations(segments)
    candidates = []
    for record in core.effect_catalogue():
        kind = str(record["kind"])
        excluded = not record["candidate"] or kind in without
        needed = record["column"]
        is_missing = needed and not any(np.any(s.columns.get(needed, np.zeros(1))) for s in segments)
        if excluded or (record["acts"] == "rail" and loaded) or is_missing:
            continue
        for at, numbers in candidate_locations(model, record):
            is_possible = at in measured if record["acts"] == "sensor" else (at in sites and at not in prescribed)
            if not is_possible:
                continue
            shapes = tuple(_shape(record, shape, sites.get(at, {})) for shape in record["shapes"])
            if any(p["role"] == "run" for p in record["parameters"]):
                shapes = tuple(shape for s in shapes for shape in (s, s | {"phase": QUADRATURE}))
            for wheelset in numbers:
                candidate = Candidate(kind, at, wheelset, shapes)
                if is_compatible(model, candidate) and not is_spanned(model, candidate, numbers):
                    candidates.append(candidate)
    return candidates


def driven_locations(segments: Sequence[Segment]) -> set[str]:
    """Return the locations where a measured force of the carbody replaces all other forces."""
    return {at for s in segments for q, at in CARBODY_FORCES.items() if q in s.columns}


def is_compatible(model: Model, candidate: Candidate) -> bool:
    """True if the model has not as many such effects as can act, and none that supersedes the same element."""
    place = (candidate.kind, candidate.at, candidate.wheelset)
    most = BRANCHES.get(candidate.kind, 1) if model.design.form == "bench" else 1
    if sum((e.kind, e.at, e.wheelset) == place for e in model.effects) >= most:
        return False
    try:
        model.vehicles((), [core.Placement(candidate.kind, candidate.at, candidate.wheelset)])
    except ValueError:
        return False
    return True


def is_spanned(model: Model, candidate: Candidate, numbers: Sequence[int | None]) -> bool:
    """True where effects of the kind act there already on so many numbers that they compose the candidate.

    That on all joints or wheelsets is the sum of those on each, so that no more of them than joints are independent.

    numbers: of the joints or wheelsets, None for all.
    """
    members = max(sum(n is not None for n in numbers), 1)
    present = {e.wheelset for e in model.effects if (e.kind, e.at) == (candidate.kind, candidate.at)}
    return len(present - {candidate.wheelset}) >= members


def _sites(
    model: Model, segments: Sequence[Segment], starts: Sequence[FloatArray | None] | None
) -> dict[str, dict[str, float]]:
    """Reference quantities of the shapes per location: stiffness k, damping c, rms motion z and its rate v."""
    linear = model.local_elements
    locations = [(at, w) for at, w in linear if w != core.LINKAGE_NUMBER]
    channels = [f"{q}.{at}.{w}" for at, w in locations for q in ("z", "v")]
    squares = []
    for i, segment in enumerate(segments):
        start = None if starts is None else starts[i]
        series, diverged = Predictor(model, segment, initial_state=start).simulate(channels)
        if diverged[0] < 0:
            squares.append(series[0][:, series.shape[2] // 10 :].var(axis=1))
    square = np.mean(squares, axis=0) if squares else np.zeros(len(channels))
    rms = dict(zip(channels, np.sqrt(square), strict=True))
    values = model.design.values
    general = {"w": W, "m": _reference_mass(model), "1": 1.0}
    general["h"] = values.get("contact.flange_clearance", 1.0)
    is_on_track = model.design.is_on_track
    general["r"] = track_geometry(model.design).rolling_radius if is_on_track else 1.0
    sites: dict[str, dict[str, float]] = {"contact": dict(general), "track": dict(general)} if is_on_track else {}
    for at in {at for at, _ in locations}:
        same = [(a, w) for a, w in locations if a == at]
        z = float(np.mean([rms[f"z.{a}.{w}"] for a, w in same])) or 1e-6
        v = float(np.mean([rms[f"v.{a}.{w}"] for a, w in same])) or 1e-5
        k, c = linear[same[0]]
        if segments[0].kind == "bench":  # the laws of a component may be far from its nominal terms
            force = float(np.sqrt(np.mean([s.columns["F"].var() for s in segments])))
            k, c = force / z, force / v
        k = k or _reference_stiffness(at, linear, general["m"], v / z)
        sites[at] = general | {"k": k, "z": z, "v": v, "F": k * z, "c": c or k * z / v}
    return sites


def _reference_mass(model: Model) -> float:
    """Mass of the frame, of a rig, or of the lightest body above the wheelsets [kg]; 1 of a component on a bench."""
    values, structure = model.design.values, model.design.structure
    if structure is None:
        return values.get("vehicle.frame.mass", values.get("vehicle.rig.mass", 1.0))
    return min((values[part.number_path("mass")] for part in structure.bodies), default=1.0)


def _reference_stiffness(
    at: str, linear: Mapping[tuple[str, int], tuple[float, float]], mass: float, w: float
) -> float:
    """Reference stiffness where the model has none: the primary spring's, or the mass times w^2 of the motion."""
    yaw = at.endswith("_yaw")
    for (other, _), (k, _c) in linear.items():
        if k > 0 and other.startswith("primary") and other.endswith("_yaw") == yaw and not at.startswith("secondary"):
            return k
    return mass * w * w


def _shape(record: core.Record, shape: Sequence[float], site: Mapping[str, float]) -> dict[str, float]:
    values: dict[str, float] = {}
    for p, multiple in zip(record["parameters"], list(shape) + [None] * 9, strict=False):
        if p["role"] == "optional" or multiple is None:
            continue
        values[p["key"]] = float(multiple) * float(evaluate_product(str(p["times"]), site) or 1.0)
    return values


@dataclass(frozen=True)
class CandidateBatch:
    """Candidates of one kind that are simulated in one structure, one lane per (candidate, shape)."""

    members: tuple[Candidate, ...]
    lanes: tuple[tuple[int, int], ...]

    @property
    def placements(self) -> list[core.Placement]:
        """Placements of the members for the kernel."""
        return [core.Placement(c.kind, c.at, c.wheelset) for c in self.members]

    def parameter_rows(self) -> FloatArray:
        """Parameters [lane, parameters of all placements]: in each lane its shape at its placement."""
        rows = []
        for member, shape in self.lanes:
            row: list[float] = []
            for i, c in enumerate(self.members):
                row += core.effect_numbers(c.kind, c.shapes[shape if i == member else 0])
            rows.append(row)
        return np.array(rows)

    def amount_rows(self, amount: float) -> FloatArray:
        """Amounts [lane, placement]: in each lane the amount of its candidate, 0 of the others."""
        out = np.zeros((len(self.lanes), len(self.members)))
        for lane, (member, _) in enumerate(self.lanes):
            out[lane, member] = amount
        return out


def batches_on(model: Model, candidates: Sequence[Candidate]) -> list[CandidateBatch]:
    """Group candidates into batches for a vehicle.

    A step of a vehicle of bodies costs far more than that of an effect: its batches are filled with placements.
    """
    return batch_candidates(candidates, PACKED if model.design.structure is None else core.LANES)


def batch_candidates(candidates: Sequence[Candidate], packed: int = PACKED) -> list[CandidateBatch]:
    """Group candidates into batches: many placements of a kind with at most so many shapes, else one placement each."""
    batches: list[CandidateBatch] = []
    by_kind: dict[str, list[Candidate]] = {}
    for c in candidates:
        by_kind.setdefault(c.kind, []).append(c)
    for members in by_kind.values():
        few = (
            max(len(c.shapes) for c in members) <= packed and core.effect_record(members[0].kind)["supersedes"] is None
        )
        packs = [members] if few else [[c] for c in members]
        for pack in packs:
            lanes = [(i, j) for i, c in enumerate(pack) for j in range(len(c.shapes))]
            size = core.LANES - 1
            size -= size % 2 if members[0].has_phase else 0  # both phases of a shape belong to one batch
            for start in range(0, len(lanes), size):
                part = lanes[start : start + size]
                used = sorted({i for i, _ in part})
                indices = tuple((used.index(i), j) for i, j in part)
                batches.append(CandidateBatch(tuple(pack[i] for i in used), indices))
    return batches


def candidate_text(candidate: Candidate) -> str:
    """Describe a candidate in words."""
    return f"{candidate.kind} at {candidate.at}" + (f" {candidate.wheelset}" if candidate.wheelset else "")
