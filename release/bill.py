"""The bill of materials: every package that a wheel brings or needs, as CycloneDX, and the licences to read.

python release/bill.py INSTALLED.json DIST
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
ENDING = ("GPL-2", "GPL-3", "AGPL", "GNU General Public")  # what a wheel under MIT must not link or need


def crates() -> list[dict[str, str]]:
    """The crates that are compiled into the kernel, not those of its tests, of its macros or of other machines."""
    wanted = ["--package", "railui_python", "--edges", "normal,no-proc-macro", "--target", "x86_64-unknown-linux-gnu"]
    command = ["cargo", "tree", "--locked", *wanted, "--prefix", "none", "--format", "{p}\t{l}"]
    told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    rows = {tuple(line.removesuffix(" (*)").split("\t")) for line in told.splitlines()}
    # what lies in this checkout tells where
    found = [(*package.split()[:2], licence) for package, licence in rows if "(/" not in package]
    return [{"name": n, "version": v.removeprefix("v"), "licence": licence} for n, v, licence in sorted(found)]


def component(package: dict[str, str], kind: str) -> dict[str, Any]:
    """A package as CycloneDX tells it."""
    purl = f"pkg:{kind}/{package['name'].lower() if kind == 'pypi' else package['name']}@{package['version']}"
    told = {"type": "library", "bom-ref": purl, "name": package["name"], "version": package["version"], "purl": purl}
    return {**told, "licenses": [{"license": {"name": package["licence"] or "not stated"}}]}


def main(installed: Path, dist: Path) -> None:
    import tomllib

    packages = {"pypi": json.loads(installed.read_text()), "cargo": crates()}
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    own = {"type": "application", "name": "railui", "version": version, "purl": f"pkg:pypi/railui@{version}"}
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": {**own, "bom-ref": own["purl"], "licenses": [{"license": {"id": "MIT"}}]}},
        "components": [component(p, kind) for kind, members in packages.items() for p in members],
    }
    (dist / "railui.cdx.json").write_text(json.dumps(bill, indent=1) + "\n")
    rows = [f"{kind:6} {p['name']:28} {p['version']:14} {p['licence'] or 'not stated'}"
            for kind, members in packages.items() for p in members]  # fmt: skip
    (dist / "licences.txt").write_text("\n".join(rows) + "\n")
    barred = [row for row in rows if any(word in row for word in ENDING) and "LGPL" not in row and " OR " not in row]
    print(f"{len(rows)} packages: {dist / 'railui.cdx.json'}, {dist / 'licences.txt'}")
    if barred:
        raise SystemExit("licences that a wheel under MIT must not need:\n" + "\n".join(barred))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
