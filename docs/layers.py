"""Draw the layers of the package from its import contract and its imports: python docs/layers.py writes layers.svg."""

import ast
import tomllib
from collections import defaultdict
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

HERE = Path(__file__).parent
ROOT = HERE.parent
CAPTIONS = {  # below the name of a package
    "desk": "terminal desk", "cli": "commands", "bench": "benchmarks", "report": "pages, figures",
    "execution": "threads, dask, cache", "documents": "all kinds of files", "doctor": "self-test",
    "capture": "serial logger", "optimisation": "studies, search", "running_stability": "modes, critical speeds",
    "identification": "estimation, structure", "campaign": "runs, data checks", "ride_quality": "comfort, safety",
    "curving": "full curve", "vehicle": "designs, simulation", "track": "spectra, excitation",
    "contact": "profiles, creep", "runs": "measured runs", "parallel": "threads", "dsp": "filters, spectra",
    "io": "files, units", "progress": "messages, events", "memo": "cache", "core": "Rust kernel",
}  # fmt: skip


def layers() -> list[list[str]]:
    """Return the packages of each layer, the highest layer first, as import-linter holds them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    rows = next(c["layers"] for c in contracts if c["name"] == "layers of the package")
    return [[name.strip(" ()").removeprefix("railui.") for name in row.split("|")] for row in rows]


def imports() -> dict[str, set[str]]:
    """Return the packages that each package imports."""
    found: dict[str, set[str]] = defaultdict(set)
    for file in (ROOT / "railui").rglob("*.py"):
        package = file.relative_to(ROOT / "railui").parts[0].removesuffix(".py")
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module] if node.module != "railui" else [f"railui.{a.name}" for a in node.names]
                parts = [name.split(".") for name in names if name.startswith("railui.")]
                found[package] |= {part[1] for part in parts} - {package}
    return found


def reduced(used: dict[str, set[str]]) -> dict[str, set[str]]:
    """Drop the imports that a path over other packages implies."""

    def reach(name: str, seen: frozenset[str]) -> set[str]:
        below = {other for other in used.get(name, set()) if other not in seen}
        return below.union(*(reach(other, seen | {name}) for other in below))

    return {
        name: {b for b in below if not any(b in reach(a, frozenset({name})) for a in below - {b})}
        for name, below in used.items()
    }


def edges() -> str:
    """Return the drawn imports as text, which the picture carries."""
    return "; ".join(
        f"{name}: {' '.join(sorted(below))}" for name, below in sorted(reduced(imports()).items()) if below
    )


def draw() -> Figure:
    """Draw a row of boxes per layer, and a line per import that no path over other packages implies."""
    rows = layers()
    figure = Figure(figsize=(8.0, 0.62 * len(rows) + 0.2))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    width, height = 0.23, 0.56
    centres = {}
    for i, row in enumerate(rows):
        for k, name in enumerate(row):
            centres[name] = (0.5 + 0.3 * (k - 0.5 * (len(row) - 1)), len(rows) - 1.0 - i)
    for name, used in reduced(imports()).items():
        for other in used & centres.keys() if name in centres else ():
            (x, y), (to_x, to_y) = centres[name], centres[other]
            axes.plot([x, to_x], [y, to_y], color="#8aa0b4", lw=0.8, alpha=0.9, zorder=1)
    for name, (x, y) in centres.items():
        axes.text(x, y + 0.1, name, ha="center", va="center", fontsize=9.5, weight="bold", zorder=3)
        caption = CAPTIONS.get(name, "")
        axes.text(x, y - 0.14, caption, ha="center", va="center", fontsize=6.5, color="#444", zorder=3)
        corner = (x - width / 2, y - height / 2)
        axes.add_patch(FancyBboxPatch(
            corner, width, height, boxstyle="round,pad=0,rounding_size=0.02", fc="white", ec="#35506b", lw=1.0, zorder=2,
        ))  # fmt: skip
    axes.set_xlim(-0.02, 1.02)
    axes.set_ylim(-0.5, len(rows) - 0.4)
    axes.set_axis_off()
    return figure


if __name__ == "__main__":
    import matplotlib

    matplotlib.rcParams.update({"svg.hashsalt": "railui", "svg.fonttype": "none"})
    draw().savefig(HERE / "layers.svg", metadata={"Date": None, "Description": edges()})
