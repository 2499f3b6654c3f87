"""Loops on the campaigns of Exudyn as a table: python -m tests.third_program.loops OUT [NAME ...]

Writes the campaigns into OUT and runs the loop on each; a loop that OUT has already is only read.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from railui.cli import cli
from railui.report.numbers import quantity_with_sd
from tests.third_program.campaign import CASES, Case, write

HEAD = "| campaign | verdict | effect | location | size, estimated | true | NRMSE | with the effect | noise floor |"
RULE = "| --- | --- | --- | --- | ---: | ---: | ---: | ---: | ---: |"
SIZES = {"force": "N", "half_width": "m", "gap": "m"}  # with their units; the runs of the rig are in SI units


def size_of(case: Case) -> str:
    """Name of the parameter that says how large an effect is."""
    return next(key for key in SIZES if key in case.effect)


def loop(case: Case, folder: Path) -> dict[str, Any]:
    """Report of the loop on a campaign, written and run where `folder` has none."""
    out = folder / "out"
    if not (out / "loop.json").is_file():
        write(case, folder)
        try:
            cli(["loop", str(folder), "-o", str(out), "--quiet"])
        except SystemExit as done:
            if done.code:
                raise RuntimeError(f"the loop on {folder} failed with exit code {done.code}") from None
    return dict(json.loads((out / "loop.json").read_text(encoding="utf-8")))


def row(name: str, report: Mapping[str, Any]) -> str:
    """One line of the table; an effect of another kind or location than the true one has no size."""
    case, effects = CASES[name], report["effects"]
    kinds = ", ".join(e["kind"] for e in effects) or "none"
    places = ", ".join(e["at"] + (f" {e['wheelset']}" if e["wheelset"] else "") for e in effects) or "none"
    key = size_of(case)
    size = next((e["parameters"][key] for e in effects if e["kind"] == case.effect["kind"]), None)
    unit = SIZES[key]
    estimate = "none" if size is None else quantity_with_sd(size["value"], size["sd"], unit)
    errors = (report[x]["nrmse"] for x in ("before", "after", "floor"))
    cells = (name, report["verdict"], kinds, places, estimate, quantity_with_sd(case.effect[key], None, unit))
    return "| " + " | ".join([*cells, *("none" if x is None else f"{x:.3f}" for x in errors)]) + " |"


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.third_program.loops", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("names", nargs="*", metavar="NAME", help=", ".join(CASES))
    given = p.parse_args(words)
    print(HEAD, RULE, sep="\n")
    for name in given.names or CASES:
        print(row(name, loop(CASES[name], given.out / name)), flush=True)


if __name__ == "__main__":
    main()
