"""The files that jedi has parsed: an incomplete file does no harm."""

from __future__ import annotations

import tempfile
from pathlib import Path

import jedi
import pytest
from jedi.api.environment import InterpreterEnvironment
from parso.cache import parser_cache

from visualhfsm.project._code_help.parsed_files import keep_parsed_files, with_readable_files


@pytest.fixture(autouse=True)
def settings(monkeypatch):
    monkeypatch.setattr(jedi.settings, "cache_directory", jedi.settings.cache_directory)


def test_the_files_are_kept_in_the_cache_of_the_user(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    keep_parsed_files()
    assert jedi.settings.cache_directory == str(tmp_path / "visualhfsm" / "parsed")


def test_without_a_directory_that_lasts_one_for_a_while_is_used(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").write_text("")
    keep_parsed_files(tmp_path / "file")
    directory = Path(jedi.settings.cache_directory)
    assert directory.parent == tmp_path
    assert directory.stat().st_mode & 0o077 == 0


def test_half_a_file_is_forgotten(tmp_path):
    module = tmp_path / "helped.py"
    module.write_text("def walk():\n    pass\n")
    jedi.settings.cache_directory = str(tmp_path / "files")

    def complete() -> list[str]:
        script = jedi.Script(
            "import helped\nhelped.wa",
            path=tmp_path / "x.py",
            project=jedi.Project(tmp_path),
            environment=InterpreterEnvironment(),  # not a separate process
        )
        return [found.name for found in script.complete(2, 9)]

    assert complete() == ["walk"]
    for kept in (tmp_path / "files").rglob("*.pkl"):
        kept.write_bytes(b"")
    parser_cache.clear()
    with pytest.raises(EOFError):
        complete()
    assert with_readable_files(complete) == ["walk"]


def test_files_that_another_process_writes_are_left_to_it(tmp_path):
    jedi.settings.cache_directory = str(tmp_path / "files")
    asked: list[str] = []

    def question() -> str:
        asked.append(jedi.settings.cache_directory)
        if asked[-1] == asked[0]:  # there the file is still being written
            raise EOFError
        return "answer"

    assert with_readable_files(question) == "answer"
