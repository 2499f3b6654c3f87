"""railui plan: keys, pages and usage errors, before a measurement and after a loop."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.runner import BOGIE, ROOT, document, run
from tests.planning.files import plan_text

BASIC = ("--speeds", "30:40:10", "--track", "erri_b176_low seed=1", "--duration", "20 s")


@pytest.fixture
def sensors(tmp_path: Path) -> str:
    path = tmp_path / "sensors.yaml"
    path.write_text(plan_text({"ayf": "0.02 m/s^2", "rf": "0.3 mrad/s"}, "costs: {run: 2}\n"))
    return str(path)


def test_a_plan_has_its_documented_keys(sensors: str, tmp_path: Path) -> None:
    page, picture = tmp_path / "plan.html", tmp_path / "plan.svg"
    result = run("plan", BOGIE, "--sensors", sensors, *BASIC, "--json", "-", "--plot", str(page))
    assert result.exit_code == 0, result.stderr
    found = document(result)
    assert found["schema"] == "railui.plan/1"
    assert set(found) >= {
        *("design", "duration", "sensors", "runs", "budget", "selected", "steps", "noise_floor", "critical_score"),
        *("detectable", "parameters", "confounded", "notes"),
    }
    assert [r["name"] for r in found["runs"]] == ["30 m/s", "40 m/s"]
    assert found["steps"][0]["cost"] == 5.0
    assert all(len(row["per_run"]) == 2 for row in (*found["detectable"], *found["parameters"]))
    assert "Minimum detectable effects" in page.read_text()
    again = run("plan", BOGIE, "--sensors", sensors, *BASIC, "--plot", str(picture), "-q")
    assert again.exit_code == 0 and picture.read_text().startswith("<?xml")
    assert "of the attainable precision" in again.stdout


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "give DESIGN, --sensors, --speeds, --track, or --after DIR"),
        ((BOGIE, "--after", "x"), "leave DESIGN out"),
        (("--after", "x", "--budget", "3"), "leave them out"),
        ((BOGIE, "--measured", "x"), "are for --after DIR"),
        ((BOGIE, "--duration", "5 s"), "give 20 to 3600 s"),
    ],
)
def test_wrong_use_is_refused(words: tuple[str, ...], message: str) -> None:
    result = run("plan", *words)
    assert result.exit_code == 2 and message in result.stderr


def test_the_fault_of_a_track_file_is_reported_with_the_file_alone(sensors: str, tmp_path: Path) -> None:
    track = tmp_path / "track.csv"
    track.write_text("s [m],yw [m]\n0,0\n1,x\n")
    result = run("plan", BOGIE, "--sensors", sensors, "--speeds", "30", "--track", str(track), "--duration", "20 s")
    assert result.exit_code == 2 and result.stderr.splitlines()[0].startswith(str(track))
    assert "Usage" not in result.stderr


def test_a_run_longer_than_its_track_is_wrong_use(sensors: str, tmp_path: Path) -> None:
    track = tmp_path / "track.csv"
    track.write_text("s [m],yw [m],phiw [rad]\n" + "".join(f"{0.5 * i},0,0\n" for i in range(200)))
    result = run("plan", BOGIE, "--sensors", sensors, "--speeds", "30", "--track", str(track), "--duration", "20 s")
    assert result.exit_code == 2 and "plan at most 3 s" in " ".join(result.stderr.split())


def test_a_numerical_error_is_no_wrong_use(sensors: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr("railui.planning.plan.collect_information", fail)
    result = run("plan", BOGIE, "--sensors", sensors, *BASIC)
    assert result.exit_code == 1 and "singular matrix" in result.stderr and "Usage" not in result.stderr


def test_a_directory_without_a_loop_is_refused_with_a_remedy(tmp_path: Path) -> None:
    result = run("plan", "--after", str(tmp_path))
    assert result.exit_code == 2 and "has no loop.json" in result.stderr
    (tmp_path / "loop.json").write_text(json.dumps({"schema": "railui.loop/1", "verdict": "none"}))
    result = run("plan", "--after", str(tmp_path))
    assert (
        result.exit_code == 2
        and "written by an older railui" in result.stderr
        and "run the loop again" in result.stderr
    )


def test_a_campaign_that_has_changed_is_refused(tmp_path: Path) -> None:
    campaign = ROOT / "designs/campaigns/worn_axle_box/campaign.yaml"
    report = {
        "schema": "railui.loop/1",
        "verdict": "none",
        "rivals": [],
        "inputs": [{"file": str(campaign), "sha256": "0" * 64}],
    }
    (tmp_path / "loop.json").write_text(json.dumps(report))
    result = run("plan", "--after", str(tmp_path))
    assert result.exit_code == 2 and "has changed since" in result.stderr
