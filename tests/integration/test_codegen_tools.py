"""The sub-commands of codegen, each as people run it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.codegen_command import ROOT, codegen, files_in
from tests.support.limits import LIMIT
from tests.support.processes import ComponentProcess

LAMP = "module home {\n\n  struct Light {\n    float power;\n  };\n\n  interface Lamp {\n    Light get();\n  };\n\n};\n"
ROOM = '#include "lamp.idl"\n\nmodule home {\n\n  interface Room {\n    Light lightOf(string lamp);\n  };\n\n};\n'
DOCUMENT = ROOT / "behaviors" / "dance.xml"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A directory with two IDL files, one of which includes the other."""
    (tmp_path / "lamp.idl").write_text(LAMP)
    (tmp_path / "room.idl").write_text(ROOM)
    return tmp_path


def git(directory: Path, *arguments: str) -> None:
    identity = ["-c", "user.name=test", "-c", "user.email=test@localhost", "-c", "commit.gpgsign=false"]
    subprocess.run(
        ["git", *identity, *arguments], cwd=directory, check=True, capture_output=True, timeout=LIMIT
    )


# generate


def test_the_default_command_has_a_name(home: Path) -> None:
    assert codegen("generate", "lamp.idl", cwd=home).returncode == 0
    assert codegen("--check", "lamp.idl", cwd=home).returncode == 0


