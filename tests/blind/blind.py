"""The loop tried blind on campaigns that it did not make: who is named, what is missed, what is cried for nothing.

python -m tests.blind.blind --campaigns 20 --seed 1000 -o blind.csv
"""

from __future__ import annotations

import argparse
import csv
import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from scipy.stats import beta

from railui.study.loop import Found, lookalikes, loop
from tests.blind.plants import Plant, alike, drawn
from tests.truth.campaign import campaigns, write

MATERIAL = 0.9  # floor over before from which nothing planted can lower the error by a tenth
ADEQUATE, CLEAN = 1.10, 1.5  # after over floor
BATCH = 1  # a campaign that derails holds up the others of its batch


@dataclass(frozen=True)
class Line:
    """One campaign of a trial: what was planted, what was found, whether that is right (None: does not apply)."""

    number: int
    sort: str
    planted: str
    nuisance: str
    verdict: str
    named: str
    right_name: bool | None
    right_class: bool | None
    right_place: bool | None
    declared: float
    before: float
    after: float
    floor: float
    best_rho2: float
    seconds: float
    problem: str = ""

    @property
    def material(self) -> bool:
        """Does what was planted raise the error enough to change a verdict?"""
        return self.before * MATERIAL > self.floor


def traced(plant: Plant, folder: Path) -> Line:
    """The loop on a campaign of a trial."""
    began = time.perf_counter()
    nan = float("nan")
    try:
        found = loop(folder, jobs=1)
    except Exception as problem:
        text = f"{type(problem).__name__}: {problem}"
        seconds = time.perf_counter() - began
        who = (plant.order.seed, plant.sort, plant.text, plant.nuisance)
        return Line(*who, "exception", "", False, False, False, nan, nan, nan, nan, nan, seconds, text)
    return judged(plant, found)


def judged(plant: Plant, found: Found) -> Line:
    """What was found held against what was planted."""
    named = [e for e in found.after.model.effects if e.kind != "measured_force"]
    words = [f"{e.kind} {e.at}{f' {e.wheelset}' if e.wheelset else ''}" for e in named]
    if found.outside:
        words.append(f"outside {found.outside.at}{f' {found.outside.wheelset}' if found.outside.wheelset else ''}")
    errors = {k: j.nrmse for k, j in found.judged.items()}
    name: bool | None
    kind: bool | None
    place: bool | None
    if plant.sort == "nothing":
        name = kind = place = found.verdict == "none"
    elif plant.sort == "outside":
        name = None
        kind = (
            found.verdict == "outside" or found.unexplained > CLEAN or errors["before"] * MATERIAL <= found.floor.nrmse
        )
        at = found.outside.at if found.outside else ""
        place = at in _places(plant.effects[0].at) if at else None
    else:
        classes = [kinds for step in found.steps if (kinds := lookalikes(step))]
        first = [{x for kinds in classes for x in kinds if e.kind in kinds} | {e.kind} for e in named]
        pairs = [[(e, more) for e, more in zip(named, first, strict=True) if e.at == p.at] for p in plant.effects]
        name = all(any(e.kind == p.kind for e, _ in near) for p, near in zip(plant.effects, pairs, strict=True))
        kind = all(
            any(p.kind in more or alike(p.kind, e.kind) for e, more in near)
            for p, near in zip(plant.effects, pairs, strict=True)
        )
        place = all(bool(near) for near in pairs)
    first_trace = found.steps[0].trace
    return Line(
        plant.order.seed, plant.sort, plant.text, plant.nuisance, found.verdict, " + ".join(words), name, kind, place,
        errors["declared"], errors["before"], errors["after"], found.floor.nrmse, first_trace.rho2, found.seconds,
    )  # fmt: skip


BESIDE = {
    "contact": ("contact", "wheelset", "wheelset_yaw"),
    "wheelset": ("wheelset", "wheelset_yaw", "contact"),
    "frame": ("frame", "secondary_lateral"),
    "frame_yaw": ("frame_yaw", "secondary_yaw"),
}


def _places(at: str) -> tuple[str, ...]:
    """Places that may stand for one."""
    return BESIDE.get(at, (at,))


def batch(job: tuple[list[Plant], Path, float]) -> list[Line]:
    """Campaigns drawn together and traced one after the other, until the time is over."""
    plants, home, until = job
    if time.time() > until:
        return []
    try:
        made = list(zip(plants, campaigns([p.order for p in plants]), strict=True))
    except ArithmeticError:
        made = []
        for plant in plants:
            try:
                made += [(plant, campaigns([plant.order])[0])]
            except ArithmeticError:
                continue  # derails whatever vehicle is drawn: no campaign of it can be measured
    lines = []
    for plant, campaign in made:
        if time.time() < until:
            folder = home / str(plant.order.seed)
            write(campaign, folder)
            lines.append(traced(plant, folder))
    return lines


