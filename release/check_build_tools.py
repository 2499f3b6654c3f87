"""List the tools that the build needs and this machine lacks, with remedies; runs with any Python 3."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RUST = "install Rust from https://rustup.rs (what distributions ship is often older)"


def required_version(path: str, key: str) -> "tuple[int, ...]":
    """Return the version that a file of the project requires, e.g. (1, 89)."""
    return parse_version((ROOT / path).read_text(encoding="utf-8").partition(key)[2])


def parse_version(text: str) -> "tuple[int, ...]":
    """Return the first two numbers of a text such as `rustc 1.89.0`; empty without numbers."""
    match = re.search(r"(\d+)\.(\d+)", text)
    return tuple(map(int, match.groups())) if match else ()


def dotted(version: "tuple[int, ...]") -> str:
    """Return a version as text."""
    return ".".join(map(str, version)) or "unknown"


def check_rust(required: "tuple[int, ...]") -> str:
    """Return the problem with the Rust compiler; empty if there is none."""
    if not (shutil.which("cargo") and shutil.which("rustc")):
        return f"cargo is missing: {RUST}"
    installed = parse_version(subprocess.run(["rustc", "--version"], capture_output=True).stdout.decode())
    return "" if installed >= required else f"rustc is {dotted(installed)}, {dotted(required)} is needed: {RUST}"


def check_python(required: "tuple[int, ...]") -> str:
    """Return the problem with the running Python; empty if there is none."""
    if sys.version_info[:2] < required:
        have, need = dotted(sys.version_info[:2]), dotted(required)
        return f"python3 is {have}, {need} is needed: make PYTHON=python{need}"
    pip = subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True)
    return "" if pip.returncode == 0 else "pip is missing: apt install python3-pip"


def check_linker() -> str:
    """Return the problem with the linker; empty if there is none."""
    return "" if shutil.which("cc") else "cc is missing, the linker of Rust: apt install gcc libc6-dev"


def main() -> int:
    """Print all problems; return 1 if there are any."""
    results = (
        check_python(required_version("pyproject.toml", "requires-python")),
        check_rust(required_version("rust_core/Cargo.toml", "rust-version")),
        check_linker(),
    )
    problems = [problem for problem in results if problem]
    print(*problems, sep="\n", end="\n" if problems else "", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
