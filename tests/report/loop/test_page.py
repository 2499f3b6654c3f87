"""The page of a loop: it says what was found, holds all its figures, and fetches nothing."""

from __future__ import annotations

import base64
import gzip
import shutil
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from railui import core
from railui.campaign import dataset
from railui.campaign.campaign import load_campaign
from railui.identification.estimation.validation import Validation
from railui.identification.loop import LoopResult, close_loop
from railui.identification.unmodelled.locate import Discrepancy
from railui.io.atomic import to_json_value
from railui.report.loop import driven, figures, laws
from railui.report.loop.data import loop_report
from railui.report.loop.page import page, write_page
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effects import default_at

CAMPAIGN = Path(__file__).parents[3] / "designs" / "campaigns" / "worn_axle_box"
SECONDS = 15
NAME = """worn <b>"axle" & box</b>"""
CHANNELS = ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")


def shortened(directory: Path) -> Path:
    """The bundled campaign, cut to its first seconds, with a name that wants escaping."""
    shutil.copy(CAMPAIGN / "vehicle.yaml", directory)
    text = (CAMPAIGN / "campaign.yaml").read_text(encoding="utf-8")
    named = text.replace("name: worn axle box", f"name: '{NAME}'")
    assert named != text
    (directory / "campaign.yaml").write_text(named, encoding="utf-8")
    for name in ("run_a.csv.gz", "run_b.csv.gz"):
        lines = gzip.decompress((CAMPAIGN / name).read_bytes()).decode("utf-8").splitlines()
        rows = next(i for i, line in enumerate(lines[1:]) if float(line.split(",")[0]) >= SECONDS)
        (directory / name).write_bytes(gzip.compress("\n".join(lines[: rows + 1]).encode("utf-8") + b"\n"))
    return directory


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> LoopResult:
    others = [r["kind"] for r in core.effect_catalogue() if r["kind"] not in ("free_play", "cubic_stiffness", "sensor_gain")]
    campaign = load_campaign(shortened(tmp_path_factory.mktemp("campaign")))
    return close_loop(dataset.read_dataset(campaign), without=others, jobs=2)


@pytest.fixture(scope="module")
def report(found: LoopResult) -> dict[str, Any]:
    return loop_report(found)


