"""The page of a loop: sentence, escaping, figures, provenance, divergence, no external resources."""

from __future__ import annotations

import base64
import json
import re
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
from railui.identification.estimation.validation import Validation
from railui.identification.result import LoopResult
from railui.io.atomic import to_json_value
from railui.report.loop import figures
from railui.report.loop.data import loop_report
from railui.report.loop.files import write_loop
from railui.report.loop.notes import report_notes
from railui.report.loop.page import _notes, render_page, write_page
from tests.report.loop.names import CAMPAIGN_NAME, CHANNELS


class Reader(HTMLParser):
    """Text, tags, addresses, and pictures by their alternative text."""

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
def html(loop_result: LoopResult, report: dict[str, Any]) -> str:
    return render_page(loop_result, report)


@pytest.fixture(scope="module")
def reader(html: str) -> Reader:
    return Reader(html)


def test_the_heading_is_the_sentence_of_the_report(report: dict[str, Any], html: str) -> None:
    heading = html.split("<h1>")[1].split("</h1>")[0]
    assert Reader(heading).text == report["sentence"]


def test_names_from_files_are_text_and_never_markup(html: str, reader: Reader) -> None:
    assert CAMPAIGN_NAME not in html
    assert CAMPAIGN_NAME in reader.text
    assert html.count("<b>") == html.count("</b>")


def test_nothing_is_fetched_from_elsewhere(html: str, reader: Reader) -> None:
    assert reader.addresses and all(a.startswith("data:image/svg+xml;base64,") for a in reader.addresses)
    assert not {"link", "iframe", "object", "base"} & set(reader.tags)
    assert re.findall(r"<script[^>]*>", html) == ['<script type="application/json" id="viewer-data">', "<script>"]
    assert "http" not in html and "url(" not in html and "@import" not in html


def test_every_figure_is_present_and_complete(reader: Reader) -> None:
    models = "measured, calibrated, calibrated + effect"
    expected = {"Bars of the error of every channel: nominal, calibrated, calibrated + effect, noise floor"}
    expected |= {f"{channel} over time: {models}" for channel in CHANNELS}
    expected |= {f"Spectrum of {channel}: {models}" for channel in CHANNELS}
    assert expected < set(reader.pictures)
    assert any("force against displacement z" in alt for alt in reader.pictures)
    for source in reader.pictures.values():
        svg = ElementTree.fromstring(base64.b64decode(source.split(",")[1]))
        assert svg.tag.endswith("svg") and len(list(svg.iter())) > 50


def test_no_figure_refers_to_another_file(reader: Reader) -> None:
    link = "{http://www.w3.org/1999/xlink}href"
    for source in reader.pictures.values():
        svg = ElementTree.fromstring(base64.b64decode(source.split(",")[1]))
        assert all(e.attrib.get(link, "#").startswith(("#", "data:")) for e in svg.iter())


def test_the_header_states_origin_runs_channels_and_what_to_inspect(html: str) -> None:
    header = html.split('<div class="facts">')[1].split("</div>")[0]
    text = " ".join(Reader(header.replace("<dd>", " <dd>")).text.split())
    assert "simulated runs: nothing was measured" in text
    assert re.search(r"estimation runs 1 run, 15\.0 s, .* at 3\d.* m/s", text)
    assert "channels 8: e1, e2" in text and "inspect clearance in the lateral primary suspension" in text


def test_the_viewer_holds_the_measured_series_within_its_quantisation(html: str, loop_result: LoopResult) -> None:
    source = html.split('id="viewer-data">')[1].split("</script>")[0]
    (run,) = json.loads(source)
    measured = figures.compared_series(loop_result, 0)["measured"]
    channel = next(c for c in run["channels"] if c["name"] == "e1")
    series = channel["series"]["measured"]
    levels = np.frombuffer(base64.b64decode(series["data"]), dtype="<u2")
    shown = series["low"] + series["step"] * levels
    assert channel["unit"] == "mm" and len(run["channels"]) == len(CHANNELS)
    assert np.max(np.abs(shown - 1e3 * measured[0])) <= 0.51 * series["step"] + 1e-9


