"""A wheel or source archive tried as a stranger would: a clean environment, a path with an umlaut, no checkout.

python release/smoke.py dist/railui-*.whl [--minimum]      --minimum: the oldest versions that pyproject admits
python release/smoke.py dist/railui-*.tar.gz --wheel dist/railui-*.whl    it must hold the same
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
COMMANDS = (
    ["--version"],
    ["doctor"],
    ["check", "designs/test_bogie.yaml", "designs/campaigns/worn_axle_box/campaign.yaml"],
    ["ride", "designs/test_bogie.yaml", "--track", "erri_b176_low length=1000", "--speed", "144 km/h"],
    ["stability", "designs/check_bogie.yaml", "--speeds", "20:80:20"],
    ["curve", "designs/check_bogie.yaml", "--radius", "600"],
    ["optimise", "designs/studies/test_bogie.yaml", "--dry-run"],
    ["capture", "--check", "--channels", "4", "--rate", "200"],
    ["loop", "--help"],
)
# an archive is built to see whether it is whole, not to be quick
ROUGHLY = {"CARGO_PROFILE_RELEASE_LTO": "off", "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16"}
FILES = "import importlib.metadata as m; print(*m.files('railui'), sep='\\n')"


def environment(home: Path, built: Path, minimum: bool) -> Path:
    """A clean environment with a wheel, or a source archive that is built there; the path of its python."""
    subprocess.run([sys.executable, "-m", "venv", home / "venv"], check=True)
    python = home / "venv" / "bin" / "python"
    if minimum:
        install = [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python,
                   "--resolution", "lowest-direct", built]  # fmt: skip
    else:
        install = [python, "-m", "pip", "install", "--quiet", "-c", ROOT / "constraints.txt", built]
    subprocess.run(install, check=True, env={**os.environ, **ROUGHLY})
    return python


def same_files(python: Path, wheel: Path) -> None:
    """What the source archive installed is what the wheel installs."""
    told = subprocess.run([python, "-c", FILES], capture_output=True, text=True, check=True).stdout.split("\n")
    with zipfile.ZipFile(wheel) as archive:
        there = {name for name in archive.namelist() if name.startswith("railui/")}
    here = {name for name in told if name.startswith("railui/") and "__pycache__" not in name}
    if here != there:
        raise SystemExit(f"the source archive and the wheel differ by {', '.join(sorted(here ^ there))}")
    print(f"ok  {len(there)} files, as in {wheel.name}")


def tried(python: Path, home: Path) -> None:
    """The commands of a first quarter of an hour, away from the checkout."""
    shutil.copytree(ROOT / "designs", home / "designs")
    bare = {"PATH": os.environ["PATH"], "HOME": str(home), "LANG": "C", "NO_COLOR": "1", "PYTHONSAFEPATH": "1"}
    for words in COMMANDS:
        done = subprocess.run(
            [python.parent / "railui", *words], cwd=home, env=bare, capture_output=True, text=True, timeout=300
        )
        if done.returncode:
            raise SystemExit(f"railui {' '.join(words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"ok  railui {' '.join(words)}")
    told = subprocess.run(
        [python, "-c", "import railui, sys; print(railui.__file__, railui.__version__)"],
        cwd=home, env=bare, capture_output=True, text=True, check=True,
    )  # fmt: skip
    if str(ROOT) in told.stdout:
        raise SystemExit(f"the checkout was imported, not the wheel: {told.stdout}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("built", type=Path, help="a wheel or a source archive")
    parser.add_argument("--wheel", type=Path, help="the wheel that a source archive is held to")
    parser.add_argument("--minimum", action="store_true")
    parser.add_argument("--freeze", type=Path, help="where the versions that were tried are told")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="für railui ") as scratch:
        home = Path(scratch)
        python = environment(home, asked.built.resolve(), asked.minimum)
        tried(python, home)
        if asked.wheel:
            same_files(python, asked.wheel)
        if asked.freeze:
            told = subprocess.run([python, "-c", (ROOT / "release" / "installed.py").read_text()], capture_output=True,
                                  text=True, check=True)  # fmt: skip
            asked.freeze.write_text(told.stdout)


if __name__ == "__main__":
    main()
