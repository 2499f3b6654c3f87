"""Choices of the dialogs: files by their kind."""

from __future__ import annotations

from pathlib import Path

from railui.desk.presenters.choices import find_documents

KINDS = ("design", "campaign", "study", "fleet")


def test_files_are_listed_by_kind_without_links_and_foreign_ones(tmp_path: Path) -> None:
    files = {
        "a.yaml": "schema: railui.design/1\nvehicle: {}\n",
        "b/study.yml": "variables: []\n",
        "c.yaml": "schema: railui.map/1\nsensors: {}\n",
        "mkdocs.yml": "nav:\n  - index.md\n",
        "broken.yaml": "\xff\x00",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(text.encode("latin-1"))
    (tmp_path / "link").symlink_to(tmp_path / "b", target_is_directory=True)
    assert [text for _, text in find_documents(tmp_path, KINDS)] == ["a.yaml", "b/study.yml"]
    assert [text for _, text in find_documents(tmp_path, ("map",))] == ["c.yaml"]