def test_a_package_with_a_name(home: Path) -> None:
    done = codegen("lamp.idl", "-o", "out", "--package", "my.api", cwd=home)
    assert done.returncode == 0, done.stderr
    script = "from my.api.home import LampPrx; print(LampPrx.__module__)"
    environment = {**os.environ, "PYTHONPATH": f"{home / 'out'}{os.pathsep}{ROOT}"}
    ran = subprocess.run(
        [sys.executable, "-c", script],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert ran.stdout == "my.api.home.lamp\n", ran.stderr
    assert codegen("--check", "lamp.idl", "-o", "out", "--package", "my.api", cwd=home).returncode == 0
    assert codegen("lamp.idl", "--package", "api", cwd=home).returncode == 0
    assert (home / "api" / "home" / "lamp.py").is_file()
    assert codegen("lamp.idl", "--package", "not-a-name", cwd=home).returncode == 2


def test_interfaces_and_documents_in_one_call(home: Path) -> None:
    shutil.copy(DOCUMENT, home / "dance.xml")
    done = codegen("lamp.idl", "dance.xml", cwd=home)
    assert done.returncode == 0, done.stderr
    assert (home / "dance.py").is_file()
    assert (home / "home" / "lamp.py").is_file()
    (home / "dance.xml").write_text("<VisualHFSM>")
    (home / "lamp.idl").write_text(LAMP.replace("float power", "double power"))
    before = files_in(home)
    assert codegen("lamp.idl", "dance.xml", cwd=home).returncode == 1
    assert files_in(home) == before


def test_watching_generates_at_every_change_and_ends_at_ctrl_c(home: Path) -> None:
    environment = {"PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "codegen", "--watch", str(home / "room.idl")]
    with ComponentProcess(command, environment) as watching:
        watching.wait_for(r"wrote .*lamp\.py")
        (home / "lamp.idl").write_text(LAMP.replace("float power", "double brightness"))
        watching.wait_for(r"wrote .*lamp\.py")
        (home / "lamp.idl").write_text(LAMP.replace("float power", "flot power"))
        watching.wait_for(r"`flot` is not defined")
        (home / "room.idl").write_text(ROOM.replace("lamp.idl", "light.idl"))
        watching.wait_for(r"`light.idl` is not found")
        (home / "light.idl").write_text(LAMP)
        watching.wait_for(r"wrote .*light\.py")
        watching.process.send_signal(2)
        assert watching.wait(LIMIT) == 130
        assert "Traceback" not in watching.output


@pytest.mark.parametrize("command", [["--check"], ["fmt"], ["fingerprint"], ["breaking", "--against", "."]])
def test_errors_as_json(home: Path, command: list[str]) -> None:
    (home / "lamp.idl").write_text("module home { struct Light { float power } };\n")
    done = codegen(*command, "--error-format", "json", "lamp.idl", cwd=home)
    assert done.returncode == 1
    (first, *_) = json.loads(done.stderr)
    assert (first["code"], first["path"], first["line"]) == ("E010", "lamp.idl", 1)


def test_errors_as_annotations(home: Path) -> None:
    (home / "lamp.idl").write_text(LAMP.replace("float power", "flot power"))
    done = codegen("--error-format", "github", "lamp.idl", cwd=home)
    assert done.returncode == 1
    assert done.stderr.startswith("::error file=lamp.idl,line=4,col=5,endColumn=9,title=codegen E012::")


# fmt


def test_formatting_files(home: Path) -> None:
    (home / "lamp.idl").write_text(LAMP.replace("\n", " ") + "// end\n")
    done = codegen("fmt", "--check", "lamp.idl", "room.idl", cwd=home)
    assert done.returncode == 1
    assert "+    float power;\n" in done.stdout
    assert done.stderr == "1 of 2 files would change\n"
    done = codegen("fmt", "lamp.idl", "room.idl", cwd=home)
    assert done.stdout == "formatted lamp.idl\n1 file left as it is\n"
    assert (home / "lamp.idl").read_text() == LAMP.rstrip("\n") + " // end\n"
    assert codegen("fmt", "--check", "lamp.idl", "room.idl", cwd=home).returncode == 0


def test_files_with_errors_are_not_formatted(home: Path) -> None:
    (home / "lamp.idl").write_text("module home { struct Light { float power };\n")
    (home / "room.idl").write_text(ROOM.replace("\n", " ").replace('idl" ', 'idl"\n'))
    before = files_in(home)
    done = codegen("fmt", "lamp.idl", "room.idl", cwd=home)
    assert done.returncode == 1
    assert "lamp.idl:1:42: error[E010]" in done.stderr
    assert files_in(home) == before


def test_a_missing_include_does_not_keep_a_file_from_being_formatted(home: Path) -> None:
    (home / "lamp.idl").unlink()
    assert codegen("fmt", "--check", "room.idl", cwd=home).returncode == 0


def test_the_interfaces_of_the_project_are_formatted() -> None:
    files = sorted(path.relative_to(ROOT) for path in ROOT.glob("interfaces/*.idl"))
    assert codegen("fmt", "--check", *files, cwd=ROOT).returncode == 0


# breaking


@pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")
def test_what_breaks_since_a_revision(home: Path) -> None:
    (home / "idl").mkdir()
    for name in ("lamp.idl", "room.idl"):
        (home / name).rename(home / "idl" / name)
    git(home, "init", "-q", "-b", "main")
    git(home, "add", "-A")
    git(home, "commit", "-q", "-m", "first")
    done = codegen("breaking", "--against", "HEAD", "idl/lamp.idl", "idl/room.idl", cwd=home)
    assert (done.returncode, done.stdout) == (0, "nothing breaks, compared with HEAD\n"), done.stderr
    (home / "idl" / "lamp.idl").write_text(LAMP.replace("float power", "double power"))
    (home / "idl" / "room.idl").unlink()
    before = files_in(home / "idl")
    done = codegen("breaking", "--against", "main", "idl/lamp.idl", cwd=home)
    assert done.returncode == 1
    assert (
        "idl/lamp.idl:4:12: error[B304]: member `power` of `::home::Light` was float and is double"
        in done.stderr
    )
    assert "note: breaks wire and source: the value is refused where it arrives" in done.stderr
    assert "main:idl/lamp.idl:4:11: note: it was here\n        float power;\n" in done.stderr
    assert "main:idl/room.idl:5:13: error[B101]: interface `::home::Room` was removed" in done.stderr
    assert done.stderr.endswith("2 errors; compared with main\n")
    assert files_in(home / "idl") == before
    done = codegen(
        "breaking", "--against", "main", "--ignore", "B101", "--ignore", "B304", "idl/lamp.idl", cwd=home
    )
    assert done.returncode == 0
    assert codegen("breaking", "--against", "gone", "idl/lamp.idl", cwd=home).returncode == 2
    assert codegen("breaking", "--against=--help", "idl/lamp.idl", cwd=home).returncode == 2


def test_what_breaks_since_a_copy(home: Path) -> None:
    shutil.copytree(home, home / "old", ignore=shutil.ignore_patterns("old"))
    (home / "lamp.idl").write_text(LAMP.replace("    float power;\n", "    float power;\n    float hue;\n"))
    done = codegen("breaking", "--against", "old", "lamp.idl", "room.idl", cwd=home)
    assert done.returncode == 1
    assert "error[B302]" in done.stderr
    assert "1 error; compared with old\n" in done.stderr
    (home / "lamp.idl").write_text(LAMP.replace("struct", "const int most = 2;\n\n  struct"))
    shutil.copy(home / "lamp.idl", home / "old" / "lamp.idl")
    (home / "lamp.idl").write_text(LAMP.replace("struct", "const int most = 3;\n\n  struct"))
    assert codegen("breaking", "--against", "old", "--kind", "wire", "lamp.idl", cwd=home).returncode == 0
    assert codegen("breaking", "--against", "old", "--kind", "source", "lamp.idl", cwd=home).returncode == 1


def test_errors_in_the_older_version_are_reported_there(home: Path) -> None:
    (home / "old").mkdir()
    (home / "old" / "lamp.idl").write_text("module home { struct Light {};")
    done = codegen("breaking", "--against", "old", "lamp.idl", cwd=home)
    assert done.returncode == 1
    assert "old/lamp.idl:1:" in done.stderr


# fingerprint, describe


def test_fingerprints_do_not_depend_on_how_a_file_is_written(home: Path) -> None:
    before = codegen("fingerprint", "lamp.idl", cwd=home).stdout
    assert [line.split()[1:] for line in before.splitlines()] == [
        ["interface", "::home::Lamp"],
        ["struct", "::home::Light"],
    ]
    (home / "lamp.idl").write_text(LAMP.replace("\n", " ").replace("struct", "/** Of a lamp. */ struct"))
    assert codegen("fingerprint", "lamp.idl", cwd=home).stdout == before
    (home / "lamp.idl").write_text(LAMP.replace("float", "double"))
    after = codegen("fingerprint", "lamp.idl", cwd=home).stdout
    assert not set(before.splitlines()) & set(after.splitlines())
    generated = (home / "home").exists()
    assert not generated


def test_describing_a_type(home: Path) -> None:
    done = codegen("describe", "Light", "lamp.idl", cwd=home)
    assert done.stdout.startswith("struct ::home::Light\ndefined in lamp.idl:3:10\n")
    assert "fingerprint" in done.stdout
    done = codegen("describe", "Lihgt", "lamp.idl", cwd=home)
    assert done.returncode == 2
    assert "did you mean" in done.stderr


# all


@pytest.mark.parametrize("command", ["fmt", "fingerprint", "describe", "breaking"])
def test_wrong_usage_exits_with_2(home: Path, command: str) -> None:
    assert codegen(command, cwd=home).returncode == 2
    assert codegen(command, "--unknown", cwd=home).returncode == 2
    done = codegen(command, "--help", cwd=home)
    assert done.returncode == 0
    assert "FILES" in done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_for_a_shell(home: Path, shell: str) -> None:
    script = codegen(cwd=home, environment={"_CODEGEN_COMPLETE": f"source_{shell}"})
    assert "codegen" in script.stdout
    assert f"complete_{shell}" in script.stdout


@pytest.mark.parametrize(
    ("words", "proposals"),
    [
        (["codegen", "f"], {"fmt", "fingerprint"}),
        (["codegen", "--ch"], {"--check"}),
        (["codegen", "lamp.idl", "--w"], {"--watch"}),
        (["codegen", "breaking", "--a"], {"--against"}),
        (["codegen", "la"], set()),  # the shell proposes files
    ],
)
def test_what_completion_proposes(home: Path, words: list[str], proposals: set[str]) -> None:
    environment = {
        "_CODEGEN_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
    }
    assert set(codegen(cwd=home, environment=environment).stdout.split()) == proposals