def trial(plants: Sequence[Plant], home: Path, minutes: float, processes: int) -> Iterator[Line]:
    """Lines of a trial as they come."""
    until = time.time() + 60.0 * minutes
    for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(threads, "1")  # the processes inherit it
    jobs = [(list(plants[i : i + BATCH]), home, until) for i in range(0, len(plants), BATCH)]
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for lines in pool.imap_unordered(batch, jobs):
            yield from lines


def limits(right: int, of: int) -> tuple[float, float]:
    """95 % limits of a share, Clopper and Pearson."""
    low = float(beta.ppf(0.025, right, of - right + 1)) if right else 0.0
    high = float(beta.ppf(0.975, right + 1, of - right)) if right < of else 1.0
    return low, high


def counted(title: str, answers: Sequence[bool]) -> str:
    """A line of the totals."""
    right, of = sum(answers), len(answers)
    if not of:
        return f"{title:44s} none of them"
    low, high = limits(right, of)
    return f"{title:44s} {right:3d} of {of:3d}   {100 * right / of:5.1f} %   ({100 * low:.0f} to {100 * high:.0f} %)"


def totals(lines: Sequence[Line]) -> list[str]:
    """The totals of a trial with binomial limits."""
    one = [x for x in lines if x.sort == "catalogue" and x.material]
    two = [x for x in lines if x.sort == "two" and x.material]
    nothing = [x for x in lines if x.sort == "nothing"]
    strangers = [x for x in lines if x.sort == "outside" and (x.material or x.verdict == "exception")]
    # coloured noise and unmeasured forces are not in the floor: they leave up to 1.3 of it with the right effect
    clean = [x for x in [*one, *two] if not x.nuisance]
    weak = [x for x in lines if x.sort in ("catalogue", "two", "outside") and not x.material and x.after == x.after]
    out = [
        counted("right name, one effect", [bool(x.right_name) for x in one]),
        counted("right class, one effect", [bool(x.right_class) for x in one]),
        counted("right place, one effect", [bool(x.right_place) for x in one]),
        counted("both names, two effects", [bool(x.right_name) for x in two]),
        counted("both classes, two effects", [bool(x.right_class) for x in two]),
        counted("false alarms, nothing planted", [x.verdict in ("effect", "outside") for x in nothing]),
        counted("outside the catalogue not named cleanly", [bool(x.right_class) for x in strangers]),
        counted(
            "outside the catalogue, its place", [bool(x.right_place) for x in strangers if x.right_place is not None]
        ),
        counted("after at most 1.10 floor, noise as declared", [x.after <= ADEQUATE * x.floor for x in clean]),
        counted("exceptions", [x.verdict == "exception" for x in lines]),
        counted("diverged on a validating run", [not np.isfinite(x.after) and x.verdict != "exception" for x in lines]),
    ]
    if weak:
        out.append(
            f"{len(weak)} planted too weakly to gain a tenth; verdict none in {sum(x.verdict == 'none' for x in weak)}"
        )
    return out


HEAD = (
    f"{'no':>5s} {'planted':54s} {'nuisance':10s} {'verdict':9s} {'named':52s} name class  "
    "decl. before after floor  a/f    s"
)


def printed(x: Line) -> str:
    """A line of the table."""
    mark = {True: "yes", False: "NO", None: "-"}
    name, kind = mark[x.right_name], mark[x.right_class]
    if not x.material and x.verdict == "none" and x.sort != "nothing":
        name = kind = "weak"
    return (
        f"{x.number:5d} {x.planted:54.54s} {x.nuisance:10s} {x.verdict:9s} {(x.named or x.problem or '-'):52.52s} "
        f"{name:4s} {kind:5s} {x.declared:6.3f} {x.before:6.3f} {x.after:5.3f} {x.floor:5.3f} "
        f"{x.after / x.floor:5.2f} {x.seconds:4.0f}"
    )


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.blind.blind", description=__doc__)
    p.add_argument("--campaigns", type=int, default=20)
    p.add_argument("--seed", type=int, default=1000)
    p.add_argument("--seconds", type=float, nargs=2, default=(50.0, 35.0), help="length of both runs")
    p.add_argument("--minutes", type=float, default=60.0, help="no campaign is begun after")
    p.add_argument("--processes", type=int, default=2, choices=(1, 2))
    p.add_argument("--keep", type=Path, metavar="DIR", help="where the campaigns stay")
    p.add_argument("-o", "--output", type=Path, metavar="CSV")
    given = p.parse_args(words)
    lines = []
    with tempfile.TemporaryDirectory() as scratch:
        print(HEAD, flush=True)
        plants = drawn(given.campaigns, given.seed, tuple(given.seconds))
        for line in trial(plants, given.keep or Path(scratch), given.minutes, given.processes):
            print(printed(line), flush=True)
            lines.append(line)
    print("\n".join(["", *totals(lines)]))
    if given.output:
        with given.output.open("w", newline="") as file:
            writer = csv.DictWriter(file, [f.name for f in fields(Line)])
            writer.writeheader()
            writer.writerows(asdict(x) for x in sorted(lines, key=lambda x: x.number))


if __name__ == "__main__":
    main()
