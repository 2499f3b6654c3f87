"""Renew requirements/*.txt: the version and the hashes of everything that pip installs here.

python release/lock.py [--upgrade]

Versions that pyproject.toml still allows are retained; --upgrade takes the newest. Needs the packages of
requirements/lock.txt.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from packaging.markers import Marker
from packaging.tags import Tag, compatible_tags, cpython_tags
from packaging.utils import parse_wheel_filename

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "requirements"
PROJECT = "pyproject.toml"
# of each file: what uv resolves
FILES = {
    "run": [PROJECT],
    "dev": [PROJECT, "--extra", "dev"],
    "exudyn": [PROJECT, "--extra", "bench"],
    **{group: ["--group", group] for group in ("build", "peers", "lock", "wheels", "mutants")},
}
# scipy 1.17 reads its own docstrings when imported: every command starts 0.7 s later
LIMITS = ("scipy<1.17",)
PYTHONS = ((3, 11), (3, 12), (3, 13), (3, 14))
MACHINES = ("x86_64", "aarch64")
NEWEST_GLIBC = 40
HEAD = "# written by `make lock` from pyproject.toml: versions and hashes of wheels for Linux and of source archives\n"


def platforms(machine: str) -> list[str]:
    """Return the platform tags of a machine under Linux with the GNU C library."""
    legacy = [f"{name}_{machine}" for name in ("manylinux1", "manylinux2010", "manylinux2014", "linux")]
    return [f"manylinux_2_{minor}_{machine}" for minor in range(5, NEWEST_GLIBC + 1)] + legacy


def accepted_tags(python: tuple[int, int], machine: str) -> set[Tag]:
    """Return the tags of the wheels that CPython of a version installs on a machine."""
    interpreter, names = "cp{}{}".format(*python), platforms(machine)
    return {*cpython_tags(python, [interpreter], names), *compatible_tags(python, interpreter, names)}


TAGS = {(python, machine): accepted_tags(python, machine) for python in PYTHONS for machine in MACHINES}


def wheel_tags(wheel: dict[str, Any]) -> set[Tag]:
    """Return the tags of a wheel in a lock."""
    return set(parse_wheel_filename(wheel["url"].rpartition("/")[2].replace("%2B", "+"))[3])


def resolve(selection: list[str], constraints: list[str]) -> list[dict[str, Any]]:
    """Return the packages that uv selects for every Python and machine, one version of each."""
    with tempfile.TemporaryDirectory() as scratch:
        pins, output = Path(scratch) / "constraints.txt", Path(scratch) / "pylock.toml"
        pins.write_text("\n".join(constraints) + "\n")
        command = [sys.executable, "-m", "uv", "pip", "compile", *selection, "--constraints", pins, "--quiet"]
        command += ["--universal", "--fork-strategy", "fewest", "--python-version", "3.11", "--format", "pylock.toml"]
        subprocess.run([*command, "--output-file", output], cwd=ROOT, check=True)
        return list(tomllib.loads(output.read_text())["packages"])


def hashes(package: dict[str, Any]) -> list[str]:
    """Return the hashes of a package's source archive and of its wheels for the Pythons and machines."""
    wanted = set().union(*TAGS.values())
    archives = [wheel for wheel in package.get("wheels", ()) if wheel_tags(wheel) & wanted]
    archives += [package["sdist"]] if "sdist" in package else []
    return sorted(archive["hashes"]["sha256"] for archive in archives)


def entry(package: dict[str, Any]) -> str:
    """Return the lines of a package in the format of pip."""
    marker = f" ; {package['marker']}" if "marker" in package else ""
    lines = [f"{package['name']}=={package['version']}{marker}", *(f"--hash=sha256:{h}" for h in hashes(package))]
    return " \\\n    ".join(lines) + "\n"


def missing_wheels(package: dict[str, Any]) -> Iterator[str]:
    """Yield the Pythons and machines for which a package has no wheel, though its marker admits them."""
    tags = [wheel_tags(wheel) for wheel in package.get("wheels", ())]
    for (python, machine), accepted in TAGS.items():
        version = ".".join(map(str, python))
        environment = {"python_version": version, "python_full_version": f"{version}.0", "platform_machine": machine}
        needed = "marker" not in package or Marker(package["marker"]).evaluate(environment)
        if needed and not any(accepted & own for own in tags):
            yield f"{version} {machine}"


def present_pins() -> list[str]:
    """Return `name==version` of every package that the files list."""
    lines = (line for path in FOLDER.glob("*.txt") for line in path.read_text().splitlines())
    return sorted({match[0] for line in lines if (match := re.match(r"[\w.-]+==[\w.+!-]+", line))})


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--upgrade", action="store_true", help="take the newest versions")
    options = parser.parse_args()
    pins = [] if options.upgrade else present_pins()
    everything = [PROJECT, *(word for selection in FILES.values() for word in selection if word != PROJECT)]
    versions = [f"{p['name']}=={p['version']}" for p in resolve(everything, [*LIMITS, *pins])]
    FOLDER.mkdir(exist_ok=True)
    for name, selection in FILES.items():
        packages = resolve(selection, versions)
        (FOLDER / f"{name}.txt").write_text(HEAD + "".join(map(entry, packages)))
        print(f"{len(packages):4} packages  requirements/{name}.txt")
        for package in packages:
            where = ", ".join(missing_wheels(package))
            source = "built from source" if "sdist" in package else "not available"
            if where:
                print(f"     {package['name']}: {source} on {where}")


if __name__ == "__main__":
    main()