class Reader(HTMLParser):
    """What a browser would see: text, tags, addresses, pictures by their words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.text, self.tags, self.addresses = "", list[str](), list[str]()
        self.pictures: dict[str, str] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.addresses += [v or "" for k, v in attrs if k in ("src", "href", "srcset", "data", "action")]
        if tag == "img":
            self.pictures[given["alt"] or ""] = given["src"] or ""

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def text(found: LoopResult, report: dict[str, Any]) -> str:
    return page(found, report)


@pytest.fixture(scope="module")
def read(text: str) -> Reader:
    return Reader(text)


def test_the_page_opens_with_the_sentence_of_the_report(report: dict[str, Any], text: str) -> None:
    heading = text.split("<h1>")[1].split("</h1>")[0]
    assert Reader(heading).text == report["sentence"]


def test_what_people_wrote_is_text_and_never_markup(text: str, read: Reader) -> None:
    assert NAME not in text
    assert NAME in read.text
    assert text.count("<b>") == text.count("</b>")


def test_nothing_is_fetched_from_anywhere(text: str, read: Reader) -> None:
    assert read.addresses and all(a.startswith("data:image/svg+xml;base64,") for a in read.addresses)
    assert not {"script", "link", "iframe", "object", "base"} & set(read.tags)
    assert "http" not in text and "url(" not in text and "@import" not in text


def test_every_figure_is_there_and_is_whole(read: Reader) -> None:
    words = ["Bars of the error of every channel: declared, before, after, noise floor"]
    words += [f"{c} over time: measured, before, after" for c in CHANNELS]
    words += [f"Spectrum of {c}: measured, before, after" for c in CHANNELS]
    assert set(words) < set(read.pictures)
    assert any("force against displacement z" in alt for alt in read.pictures)
    for source in read.pictures.values():
        svg = ElementTree.fromstring(base64.b64decode(source.split(",")[1]))
        assert svg.tag.endswith("svg") and len(list(svg.iter())) > 50


def test_a_figure_fetches_nothing_either(read: Reader) -> None:
    link = "{http://www.w3.org/1999/xlink}href"
    for source in read.pictures.values():
        svg = ElementTree.fromstring(base64.b64decode(source.split(",")[1]))
        assert all(e.attrib.get(link, "#").startswith(("#", "data:")) for e in svg.iter())


def test_every_parameter_and_every_input_is_named(report: dict[str, Any], read: Reader) -> None:
    assert all(path in read.text for path in report["parameters"])
    assert all(run["sha256"] in read.text for run in report["runs"])
    assert all(effect["source"] in read.text for effect in map(core.effect_record, {e["kind"] for e in report["effects"]}))


def test_the_same_loop_gives_the_same_page(found: LoopResult, report: dict[str, Any], text: str) -> None:
    assert page(found, report) == text


def test_a_page_is_written_whole(found: LoopResult, report: dict[str, Any], text: str, tmp_path: Path) -> None:
    assert write_page(found, report, tmp_path / "report.html").read_text(encoding="utf-8") == text
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def diverged(found: LoopResult) -> Validation:
    """The vehicle before, had it diverged on the validating run."""
    return replace(found.validations["before"], nrmse=np.nan, channels=dict.fromkeys(CHANNELS, np.nan),
                   series=tuple(np.full_like(x, np.nan) for x in found.validations["before"].series),
                   diverged=(("run_b.csv.gz", 3.0),))  # fmt: skip


def test_a_vehicle_that_diverges_has_no_riding_quality(found: LoopResult) -> None:
    told = loop_report(replace(found, validations=found.validations | {"before": diverged(found)}))["riding"]
    assert told["before"] == dict.fromkeys(told["after"]) and None not in told["after"].values()


def test_a_vehicle_that_diverges_leaves_a_page(found: LoopResult, report: dict[str, Any]) -> None:
    lost = diverged(found)
    told = dict(report) | {"before": to_json_value({"nrmse": lost.nrmse, "channels": lost.channels, "constrained": False,
                                             "diverged": {"file": "run_b.csv.gz", "at_s": 3.0}})}  # fmt: skip
    text = page(replace(found, validations=found.validations | {"before": lost}), told)
    assert "before: the vehicle diverges on run_b.csv.gz at 3.00 s" in Reader(text).text
    assert "nan" not in Reader(text).text.lower().split()


def test_a_campaign_with_nothing_missing_has_a_page(found: LoopResult, report: dict[str, Any]) -> None:
    bare = replace(
        found, after=found.before, judged=found.validations | {"after": found.validations["before"]}, verdict="none"
    )
    told = dict(report) | {"effects": [], "classes": [], "verdict": "none", "sentence": "Nothing is missing."}
    told |= {"after": report["before"], "detectable": [r | {"value": None} for r in report["detectable"]]}
    read = Reader(page(bare, told))
    assert "What was found" not in read.text
    assert "nothing was added" in read.text


def test_a_curve_outside_the_catalogue_is_drawn_with_its_bars(found: LoopResult, report: dict[str, Any]) -> None:
    motion, force = np.linspace(-2e-3, 2e-3, 5), -np.array([-900.0, -100.0, 0.0, 100.0, 900.0])
    curve = {"motion": tuple(map(float, motion)), "force": tuple(map(float, force))}
    placed = PlacedEffect("measured_force", "primary_lateral", 2, curve, "z")
    fit = replace(found.before, model=found.before.model.with_effect(placed))
    told = Discrepancy(
        "primary_lateral", 2, "z", motion, force, np.full(5, 20.0), "m", "N", 0.9, fit, found.validations["after"]
    )
    one = replace(found, after=fit, discrepancy=told, verdict="outside")
    (law,) = laws.effect_figures(one, loop_report(one), figures.most_informative_window(found))
    assert law.title == "identified force curve: primary lateral, wheelset 2"
    assert [p.name for p in law.pictures] == ["outside-whole", "outside"]
    read = Reader(page(one, loop_report(one)))
    assert "outside the catalogue" in read.text and "two standard deviations" in read.text


def test_the_bench_returns_the_law_of_a_free_play() -> None:
    k, h, t = 4e6, 0.3e-3, np.arange(2000) * 0.005
    z = 1e-3 * np.sin(7.0 * t) * np.cos(1.3 * t)
    expected = k * np.sign(z) * np.maximum(np.abs(z) - h, 0.0)
    effect = PlacedEffect("free_play", "primary_lateral", None, {"half_width": h})
    force, speed = driven.restoring_force(z, 0.005, 2900.0, [effect], k, 0.0)
    assert np.abs(force - expected).max() < 1e-4 * np.abs(expected).max()
    assert np.abs(speed - np.gradient(z, 0.005))[1:-1].max() < 0.01 * np.abs(speed).max()


def test_the_bench_returns_a_spring_and_a_damper() -> None:
    t = np.arange(1000) * 0.005
    z, v = 1e-3 * np.sin(9.0 * t), 9e-3 * np.cos(9.0 * t)
    force, _ = driven.restoring_force(z, 0.005, 2900.0, [], 2e5, 3e4)
    assert np.abs(force - (2e5 * z + 3e4 * v)).max() < 1e-3 * np.abs(force).max()


# a curve is drawn from its points, below
@pytest.mark.parametrize(
    "record", [r for r in core.effect_catalogue() if r["kind"] not in core.CURVE_KINDS], ids=lambda r: r["kind"]
)
def test_every_effect_of_the_catalogue_is_drawn(
    found: LoopResult, report: dict[str, Any], record: dict[str, Any]
) -> None:
    model = found.before.model
    at = next((p for p in record["at"] if p != "rig"), record["at"][0])
    needed = [p for p in record["parameters"] if not p["optional"]]
    values = {p["key"]: default_at(p, at, model.design.values) or min(1e3, p["maximum"] or 1e3) for p in needed}
    placed = model.with_effect(PlacedEffect(record["kind"], at, None, values))
    one = replace(found, after=replace(found.before, model=placed))
    (law,) = laws.effect_figures(one, report, figures.most_informative_window(found))
    assert record["title"] in law.title
    assert law.pictures or "constant" in law.note


def test_the_report_is_imported_without_what_only_a_page_needs() -> None:
    code = "import sys, railui.report.loop.page; print(sorted({'matplotlib', 'jinja2'} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


@pytest.mark.skipif(not shutil.which("chromium"), reason="no chromium here")
def test_a_browser_shows_the_figures(text: str, tmp_path: Path) -> None:
    from matplotlib.image import imread

    (tmp_path / "report.html").write_text(text, encoding="utf-8")
    picture = tmp_path / "page.png"
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    command += [f"--screenshot={picture}", "--window-size=1000,1600", (tmp_path / "report.html").as_uri()]
    subprocess.run(command, capture_output=True, timeout=120, check=True)
    seen = np.round(255 * np.asarray(imread(picture))[..., :3]).astype(int)
    for name in ("before", "after"):
        colour = [int(figures.COLOURS[name][i : i + 2], 16) for i in (1, 3, 5)]
        assert np.sum(np.all(seen == colour, axis=-1)) > 200, f"no bar of {name} is seen"
