"""The public names: every command has its function, nothing is imported before it is used."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest
from matplotlib.figure import Figure

import railui
from railui.cli import COMMANDS
from railui.io.atomic import to_json_value
from tests.cli.runner import BOGIE, ROOT, TRACK, document, run

# functions of each command; those of sub-commands and options that change its result after it
FUNCTIONS = {
    "desk": ["open_desk"],
    "check": ["check"],
    "effects": ["effects"],
    "track": ["synthetic_track", "analyse_track"],
    "ride": ["ride", "ride_cases", "ride_many", "simulate"],
    "response": ["response"],
    "stability": ["stability"],
    "curve": ["curve", "curves"],
    "map": ["response_map"],
    "sensitivity": ["sensitivity"],
    "assess": ["assess", "assess_en14363"],
    "contact": ["analyse_contact", "analyse_radius_table", "linearise_profiles"],
    "adjust": ["adjust"],
    "loop": ["loop"],
    "plan": ["plan", "next_runs"],
    "fleet": ["update_fleet", "fleet_status", "fleet_block_means"],
    "optimise": ["optimise"],
    "status": ["status"],
    "diff": ["diff"],
    "capture": ["record", "decode_recording"],
    "import": ["import_recording"],
    "export": ["export_state_space", "export_fmu", "fmu_inputs"],
    "schema": ["schema"],
    "doctor": ["self_test"],
    "bench": ["benchmark"],
}
START_UP = {"railui"}
PROFILES = tuple(str(ROOT / f"designs/profiles/{name}.txt") for name in ("s1002", "60e1"))
HEAVY = ("numpy", "scipy", "pydantic", "matplotlib", "pandas", "yaml", "rich", "railui.core", "railui.api")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_its_function_in_the_package(name: str) -> None:
    for function in FUNCTIONS[name]:
        assert function in railui.__all__ and callable(getattr(railui, function))


def test_the_table_of_functions_in_the_manual_is_complete() -> None:
    page = (ROOT / "docs/python.md").read_text()
    for command, functions in FUNCTIONS.items():
        row = next(line for line in page.splitlines() if line.startswith(f"| `{command}`"))
        assert all(f"`{function}`" in row for function in functions), row


@pytest.mark.parametrize("name", sorted(set(railui.__all__) - {"__version__"}))
def test_every_public_name_is_documented(name: str) -> None:
    thing = getattr(railui, name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing) and name not in ("FileProblems", "Problem"):
        for key, member in vars(thing).items():
            if not key.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
                assert inspect.getdoc(getattr(thing, key)), f"{name}.{key}"


def imported_by(code: str) -> set[str]:
    program = f"{code}\nimport sys; print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.splitlines()[-1].split())


def test_importing_the_package_imports_nothing_else() -> None:
    modules = imported_by("import railui")
    assert {name for name in modules if name.startswith("railui")} == START_UP
    assert not {name for name in modules if name.split(".")[0] in HEAVY}


def test_the_help_of_the_command_line_imports_no_computation() -> None:
    help_text = "from click.testing import CliRunner; from railui.cli import cli; CliRunner().invoke(cli, ['--help'])"
    modules = imported_by(help_text)
    assert not {name for name in modules if any(name == h or name.startswith(f"{h}.") for h in HEAVY)}
    assert len([name for name in modules if name.startswith("railui")]) < 8


def test_a_name_that_is_not_there_is_refused() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'rides'"):
        _ = railui.rides


def test_the_commands_have_no_computation_of_their_own() -> None:
    done = subprocess.run(["grep", "-rn", "from railui.identification.estimation", str(ROOT / "railui/cli")], text=True)
    assert done.returncode == 1


@pytest.mark.parametrize(
    ("words", "result"),
    [
        (("effects",), lambda: {"effects": railui.effects()}),
        (("track", "--spectrum", TRACK), lambda: railui.analyse_track(TRACK)),
        (("schema", "study"), lambda: railui.schema("study")),
        (("diff", BOGIE, str(ROOT / "designs/check_bogie.yaml")), lambda: _differences()),
        (
            ("ride", BOGIE, "--track", TRACK, "--speeds", "30:40:10", "--seeds", "1,2"),
            lambda: railui.ride_cases(BOGIE, TRACK, [30.0, 40.0], seeds=[1, 2]),
        ),
        (
            ("sensitivity", BOGIE, "--of", "linear_critical_speed"),
            lambda: railui.sensitivity(BOGIE, ["linear_critical_speed"]),
        ),
        (("contact", *PROFILES, "--inclination=1:40"), lambda: railui.analyse_contact(*PROFILES, inclination="1:40")),
        (("curve", BOGIE, "--radius", "600"), lambda: railui.curve(BOGIE, 600.0)),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else "",
)
def test_a_function_returns_what_the_command_writes(words: tuple[str, ...], result: object) -> None:
    printed = document(run(*words, "-q", "--json", "-"))
    expected = to_json_value(result())  # type: ignore[operator]
    assert {key: printed[key] for key in expected} == expected


def _differences() -> dict[str, object]:
    return {"differences": railui.diff(BOGIE, ROOT / "designs/check_bogie.yaml")}


def test_a_map_is_that_of_the_command(tmp_path: Path) -> None:
    axes = ("contact.conicity=0.1:0.2:0.1", "vehicle.secondary.yaw_damping=10e3:30e3:20e3")
    words = ("map", BOGIE, "--x", axes[0], "--y", axes[1], "--of", "linear_critical_speed", "-o", str(tmp_path / "m"))
    printed = document(run(*words, "-q", "--json", "-"))
    result = railui.response_map(BOGIE, *axes, ["linear_critical_speed"])
    assert to_json_value(result["of"]) == printed["of"]


def test_a_plan_is_that_of_the_command(tmp_path: Path) -> None:
    sensors = str(ROOT / "designs/plans/test_bogie.yaml")
    words = ("plan", BOGIE, "--sensors", sensors, "--speeds", "30,40", "--track", TRACK, "--duration", "20")
    printed = document(run(*words, "--store", str(tmp_path / "store"), "-q", "--json", "-"))
    plan = railui.Design.load(BOGIE).plan(sensors, ["30 m/s", 40.0], TRACK, duration=20.0, store=tmp_path / "store")
    assert to_json_value(plan.to_dict()) == printed
    again = railui.plan(BOGIE, sensors, [30.0, 40.0], TRACK, duration=20.0, store=tmp_path / "store")
    assert to_json_value(again) == to_json_value(dict(plan.data))
    assert plan.sentence in plan.summary() and len(plan.to_frame()) == len(plan.detectable)
    assert plan.plot_selection(Figure().subplots()).get_ylabel() == "attained precision [%]"
    assert plan.plot_limits(Figure().subplots()).texts
    assert plan.save(tmp_path / "plan.html").read_text().startswith("<!DOCTYPE html>")


def test_errors_have_the_text_of_the_command() -> None:
    wrong = str(ROOT / "designs/no_such_bogie.yaml")
    with pytest.raises(railui.FileProblems) as raised:
        railui.Design.load(wrong)
    assert run("ride", wrong, "--track", TRACK, "--speed", "40").stderr.strip() == str(raised.value)
