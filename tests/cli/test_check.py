"""railui check: problems with their place, bundled files."""

from __future__ import annotations

from pathlib import Path

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
