"""Inputs that no vehicle or track has are refused before they cost memory or time."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from railui.cli import cli
from railui.documents.check import check
from railui.io.units import UnitError, read_speed
from railui.ride_quality.guiding_forces import instability_rms
from tests.execution.small import railui

DESIGNS = Path(__file__).parents[2] / "designs"
BOGIE, WHEEL, RAIL = (str(DESIGNS / name) for name in ("test_bogie.yaml", "profiles/s1002.txt", "profiles/60e1.txt"))
MEMORY = 2_000_000  # kB


def limited(*words: str, timeout: float = 30.0) -> subprocess.CompletedProcess[str]:
    """Run a command with 2 GB of address space in addition to the libraries."""
    line = f"ulimit -v {MEMORY}; exec " + " ".join(f"'{word}'" for word in railui(*words))
    return subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=timeout)


@pytest.mark.parametrize("speed", ["121", "1e4", "1.5e2", "1E9", "720 km/h", "1e308", "0.5 km/s", "-3"])
def test_a_speed_beyond_that_of_trains_is_refused_in_any_notation(speed: str) -> None:
    with pytest.raises(UnitError, match=r"faster than any train|not between|is not a speed"):
        read_speed(speed)


def test_possible_speeds_are_read() -> None:
    assert read_speed("1.2e2") == 120.0 and read_speed("574.8 km/h") == pytest.approx(159.67, abs=0.01)


@pytest.mark.parametrize(
    "words",
    [
        ("curve", BOGIE, "--radius", "0.5"),
        ("curve", BOGIE, "--radius", "600 mm"),
        ("curve", BOGIE, "--radii", "1e-300 m"),
        ("contact", WHEEL, RAIL, "--radius", "-1"),
        ("contact", WHEEL, RAIL, "--load=-5kN"),
        ("stability", BOGIE, "--speeds", "1e9"),
        ("ride", BOGIE, "--track", "erri_b176_low length=300", "--speeds", "1e308"),
    ],
)
def test_a_quantity_out_of_range_is_refused_at_once(words: tuple[str, ...]) -> None:
    done = limited(*words)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert any(text in done.stderr for text in ("give ", "write for example")), done.stderr


def test_a_spoilt_profile_takes_no_memory(tmp_path: Path) -> None:
    cells = [line.split(",") for line in Path(RAIL).read_text().splitlines() if line[:1] in "-0123456789"]
    rows = [f"{float(y)},{float(z) * 1e6}" for y, z in cells]
    (tmp_path / "rail.txt").write_text("\n".join(["y [mm],z [mm]", *rows]))
    done = limited("contact", WHEEL, str(tmp_path / "rail.txt"), "--smooth", "4 mm")
    assert done.returncode == 2 and "mm high, more than" in done.stderr


def test_a_table_of_radii_in_wrong_units_is_refused(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("y [mm],delta_r [mm]\n" + "".join(f"{y},{-1e6 * y / 5}\n" for y in range(-10, 11)))
    done = limited("contact", "--delta-r", str(tmp_path / "d.csv"))
    assert done.returncode == 2 and "more than the 0.1 m of a wheelset" in done.stderr


@pytest.mark.parametrize("command", ["check", "import", "loop", "adjust", "stability"])
def test_pipes_and_devices_are_refused_by_name(tmp_path: Path, command: str) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for path, kind in ((tmp_path / "pipe.csv", "a pipe"), (Path("/dev/zero"), "a device")):
        done = limited(command, str(path))
        assert done.returncode == 2 and f"is {kind}, not a file" in done.stderr + done.stdout, done.stderr


@pytest.mark.parametrize("value", ["1e308", "1000", "5"])
def test_a_track_of_impossible_angles_is_refused(tmp_path: Path, value: str) -> None:
    rows = "".join(f"{0.25 * k},{1e-3 * np.sin(k):.6f},{value if k == 40 else 0.001}\n" for k in range(2000))
    (tmp_path / "track.csv").write_text("s [m],yw [m],phiw [rad]\n" + rows)
    (problem,) = check([tmp_path / "track.csv"])
    assert problem.key == "phiw" and problem.line == 42


def test_the_noise_of_a_map_is_positive_and_may_be_in_g(tmp_path: Path) -> None:
    from railui.capture.processing.sensor_map import load_map

    text = "sensors: {{ay1: {{channel: a, gravity: removed, noise: {noise}}}}}\n"
    (tmp_path / "map.yaml").write_text(text.format(noise="0.05 g"))
    assert load_map(tmp_path / "map.yaml").noise["ay1"] == pytest.approx(0.4903325)
    (tmp_path / "map.yaml").write_text(text.format(noise="-0.02"))
    (problem,) = check([tmp_path / "map.yaml"], readers={"map": load_map})
    assert problem.key == "sensors.ay1.noise" and "no standard deviation" in problem.message


def test_maps_are_checked_with_and_without_a_schema_line(tmp_path: Path) -> None:
    done = limited("check", str(DESIGNS / "maps/demo_logger.yaml"))
    assert done.returncode == 0, done.stdout
    page = (DESIGNS.parent / "docs/capture.md").read_text().partition("```yaml\n")[2].partition("```")[0]
    (tmp_path / "map.yaml").write_text(page.replace("../test_bogie.yaml", BOGIE))
    done = limited("check", str(tmp_path / "map.yaml"))
    assert done.returncode == 0, done.stdout
    (tmp_path / "map.yaml").write_text("sensors: {ay9: {channel: a}}\n")
    done = limited("check", str(tmp_path / "map.yaml"))
    assert done.returncode == 2 and "sensors.ay9: is not a measurable quantity" in done.stdout
    assert '"$id": "railui.map/1"' in limited("schema", "map").stdout


def test_a_lack_of_memory_and_overflows_are_reported_in_words(monkeypatch: pytest.MonkeyPatch) -> None:
    from click.testing import CliRunner

    def overflow(**_: object) -> None:
        np.array([1e308]) * np.array([10.0])
        raise MemoryError("Unable to allocate 10.8 GiB")

    from railui.cli import effects

    monkeypatch.setattr(effects.command, "callback", overflow)
    result = CliRunner().invoke(cli, ["effects"])
    assert result.exit_code == 1 and "Traceback" not in result.output
    assert "needs more memory than there is" in result.output and "not finite (overflow" in result.output


def test_the_dominant_frequency_leaves_room_for_its_band() -> None:
    noise = np.random.default_rng(0).normal(size=4000)
    noise = np.diff(noise, 3)  # most power at half the sampling rate
    assert instability_rms(noise, 400.0, 0.1)["rms_100m"] is not None
