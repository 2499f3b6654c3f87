"""The page of an optimisation: front, knee point, baseline, spread, failures, provenance."""

from __future__ import annotations

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from railui.cli import cli
from railui.optimisation.study import Variable
from railui.report.numbers import digits_apart, format_number
from railui.report.search.page import front_note, selected_designs, sentence
from tests.execution.small import write_study


class Page(HTMLParser):
    """Text by section, tables by section as rows of cells, pictures by section."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.section, self.words = "", dict[str, str]()
        self.rows: dict[str, list[list[str]]] = {}
        self.pictures: dict[str, list[str]] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag == "section":
            self.section = given.get("id") or ""
        elif tag == "tr":
            self.rows.setdefault(self.section, []).append([])
        elif tag in ("td", "th") and self.rows.get(self.section):
            self.rows[self.section][-1].append("")
        elif tag == "img":
            self.pictures.setdefault(self.section, []).append(given.get("src") or "")

    def handle_data(self, data: str) -> None:
        self.words[self.section] = self.words.get(self.section, "") + data
        if self.rows.get(self.section) and self.rows[self.section][-1]:
            self.rows[self.section][-1][-1] += data.strip()


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> tuple[Page, dict[str, Any], str]:
    home = tmp_path_factory.mktemp("study")
    study = write_study(home, length=200, population=8, generations=3)
    done = CliRunner().invoke(cli, ["optimise", str(study), "-o", str(home / "out"), "-q"])
    assert done.exit_code == 0, done.output
    text = (home / "out" / "report.html").read_text("utf-8")
    return Page(text), json.loads((home / "out" / "result.json").read_text("utf-8")), text


def test_every_design_of_the_front_is_in_the_table_with_its_objectives(searched: tuple[Page, dict[str, Any], str]):
    page, result, _ = searched
    rows = page.rows["table"][1:]
    assert [int(row[0]) for row in rows] == list(range(len(result["pareto"])))
    shown = list(zip(*(row[3:5] for row in rows), strict=True))
    for cells, values in zip(
        shown, zip(*(point["objectives"] for point in result["pareto"]), strict=True), strict=True
    ):
        digits = digits_apart(values)
        assert list(cells) == [format_number(x, digits) for x in values]
        assert len(set(cells)) == len(set(values))
    head = page.rows["table"][0]
    met = head.index("linear_damping >= 0.02")
    assert all(
        row[met].endswith(f"({p['fresh']['met'][0]} of 8)") for row, p in zip(rows, result["pareto"], strict=True)
    )
    assert rows[result["knee"]][head.index("flange margin, worst, minus the knee point")] == "–"


def test_baseline_and_knee_point_are_shown_with_their_spread_on_fresh_seeds(
    searched: tuple[Page, dict[str, Any], str],
):
    page, result, _ = searched
    head, *rows = page.rows["chosen"]
    assert head[2] == "baseline" and head[3] == f"knee point ({result['knee']})"
    aims = [row for row in rows if row[0].startswith(("minimise", "maximise"))]
    knee = result["pareto"][result["knee"]]
    digits = [digits_apart(values) for values in zip(*(p["objectives"] for p in result["pareto"]), strict=True)]
    assert [row[2] for row in aims] == list(map(format_number, result["baseline"]["objectives"], digits))
    assert [row[3] for row in aims] == list(map(format_number, knee["objectives"], digits))
    fresh = [row[3] for row in rows if row[0] == "on fresh seeds"]
    assert len(fresh) == len(aims) and all("±" in cell for cell in fresh)
    changes = [row[3] for row in rows if row[0] == "minus the baseline"]
    for cell, mean, p_value in zip(
        changes, *(knee["fresh"]["minus_baseline"][key] for key in ("mean", "p_value")), strict=True
    ):
        assert cell.startswith("−") == (mean < 0) and ("n. s." in cell) == (p_value >= 0.05)
    assert "smaller differences are not significant" not in page.words["front"]


def test_a_track_file_has_no_fresh_seeds(tmp_path: Path) -> None:
    """A file without seeds: neither table nor page speaks of a second evaluation."""
    track = CliRunner().invoke(cli, ["track", "erri_b176_low", "length=200", "-o", str(tmp_path / "line.csv")])
    assert track.exit_code == 0
    study = write_study(tmp_path, population=8, generations=2)
    text = study.read_text("utf-8").replace("erri_b176_low length=300", "line.csv").replace("  seed: [1, 2]\n", "")
    study.write_text(text, "utf-8")
    plan = CliRunner().invoke(cli, ["optimise", str(study), "--dry-run"])
    done = CliRunner().invoke(cli, ["optimise", str(study), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "fresh: null, the tracks are files without seeds" in done.output
    for words in (plan.output, done.output, Page(page).words["front"], Page(page).words["chosen"]):
        assert "fresh seeds" not in words and "Crosses" not in words
    assert "fresh" not in Page(page).words["table"]


def test_the_sentences_fit_the_size_of_the_front() -> None:
    aims = [{"key": "wear_number", "over": "worst"}, {"key": "score", "over": "mean"}]
    point = {"objectives": [100.0, 50.0]}
    report: dict[str, Any] = {"aims": aims, "baseline": point, "pareto": [point], "knee": 0, "limits": []}
    assert sentence(report).startswith("Best design in every objective: wear number, worst 100")
    assert sentence(report | {"aims": aims[:1]}).startswith("Best design: wear number")
    assert sentence(report | {"pareto": [point] * 2}).startswith("Knee point of a Pareto front of 2 designs: ")
    assert front_note(report | {"nondominated": 1}) == (
        "No design tried is better than a design of the front in every objective."
    )
    note = front_note(report | {"nondominated": 9, "limits": ["wear_number <= 200"]})
    assert note == (
        "No design tried that meets the constraints is better than a design of the front in every objective. "
        "9 such designs were found, of which the front has 1."
    )


def test_a_value_at_a_bound_of_the_search_range_is_marked():
    """Over two decades the search is logarithmic: 1.5e3 is 9 % of the way from 1e3 to 1e5."""
    path = "vehicle.secondary.yaw_damping"
    study = SimpleNamespace(variables=[Variable(path, 1e3, 1e5, "N*m*s/rad")], constraints=[])

    def point(value: float) -> dict[str, Any]:
        fresh = {"mean": [], "sd": [], "failed": 0}
        return {"variables": {path: value}, "objectives": [], "constraints": [], "fresh": fresh}

    report = {"baseline": point(1.5e3), "pareto": [point(1e5)], "knee": 0, "aims": [], "limits": []}
    table = selected_designs(study, report)  # type: ignore[arg-type]
    assert table["rows"] == [{"name": path, "unit": "kN·m·s/rad", "cells": ["1.50", "100 (bound)"]}]


def test_the_page_shows_designs_failures_and_sources(searched: tuple[Page, dict[str, Any], str]):
    page, result, _ = searched
    assert ["designs", str(result["evaluations"])] in page.rows["search"]
    assert ["failed", str(result["failed"])] in page.rows["search"]
    assert result["inputs"]
    for source in result["inputs"]:
        assert source["sha256"][:12] in page.words["provenance"]


def test_every_section_has_its_pictures_and_nothing_is_fetched(
    searched: tuple[Page, dict[str, Any], str],
):
    page, _, text = searched
    for section in ("front", "parallel", "search", "sensitivities"):
        assert page.pictures[section], section
        for source in page.pictures[section]:
            kind, _, data = source.partition(",")
            assert kind.startswith("data:image/") and len(base64.b64decode(data)) > 2000
    assert not re.search(r"(src|href)=\"(?!data:|#)", text)
