"""The files that jedi has parsed: one process a directory, and no harm by half a file."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import jedi
import pytest
from jedi.api.environment import InterpreterEnvironment
from parso.cache import parser_cache

from visualhfsm.code_help.parsed_files import keep_parsed_files, with_readable_files

KEEP = (
    "import sys; from pathlib import Path; from visualhfsm.code_help.parsed_files import keep_parsed_files;"
    "print(keep_parsed_files(Path(sys.argv[1])), flush=True); sys.stdin.read()"
)


@pytest.fixture(autouse=True)
def settings(monkeypatch):
    monkeypatch.setattr(jedi.settings, "cache_directory", jedi.settings.cache_directory)


def keeper(root: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", KEEP, str(root)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )


def test_two_processes_never_share_a_directory_and_the_next_takes_over(tmp_path):
    with keeper(tmp_path) as first, keeper(tmp_path) as second:
        assert first.stdout is not None
        assert second.stdout is not None
        used = {first.stdout.readline().strip(), second.stdout.readline().strip()}
        assert used == {str(tmp_path / "0"), str(tmp_path / "1")}
        first.kill()
        second.kill()
    with keeper(tmp_path) as third:
        assert third.stdout is not None
        assert third.stdout.readline().strip() == str(tmp_path / "0")
        third.kill()


def test_without_a_directory_that_lasts_one_for_a_while_is_used(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").write_text("")
    assert keep_parsed_files(tmp_path / "file") is None
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
            environment=InterpreterEnvironment(),  # not a process of its own
        )
        return [found.name for found in script.complete(2, 9)]

    assert complete() == ["walk"]
    for kept in (tmp_path / "files").rglob("*.pkl"):
        kept.write_bytes(b"")
    parser_cache.clear()
    with pytest.raises(EOFError):
        complete()
    assert with_readable_files(complete) == ["walk"]
