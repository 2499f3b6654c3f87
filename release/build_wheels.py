"""Build the wheels for x86-64 and aarch64 Linux, and try those that this machine can run with every Python found.

python release/build_wheels.py dist/wheels

The linker is zig, so that the wheels run on Linux with the GNU C library 2.17 or later. Needs the packages of
requirements/wheels.txt and, of Rust, the standard libraries of both targets.
"""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
MACHINES = {"x86_64": 62, "aarch64": 183}  # e_machine in the header of an ELF file
LIBRARY = "railui/_core.abi3.so"
MACHINE_OFFSET = 18  # of e_machine
PYTHONS = ("3.11", "3.12", "3.13")


def target(machine: str) -> str:
    """Return Rust's name of a machine."""
    return f"{machine}-unknown-linux-gnu"


def check_targets() -> None:
    """Exit with the command that installs the standard libraries which Rust lacks."""
    root = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    missing = [target(m) for m in MACHINES if not (Path(root) / "lib" / "rustlib" / target(m) / "lib").is_dir()]
    if missing:
        raise SystemExit(f"Rust lacks the standard library of {', '.join(missing)}: rustup target add {missing[0]}")


def build(machine: str, folder: Path) -> Path:
    """Build the wheel of a machine and return its path."""
    options = ["--release", "--zig", "--target", target(machine), "--compatibility", "manylinux2014", "--quiet"]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    command = [sys.executable, "-m", "maturin", "build", *options, "--out", folder]
    subprocess.run(command, cwd=ROOT, check=True, env={**os.environ, "PATH": path})
    return next(folder.glob(f"*_{machine}.whl"))


def check_wheel(wheel: Path, machine: str) -> None:
    """Exit with an error unless a wheel is for every Python from 3.11 on and its library for the machine."""
    if "-cp311-abi3-manylinux" not in wheel.name or not wheel.name.endswith(f"_{machine}.whl"):
        raise SystemExit(f"{wheel.name} is not a wheel of CPython 3.11 and later for {machine}")
    with zipfile.ZipFile(wheel) as archive:
        header = archive.read(LIBRARY)[: MACHINE_OFFSET + 2]
    found = int.from_bytes(header[MACHINE_OFFSET:], "little")
    if header[:4] != b"\x7fELF" or found != MACHINES[machine]:
        raise SystemExit(f"{wheel.name}: {LIBRARY} is for the machine {found}, {machine} is {MACHINES[machine]}")


def find_pythons() -> list[str]:
    """Return the interpreters of the supported versions that run here; name the others."""
    found = []
    for version in PYTHONS:
        name = shutil.which(f"python{version}")
        if name and subprocess.run([name, "-c", "import venv"], capture_output=True).returncode == 0:
            found.append(name)
        else:
            print(f"not tried with python{version}, which is not here")
    return found


def main(folder: Path) -> None:
    """Build, check and try the wheels."""
    check_targets()
    shutil.rmtree(folder, ignore_errors=True)
    for machine in MACHINES:
        wheel = build(machine, folder)
        check_wheel(wheel, machine)
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB", flush=True)
        if machine != platform.machine():
            print(f"not tried: this machine is {platform.machine()}")
            continue
        for python in find_pythons():
            print(f"with {python}", flush=True)
            check = [sys.executable, ROOT / "release" / "check_install.py", wheel, "--python", python]
            subprocess.run(check, check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
