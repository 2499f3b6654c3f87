"""Profile files: SIMPACK's flags, text formats, and faults with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from railui.contact.profile import Profile
from railui.contact.profile_reader import read_profile
from railui.contact.radius_table_reader import read_radius_table
from railui.io.problems import FileProblems, Problem
from tests.contact.shapes import coned_wheel, reference, round_rail

PROFILES = Path(__file__).parents[2] / "designs" / "profiles"
WHEEL, RAIL = coned_wheel(0.05), round_rail()


def simpack(y: np.ndarray, z: np.ndarray, kind: int, **flags: object) -> str:
    """A file of SIMPACK's with some of its flags set."""
    settings = "".join(f"    {key.replace('__', '.')} = {value} ! as asked\n" for key, value in flags.items())
    points = "".join(f"  {a:+.9E} {b:+.9E}\n" for a, b in zip(y, z, strict=True))
    return (
        f"! a profile\n  header.begin\n    version = 1\n    type = {kind} ! 0=rail, 1=wheel\n  header.end\n"
        f"  spline.begin\n    type = 0 ! of the original data file\n{settings}    point.begin\n{points}"
        "    point.end\n  spline.end\n"
    )


def read(path: Path, text: str, kind: str = "wheel", **more: float) -> Profile:
    path.write_text(text)
    return read_profile(path, kind, **more)  # type: ignore[arg-type]


def same(found: Profile, expected: Profile) -> None:
    grid = np.linspace(-0.03, 0.05 if expected.kind == "wheel" else 0.03, 200)
    level = [np.interp(grid, p.y, p.h) for p in (found, expected)]
    assert level[0] - level[0].max() == pytest.approx(level[1] - level[1].max(), abs=2e-8)


@pytest.mark.parametrize(
    ("flags", "y", "z"),
    [
        ({"units__len__f": 1}, 1, 1),
        ({"units__len__f": 1000}, 1e3, 1e3),
        ({"units__len__f": 1000, "mirror__y": 1}, -1e3, 1e3),
        ({"units__len__f": 1000, "mirror__z": 1}, 1e3, -1e3),
        ({"units__len__f": "+1.0D+03", "mirror__z": 1, "mirror__y": 1}, -1e3, -1e3),
        ({"units__len__f": 1000, "inversion": 1}, 1e3, 1e3),
    ],
)
@pytest.mark.parametrize(("shape", "name"), [(WHEEL, "a.prw"), (RAIL, "a.prr")], ids=["wheel", "rail"])
def test_units_and_mirrors_of_simpack_are_applied(
    tmp_path: Path, flags: dict[str, object], y: float, z: float, shape: Profile, name: str
) -> None:
    text = simpack(y * shape.y, z * shape.h, int(shape.kind == "wheel"), **flags)
    same(read(tmp_path / name, text, shape.kind), shape)


def test_shifts_rotation_and_bounds_of_simpack_are_applied_in_order(tmp_path: Path) -> None:
    a = 0.02
    # what the file's own shift and rotation turn back
    y, z = np.cos(a) * RAIL.y + np.sin(a) * RAIL.h, -np.sin(a) * RAIL.y + np.cos(a) * RAIL.h
    text = simpack(1e3 * y - 5, 1e3 * z + 2, 0, units__len__f=1000, units__ang__f=1000, shift__y=5, shift__z=-2,
                   rotate=1e3 * a, bound__y__min=-100, bound__y__max=29)  # fmt: skip
    result = read(tmp_path / "a.prr", text, "rail")
    assert result.y.max() <= 0.029
    inside = np.linspace(-0.029, 0.028, 50)
    assert np.interp(inside, result.y, result.h) == pytest.approx(np.interp(inside, RAIL.y, RAIL.h), abs=1e-7)


@pytest.mark.parametrize(
    "line",
    [
        "{y:.6f}, {z:.6f}",
        "{y:.6f}\t{z:.6f}",
        "  {y:.6f}   {z:.6f}  # a remark",
        "{y:.6f}; {z:.6f}",
        "{y:.6f},{z:.6f},0",
    ],
)
def test_text_has_two_columns_in_any_common_format(tmp_path: Path, line: str) -> None:
    rows = [line.format(y=1e3 * y, z=1e3 * z) for y, z in zip(WHEEL.y, WHEEL.h, strict=True)]
    same(read(tmp_path / "w.txt", "# of a lathe\n" + "\n".join(rows)), WHEEL)


def test_decimal_commas_metres_and_inner_face_origin_are_read(tmp_path: Path) -> None:
    rows = [f"{y + 0.07:.9f};{z:.9f}".replace(".", ",") for y, z in zip(WHEEL.y, WHEEL.h, strict=True)]
    result = read(tmp_path / "w.txt", "y [m]; z [m]\n" + "\n".join(rows))
    same(result, WHEEL)
    assert any("inner face" in note for note in result.notes)


def test_smoothing_halves_the_amplitude_at_its_wavelength(tmp_path: Path) -> None:
    y = np.linspace(-0.03, 0.06, 2000)
    wave = 20e-6 * np.sin(2 * np.pi * y / 4e-3)
    flange = np.linspace(-0.06, -0.0301, 50)
    smooth = Profile.from_points(
        "wheel", np.concatenate([flange, y]), np.concatenate([-0.02 + (flange + 0.0301) * 0.4, 0 * y + wave])
    ).smoothed(4e-3)
    inside = (smooth.y > -0.01) & (smooth.y < 0.05)
    assert np.ptp(smooth.h[inside]) == pytest.approx(0.5 * 40e-6, rel=0.02)


