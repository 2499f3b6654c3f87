"""Editing and writing files: only the value changes, comments remain, writing is atomic."""

from __future__ import annotations

import gzip
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from railui.campaign.campaign import load_campaign
from railui.documents.saving import design_text, save_campaign, save_design
from railui.io.atomic import canonical_json, sha256, sha256_file, write_bytes, write_text
from railui.io.problems import Problem
from railui.io.yaml_document import parse_yaml
from railui.io.yaml_edit import edit_values
from railui.vehicle.design import Adjustment
from railui.vehicle.design_reader import PlacedEffect, load_design, parse_design
from railui.vehicle.parameters import FORMS

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]


def test_a_changed_value_keeps_its_unit_and_the_comments_around_it(bogie: str) -> None:
    edited = edit_values(bogie, {"vehicle.primary.lateral_stiffness": 3.2e6, "name": "other bogie"})
    assert edited == bogie.replace("3.0 MN/m", "3.2 MN/m").replace("test bogie ", "other bogie ")
    assert "# declared" in edited


def test_a_text_value_is_written_as_it_is(bogie: str) -> None:
    assert edit_values(bogie, {"vehicle.wheel_load": "60 kN"}) == bogie.replace("55 kN", "60 kN")


def test_an_absent_key_is_added_in_the_style_of_the_group() -> None:
    text = "a: {b: 1}  # flow\nc:\n  d: 2  # block\n  # tail\n\ne:\n"
    assert edit_values(text, {"a.x": 3, "c.y": 4, "e.z": 5, "f.g": "on"}) == (
        "a: {b: 1, x: 3}  # flow\nc:\n  d: 2  # block\n  y: 4\n  # tail\n\ne: {z: 5}\nf: {g: on}\n"
    )


def test_lists_are_edited_and_extended() -> None:
    text = "effects:\n- kind: a   # one\n  gap: 1 mm\n- {kind: b}\n"
    edited = edit_values(text, {"effects.0.gap": 0.002, "effects.1.x": 1, "effects.2": {"kind": "c"}})
    assert edited == "effects:\n- kind: a   # one\n  gap: 2 mm\n- {kind: b, x: 1}\n- {kind: c}\n"
    assert edit_values(text, {"effects": []}) == "effects: []\n"


def test_keys_that_are_paths_themselves_are_found() -> None:
    text = "variables: {vehicle.wheel_load: [1 kN, 2 kN]}\n"
    assert parse_yaml(edit_values(text, {"variables.vehicle.wheel_load": ["1 kN", 3.0]})).value["variables"] == {
        "vehicle.wheel_load": ["1 kN", 3]
    }


def test_windows_line_ends_stay() -> None:
    assert edit_values("a: 1\r\nb: 2\r\n", {"a": 3, "c": 4}) == "a: 3\r\nb: 2\r\nc: 4\r\n"


def test_a_text_block_is_replaced_whole() -> None:
    assert edit_values("a: |\n  one\n  two\nb: 1\n", {"a": "three"}) == "a: three\nb: 1\n"


@pytest.mark.parametrize(("text", "path"), [("l: &a {x: 1}\nt: *a\n", "t.x"), ("a: [1]\n", "a.3"), ("a: b\n", "a.c")])
def test_an_impossible_edit_is_rejected(text: str, path: str, problems_of: ProblemsOf) -> None:
    assert problems_of(lambda: edit_values(text, {path: 2}))[0].key == path


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    changes=st.dictionaries(
        st.sampled_from([p.path for p in FORMS["bogie"]]), st.floats(1e-9, 0.09), min_size=1, max_size=6
    )
)
def test_edited_numbers_read_back_to_the_last_digit(bogie: str, changes: dict[str, float]) -> None:
    design = parse_design(edit_values(bogie, changes))
    assert design.values == parse_design(bogie).with_values(changes).values


def test_a_saved_design_is_the_same_design(bogie: str, catalogue: Records, tmp_path: Path) -> None:
    text = bogie + (
        "effects:\n  - {kind: free_play, at: primary_lateral, wheelset: 2, half_width: 0.3 mm}\n"
        "  - {kind: measured_force, at: secondary_yaw, against: v, motion: [0, 1], force: [0, 3.3]}\n"
        "riding: {use: local, journey: 20 min}\n"
        'adjustment: {campaign: a b, sha256: "00e1", names: [effects.0.half_width], covariance: [[1.5e-9]]}\n'
    )
    design = parse_design(text, catalogue=catalogue)
    path = save_design(design, tmp_path / "adjusted.yaml")
    again = load_design(path, catalogue)
    assert path.read_text().startswith("schema: railui.design/1\n")
    assert again.content() == design.content()
    assert (again.name, again.adjustment) == (design.name, design.adjustment)
    assert again.adjustment == Adjustment("a b", "00e1", ("effects.0.half_width",), ((1.5e-9,),))


def test_a_saved_rig_is_the_same_rig(catalogue: Records) -> None:
    rig = parse_design("vehicle: {rig: {mass: 95 kg, input: base_displacement}}", catalogue=catalogue)
    rig = rig.with_effects([PlacedEffect("free_play", "rig", None, {"half_width": 0.1})])
    assert parse_design(design_text(rig), catalogue=catalogue).content() == rig.content()


def test_a_saved_campaign_reads_the_same_runs(campaign_folder: Path, catalogue: Records) -> None:
    campaign = load_campaign(campaign_folder, catalogue)
    path = save_campaign(campaign, campaign_folder / "loop" / "campaign.yaml")
    again = load_campaign(path, catalogue)
    assert path.read_text().startswith("schema: railui.campaign/1\n")
    for name in ("name", "noise", "estimated_parameters", "band", "cut", "min_relative_gain", "sensors", "track"):
        assert getattr(again, name) == getattr(campaign, name)
    assert [r.file.resolve() for r in again.runs] == [r.file.resolve() for r in campaign.runs]
    assert again.design.content() == campaign.design.content()


def test_a_file_appears_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_text(tmp_path / "a.yaml", "old\n")

    def full(_: int) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space"):
        write_text(path, "new\n")
    assert path.read_text() == "old\n"
    assert [p.name for p in tmp_path.iterdir()] == ["a.yaml"]


def test_an_edited_file_keeps_its_comments(bogie: str, tmp_path: Path) -> None:
    path = write_text(tmp_path / "a.yaml", bogie)
    write_text(path, edit_values(path.read_text(), {"contact.flange_clearance": 0.008}, str(path)))
    assert path.read_text() == bogie.replace("7 mm", "8 mm")


def test_a_gzipped_text_has_always_the_same_bytes(tmp_path: Path) -> None:
    first = write_text(tmp_path / "a.csv.gz", "t [s]\n").read_bytes()
    assert first == write_text(tmp_path / "b.csv.gz", "t [s]\n").read_bytes()
    assert gzip.decompress(first) == b"t [s]\n"


def test_hashes_are_those_of_the_bytes(tmp_path: Path) -> None:
    assert sha256_file(write_bytes(tmp_path / "a", b"abc")) == sha256("abc") == sha256(b"abc")
    assert sha256("abc").startswith("ba7816bf")


def test_canonical_json_rejects_nan() -> None:
    assert canonical_json({"b": 0.1, "a": [None, "ü"]}) == '{"a":[null,"ü"],"b":0.1}'
    with pytest.raises(ValueError, match="JSON"):
        canonical_json(float("nan"))
