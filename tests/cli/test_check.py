"""railui check: problems with their place, bundled files."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.runner import BOGIE, ROOT, document, run


def test_every_problem_is_listed_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(Path(BOGIE).read_text("utf-8").replace("yaw_inertia: 3300", "yaw_inertai: 3300 kg"), "utf-8")
    result = run("check", str(path), BOGIE)
    assert result.exit_code == 2
    assert f"{path}:5:" in result.stdout and "did you mean 'yaw_inertia'?" in result.stdout
    found = document(run("check", str(path), "--json", "-"))
    assert {"file", "line", "column", "key", "message", "remedy"} <= set(found["problems"][0])
    assert run("check", BOGIE).exit_code == 0
    assert run("check", str(tmp_path / "absent.yaml")).exit_code == 2


def test_the_bundled_designs_and_studies_have_no_problem() -> None:
    files = [*ROOT.glob("designs/*.yaml"), ROOT / "designs/studies/test_bogie.yaml"]
    result = run("check", *map(str, files))
    assert result.exit_code == 0
    (warning,) = result.stdout.splitlines()  # S1002 on 60E1
    assert "profiled_bogie.yaml" in warning and "tread and flange touch at once" in warning


def test_a_design_and_a_campaign_are_drawn(tmp_path: Path) -> None:
    design, campaign = tmp_path / "design.svg", tmp_path / "campaign.svg"
    result = run("check", BOGIE, "--draw", str(design))
    assert result.exit_code == 0 and f"wrote {design}" in result.stderr
    assert run("check", str(ROOT / "designs/campaigns/worn_centre_guide"), "--draw", str(campaign)).exit_code == 0
    assert 'data-key="primary_2"' in design.read_text("utf-8")
    assert 'data-key="floor_rear"' in campaign.read_text("utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("{bogie}", "--draw", "{here}/bogie.png"), "write a name that ends in .svg"),
        (("{bogie}", "--draw", "{here}/file/bogie.svg"), "Not a directory"),
        (("{bogie}", "{bogie}", "--draw", "{here}/bogie.svg"), "name one file"),
        (("{designs}/studies/test_bogie.yaml", "--draw", "{here}/bogie.svg"), "is a study"),
        (("{designs}/profiles/60e1.txt", "--draw", "{here}/bogie.svg"), "is a profile"),
    ],
)
def test_what_cannot_be_drawn_is_refused(tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    (tmp_path / "file").write_text("", "utf-8")
    filled = [word.format(bogie=BOGIE, here=tmp_path, designs=ROOT / "designs") for word in words]
    result = run("check", *filled)
    assert result.exit_code != 0 and message in " ".join(result.stderr.split())
    assert not (tmp_path / "bogie.svg").exists()


def test_a_design_with_errors_is_not_drawn(tmp_path: Path) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(Path(BOGIE).read_text("utf-8").replace("55 kN", "55 kg"), "utf-8")
    result = run("check", str(path), "--draw", str(tmp_path / "bad.svg"))
    assert result.exit_code == 2 and not (tmp_path / "bad.svg").exists()