def test_s1002_agrees_with_the_reference_profile() -> None:
    result = read_profile(PROFILES / "s1002.txt", "wheel")
    expected = read_profile(reference("profiles/S1002.prw"), "wheel")
    for first, error in ((-0.06, 4e-5), (-0.034, 6e-6), (-0.025, 1e-6)):
        grid = np.linspace(first, 0.06, 500)
        assert np.interp(grid, result.y, result.h) == pytest.approx(np.interp(grid, expected.y, expected.h), abs=error)


# ------------------------------------------------------------------------------------------ what is wrong


def problem_of(path: Path, text: str, kind: str = "wheel") -> Problem:
    with pytest.raises(FileProblems) as error:
        read(path, text, kind)
    return error.value.problems[0]


def written(y: np.ndarray, z: np.ndarray) -> str:
    return "y [mm], z [mm]\n" + "\n".join(f"{1e3 * a:.6f}, {1e3 * b:.6f}" for a, b in zip(y, z, strict=True))


def test_a_crossing_profile_is_reported_with_its_line(tmp_path: Path) -> None:
    y, h = WHEEL.y.copy(), WHEEL.h.copy()
    h[200] += 2e-3
    y[[200, 201, 202]] = y[[202, 201, 200]]
    problem = problem_of(tmp_path / "w.txt", written(y, h))
    assert "crosses itself at y" in problem.message and "between points" in problem.message
    assert abs(problem.line - 202) <= 3


@pytest.mark.parametrize(
    ("factor", "words"), [(1e-3, "in another unit"), (30.0, "in another unit"), (0.3, "too short, or in another unit")]
)
def test_an_implausible_width_suggests_another_unit(tmp_path: Path, factor: float, words: str) -> None:
    problem = problem_of(tmp_path / "w.txt", written(factor * WHEEL.y, factor * WHEEL.h))
    assert words in problem.message and "y [mm], z [mm]" in problem.remedy


def test_an_ambiguous_width_asks_for_the_unit(tmp_path: Path) -> None:
    rows = "\n".join(f"{1e6 * a:.3f} {1e6 * b:.3f}" for a, b in zip(WHEEL.y, WHEEL.h, strict=True))
    assert "neither mm nor m" in problem_of(tmp_path / "w.txt", rows).message


def test_wrong_units_and_words_are_reported_with_their_line(tmp_path: Path) -> None:
    assert "not a length" in problem_of(tmp_path / "w.txt", "y [kg], z [mm]\n1, 2\n").message
    problem = problem_of(tmp_path / "w.txt", "1 2\n3 4\nfive 6\n")
    assert (problem.line, problem.message) == (3, "'five' is not a number")


def test_a_simpack_rail_given_as_a_wheel_is_reported(tmp_path: Path) -> None:
    text = simpack(1e3 * RAIL.y, 1e3 * RAIL.h, 0, units__len__f=1000)
    assert "is a rail profile where a wheel belongs" in problem_of(tmp_path / "a.prr", text).message


def test_the_header_decides_the_kind_of_a_simpack_file(tmp_path: Path) -> None:
    text = simpack(1e3 * WHEEL.y, 1e3 * WHEEL.h, 1, units__len__f=1000)
    assert read(tmp_path / "a.txt", text, "wheel").kind == "wheel"
    assert "is a wheel profile where a rail belongs" in problem_of(tmp_path / "a.txt", text, "rail").message


def test_a_type_that_is_not_a_number_is_ignored(tmp_path: Path) -> None:
    text = simpack(1e3 * RAIL.y, 1e3 * RAIL.h, 0, units__len__f=1000).replace("type = 0", "type = nan")
    assert read(tmp_path / "a.txt", text, "rail").kind == "rail"


def test_a_profile_of_too_many_points_is_rejected(tmp_path: Path) -> None:
    points = "".join(f"{0.003 * i:.4f}, 0\n" for i in range(20_001))
    assert "20001 points" in problem_of(tmp_path / "w.txt", points).message


def test_a_radius_table_is_read_in_either_order_with_faults_by_line(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    rows = [f"{y},{0.1 * y:.2f}" for y in range(-6, 7)]
    for order in (1, -1):
        path.write_text("y [mm],delta_r [mm]\n" + "\n".join(rows[::order]))
        y, delta_r = read_radius_table(path)
        assert y == pytest.approx(1e-3 * np.arange(-6, 7)) and delta_r == pytest.approx(1e-4 * np.arange(-6, 7))
    for text, line, words in (
        ("y [mm],delta_r [mm]\n0,0\n1,1\n1,2\n3,3\n4,4\n", 4, "does not increase"),
        ("y [mm],r [mm]\n0,0\n", 1, "no column delta_r"),
        ("y [mm],delta_r [kg]\n0,0\n", 1, "not a length"),
        ("y [mm],delta_r [mm]\n0,0\n1,\n2,2\n3,3\n4,4\n", 3, "delta_r: is not a number, give a number in each row"),
        ("y [mm],delta_r [mm]\n4,4\n3,3\n3,2\n1,1\n0,0\n", 4, "does not decrease"),
        ("y [mm],delta_r [mm]\n4,4\n0,0\n3,3\n2,2\n1,1\n", 4, "does not decrease"),
    ):
        path.write_text(text)
        with pytest.raises(FileProblems) as error:
            read_radius_table(path)
        assert words in str(error.value) and error.value.problems[0].line == line


def test_a_damaged_profile_reports_ten_lines_and_counts_the_others(tmp_path: Path) -> None:
    (tmp_path / "bad.txt").write_text("y [mm], z [mm]\n" + "".join(f"{i}.0, 1x\n" for i in range(100)))
    with pytest.raises(FileProblems) as caught:
        read_profile(tmp_path / "bad.txt", "wheel")
    assert len(caught.value.problems) == 11 and "90 more lines are faulty" in str(caught.value)
