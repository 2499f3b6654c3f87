"""The commands and programs of README and docs print what the pages show."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.transcript import ROOT, Shell, copy_bundled_files, outputs_agree, parse_blocks, updated_output

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def pages_with_blocks(slow: bool) -> list[object]:
    """Return the pages with blocks that run, either with or without a slow one: a page is one session."""
    pages = []
    for page in PAGES:
        blocks = [b for b in parse_blocks(page.read_text()) if b.is_run]
        if blocks and any(b.is_slow for b in blocks) == slow:
            pages.append(pytest.param(page, id=str(page.relative_to(ROOT))))
    return pages


@pytest.fixture(scope="session")
def shell() -> Shell:
    """Share one shell between all pages: the same command in the same state of its directory runs once."""
    return Shell()


def run_page(page: Path, home: Path, shell: Shell) -> None:
    """Run a page from its first line to its last in one directory; its python blocks are one program."""
    blocks = [b for b in parse_blocks(page.read_text()) if b.is_run]
    for block in blocks:
        for command in block.commands() if block.language == "console" else ():
            output, code = shell.run(command.line, home)
            expected = f"$ {command.line}\n" + "\n".join(command.output)
            assert code == 0, "\n".join([expected, *output])
            if command.output:
                agree = outputs_agree(command.output, output, block.tolerance)
                assert agree, f"the page shows\n{expected}\nthe command prints\n" + "\n".join(output)
    program = "\n".join(b.body for b in blocks if b.language == "python")
    if program:
        done = subprocess.run([sys.executable, "-c", program], cwd=home, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", pages_with_blocks(slow=False))
def test_the_commands_of_a_page_print_its_output(page: Path, tmp_path: Path, shell: Shell) -> None:
    run_page(page, copy_bundled_files(tmp_path), shell)


@pytest.mark.slow
@pytest.mark.parametrize("page", pages_with_blocks(slow=True))
def test_the_commands_of_a_slow_page_print_its_output(page: Path, tmp_path: Path, shell: Shell) -> None:
    run_page(page, copy_bundled_files(tmp_path), shell)


def test_the_comparison_detects_other_words_other_numbers_and_extra_lines() -> None:
    output = ["score 53.1", "class good"]
    assert outputs_agree(["score 53.2", "class good"], output)
    assert not outputs_agree(["score 56.0", "class good"], output)
    assert not outputs_agree(["score 53.1", "class bad"], output)
    assert not outputs_agree(["score 53.1"], output)
    assert outputs_agree(["...", "class good"], output)
    assert outputs_agree(["score 56.0", "class good"], output, tolerance=0.10)


def test_a_command_runs_once_per_state_of_its_directory(tmp_path: Path) -> None:
    shell, homes = Shell(), [tmp_path / name for name in "abc"]
    for home in homes:
        home.mkdir()
        (home / "word").write_text("c" if home.name == "c" else "same")
    line = "echo run >> ../runs; cat word; mkdir out; cat word word > out/twice; mv word moved"
    assert [shell.run(line, home)[0] for home in homes] == [["same"], ["same"], ["c"]]
    assert (tmp_path / "runs").read_text() == "run\n" * 2
    assert [(home / "out/twice").read_text() for home in homes] == ["samesame", "samesame", "cc"]
    assert not any((home / "word").exists() for home in homes)


def test_updating_an_abridged_transcript_changes_only_its_numbers() -> None:
    output = ["title", "score  60.0", "class good", "margin  5.0", "end"]
    page = ["...", "score 50.0", "...", "margin 4.0", "..."]
    assert updated_output(page, output, 0.02) == ["...", "score  60.0", "...", "margin  5.0", "..."]
    assert updated_output(["...", "score 59.9", "..."], output, 0.02) == ["...", "score 59.9", "..."]
    assert updated_output(["title"], output, 0.02) == output
