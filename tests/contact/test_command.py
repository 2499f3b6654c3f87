"""Command railui contact: JSON result, figures, rejected input."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from railui.cli import cli

PROFILES = Path(__file__).parents[2] / "designs" / "profiles"
PAIR = (str(PROFILES / "s1002.txt"), str(PROFILES / "60e1.txt"), "--inclination", "1:40")


def run(*words: str) -> Result:
    return CliRunner().invoke(cli, ["contact", *words])


def document(*words: str) -> dict[str, Any]:
    result = run(*words, "-q", "--json", "-")
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_the_json_has_the_documented_keys() -> None:
    result = document(*PAIR, "--gauge", "1435 mm", "--back-to-back", "1.36")
    assert list(result)[:5] == ["schema", "version", "inputs", "seed", "simd"]
    amplitude, tan_gamma = result["conicity"]["amplitude"], result["conicity"]["tan_gamma"]
    assert amplitude == pytest.approx(1e-3 * np.arange(10, 101) / 10) and len(tan_gamma) == len(amplitude)
    assert tan_gamma[20] == pytest.approx(0.181, abs=0.01)
    assert set(result["conicity_parameters"]) == {"conicity", "gravitational_stiffness", "contact_angle", "roll"}
    assert all(value > 0 for value in result["conicity_parameters"].values())
    assert result["creep"]["longitudinal_creep"] == pytest.approx(140, rel=0.05)


def test_s1002_at_1_to_20_hardly_guides() -> None:
    # the well-known 0.01
    assert document(*PAIR[:2], "--inclination", "1:20")["conicity_3mm"] == pytest.approx(0.01, abs=0.002)


def test_the_surface_and_the_load_are_those_of_the_ellipse() -> None:
    light, heavy, clean = (document(*PAIR, *more)["creep"] for more in
                           ((), ("--load", "110 kN"), ("--surface", "1.0")))  # fmt: skip
    # a b grows as N^(2/3): kappa falls as N^(-1/3), kappa_s stays
    assert heavy["lateral_creep"] / light["lateral_creep"] == pytest.approx(2 ** (-1 / 3), rel=1e-6)
    assert heavy["spin_creep"] == pytest.approx(light["spin_creep"], rel=1e-6)
    assert clean["lateral_creep"] == pytest.approx(light["lateral_creep"] / 0.6, rel=1e-9)


def test_a_table_gives_its_conicity_within_its_range(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    table.write_text("y [mm],delta_r [mm]\n" + "\n".join(f"{y},{0.2 * (y - 1):.2f}" for y in range(-6, 7)))
    result = run("--delta-r", str(table), "--json", str(tmp_path / "j.json"), "--figure", str(tmp_path / "f.svg"))
    assert result.exit_code == 0 and "left out" in result.output
    found = json.loads((tmp_path / "j.json").read_text())
    assert found["conicity"]["amplitude"][-1] == pytest.approx(5e-3)  # about a centre at 1 mm
    assert found["conicity"]["tan_gamma"] == pytest.approx([0.1] * len(found["conicity"]["tan_gamma"]), rel=1e-6)
    assert found["conicity_parameters"]["gravitational_stiffness"] is None
    assert "equivalent conicity (EN 15302)" in (tmp_path / "f.svg").read_text()


def test_figures_are_written_whole(tmp_path: Path) -> None:
    figure, laws = tmp_path / "f.svg", tmp_path / "l.png"
    assert run(*PAIR, "--figure", str(figure), "--laws", str(laws)).exit_code == 0
    text = figure.read_text()
    for words in ("lateral displacement e [mm]", "contact angle [degrees]", "roll [mrad]", "amplitude [mm]"):
        assert words in text
    assert laws.read_bytes()[:4] == b"\x89PNG"


def test_a_name_with_dollar_signs_is_not_typeset(tmp_path: Path) -> None:
    wheel, figure = tmp_path / "a$_{b$.txt", tmp_path / "f.svg"
    wheel.write_text(Path(PAIR[0]).read_text())
    assert run(str(wheel), *PAIR[1:], "--figure", str(figure)).exit_code == 0
    assert "a$_{b$" in figure.read_text()


def test_unequal_diameters_shift_the_centre() -> None:
    result = document(*PAIR, "--diameter-difference", "1 mm")
    assert result["conicity"]["centre"] < -2e-4
    assert result["diameter_difference"] == 1e-3


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ((PAIR[0],), "give a wheel and a rail"),
        ((*PAIR, "--delta-r", "t.csv"), "either two profiles or"),
        (("--delta-r", "t.csv", "--laws", "l.png"), "no contact ellipse"),
        ((*PAIR, "--figure", "f.gif"), "is not the file of a figure"),
        ((*PAIR[:2], "--inclination", "40"), "write 1:40"),
        ((*PAIR, "--gauge", "1435"), "or write its unit"),
        ((*PAIR, "--gauge", "1405 mm"), "1405 mm"),
        ((PAIR[1], PAIR[0]), "that is a rail"),
        ((*PAIR, "--smooth", "1 m"), "out of range"),
        ((*PAIR, "--radius", "0"), "give 0.05 to 1.5 m"),
        ((*PAIR, "--load", "55"), "give 1000 to 1e+06 N"),
    ],
)
def test_invalid_options_are_rejected_with_a_remedy(words: tuple[str, ...], expected: str) -> None:
    result = run(*words)
    assert result.exit_code == 2
    assert expected in " ".join(result.output.split())
    assert "Traceback" not in result.output


def test_faults_of_both_files_are_reported_together(tmp_path: Path) -> None:
    for name in ("w.txt", "r.txt"):
        (tmp_path / name).write_text("1 2\nx 3\n")
    result = run(str(tmp_path / "w.txt"), str(tmp_path / "r.txt"))
    assert result.exit_code == 2 and "w.txt:2" in result.output and "r.txt:2" in result.output


def test_a_motion_beyond_the_treads_is_null_with_its_reason() -> None:
    result = document(*PAIR, "--gauge", "1428 mm")
    assert result["harmonic_parameters"]["conicity"] is None
    assert any("amplitude of 3 mm" in note and "beyond the treads" in note for note in result["notes"])
