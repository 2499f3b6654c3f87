"""Every block of README and docs that a reader may type does what the page says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.transcript import ROOT, Shell, agree, blocks, bundled, rewritten

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def cases(slow: bool) -> list[object]:
    """Pages with blocks that run; those with a slow block apart, as a page is one session."""
    found = []
    for page in PAGES:
        runnable = [b for b in blocks(page.read_text()) if b.runs]
        if runnable and any(b.slow for b in runnable) == slow:
            found.append(pytest.param(page, id=str(page.relative_to(ROOT))))
    return found


@pytest.fixture(scope="session")
def shell() -> Shell:
    """One shell for all pages: the same command in the same state of its directory runs once."""
    return Shell()


def play(page: Path, home: Path, shell: Shell) -> None:
    """Types a page from its first line to its last, in one directory; python blocks are one program."""
    found = [b for b in blocks(page.read_text()) if b.runs]
    for block in found:
        for command in block.commands() if block.language == "console" else ():
            printed, code = shell.run(command.line, home)
            expected = f"$ {command.line}\n" + "\n".join(command.printed)
            assert code == 0, "\n".join([expected, *printed])
            if command.printed:
                told = agree(command.printed, printed, block.close)
                assert told, f"the page says\n{expected}\nprinted is\n" + "\n".join(printed)
    program = "\n".join(b.body for b in found if b.language == "python")
    if program:
        done = subprocess.run([sys.executable, "-c", program], cwd=home, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", cases(slow=False))
def test_a_page_prints_what_it_says(page: Path, tmp_path: Path, shell: Shell) -> None:
    play(page, bundled(tmp_path), shell)


@pytest.mark.slow
@pytest.mark.parametrize("page", cases(slow=True))
def test_a_page_of_long_jobs_prints_what_it_says(page: Path, tmp_path: Path, shell: Shell) -> None:
    play(page, bundled(tmp_path), shell)


def test_a_page_that_lies_is_found() -> None:
    """The comparison can fail: another word, another number, a line too many."""
    printed = ["score 53.1", "class good"]
    assert agree(["score 53.2", "class good"], printed)
    assert not agree(["score 56.0", "class good"], printed)
    assert not agree(["score 53.1", "class bad"], printed)
    assert not agree(["score 53.1"], printed)
    assert agree(["...", "class good"], printed)
    assert agree(["score 56.0", "class good"], printed, close=0.10)


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


def test_rewriting_a_cut_transcript_changes_its_numbers_only() -> None:
    printed = ["title", "score  60.0", "class good", "margin  5.0", "end"]
    page = ["...", "score 50.0", "...", "margin 4.0", "..."]
    assert rewritten(page, printed, 0.02) == ["...", "score  60.0", "...", "margin  5.0", "..."]
    assert rewritten(["...", "score 59.9", "..."], printed, 0.02) == ["...", "score 59.9", "..."]
    assert rewritten(["title"], printed, 0.02) == printed
