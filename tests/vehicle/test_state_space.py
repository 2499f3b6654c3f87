"""The exported state space, simulated by scipy, moves as the kernel simulates the vehicle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.interpolate import CubicSpline
from scipy.io import loadmat

import railui
from tests.cli.runner import ROOT, document, run

BOGIE = str(ROOT / "designs/check_bogie.yaml")
SPEED = 40.0
CHANNELS = ["e1", "e2", "ay1", "ayf", "rf", "d2", "psi1"]
FINE = 8  # steps of scipy per sample, between which it interpolates the inputs linearly


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    home = tmp_path_factory.mktemp("export")
    files = {kind: home / f"bogie.{kind}" for kind in ("npz", "mat")}
    for file in files.values():
        words = ("--state-space", str(file), "--speed", "144 km/h", "--channels", ",".join(CHANNELS), "-q")
        assert run("export", BOGIE, *words).exit_code == 0
    return files


def test_scipy_simulates_the_exported_vehicle_as_the_kernel_does(files: dict[str, Path]) -> None:
    space = np.load(files["npz"])
    track = railui.Track.synthetic("erri_b176_low", 400.0, seed=3)
    kernel = railui.simulate(BOGIE, track, SPEED, CHANNELS)
    t = np.arange(FINE * (track.s.size - 1) + 1) * (track.spacing / SPEED / FINE)
    curves = {name: CubicSpline(track.s, getattr(track, name)) for name in ("yw", "phiw", "gauge")}
    inputs = np.zeros((t.size, len(space["inputs"])))
    for k, name in enumerate(space["inputs"]):
        quantity, _, number = str(name).partition(".")
        s = SPEED * (t - space["delays"][int(number) - 1])
        slope = int(quantity.startswith("d"))
        curve = curves[quantity.removeprefix("d").removesuffix("_ds")]
        inputs[:, k] = np.where(s >= 0.0, curve(np.maximum(s, 0.0), slope), 0.0)
    matrices = (space["A"], space["B"], space["C"], space["D"])
    _, y, _ = signal.lsim(signal.StateSpace(*matrices), inputs, t)
    for k, channel in enumerate(CHANNELS):
        deviation = np.abs(y[::FINE, k] - kernel[channel]).max() / kernel[channel].std()
        assert deviation < 2e-3, channel


def test_the_roots_and_transfer_functions_are_those_of_the_response() -> None:
    design = railui.Design.load(ROOT / "designs/manchester_coach.yaml")
    space = design.state_space(30.0, ["e1", "ay3"])
    response = design.response(30.0, channels=["e1", "ay3"], frequencies=[0.5, 1.3, 6.0])
    least_damped = max(np.linalg.eigvals(space.A), key=lambda z: z.real)
    assert least_damped.real == pytest.approx(response.data["roots"][0]["real"], abs=1e-6)
    jw = 2j * np.pi * response.frequencies
    u = np.zeros((3, len(space.inputs)), dtype=complex)  # a unit wave of yw under every wheelset
    for k, name in enumerate(space.inputs):
        wave = np.exp(-jw * space.delays[int(name.rpartition(".")[2]) - 1])
        u[:, k] = {"yw": wave, "dyw_ds": wave * jw / 30.0}.get(name.partition(".")[0], 0.0 * wave)
    for i, s in enumerate(jw):
        motion = np.linalg.solve(s * np.eye(len(space.A)) - space.A, space.B @ u[i])
        y = space.C @ motion + space.D @ u[i]
        assert y == pytest.approx([response.transfer("e1")[i], response.transfer("ay3")[i]], rel=1e-9)


def test_signs_and_names_are_those_of_the_manual() -> None:
    space = railui.Design.load(BOGIE).state_space(SPEED, ["e2", "rf"])
    e2 = dict(zip(space.inputs, space.D[0], strict=True))
    assert e2["yw.2"] == pytest.approx(-1.0) and e2["yw.1"] == pytest.approx(0.0, abs=1e-12), "e = y - yw"
    rate = dict(zip(space.states, space.C[1], strict=True))
    assert {name for name, slope in rate.items() if abs(slope) > 1e-9} == {"dpsi_dt"}
    half = len(space.states) // 2
    assert space.A[:half, half:] == pytest.approx(np.eye(half)) and space.state_units[half] == "m/s"


def test_both_files_have_the_same_contents(files: dict[str, Path]) -> None:
    numpy, matlab = np.load(files["npz"]), loadmat(files["mat"])
    for key in "ABCD":
        assert np.array_equal(numpy[key], matlab[key])
    assert [cell.item() for cell in matlab["outputs"][0]] == CHANNELS == list(numpy["outputs"])
    assert matlab["speed"].item() == SPEED and matlab["delays"].ravel() == pytest.approx(numpy["delays"])


def test_equal_vehicles_give_equal_bytes_by_function_and_command(files: dict[str, Path], tmp_path: Path) -> None:
    for kind, file in files.items():
        railui.export_state_space(BOGIE, tmp_path / f"again.{kind}", SPEED, CHANNELS)
        assert (tmp_path / f"again.{kind}").read_bytes() == file.read_bytes()


def test_effects_that_are_not_linear_are_named(tmp_path: Path) -> None:
    worn = (
        railui.Design.load(BOGIE).to_yaml() + "effects: [{kind: free_play, at: primary_lateral, half_width: 0.3 mm}]\n"
    )
    (tmp_path / "worn.yaml").write_text(worn)
    words = ("--state-space", str(tmp_path / "worn.npz"), "--speed", "40", "-q", "--json", "-")
    assert document(run("export", str(tmp_path / "worn.yaml"), *words))["notes"] == ["linear: without free_play"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--state-space", "x.csv", "--speed", "40"), "write a name that ends in .npz or .mat"),
        (("--state-space", "x.npz", "--speed", "40", "--channels", "e9"), "--channels: no channel 'e9'"),
    ],
)
def test_wrong_use_is_refused(
    words: tuple[str, ...], message: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    result = run("export", BOGIE, *words)
    assert result.exit_code == 2 and message in result.stderr and not list(tmp_path.iterdir())
