"""Recognising and checking files of every kind, and schemas for editors."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from railui.campaign.campaign import Campaign
from railui.documents.check import check, load
from railui.documents.recognise import recognise
from railui.documents.schema import json_schema
from railui.io.problems import FileProblems, Findings, Problem, suggest_name
from railui.ride_quality.evaluation import ride
from railui.ride_quality.track_assessment import assess
from railui.running_stability.summary import stability
from railui.runs.run import Run
from railui.vehicle.design_reader import Design, load_design
from railui.vehicle.parameters import PARAMETERS

ProblemsOf = Callable[[Callable[[], object]], list[Problem]]
Records = list[dict[str, Any]]


def test_a_file_is_recognised_by_its_schema_its_keys_or_its_columns(campaign_folder: Path, tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("s [m],yw [m]\n0,0\n")
    (tmp_path / "study.yaml").write_text("vehicle: a.yaml\nvariables: {}\n")
    (tmp_path / "named.yaml").write_text("schema: railui.study/1\nvehicle: a.yaml\n")
    kinds = {
        campaign_folder: "campaign",
        campaign_folder / "campaign.yaml": "campaign",
        campaign_folder / "vehicle.yaml": "design",
        campaign_folder / "run_a.csv": "run",
        tmp_path / "track.csv": "track",
        tmp_path / "study.yaml": "study",
        tmp_path / "named.yaml": "study",
    }
    assert {path: recognise(path) for path in kinds} == kinds


def test_a_file_of_no_known_kind_is_reported(tmp_path: Path, problems_of: ProblemsOf) -> None:
    (tmp_path / "a.yaml").write_text("colour: red\n")
    (tmp_path / "a.csv").write_text("height [mm],width [mm]\n0,0\n")
    (tmp_path / "loop.json").write_text('{"schema": "railui.loop/1"}')
    for name in ("a.yaml", "a.csv"):
        assert problems_of(lambda name=name: recognise(tmp_path / name))[0].message == "is not a file of railui"
    assert "is a loop" in problems_of(lambda: recognise(tmp_path / "loop.json"))[0].message


def test_each_file_is_loaded_by_its_reader(campaign_folder: Path) -> None:
    assert isinstance(load(campaign_folder), Campaign)
    assert isinstance(load(campaign_folder / "vehicle.yaml"), Design)
    assert isinstance(load(campaign_folder / "run_a.csv"), Run)


def test_a_good_campaign_has_no_problem(campaign_folder: Path) -> None:
    assert check([campaign_folder, campaign_folder / "vehicle.yaml"]) == []


def test_a_band_above_half_the_sampling_rate_is_refused(campaign_folder: Path) -> None:
    """Below it the band is limited to 0.45 of the sampling rate, as documented."""
    campaign = campaign_folder / "campaign.yaml"
    text = campaign.read_text()
    run = load(campaign_folder / "run_a.csv")
    assert isinstance(run, Run)
    for upper, is_refused in ((0.49, False), (2.0, True)):
        campaign.write_text(f"{text}\nband: [0.3 Hz, {upper * run.rate} Hz]\n")
        found = [p for p in check([campaign_folder]) if p.key == "band"]
        assert bool(found) == is_refused
    assert found[0].line > 0 and "half the sampling rate" in found[0].message and "give at most" in found[0].remedy


def test_a_run_sampled_more_slowly_than_the_band_of_the_others_is_warned_of(campaign_folder: Path) -> None:
    assert not [p for p in check([campaign_folder]) if "sampled" in p.message]
    run = campaign_folder / "run_b.csv"
    header, *rows = run.read_text().splitlines()
    run.write_text("\n".join([header, *rows[::2]]) + "\n")
    [problem] = [p for p in check([campaign_folder]) if "sampled" in p.message]
    assert problem.severity == "warning" and (problem.line, problem.key) == (5, "runs.1.file")
    assert problem.message == "run_b.csv: sampled at 25 Hz, compared up to 11.2 Hz, not 22.5 Hz"
    assert problem.remedy == "`band: [0.3 Hz, 11.2 Hz]` compares all runs at the same frequencies"


def test_a_stiffness_without_its_unit_is_warned_of(tmp_path: Path) -> None:
    design = Path(__file__).parents[2] / "designs" / "test_bogie.yaml"
    text = design.read_text()
    assert check([design]) == [] and "lateral_stiffness: 3.0 MN/m" in text
    (tmp_path / "odd.yaml").write_text(text.replace("lateral_stiffness: 3.0 MN/m", "lateral_stiffness: 3.0"))
    [problem] = check([tmp_path / "odd.yaml"])
    assert problem.severity == "warning" and problem.key == "vehicle.primary.lateral_stiffness"
    assert problem.message.startswith("3 N/m is far from the") and "SI units" in problem.remedy


@pytest.mark.parametrize(
    ("half", "whole", "name"),
    [
        ("half_wheelbase: 1.28", "half_wheelbase: 2.56", "the wheelbase"),
        ("half_gauge: 0.75", "half_gauge: 1.5", "the distance of the rolling circles"),
        ("half_spring_base: 1.0", "half_spring_base: 2.0", "the lateral distance of the primary springs"),
        ("rolling_radius: 0.46", "rolling_radius: 0.92", "the diameter"),
    ],
)
def test_the_whole_length_in_place_of_its_half_is_warned_of(tmp_path: Path, half: str, whole: str, name: str) -> None:
    text = (Path(__file__).parents[2] / "designs" / "test_bogie.yaml").read_text()
    assert half in text
    (tmp_path / "odd.yaml").write_text(text.replace(half, whole))
    [problem] = [p for p in check([tmp_path / "odd.yaml"]) if whole.partition(":")[0] in p.key]
    assert problem.severity == "warning" and problem.remedy.startswith(f"give half of it if this is {name},")


@pytest.mark.parametrize(
    ("whole", "half"),
    [
        ("wheelbase", "half_wheelbase"),
        ("wheel_base", "half_wheelbase"),
        ("gauge", "half_gauge"),
        ("spring_base", "half_spring_base"),
        ("diameter", "rolling_radius"),
    ],
)
def test_a_whole_length_is_to_be_halved(tmp_path: Path, whole: str, half: str) -> None:
    text = (Path(__file__).parents[2] / "designs" / "test_bogie.yaml").read_text()
    (tmp_path / "whole.yaml").write_text(text.replace(f"{half}:", f"{whole}:"))
    [problem] = [p for p in check([tmp_path / "whole.yaml"]) if p.message == "unknown key"]
    assert problem.remedy == f"did you mean {half!r}? give half of it"


def test_goods_without_the_acceleration_that_they_bear_are_warned_of(tmp_path: Path) -> None:
    """Only what rates the ride refuses the design."""
    text = (Path(__file__).parents[2] / "designs" / "test_bogie.yaml").read_text()
    start = text.index("riding:")
    (tmp_path / "goods.yaml").write_text(f"{text[:start]}riding: {{use: goods}}\n")
    [problem] = check([tmp_path / "goods.yaml"])
    assert problem.severity == "warning" and problem.key == "riding.rms_limit"
    assert problem.line == text[:start].count("\n") + 1 and "`rms_limit: 2.5 m/s^2`" in problem.remedy
    design = load_design(tmp_path / "goods.yaml")
    assert stability(design, [20.0, 40.0])["klingel_wavelength"] > 0.0
    for rate in (ride, assess_goods):
        with pytest.raises(FileProblems, match=rf"goods\.yaml:{problem.line}:.*rms_limit"):
            rate(design, "erri_b176_low length=100", 20.0)


def assess_goods(design: Design, track: str, speed: float) -> object:
    return assess(track, design, speed)


def test_a_column_in_other_letters_is_warned_of(campaign_folder: Path) -> None:
    """A column of another name, such as a temperature, is no misspelt one."""
    run = campaign_folder / "run_a.csv"
    header, *rows = run.read_text().splitlines()
    lines = [f"{header},AY_2 [m/s^2],temperature [1]", *(f"{row},1,20" for row in rows)]
    assert "ay2" not in header
    run.write_text("\n".join(lines) + "\n")
    [problem] = check([campaign_folder])
    assert problem.severity == "warning" and problem.remedy == "name it ay2"
    assert problem.message == "run_a.csv: column AY_2 has no known name and is not used"


def test_problems_of_several_files_come_together(campaign_folder: Path) -> None:
    vehicle = campaign_folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("55 kN", "55 m"))
    found = check([campaign_folder, vehicle, campaign_folder / "absent.yaml"])
    assert [(Path(p.file).name, p.line, p.column) for p in found] == [
        ("vehicle.yaml", 6, 15),
        ("absent.yaml", 0, 0),
    ]


def test_a_campaign_is_checked_with_its_runs(campaign_folder: Path) -> None:
    run = campaign_folder / "run_b.csv"
    run.write_text(run.read_text().replace("e1 [m]", "e1 [s]"))
    assert [(Path(p.file).name, p.key) for p in check([campaign_folder])] == [("run_b.csv", "e1")]


def test_a_warning_is_no_error(campaign_folder: Path) -> None:
    vehicle = campaign_folder / "vehicle.yaml"
    vehicle.write_text(vehicle.read_text().replace("55 kN", "5 kN"))
    (warning,) = check([vehicle])
    assert warning.severity == "warning" and str(warning).startswith(
        f"{vehicle}:6:15: warning: vehicle.wheel_load: 4 x wheel load is"
    )


def test_noise_of_a_column_that_no_run_has_is_a_warning(campaign_folder: Path) -> None:
    path = campaign_folder / "campaign.yaml"
    path.write_text(path.read_text().replace("e1: 0.05 mm", "e1: 0.05 mm, d2: 0.02 mm"))
    assert [(p.key, p.severity, p.line) for p in check([campaign_folder])] == [("noise.d2", "warning", 6)]


def test_problems_print_position_key_message_and_remedy() -> None:
    findings = Findings("f.yaml", {"": (1, 1), "a": (2, 3), "a.b": (4, 5)})
    findings.add("a.b", "is wrong", "mend it")
    findings.add("a.c", "is missing", "add it")
    with pytest.raises(FileProblems) as caught:
        findings.raise_errors()
    assert str(caught.value) == "f.yaml:2:3: a.c: is missing, add it\nf.yaml:4:5: a.b: is wrong, mend it"
    assert set(caught.value.problems[0].as_dict()) >= {"file", "line", "column", "key", "message", "remedy"}


def test_the_nearest_name_is_reported_or_all_of_few() -> None:
    assert suggest_name("Mass", ["yaw_inertia", "mass"]) == "did you mean 'mass'?"
    assert suggest_name("colour", ["mass", "yaw_inertia"]) == "known are mass, yaw_inertia"
    assert suggest_name("colour", [f"name_{i}" for i in range(40)] + ["colossal"]) == "the nearest is 'colossal'"


# schemas


@pytest.mark.parametrize("kind", ["design", "campaign", "study"])
def test_a_schema_is_json_and_names_its_version(kind: str, catalogue: Records) -> None:
    made = json.loads(json.dumps(json_schema(kind, catalogue), allow_nan=False))
    assert made["$id"] == f"railui.{kind}/1" and made["title"] == kind


def test_every_parameter_is_in_the_schema_with_unit_and_default(catalogue: Records) -> None:
    made = json_schema("design", catalogue)

    def resolved(entry: dict[str, Any]) -> dict[str, Any]:
        return made["$defs"][entry["$ref"].rsplit("/", 1)[1]] if "$ref" in entry else entry

    for path, parameter in PARAMETERS.items():
        here = made["anyOf"][1 if "rig" in path else 0]
        for step in path.split("."):
            here = resolved(here)["properties"][step]
        assert here["unit"] == parameter.unit and here.get("default") == parameter.default
        assert here.get("prior_standard_deviation") == parameter.prior_sd


def test_the_schema_lists_every_effect_but_no_sensor(catalogue: Records) -> None:
    entries = json_schema("design", catalogue)["anyOf"][0]["properties"]["effects"]["items"]["oneOf"]
    *entries, mounted = entries
    assert mounted["required"] == ["element", "at"]
    kinds = {entry["properties"]["kind"]["const"] for entry in entries}
    assert "free_play" in kinds and not {k for k in kinds if k.startswith("sensor")}
    sensors = json_schema("campaign", catalogue)["properties"]["sensors"]["anyOf"][0]["items"]["oneOf"]
    assert [entry["properties"]["kind"]["const"] for entry in sensors] == ["sensor_gain", "sensor_offset"]


def test_another_schema_is_rejected() -> None:
    with pytest.raises(ValueError, match="design, campaign, study"):
        json_schema("loop", [])