def test_a_name_in_the_viewer_cannot_end_its_script(loop_result: LoopResult, report: dict[str, Any]) -> None:
    segment = replace(loop_result.dataset.validation[0], file="</script><b>")
    segments = tuple(segment if s.role == "validate" else s for s in loop_result.dataset.segments)
    dataset = replace(loop_result.dataset, segments=segments)
    html = render_page(replace(loop_result, context=replace(loop_result.context, dataset=dataset)), report)
    assert "</script><b>" not in html


def test_residuals_are_drawn_in_time_spectrum_autocorrelation_and_coherence(reader: Reader) -> None:
    for channel in CHANNELS:
        assert f"Residual of {channel} over time" in reader.pictures
        assert f"Spectrum of the residual of {channel} and of its noise" in reader.pictures
    assert sum(alt.startswith("Autocorrelation of the whitened residual") for alt in reader.pictures) == 4
    assert sum(alt.startswith("Coherence of") for alt in reader.pictures) == 4


def test_the_matrix_of_correlations_has_a_row_for_every_estimate(loop_result: LoopResult, html: str) -> None:
    matrix = html.split('<table class="matrix">')[1].split("</table>")[0]
    assert matrix.count("<code>") == len(loop_result.after.free.paths)
    assert matrix.count('class="cell diagonal"') == len(loop_result.after.free.paths)


def test_every_parameter_input_and_source_is_named(report: dict[str, Any], reader: Reader) -> None:
    assert all(path in reader.text for path in report["parameters"])
    assert all(run["sha256"] in reader.text for run in report["runs"])
    assert all(core.effect_record(effect["kind"])["source"] in reader.text for effect in report["effects"])


def test_the_page_separates_validation_from_the_independent_test(reader: Reader) -> None:
    text = " ".join(reader.text.split())
    assert "they decide which effects are accepted; the independent test is on runs or parts of runs" in text


def test_equal_loops_give_equal_pages(loop_result: LoopResult, report: dict[str, Any], html: str) -> None:
    assert render_page(loop_result, report) == html


def test_a_page_is_written_atomically(
    loop_result: LoopResult, report: dict[str, Any], html: str, tmp_path: Path
) -> None:
    assert write_page(loop_result, report, tmp_path / "report.html").read_text(encoding="utf-8") == html
    assert [f.name for f in tmp_path.iterdir()] == ["report.html"]


def diverged(result: LoopResult) -> Validation:
    """Return the validation of the calibrated model as if it had diverged."""
    before = result.validations["before"]
    return replace(
        before,
        nrmse=np.nan,
        channels=dict.fromkeys(CHANNELS, np.nan),
        series=tuple(np.full_like(x, np.nan) for x in before.series),
        diverged=(("run_b.csv.gz", 3.0),),
    )


def test_a_diverged_model_has_no_ride_quality(loop_result: LoopResult) -> None:
    validations = loop_result.validations | {"before": diverged(loop_result)}
    riding = loop_report(replace(loop_result, validations=validations))["riding"]
    assert riding["before"] == dict.fromkeys(riding["after"]) and None not in riding["after"].values()


def test_a_diverged_model_has_a_page(loop_result: LoopResult, report: dict[str, Any]) -> None:
    validation = diverged(loop_result)
    errors = {"nrmse": validation.nrmse, "channels": validation.channels, "constrained": False}
    errors["diverged"] = {"file": "run_b.csv.gz", "at_s": 3.0}
    validations = loop_result.validations | {"before": validation}
    result = replace(loop_result, validations=validations)
    text = Reader(render_page(result, report | {"before": to_json_value(errors)})).text
    assert "calibrated: the simulation diverges on run_b.csv.gz at 3.00 s" in text
    assert "nan" not in text.lower().split()


