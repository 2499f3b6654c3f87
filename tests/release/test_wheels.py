"""Wheels for both machines: a wheel with another tag, or with the library of another machine, is refused."""

from __future__ import annotations

import importlib.util
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
AARCH64 = b"\x7fELF\x02\x01\x01" + bytes(9) + b"\x03\x00\xb7\x00"


@pytest.fixture
def wheels() -> ModuleType:
    spec = importlib.util.spec_from_file_location("build_wheels", ROOT / "release" / "build_wheels.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def wheel(folder: Path, tag: str, header: bytes) -> Path:
    path = folder / f"railui-1-{tag}.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("railui/_core.abi3.so", header + bytes(100))
    return path


def test_a_wheel_with_a_library_of_its_machine_is_accepted(wheels: ModuleType, tmp_path: Path) -> None:
    wheels.check_wheel(wheel(tmp_path, "cp311-abi3-manylinux_2_17_aarch64", AARCH64), "aarch64")


@pytest.mark.parametrize(
    ("tag", "header", "message"),
    [
        ("cp311-abi3-manylinux_2_17_x86_64", AARCH64, "machine 183, x86_64 is 62"),
        ("cp311-abi3-linux_x86_64", AARCH64, "not a wheel"),
        ("cp312-cp312-manylinux_2_17_x86_64", AARCH64, "not a wheel"),
        ("cp311-abi3-manylinux_2_17_aarch64", AARCH64, "not a wheel"),
        ("cp311-abi3-manylinux_2_17_x86_64", b"no library", "machine"),
    ],
)
def test_other_wheels_are_refused(wheels: ModuleType, tmp_path: Path, tag: str, header: bytes, message: str) -> None:
    with pytest.raises(SystemExit, match=message):
        wheels.check_wheel(wheel(tmp_path, tag, header), "x86_64")


def test_a_missing_standard_library_is_named_with_its_command(
    wheels: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "lib" / "rustlib" / "x86_64-unknown-linux-gnu" / "lib").mkdir(parents=True)
    rustc = tmp_path / "rustc"
    rustc.write_text(f"#!/bin/sh\necho {tmp_path}\n")
    rustc.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(SystemExit, match="rustup target add aarch64-unknown-linux-gnu"):
        wheels.check_targets()
