"""Install a wheel or source archive into a clean environment away from the checkout and run its first commands.

python release/check_install.py dist/railui-*.whl [--minimum] [--python python3.13] [--notebooks]
python release/check_install.py dist/railui-*.tar.gz --wheel dist/railui-*.whl

Dependencies are those of requirements/, checked by hash. --minimum installs the oldest versions that pyproject.toml
allows instead; --wheel compares the installed files; --notebooks runs those of examples/ with nothing but the wheel.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
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
# the archive is built to check that it is complete: optimisation would only take time
FAST_BUILD = {"CARGO_PROFILE_RELEASE_LTO": "off", "CARGO_PROFILE_RELEASE_CODEGEN_UNITS": "16"}
LIST_FILES = "import importlib.metadata as m; print(*m.files('railui'), sep='\\n')"


def create_environment(home: Path, built: Path, interpreter: str, minimum: bool) -> Path:
    """Install a wheel or source archive into a new environment; return the path of its python."""
    subprocess.run([interpreter, "-m", "venv", home / "venv"], check=True)
    python = home / "venv" / "bin" / "python"
    install = [python, "-m", "pip", "install", "--quiet", "--no-build-isolation"]
    locked = [*install, "--require-hashes", "-r"]
    if minimum:
        command = [sys.executable, "-m", "uv", "pip", "install", "--quiet", "--python", python]
        commands = [[*command, "--resolution", "lowest-direct", built]]
    else:
        commands = [[*locked, ROOT / "requirements" / f"{name}.txt"] for name in ("build", "run")]
        commands += [[*install, "--no-deps", built], [python, "-m", "pip", "check"]]
    path = f"{python.parent}{os.pathsep}{os.environ['PATH']}"  # of maturin
    for command in commands:
        subprocess.run(command, check=True, env={**os.environ, **FAST_BUILD, "PATH": path})
    return python


def compare_files(python: Path, wheel: Path) -> None:
    """Exit with an error unless the source archive installed the files of the wheel."""
    names = subprocess.run([python, "-c", LIST_FILES], capture_output=True, text=True, check=True).stdout.split("\n")
    with zipfile.ZipFile(wheel) as archive:
        expected = {name for name in archive.namelist() if name.startswith("railui/")}
    installed = {name for name in names if name.startswith("railui/") and "__pycache__" not in name}
    if installed != expected:
        raise SystemExit(f"the source archive and the wheel differ by {', '.join(sorted(installed ^ expected))}")
    print(f"ok  {len(expected)} files, as in {wheel.name}")


def environment_of(home: Path) -> dict[str, str]:
    """Return the variables of a process that sees the installed package only."""
    return {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "LANG": "C",
        "MPLBACKEND": "Agg",
        "NO_COLOR": "1",
        "PYTHONSAFEPATH": "1",
    }


def run_notebooks(python: Path, home: Path) -> None:
    """Run every notebook in an empty directory: its vehicles and measurements are those of the wheel."""
    folder = home / "notebooks"
    folder.mkdir()
    for notebook in sorted((ROOT / "examples").glob("*.py")):
        shutil.copy(notebook, folder)
        started = time.monotonic()
        done = subprocess.run(
            [python, notebook.name], cwd=folder, env=environment_of(home), capture_output=True, text=True
        )
        if done.returncode:
            raise SystemExit(f"{notebook.name}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"ok  {notebook.name}, {time.monotonic() - started:.0f} s")


def run_commands(python: Path, home: Path) -> None:
    """Run the first commands of the guide away from the checkout."""
    shutil.copytree(ROOT / "designs", home / "designs")
    environment = environment_of(home)
    for words in COMMANDS:
        done = subprocess.run(
            [python.parent / "railui", *words], cwd=home, env=environment, capture_output=True, text=True, timeout=300
        )
        if done.returncode:
            raise SystemExit(f"railui {' '.join(words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"ok  railui {' '.join(words)}")
    program = "import railui; print(railui.__file__, railui.__version__)"
    imported = subprocess.run(
        [python, "-c", program], cwd=home, env=environment, capture_output=True, text=True, check=True
    )
    if str(ROOT) in imported.stdout:
        raise SystemExit(f"the checkout was imported, not the wheel: {imported.stdout}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("built", type=Path, help="a wheel or a source archive")
    parser.add_argument("--wheel", type=Path, help="wheel to compare the files of a source archive with")
    parser.add_argument("--minimum", action="store_true")
    parser.add_argument("--python", default=sys.executable, help="interpreter of the environment; this one by default")
    parser.add_argument("--notebooks", action="store_true")
    parser.add_argument("--freeze", type=Path, help="file for the list of installed versions")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="für railui ") as scratch:
        home = Path(scratch)
        python = create_environment(home, options.built.resolve(), options.python, options.minimum)
        run_commands(python, home)
        if options.notebooks:
            run_notebooks(python, home)
        if options.wheel:
            compare_files(python, options.wheel)
        if options.freeze:
            program = (ROOT / "release" / "list_installed.py").read_text()
            installed = subprocess.run([python, "-c", program], capture_output=True, text=True, check=True)
            options.freeze.write_text(installed.stdout)


if __name__ == "__main__":
    main()