def test_a_campaign_without_an_effect_has_a_page(loop_result: LoopResult, report: dict[str, Any]) -> None:
    validations = loop_result.validations | {"after": loop_result.validations["before"]}
    result = replace(loop_result, after=loop_result.before, validations=validations, verdict="none")
    without_effect = {"effects": [], "classes": [], "verdict": "none", "after": report["before"]}
    detectable = [row | {"value": None} for row in report["detectable"]]
    reader = Reader(render_page(result, report | without_effect | {"detectable": detectable}))
    assert "Identified effect" not in reader.text
    assert "no effect added" in reader.text and "no unmodelled effect detected" in reader.text


def test_the_report_is_imported_without_matplotlib_and_jinja() -> None:
    code = "import sys, railui.report.loop.page; print(sorted({'matplotlib', 'jinja2'} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


@pytest.mark.skipif(not shutil.which("chromium"), reason="no chromium here")
def test_a_browser_shows_the_figures(html: str, tmp_path: Path) -> None:
    from matplotlib.image import imread

    (tmp_path / "report.html").write_text(html, encoding="utf-8")
    picture = tmp_path / "page.png"
    command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}"]
    command += [f"--screenshot={picture}", "--window-size=1000,1600", (tmp_path / "report.html").as_uri()]
    subprocess.run(command, capture_output=True, timeout=120, check=True)
    pixels = np.round(255 * np.asarray(imread(picture))[..., :3]).astype(int)
    for model in ("before", "after"):
        colour = [int(figures.COLOURS[model][i : i + 2], 16) for i in (1, 3, 5)]
        assert np.sum(np.all(pixels == colour, axis=-1)) > 200, f"no bar of {model} is visible"


def test_the_vehicle_is_drawn_with_its_sensors_and_effects(reader: Reader, report: dict[str, Any]) -> None:
    (alt,) = [alt for alt in reader.pictures if alt.startswith("Schematic of the vehicle")]
    svg = base64.b64decode(reader.pictures[alt].partition("base64,")[2]).decode("utf-8")
    for name in report["before"]["channels"]:
        assert svg.count(f'class="sensor" data-key="{name}"') == 1
    effects = report["effects"]
    assert effects and svg.count('class="halo"') == len(effects)
    for effect in effects:
        assert core.effect_record(effect["kind"])["title"] in alt
        assert f'class="halo" data-key="{effect["at"]}' in svg


def test_a_divergence_without_an_effect_is_noted_once(loop_result: LoopResult) -> None:
    validation = diverged(loop_result)
    validations = loop_result.validations | {"before": validation, "after": validation}
    fields = {"after": loop_result.before, "discrepancy": None, "validations": validations}
    result = replace(loop_result, **fields)
    assert len([note for note in report_notes(result) if "diverges" in note]) == 1
    errors = {"nrmse": None, "channels": {}, "diverged": {"file": "run_b.csv.gz", "at_s": 3.0}}
    assert len(_notes({"declared": {}, "before": errors, "after": errors})) == 1


def test_series_of_other_runs_are_removed_from_the_directory(
    loop_result: LoopResult, report: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "simulated_other.csv.gz").touch()
    write_loop(loop_result, report, tmp_path, [])
    assert {file.name for file in tmp_path.glob("simulated_*")} == {
        "simulated_run_a.csv.gz",
        "simulated_run_b.csv.gz",
    }


def test_a_figure_that_fails_costs_the_page_alone(
    loop_result: LoopResult, report: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise IndexError("no lags")

    monkeypatch.setattr("railui.report.loop.files.write_page", fail)
    with pytest.raises(IndexError, match="no lags"):
        write_loop(loop_result, report, tmp_path, ["verdict effect"])
    assert json.loads((tmp_path / "loop.json").read_text(encoding="utf-8")) == json.loads(json.dumps(report))
    assert (tmp_path / "log.txt").read_text(encoding="utf-8") == "verdict effect\n"
    assert {file.name for file in tmp_path.iterdir()} >= {"adjusted.yaml", "simulated_run_b.csv.gz"}
