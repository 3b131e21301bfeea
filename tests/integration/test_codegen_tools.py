"""The options of codegen, as people use them."""

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


def test_errors_as_json(home: Path) -> None:
    (home / "lamp.idl").write_text("module home { struct Light { float power } };\n")
    done = codegen("--check", "--error-format", "json", "lamp.idl", cwd=home)
    assert done.returncode == 1
    (first, *_) = json.loads(done.stderr)
    assert (first["code"], first["path"], first["line"]) == ("E010", "lamp.idl", 1)


def test_errors_as_annotations(home: Path) -> None:
    (home / "lamp.idl").write_text(LAMP.replace("float power", "flot power"))
    done = codegen("--error-format", "github", "lamp.idl", cwd=home)
    assert done.returncode == 1
    assert done.stderr.startswith("::error file=lamp.idl,line=4,col=5,endColumn=9,title=codegen E012::")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_for_a_shell(home: Path, shell: str) -> None:
    script = codegen(cwd=home, environment={"_CODEGEN_COMPLETE": f"source_{shell}"})
    assert "codegen" in script.stdout
    assert f"complete_{shell}" in script.stdout


@pytest.mark.parametrize(
    ("words", "proposals"),
    [
        (["codegen", "--ch"], {"--check"}),
        (["codegen", "lamp.idl", "--w"], {"--watch"}),
        (["codegen", "--error-format", "g"], {"github"}),
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
