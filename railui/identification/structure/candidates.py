"""What may be missing: every effect of the catalogue at every place, each in a grid of shapes."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.campaign.dataset import COMPARED, RIG_RESPONSES, Segment, simulate
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effect_records import WHEELSET_LOCATIONS, evaluate_product
from railui.vehicle.model import Model

W = 10.0  # rad/s, the corner that dampers are measured by
QUADRATURE = 0.5 * np.pi  # what belongs to a run is seen in two phases
LINEAR = ("spring", "viscous_damper")  # kinds that an adjusted vehicle may do without, by other values
PACKED = 2  # kinds with at most so many shapes share their groups


@dataclass(frozen=True)
class Candidate:
    """An effect at a place, with its shapes: parameters in SI, one mapping each."""

    kind: str
    at: str
    wheelset: int | None
    shapes: tuple[Mapping[str, float], ...] = field(default=(), compare=False)

    @property
    def one_sided(self) -> bool:
        """Can its strength have only one sign?"""
        found = [p for p in core.record(self.kind)["parameters"] if p["role"] == "strength"]
        if core.record(self.kind)["acts"] == "sensor":
            return False
        return all(p["minimum"] >= 0 for p in found)

    @property
    def phased(self) -> bool:
        """Does it stand in two phases, every second of its shapes in quadrature to the one before?"""
        return any(p["role"] == "run" for p in core.record(self.kind)["parameters"])

    @property
    def strength(self) -> str | None:
        """The parameter that the force is proportional to."""
        found = [p["key"] for p in core.record(self.kind)["parameters"] if p["role"] == "strength"]
        return found[0] if found else None

    def scaled(self, shape: Mapping[str, float], amount: float) -> dict[str, float]:
        """A shape whose force is so many times as large at the same motion: the strength, and with it all stiffness,
        damping and yield, by whose ratios an effect with memory keeps its time constant or its length of slip.
        """
        record = core.record(self.kind)["parameters"]
        forces = {p["key"] for p in record if p["role"] == "strength" or p["unit"].startswith("F")}
        return {key: value * amount if key in forces else value for key, value in shape.items()}

    def placed(self, parameters: Mapping[str, float]) -> PlacedEffect:
        """The effect at this place with parameters in SI."""
        return PlacedEffect(self.kind, self.at, self.wheelset, dict(parameters))


def list_candidates(
    model: Model, stretches: Sequence[Segment], *, without: Collection[str] = (), loaded: bool = False
) -> list[Candidate]:
    """All candidates for a vehicle and its runs; `without` bars kinds, `loaded` the rail's flexibility."""
    sites = _sites(model, stretches)
    measured = {c for s in stretches for c in s.channels if c in (*COMPARED, *RIG_RESPONSES)}
    driven = driven_places(stretches)
    has_gauge = any(np.any(s.columns.get("gauge", np.zeros(1))) for s in stretches)
    found = []
    for record in core.catalogue():
        kind = str(record["kind"])
        barred = not record["candidate"] or kind in without
        if barred or (kind == "rail_flexibility" and loaded) or (kind == "gauge_conicity" and not has_gauge):
            continue
        for at in record["at"]:
            known = at in measured if record["acts"] == "sensor" else (at in sites and at not in driven)
            if not known:
                continue
            shapes = tuple(_shape(record, shape, sites.get(at, {})) for shape in record["shapes"])
            if any(p["role"] == "run" for p in record["parameters"]):
                shapes = tuple(one for s in shapes for one in (s, s | {"phase": QUADRATURE}))
            for wheelset in (None, 1, 2) if at in WHEELSET_LOCATIONS else (None,):
                candidate = Candidate(kind, at, wheelset, shapes)
                if _compatible(model, candidate):
                    found.append(candidate)
    return found


def driven_places(stretches: Sequence[Segment]) -> set[str]:
    """Places where a measured force of the coach acts in place of everything else."""
    pairs = (("Qy", "secondary_lateral"), ("Qpsi", "secondary_yaw"))
    return {place for s in stretches for q, place in pairs if q in s.columns}


def _compatible(model: Model, candidate: Candidate) -> bool:
    """Is it new, and does it leave alone what an effect of the model has superseded?"""
    if any((e.kind, e.at, e.wheelset) == (candidate.kind, candidate.at, candidate.wheelset) for e in model.effects):
        return False
    try:
        model.vehicles((), [core.Placement(candidate.kind, candidate.at, candidate.wheelset)])
    except ValueError:
        return False
    return True


