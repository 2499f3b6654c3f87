"""Write the bill of materials: every package in or required by a wheel, as CycloneDX, and a list of licences.

python release/bill_of_materials.py INSTALLED.json DIST
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
INCOMPATIBLE_LICENCES = ("GPL-2", "GPL-3", "AGPL", "GNU General Public")  # with a wheel under MIT


def kernel_crates() -> list[dict[str, str]]:
    """List the crates compiled into the kernel, without those of tests, macros and other platforms."""
    selection = [
        "--package",
        "railui_python",
        "--edges",
        "normal,no-proc-macro",
        "--target",
        "x86_64-unknown-linux-gnu",
    ]
    command = ["cargo", "tree", "--locked", *selection, "--prefix", "none", "--format", "{p}\t{l}"]
    output = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    rows = {tuple(line.removesuffix(" (*)").split("\t")) for line in output.splitlines()}
    # packages of this checkout carry their path
    crates = [(*package.split()[:2], licence) for package, licence in rows if "(/" not in package]
    return [{"name": n, "version": v.removeprefix("v"), "licence": licence} for n, v, licence in sorted(crates)]


def component(package: dict[str, str], kind: str) -> dict[str, Any]:
    """Return a package as a component of CycloneDX."""
    purl = f"pkg:{kind}/{package['name'].lower() if kind == 'pypi' else package['name']}@{package['version']}"
    record = {"type": "library", "bom-ref": purl, "name": package["name"], "version": package["version"], "purl": purl}
    return {**record, "licenses": [{"license": {"name": package["licence"] or "not stated"}}]}


def _is_incompatible(row: str) -> bool:
    return any(word in row for word in INCOMPATIBLE_LICENCES) and "LGPL" not in row and " OR " not in row


def main(installed: Path, dist: Path) -> None:
    """Write railui.cdx.json and licences.txt; exit with an error at an incompatible licence."""
    import tomllib

    packages = {"pypi": json.loads(installed.read_text()), "cargo": kernel_crates()}
    version = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]
    railui = {"type": "application", "name": "railui", "version": version, "purl": f"pkg:pypi/railui@{version}"}
    bill = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": {**railui, "bom-ref": railui["purl"], "licenses": [{"license": {"id": "MIT"}}]}},
        "components": [component(p, kind) for kind, members in packages.items() for p in members],
    }
    (dist / "railui.cdx.json").write_text(json.dumps(bill, indent=1) + "\n")
    rows = [
        f"{kind:6} {p['name']:28} {p['version']:14} {p['licence'] or 'not stated'}"
        for kind, members in packages.items()
        for p in members
    ]
    (dist / "licences.txt").write_text("\n".join(rows) + "\n")
    incompatible = [row for row in rows if _is_incompatible(row)]
    print(f"{len(rows)} packages: {dist / 'railui.cdx.json'}, {dist / 'licences.txt'}")
    if incompatible:
        raise SystemExit("licences incompatible with a wheel under MIT:\n" + "\n".join(incompatible))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
