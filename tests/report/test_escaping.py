"""Names from files never become markup of a page, since its reader may not be the author of the study."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner

from railui.cli import cli
from tests.docs.transcript import ROOT

MARKUP = "<script>alert(1)</script>"
STUDY = f"""
name: "{MARKUP}"
vehicle: vehicle.yaml
variables: {{vehicle.primary.lateral_stiffness: [2 MN/m, 4 MN/m]}}
cases: {{track: [erri_b176_low length=200], speed: [30 m/s]}}
objectives: [{{minimise: weighted_acceleration, over: mean}}]
method: {{kind: de, population: 4, generations: 1}}
"""


def test_a_name_with_markup_is_shown_as_it_is_written(tmp_path: Path) -> None:
    bogie = (ROOT / "designs" / "test_bogie.yaml").read_text()
    (tmp_path / "vehicle.yaml").write_text(bogie.replace("name: ", f'name: "{MARKUP}" # ', 1))
    (tmp_path / "study.yaml").write_text(STUDY)
    done = CliRunner().invoke(cli, ["optimise", str(tmp_path / "study.yaml"), "-o", str(tmp_path / "out"), "-q"])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "out" / "report.html").read_text()
    assert "&lt;script&gt;alert(1)" in page
    assert MARKUP not in page
