"""Trial of the diagnosis of data faults: faults planted into the columns of simulated campaigns.

python -m tests.blind.faults -o docs/data_faults.md
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from railui.campaign.dataset import Dataset
from railui.campaign.faults.diagnose import diagnose
from railui.campaign.faults.fault import Diagnosis, Fault
from tests.bench.page import write_after
from tests.blind.cases import EFFECTS_NOT_IN_LIBRARY, STRONG, library_entries, planted_effect
from tests.blind.simulated import recorded
from tests.truth.campaign import Order, campaign
from tests.truth.effects import Effect

Columns = dict[str, np.ndarray]
Plant = Callable[[Columns, np.random.Generator], Columns]
SECONDS, SOUND_SECONDS = (30.0, 22.0), (16.0, 14.0)
WHEELBASE = 2.56  # m
CHANNEL_SETS = {
    "all eight channels": (),
    "no displacement of a wheelset": ("e1", "e2"),
    "one wheelset": ("e2", "ay2", "d2"),
    "accelerations and yaw rate only": ("e1", "e2", "d1", "d2"),
}


@dataclass(frozen=True)
class PlantedFault:
    """A fault: kind, channels as the diagnosis should name them, size in words, and what it does to the columns."""

    kind: str
    channels: tuple[str, ...]
    size: str
    plant: Plant

    @property
    def text(self) -> str:
        return f"{self.kind} {'+'.join(self.channels)} {self.size}".strip()


def scaled(*channels: str, gain: float) -> Plant:
    return lambda c, rng: {**c, **{x: gain * c[x] for x in channels if x in c}}


def retimed(*channels: str, delay: float = 0.0, rate: float = 1.0) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        t = c["t"]
        at = np.clip((t - t[0] - delay) / rate + t[0], t[0], t[-1])
        return {**c, **{x: CubicSpline(t, c[x])(at) for x in channels if x in c}}

    return plant


def moved_track(offset: float) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        s = c["s"]
        at = np.clip(s - offset, s[0], s[-1])
        return {**c, **{x: CubicSpline(s, c[x])(at) for x in ("yw", "phiw", "gauge") if x in c}}

    return plant


def exchanged(a: str, b: str) -> Plant:
    return lambda c, rng: {**c, a: c[b], b: c[a]} if a in c and b in c else c


def with_gravity(channel: str, g: float) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        trailing = np.interp(c["s"] - WHEELBASE, c["s"], c["phiw"])
        roll = {"ay1": c["phiw"], "ay2": trailing}.get(channel, 0.5 * (c["phiw"] + trailing))
        return {**c, channel: c[channel] + g * roll} if channel in c else c

    return plant


def clipped(channel: str, deviations: float) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        if channel not in c:
            return c
        limit = deviations * c[channel].std()
        return {**c, channel: np.clip(c[channel], -limit, limit)}

    return plant


def with_dropouts(channel: str, events: int, holds: bool) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        if channel not in c:
            return c
        x = c[channel].copy()
        for start in rng.choice(len(x) - 100, events, replace=False):
            x[start : start + 20] = x[start] if holds else 0.0
        return {**c, channel: x}

    return plant


def with_spikes(channel: str, size: float, rows: Sequence[int]) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        x = c[channel].copy()
        x[list(rows)] = size
        return {**c, channel: x}

    return plant


def with_hum(channel: str, frequency: float, share: float) -> Plant:
    def plant(c: Columns, rng: np.random.Generator) -> Columns:
        if channel not in c:
            return c
        wave = np.sqrt(2.0) * np.sin(2 * np.pi * frequency * c["t"])
        return {**c, channel: c[channel] + share * c[channel].std() * wave}

    return plant


def noisy(channel: str, sd: float) -> Plant:
    return lambda c, rng: {**c, channel: c[channel] + sd * rng.standard_normal(len(c["t"]))} if channel in c else c


def partly(plant: Plant, first: float, last: float) -> Plant:
    """Plant a fault between two shares of the samples only."""

    def plant_partly(c: Columns, rng: np.random.Generator) -> Columns:
        whole, n = plant(c, rng), len(c["t"])
        is_faulty = (np.arange(n) >= first * n) & (np.arange(n) < last * n)
        return {k: np.where(is_faulty, whole[k], x) for k, x in c.items()}

    return plant_partly


INERTIAL = ("ay1", "ay2", "ayf", "rf")
TRACK = ("yw", "phiw", "gauge")
SINGLE_FAULTS = [
    *(
        PlantedFault("sign", (c,), "", scaled(c, gain=-1.0))
        for c in ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")
    ),
    PlantedFault("sign", ("yw",), "", scaled("yw", gain=-1.0)),
    PlantedFault("sign", ("phiw",), "", scaled("phiw", gain=-1.0)),
    PlantedFault("sign", ("yw", "phiw"), "", scaled("yw", "phiw", gain=-1.0)),
    PlantedFault("unit", ("ay1",), "g", scaled("ay1", gain=1 / 9.81)),
    PlantedFault("unit", ("rf",), "deg/s", scaled("rf", gain=180 / np.pi)),
    PlantedFault("unit", ("d1",), "x 10", scaled("d1", gain=10.0)),
    PlantedFault("unit", ("ayf",), "x 1000", scaled("ayf", gain=1000.0)),
    PlantedFault("unit", ("e1",), "x 0.1", scaled("e1", gain=0.1)),
    PlantedFault("gain", ("ayf",), "x 3", scaled("ayf", gain=3.0)),
    PlantedFault("delay", ("e1",), "80 ms", retimed("e1", delay=0.08)),
    PlantedFault("delay", ("rf",), "120 ms", retimed("rf", delay=0.12)),
    PlantedFault("delay", ("d1", "d2"), "15 ms", retimed("d1", "d2", delay=0.015)),
    PlantedFault("clock", INERTIAL, "500 ppm", retimed(*INERTIAL, rate=1.0005)),
    PlantedFault("clock", ("e1", "e2"), "2000 ppm", retimed("e1", "e2", rate=1.002)),
    *(PlantedFault("track_offset", ("track",), f"{x:g} m", moved_track(x)) for x in (0.2, -0.5, 2.0)),
    PlantedFault("exchanged", ("e1", "e2"), "", exchanged("e1", "e2")),
    PlantedFault("exchanged", ("ay1", "ay2"), "", exchanged("ay1", "ay2")),
    PlantedFault("exchanged", ("d1", "d2"), "", exchanged("d1", "d2")),
    PlantedFault("exchanged", ("ay1", "ayf"), "", exchanged("ay1", "ayf")),
    PlantedFault("gravity", ("ay1",), "g", with_gravity("ay1", 9.81)),
    PlantedFault("gravity", ("ayf",), "-g", with_gravity("ayf", -9.81)),
    PlantedFault("clipping", ("d2",), "2 sd", clipped("d2", 2.0)),
    PlantedFault("clipping", ("ay1",), "2.5 sd", clipped("ay1", 2.5)),
    PlantedFault("dropouts", ("rf",), "zeros", with_dropouts("rf", 12, holds=False)),
    PlantedFault("dropouts", ("e2",), "held", with_dropouts("e2", 12, holds=True)),
    PlantedFault("hum", ("ayf",), "50 Hz", with_hum("ayf", 50.03, 0.5)),
    PlantedFault("hum", ("d1",), "16.7 Hz", with_hum("d1", 16.68, 0.5)),
]
INTERMITTENT_FAULTS = [
    *(
        PlantedFault("intermittent", (c,), "x 0.5 in the middle 40 %", partly(scaled(c, gain=0.5), 0.3, 0.7))
        for c in ("e1", "ay1", "ayf", "rf", "d2")
    ),
    PlantedFault("intermittent", ("ay2",), "x 0.1 in the last third", partly(scaled("ay2", gain=0.1), 0.67, 1.0)),
    PlantedFault("intermittent", ("ay1",), "6 times the noise in 40 %", partly(noisy("ay1", 0.3), 0.2, 0.6)),
    PlantedFault("intermittent", ("e2",), "6 times the noise in 40 %", partly(noisy("e2", 3e-4), 0.2, 0.6)),
]


def fault_pairs(count: int, seed: int) -> list[tuple[PlantedFault, PlantedFault]]:
    """Draw pairs of faults of different channels."""
    rng = np.random.default_rng([seed, 91])
    pairs: list[tuple[PlantedFault, PlantedFault]] = []
    while len(pairs) < count:
        a, b = (SINGLE_FAULTS[int(k)] for k in rng.choice(len(SINGLE_FAULTS), 2, replace=False))
        if not set(a.channels) & set(b.channels) and {"track", "yw", "phiw"} - set(a.channels) - set(b.channels):
            pairs.append((a, b))
    return pairs


def with_faults(
    dataset: Dataset, faults: Sequence[PlantedFault], missing: Sequence[str] = (), runs: Collection[str] = ()
) -> Dataset:
    """Return a dataset with faults in some or by default all of its runs, and without some channels."""
    segments = []
    for i, segment in enumerate(dataset.segments):
        columns = {k: x for k, x in segment.columns.items() if k not in missing}
        for fault in faults if not runs or segment.file in runs else ():
            columns = fault.plant(columns, np.random.default_rng([i, 92]))
        segments.append(replace(segment, columns=columns, tables={}))
    return replace(dataset, segments=tuple(segments))


def outcome(diagnosis: Diagnosis, planted: Sequence[PlantedFault]) -> str:
    """Classify a diagnosis: found, ambiguous, partly found, missed or wrong channel."""
    expected = {(f.kind, frozenset(f.channels)) for f in planted}
    named = {_named(f, planted): f for f in diagnosis.serious}
    if set(named) == expected:
        return "ambiguous" if any(f.alternatives for f in named.values()) else "found"
    if set(named) < expected:
        return "partly found" if named else "missed"
    true_channels = {c for f in planted for c in f.channels}
    true_channels |= set(TRACK) if "track" in true_channels else set()
    named_channels = {c for f in diagnosis.serious for c in f.channels}
    return "correct channel, other kind" if named_channels <= true_channels | {"track"} else "wrong channel"


def _named(fault: Fault, planted: Sequence[PlantedFault]) -> tuple[str, frozenset[str]]:
    """Kind and channels of a fault; of a planted one that an intermittent fault has as its alternative."""
    for p in planted if fault.kind == "intermittent" else ():
        if p.kind == fault.kind and any(f"{{{p.channels[0]}: {{leave_out" in line for line in fault.alternatives):
            return p.kind, frozenset(p.channels)
    return fault.kind, frozenset(fault.channels)


@dataclass
class Row:
    """Result of a case."""

    campaign: str
    channels: str
    planted: str
    kind: str
    result: str
    seconds: float
    named: str


def simulated(name: str, effects: Sequence[Effect], **options: object) -> tuple[str, Dataset]:
    """Simulate a campaign."""
    order = Order(tuple(effects), **{"seconds": SECONDS, "name": name, **options})  # type: ignore[arg-type]
    return name, recorded(campaign(order))


def planted_campaigns(count: int) -> list[tuple[str, Dataset]]:
    """Simulate the campaigns into which faults are planted."""
    friction = planted_effect(("dry_friction", "primary_lateral", None), STRONG)
    saturation = planted_effect(("creep_saturation", "contact", None), STRONG)
    campaigns = (("no effect", ()), ("dry friction", (friction,)), ("creep saturation", (saturation,)))
    return [simulated(name, effects, seed=501 + k) for k, (name, effects) in enumerate(campaigns[:count])]


def examine(name: str, dataset: Dataset, planted: Sequence[PlantedFault], channels: str) -> Row:
    """Plant faults and diagnose them."""
    faulty = with_faults(dataset, planted, CHANNEL_SETS[channels])
    started = time.process_time()
    diagnosis = diagnose(faulty)
    seconds = time.process_time() - started
    named = "; ".join(f"{f.kind} {'+'.join(f.channels)}" for f in diagnosis.serious)
    kind = " and ".join(sorted(f.kind for f in planted)) or "none"
    text = " and ".join(f.text for f in planted) or "none"
    return Row(name, channels, text, kind, outcome(diagnosis, planted), seconds, named)


def false_alarms(count: int) -> list[Row]:
    """Diagnose sound campaigns: strong effects of the library and others, noise beyond what is stated."""
    rows = []
    orders: list[tuple[str, tuple[Effect, ...], Mapping[str, object]]] = [
        *((" ".join(map(str, e)), (planted_effect(e, STRONG),), {}) for e in library_entries()),
        *((e.kind, (e,), {}) for e in EFFECTS_NOT_IN_LIBRARY),
        ("coloured sensor noise", (), {"coloured": 0.05}),
        ("unmeasured force", (), {"unmeasured": 1500.0}),
        ("track noise of 0.2 mm", (), {"noise": {"yw": 2e-4, "phiw": 2e-4}}),
        ("five times the stated noise", (), {"noise": {"e1": 2.5e-4, "e2": 2.5e-4, "ay1": 0.25, "ay2": 0.25, "ayf": 0.1,
                                                       "rf": 1.5e-3, "d1": 1e-4, "d2": 1e-4}, "coloured": 0.2}),
    ]  # fmt: skip
    chosen = [*orders[-4:], *orders[:-4][:: max(len(orders) // max(count, 1), 1)]][:count]
    for k, (name, effects, options) in enumerate(chosen):
        try:
            _, dataset = simulated(name, effects, seed=700 + k, seconds=SOUND_SECONDS, **options)
        except (ArithmeticError, ValueError) as error:
            print(f"{name}: not simulated, {error}", flush=True)
            continue
        print(name, flush=True)
        for channels in CHANNEL_SETS:
            rows.append(examine(name, dataset, (), channels))
            if rows[-1].named:
                print(f"FALSE ALARM {name}, {channels}: {rows[-1].named}", flush=True)
    return rows


def tables(rows: Sequence[Row], sound: Sequence[Row]) -> str:
    """Return the tables of the results."""
    results = ("found", "ambiguous", "correct channel, other kind", "partly found", "missed", "wrong channel")
    lines = []
    alarms = [r for r in sound if r.named]
    campaigns = len({r.campaign for r in sound})
    lines.append(f"Sound data: {len(sound)} diagnoses of {campaigns} campaigns, {len(alarms)} false alarms.\n")
    for channels in CHANNEL_SETS:
        part = [r for r in rows if r.channels == channels]
        if not part:
            continue
        lines += [
            f"## Faults, {channels}\n",
            f"| kind | cases | {' | '.join(results)} |",
            "| --- " * (len(results) + 2) + "|",
        ]
        for kind in dict.fromkeys(r.kind for r in part):
            counts = Counter(r.result for r in part if r.kind == kind)
            lines.append(
                f"| {kind} | {sum(counts.values())} | " + " | ".join(str(counts[x] or "") for x in results) + " |"
            )
        lines.append("")
    worst = [r for r in rows if r.result not in ("found", "ambiguous")]
    lines += [
        "## Cases that were not found\n",
        "| campaign | channels | planted | result | named |",
        "| --- " * 5 + "|",
    ]
    lines += [f"| {r.campaign} | {r.channels} | {r.planted} | {r.result} | {r.named or '-'} |" for r in worst]
    seconds = np.array([r.seconds for r in rows])
    if not worst:
        lines.append("| - | - | - | - | - |")
    lines.append(
        f"\nProcessor time per diagnosis: {np.median(seconds):.1f} s in the median, {seconds.max():.1f} s at most."
    )
    return "\n".join(lines) + "\n"


def planted_rows(pairs: int, campaigns: int) -> list[Row]:
    """Plant every fault alone and some pairs."""
    rows: list[Row] = []
    for i, (name, dataset) in enumerate(planted_campaigns(campaigns)):
        for channels in list(CHANNEL_SETS) if i == 0 else list(CHANNEL_SETS)[:1]:
            for fault in (*SINGLE_FAULTS, *INTERMITTENT_FAULTS):
                if not set(fault.channels) & set(CHANNEL_SETS[channels]):
                    rows.append(examine(name, dataset, (fault,), channels))
                    print(rows[-1], flush=True)
        for pair in fault_pairs(pairs, i) if i < 2 else []:
            rows.append(examine(name, dataset, pair, next(iter(CHANNEL_SETS))))
            print(rows[-1], flush=True)
    return rows


def main() -> None:
    """The command line; each part can be computed by itself, --rows joins them."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.faults", description=__doc__)
    p.add_argument("-o", "--out", type=Path, default=Path("docs/data_faults.md"))
    p.add_argument("--pairs", type=int, default=12, help="number of pairs in each of two campaigns")
    p.add_argument("--campaigns", type=int, default=3, help="campaigns into which faults are planted, 3 at most")
    p.add_argument("--sound", type=int, default=84, help="number of sound campaigns, all library effects at most")
    p.add_argument("--save", type=Path, help="write the rows of this part as JSON, no page")
    p.add_argument("--skip-planted", action="store_true")
    p.add_argument("--rows", type=Path, nargs="*", default=[], help="rows of other parts")
    given = p.parse_args()
    rows = [Row(**row) for file in given.rows for row in json.loads(file.read_text())]
    rows += false_alarms(given.sound) if given.sound else []
    rows += [] if given.skip_planted else planted_rows(given.pairs, given.campaigns)
    if given.save:
        given.save.write_text(json.dumps([asdict(row) for row in rows]))
        return
    write_after(given.out, tables([r for r in rows if r.kind != "none"], [r for r in rows if r.kind == "none"]))


if __name__ == "__main__":
    main()
