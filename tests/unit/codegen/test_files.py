from __future__ import annotations

import os
from pathlib import Path

import pytest

from codegen.files import FilesNotWrittenError, GeneratedFile, apply, compare_with_disk, diff


def contents(directory: Path) -> dict[str, str]:
    files = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_text() for path in files}


def test_files_and_their_directories_are_written(tmp_path: Path) -> None:
    apply(compare_with_disk([GeneratedFile(tmp_path / "a/b/c.py", "x\n"), GeneratedFile(tmp_path / "d", "")]))
    assert contents(tmp_path) == {"a/b/c.py": "x\n", "d": ""}


def test_an_unchanged_file_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_text("same\n")
    os.utime(path, (1, 1))
    changes = compare_with_disk([GeneratedFile(path, "same\n")])
    assert not changes
    apply(changes)
    assert path.stat().st_mtime == 1


def test_a_path_gets_one_text(tmp_path: Path) -> None:
    once, same, other = (GeneratedFile(tmp_path / "a.py", text) for text in ("x\n", "x\n", "y\n"))
    assert len(compare_with_disk([once, same]).write) == 1
    with pytest.raises(FilesNotWrittenError, match=r"a\.py"):
        compare_with_disk([once, other])


def test_a_file_with_other_line_ends_has_changed(tmp_path: Path) -> None:
    path = tmp_path / "a.py"
    path.write_bytes(b"same\r\n")
    assert compare_with_disk([GeneratedFile(path, "same\n")])


def test_permissions_of_a_file_are_kept_and_links_followed(tmp_path: Path) -> None:
    target = tmp_path / "target.py"
    target.write_text("old\n")
    target.chmod(0o751)
    link = tmp_path / "link.py"
    link.symlink_to(target)
    apply(compare_with_disk([GeneratedFile(link, "new\n")]))
    assert link.is_symlink()
    assert target.read_text() == "new\n"
    assert target.stat().st_mode & 0o777 == 0o751


def test_leftovers_go_with_their_directory(tmp_path: Path) -> None:
    leftover = tmp_path / "old" / "a.py"
    leftover.parent.mkdir()
    leftover.write_text("x\n")
    apply(compare_with_disk([], [leftover, tmp_path / "never_there.py"]))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("obstacle", ["a_directory", "a_file_for_a_parent"])
def test_after_a_failure_the_disk_is_as_before(tmp_path: Path, obstacle: str) -> None:
    (tmp_path / "first.py").write_text("old\n")
    (tmp_path / "leftover.py").write_text("left\n")
    if obstacle == "a_directory":
        bad = tmp_path / "z.py"
        bad.mkdir()
        (bad / "inside").write_text("kept\n")
    else:
        (tmp_path / "z").write_text("a file\n")
        bad = tmp_path / "z" / "below.py"
    before = contents(tmp_path)
    files = [GeneratedFile(tmp_path / name, "new\n") for name in ("first.py", "new/second.py")]
    with pytest.raises((FilesNotWrittenError, OSError)) as failure:
        apply(compare_with_disk([*files, GeneratedFile(bad, "new\n")], [tmp_path / "leftover.py"]))
    assert str(bad) in str(failure.value)
    assert contents(tmp_path) == before
    assert not (tmp_path / "new").exists()


def test_the_diff_names_new_changed_and_leftover_files(tmp_path: Path) -> None:
    changed, leftover, new, empty = (tmp_path / name for name in ("changed", "leftover", "new", "empty"))
    changed.write_text("one\ntwo")
    leftover.write_text("gone\n")
    text = diff(
        compare_with_disk(
            [GeneratedFile(changed, "one\nthree\n"), GeneratedFile(new, "n\n"), GeneratedFile(empty, "")],
            [leftover],
        )
    )
    assert f"--- {changed}\n+++ {changed}\n@@" in text
    assert "\n-two\n\\ No newline at end of file\n+three\n" in text
    assert f"--- {leftover}\n+++ /dev/null\n" in text
    assert f"--- /dev/null\n+++ {empty}\n" in text
    assert f"--- /dev/null\n+++ {new}\n@@ -0,0 +1 @@\n+n\n" in text
