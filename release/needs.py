"""What a machine lacks for the build, each with its remedy; nothing need be installed, and any Python 3 will do."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
RUST = "install Rust from https://rustup.rs (what distributions ship is often older)"


def least(path: str, key: str) -> "tuple[int, ...]":
    """The version that a file of the project asks for, e.g. (1, 89)."""
    return version((HOME / path).read_text(encoding="utf-8").partition(key)[2])


def version(text: str) -> "tuple[int, ...]":
    """The first two numbers of a text such as `rustc 1.89.0`; none where there are none."""
    found = re.search(r"(\d+)\.(\d+)", text)
    return tuple(map(int, found.groups())) if found else ()


def dotted(version: "tuple[int, ...]") -> str:
    return ".".join(map(str, version)) or "unknown"


def rust(wanted: "tuple[int, ...]") -> str:
    """What is wrong with the Rust compiler, or nothing."""
    if not (shutil.which("cargo") and shutil.which("rustc")):
        return f"cargo is missing: {RUST}"
    have = version(subprocess.run(["rustc", "--version"], capture_output=True).stdout.decode())
    return "" if have >= wanted else f"rustc is {dotted(have)}, {dotted(wanted)} is needed: {RUST}"


def python(wanted: "tuple[int, ...]") -> str:
    """What is wrong with the Python that runs this, or nothing."""
    if sys.version_info[:2] < wanted:
        return (
            f"python3 is {dotted(sys.version_info[:2])}, {dotted(wanted)} is needed: make PYTHON=python{dotted(wanted)}"
        )
    told = subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True)
    return "" if told.returncode == 0 else "pip is missing: apt install python3-pip"


def linker() -> str:
    """What is wrong with the linker, or nothing."""
    return "" if shutil.which("cc") else "cc is missing, with which Rust links: apt install gcc libc6-dev"


def main() -> int:
    """All that is lacking, told at once."""
    told = (
        python(least("pyproject.toml", "requires-python")),
        rust(least("rust_core/Cargo.toml", "rust-version")),
        linker(),
    )
    lacks = [lack for lack in told if lack]
    print(*lacks, sep="\n", end="\n" if lacks else "", file=sys.stderr)
    return 1 if lacks else 0


if __name__ == "__main__":
    sys.exit(main())
