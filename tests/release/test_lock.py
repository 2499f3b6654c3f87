"""Locked requirements: they agree with pyproject.toml, have hashes, and everything is installed from them."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT, GROUPS = PYPROJECT["project"], PYPROJECT["dependency-groups"]
LOCKS = {path.stem: path.read_text() for path in sorted((ROOT / "requirements").glob("*.txt"))}
ENTRY = re.compile(r"(?P<name>[\w.-]+)==(?P<version>\S+)(?: ; [^\\\n]+?)?(?: \\\n    --hash=sha256:[0-9a-f]{64})+\n")


def pins(lock: str) -> dict[str, str]:
    """Return the versions in a lock by package."""
    return {canonicalize_name(entry["name"]): entry["version"] for entry in ENTRY.finditer(LOCKS[lock])}


def extra(name: str) -> list[str]:
    """Return the requirements of an extra, with those of the extras that it names."""
    found: list[str] = []
    for line in PROJECT["optional-dependencies"][name]:
        requirement = Requirement(line)
        found += [line] if requirement.name != "railui" else [r for e in requirement.extras for r in extra(e)]
    return found


DECLARED = {
    "run": PROJECT["dependencies"],
    "dev": [*PROJECT["dependencies"], *extra("dev")],
    "exudyn": [*PROJECT["dependencies"], *extra("bench")],
    **GROUPS,
}


def load_lock() -> ModuleType:
    """Import release/lock.py."""
    spec = importlib.util.spec_from_file_location("lock", ROOT / "release" / "lock.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_declared_set_of_requirements_has_a_lock() -> None:
    assert set(LOCKS) == set(DECLARED)


@pytest.mark.parametrize("lock", DECLARED)
def test_a_lock_has_every_declared_requirement_in_an_allowed_version(lock: str) -> None:
    versions = pins(lock)
    for requirement in map(Requirement, DECLARED[lock]):
        assert requirement.specifier.contains(versions[canonicalize_name(requirement.name)]), requirement


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_contains_only_versions_with_hashes(lock: str) -> None:
    comment, _, entries = LOCKS[lock].partition("\n")
    assert comment.startswith("#") and pins(lock) and ENTRY.sub("", entries) == ""


def test_locks_name_one_version_of_a_package() -> None:
    versions: dict[str, set[str]] = {}
    for lock in LOCKS:
        for name, version in pins(lock).items():
            versions.setdefault(name, set()).add(version)
    assert {name: found for name, found in versions.items() if len(found) > 1} == {}


def test_the_build_requirement_is_the_locked_one() -> None:
    for requirement in map(Requirement, PYPROJECT["build-system"]["requires"]):
        assert requirement.specifier.contains(pins("build")[requirement.name])
        assert str(requirement) in map(str, map(Requirement, GROUPS["build"]))


def test_the_makefile_installs_only_by_hash_or_without_dependencies() -> None:
    lines = re.findall(r".*pip.* install .*", (ROOT / "Makefile").read_text())
    assert len(lines) > 3
    assert [line for line in lines if "--require-hashes" not in line and "--no-deps" not in line] == []


def test_crates_are_compiled_in_the_locked_versions() -> None:
    pattern = r"^\s*(?:cargo|\$\(CARGO\)) (?:test|clippy|build|check) .*"
    lines = re.findall(pattern, (ROOT / "Makefile").read_text(), re.MULTILINE)
    assert len(lines) > 2 and [line for line in lines if "--locked" not in line] == []
    assert PYPROJECT["tool"]["maturin"]["locked"] is True


def archive(name: str) -> dict[str, Any]:
    """Return an archive of a lock whose hash is its name."""
    return {"url": f"somewhere/{name}", "hashes": {"sha256": name}}


def test_hashes_are_those_of_wheels_for_linux_and_of_the_source_archive() -> None:
    lock = load_lock()
    accepted = [
        "p-1-cp311-cp311-manylinux_2_17_x86_64.manylinux2014_x86_64.whl",
        "p-1-cp39-abi3-manylinux_2_28_aarch64.whl",
        "p-1-py3-none-any.whl",
    ]
    others = [
        "p-1-cp310-cp310-manylinux_2_17_x86_64.whl",
        "p-1-cp312-cp312-macosx_11_0_arm64.whl",
        "p-1-cp312-cp312-musllinux_1_2_x86_64.whl",
        "p-1-cp313-cp313t-manylinux_2_28_x86_64.whl",
        "p-1-cp313-cp313-win_amd64.whl",
    ]
    package = {"sdist": archive("p-1.tar.gz"), "wheels": [archive(name) for name in [*accepted, *others]]}
    assert lock.hashes(package) == sorted([*accepted, "p-1.tar.gz"])


def test_pythons_and_machines_without_a_wheel_are_listed() -> None:
    lock = load_lock()
    wheels = [archive("p-1-cp312-abi3-manylinux_2_28_x86_64.whl"), archive("p-1-cp311-cp311-linux_aarch64.whl")]
    missing = ["3.11 x86_64", "3.12 aarch64", "3.13 aarch64", "3.14 aarch64"]
    assert list(lock.missing_wheels({"wheels": wheels})) == missing
    assert list(lock.missing_wheels({"wheels": wheels, "marker": "platform_machine == 'x86_64'"})) == ["3.11 x86_64"]