def _sites(model: Model, stretches: Sequence[Segment]) -> dict[str, dict[str, float]]:
    """Place -> the vehicle's own k, c, and its actual rms motion z, v there: what shapes are multiples of."""
    linear = model.vehicles().sites(model.single())
    places = [(at, w) for at, w in linear if w != core.LINKAGE]
    channels = [f"{q}.{at}.{w}" for at, w in places for q in ("z", "v")]
    square = np.zeros(len(channels))
    for stretch in stretches:
        series, lost = simulate(model, stretch, channels)
        if lost[0] < 0:
            square += series[0][:, series.shape[2] // 10 :].var(axis=1) / len(stretches)
    rms = dict(zip(channels, np.sqrt(square), strict=True))
    values = model.design.values
    general = {"w": W, "m": values.get("vehicle.frame.mass", values.get("vehicle.rig.mass", 1.0)), "1": 1.0}
    general["h"] = values.get("contact.flange_clearance", 1.0)
    general["r"] = values.get("vehicle.geometry.rolling_radius", 1.0)
    found: dict[str, dict[str, float]] = {"contact": dict(general), "track": dict(general)}
    if model.design.kind == "rig":
        found = {}
    for at in {at for at, _ in places}:
        same = [(a, w) for a, w in places if a == at]
        z = float(np.mean([rms[f"z.{a}.{w}"] for a, w in same])) or 1e-6
        v = float(np.mean([rms[f"v.{a}.{w}"] for a, w in same])) or 1e-5
        k, c = linear[same[0]]
        k = k or _stand_in(at, linear, general["m"], v / z)
        found[at] = general | {"k": k, "z": z, "v": v, "F": k * z, "c": c or k * z / v}
    return found


def _stand_in(at: str, linear: Mapping[tuple[str, int], tuple[float, float]], mass: float, w: float) -> float:
    """A stiffness to measure by where none is declared: the primary spring's, or the mass at the motion's frequency."""
    yaw = at.endswith("_yaw")
    for (place, _), (k, _c) in linear.items():
        if k > 0 and place.startswith("primary") and place.endswith("_yaw") == yaw and not at.startswith("secondary"):
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
    """Candidates of one kind that are simulated in one structure: placements, and lanes (candidate, shape)."""

    members: tuple[Candidate, ...]
    lanes: tuple[tuple[int, int], ...]

    @property
    def placements(self) -> list[core.Placement]:
        """Where the members stand, as the kernel wants it."""
        return [core.Placement(c.kind, c.at, c.wheelset) for c in self.members]

    def numbers(self) -> FloatArray:
        """Numbers [lane, all placements] with each lane's own shape at its own placement."""
        rows = []
        for member, shape in self.lanes:
            row: list[float] = []
            for i, c in enumerate(self.members):
                row += core.effect_numbers(c.kind, c.shapes[shape if i == member else 0])
            rows.append(row)
        return np.array(rows)

    def amounts(self, amount: float) -> FloatArray:
        """Amounts [lane, placement]: each lane has a little of its own."""
        out = np.zeros((len(self.lanes), len(self.members)))
        for lane, (member, _) in enumerate(self.lanes):
            out[lane, member] = amount
        return out


def batch_candidates(found: Sequence[Candidate]) -> list[CandidateBatch]:
    """Candidates packed into groups: many placements of a kind with few shapes, else one placement each."""
    out: list[CandidateBatch] = []
    by_kind: dict[str, list[Candidate]] = {}
    for c in found:
        by_kind.setdefault(c.kind, []).append(c)
    for members in by_kind.values():
        few = len(members[0].shapes) <= PACKED and core.record(members[0].kind)["supersedes"] is None
        packs = [members] if few else [[c] for c in members]
        for pack in packs:
            lanes = [(i, j) for i, c in enumerate(pack) for j in range(len(c.shapes))]
            size = core.LANES - 1
            size -= size % 2 if members[0].phased else 0  # what stands in two phases is seen in both at once
            for begin in range(0, len(lanes), size):
                part = lanes[begin : begin + size]
                used = sorted({i for i, _ in part})
                renamed = tuple((used.index(i), j) for i, j in part)
                out.append(CandidateBatch(tuple(pack[i] for i in used), renamed))
    return out
