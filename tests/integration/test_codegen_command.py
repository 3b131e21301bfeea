"""The command `codegen`, as users run it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.codegen_command import ROOT, codegen, files_in
from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.processes import ComponentProcess

LAMP = "module home { struct Light { float power; }; interface Lamp { Light get(); }; };\n"
ROOM = '#include "lamp.idl"\nmodule home { interface Room { Light lightOf(string lamp); }; };\n'
DOCUMENT = ROOT / "behaviors" / "dance.xml"


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A directory with two IDL files, one of which includes the other."""
    (tmp_path / "lamp.idl").write_text(LAMP)
    (tmp_path / "room.idl").write_text(ROOM)
    return tmp_path


def test_the_packages_of_the_project_are_current() -> None:
    interfaces = sorted(path.relative_to(ROOT) for path in ROOT.glob("interfaces/*.idl"))
    done = codegen("--check", *interfaces, cwd=ROOT)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("arguments", [("--help",), ("lamp.idl",), ("--check", "lamp.idl")])
def test_output_that_cannot_be_written_is_reported_in_one_line(
    home: Path, arguments: tuple[str, ...]
) -> None:
    command = [sys.executable, "-m", "codegen", *arguments]
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(
            command, cwd=home, stdout=full, stderr=subprocess.PIPE, text=True, timeout=RUN_LIMIT, check=False
        )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == "codegen: error: cannot write: No space left on device"
    assert "Traceback" not in done.stderr


def test_an_included_file_is_generated_too_and_the_package_stays_complete(home: Path) -> None:
    (home / "fan.idl").write_text("module home { interface Fan { void spin(); }; };")
    assert codegen("room.idl", cwd=home).returncode == 0
    assert set(files_in(home / "home")) == {"__init__.py", "lamp.py", "room.py", "py.typed", "schema.json"}
    assert codegen("fan.idl", cwd=home).returncode == 0
    one_by_one = files_in(home / "home")
    assert "from .lamp import *" in one_by_one["__init__.py"]
    done = codegen("--check", "fan.idl", "lamp.idl", "room.idl", cwd=home)
    assert done.returncode == 0, done.stdout
    shutil.rmtree(home / "home")
    assert codegen("room.idl", "fan.idl", cwd=home).returncode == 0
    assert files_in(home / "home") == one_by_one


def test_a_second_run_touches_nothing(home: Path) -> None:
    assert codegen("lamp.idl", cwd=home).returncode == 0
    before = {path: path.stat().st_mtime_ns for path in (home / "home").iterdir()}
    done = codegen("lamp.idl", cwd=home)
    assert done.stdout == "4 files up to date\n"
    assert {path: path.stat().st_mtime_ns for path in (home / "home").iterdir()} == before


def test_check_shows_what_is_out_of_date_and_writes_nothing(home: Path) -> None:
    assert codegen("lamp.idl", "room.idl", cwd=home).returncode == 0
    (home / "lamp.idl").write_text(LAMP.replace("float power", "double brightness"))
    (home / "room.idl").unlink()
    before = files_in(home)
    done = codegen("--check", "lamp.idl", cwd=home)
    assert done.returncode == 1
    assert "-    power: float = 0.0\n+    brightness: float = 0.0\n" in done.stdout
    assert "--- home/room.py\n+++ /dev/null\n" in done.stdout
    assert "-from .room import *  # noqa: F403\n" in done.stdout
    assert "out of date" in done.stderr
    assert files_in(home) == before
    assert codegen("lamp.idl", cwd=home).returncode == 0
    assert "room.py" not in files_in(home / "home")
    assert codegen("--check", "lamp.idl", cwd=home).returncode == 0


def test_a_package_without_any_source_left_goes(home: Path) -> None:
    (home / "shed.idl").write_text("module shed { interface Fan { void spin(); }; };")
    assert codegen("shed.idl", "lamp.idl", cwd=home).returncode == 0
    (home / "shed" / "notes.txt").write_text("mine")
    (home / "shed.idl").unlink()
    assert codegen("lamp.idl", cwd=home).returncode == 0
    assert files_in(home / "shed") == {"notes.txt": "mine"}


def test_a_module_whose_file_now_opens_another_module_goes(home: Path) -> None:
    assert codegen("lamp.idl", "room.idl", cwd=home).returncode == 0
    (home / "room.idl").write_text(
        ROOM.replace("module home", "module house").replace("Light", "home::Light")
    )
    assert codegen("room.idl", cwd=home).returncode == 0
    assert "room.py" not in files_in(home / "home")
    assert "Room" not in files_in(home / "home")["__init__.py"]
    assert "from ..home.lamp import Light" in files_in(home / "house")["room.py"]


def test_what_was_made_from_files_elsewhere_stays_while_something_needs_it(home: Path) -> None:
    (home / "parts").mkdir()
    (home / "parts" / "bulb.idl").write_text("module home { struct Bulb { int watts; }; };")
    (home / "parts" / "socket.idl").write_text("module wiring { struct Socket { int volts; }; };")
    (home / "chandelier.idl").write_text(
        '#include "parts/bulb.idl"\n#include "parts/socket.idl"\n'
        "module home { struct Chandelier { Bulb bulb; wiring::Socket socket; }; };"
    )
    assert codegen("chandelier.idl", cwd=home).returncode == 0
    assert codegen("lamp.idl", cwd=home).returncode == 0
    assert {"bulb.py", "chandelier.py", "lamp.py"} < files_in(home / "home").keys()
    assert "socket.py" in files_in(home / "wiring")
    (home / "chandelier.idl").unlink()
    assert codegen("lamp.idl", cwd=home).returncode == 0
    assert set(files_in(home / "home")) == {"__init__.py", "lamp.py", "py.typed", "schema.json"}
    assert not (home / "wiring").exists()


def test_files_of_one_name_in_two_directories_leave_the_modules_of_each_other(home: Path) -> None:
    for name in ("bath", "hall"):
        (home / name).mkdir()
        (home / name / "fan.idl").write_text(f"module home {{ struct Fan{name} {{ int speed; }}; }};")
    (home / "all.idl").write_text('#include "bath/fan.idl"\n#include "hall/fan.idl"\n')
    assert codegen("all.idl", "-o", "api", cwd=home).returncode == 0
    both = files_in(home / "api" / "home")
    assert {"fan.py", "hall_fan.py"} < both.keys()
    assert codegen("bath/fan.idl", "-o", "api", cwd=home).returncode == 0
    assert files_in(home / "api" / "home") == both


def test_output_and_include_directories(home: Path) -> None:
    (home / "own").mkdir()
    (home / "room.idl").rename(home / "own" / "room.idl")
    assert codegen("own/room.idl", "-o", "api", cwd=home).returncode == 1
    done = codegen("own/room.idl", "-I", ".", "-o", "api", cwd=home)
    assert done.returncode == 0, done.stderr
    assert set(files_in(home / "api")) == {
        "__init__.py",
        "py.typed",
        "home/__init__.py",
        "home/lamp.py",
        "home/room.py",
        "home/py.typed",
        "home/schema.json",
    }
    done = codegen("--check", "own/room.idl", "-I", ".", "-o", "api", cwd=home)
    assert done.returncode == 0, done.stdout


def test_errors_are_reported_together_and_nothing_is_written(home: Path) -> None:
    (home / "room.idl").write_text(ROOM.replace("Light lightOf", "Lihgt lightOf"))
    (home / "bad.idl").write_text("module bad { struct S { int a };\n  interface I { void f(flot x); }; };")
    done = codegen("lamp.idl", "room.idl", "bad.idl", "absent.idl", cwd=home)
    assert done.returncode == 1
    assert done.stdout == ""
    assert "room.idl:2:32: error[E012]: `Lihgt` is not defined\n" in done.stderr
    assert "    module home { interface Room { Lihgt lightOf(string lamp); }; };\n" in done.stderr
    assert " " * 35 + "^~~~~\n  note: did you mean `Light`?\n" in done.stderr
    assert "bad.idl:1:31: error[E010]: expected `;` after a member, found `}`" in done.stderr
    assert "bad.idl:2:24: error[E012]: `flot` is not defined" in done.stderr
    assert "absent.idl: error[E001]" in done.stderr
    assert done.stderr.endswith("4 errors; nothing was written\n")
    assert not (home / "home").exists()


def test_an_error_leaves_what_is_there_as_it_is(home: Path) -> None:
    assert codegen("lamp.idl", cwd=home).returncode == 0
    before = files_in(home / "home")
    (home / "lamp.idl").write_text(LAMP.replace("float power", "flot power"))
    assert codegen("lamp.idl", cwd=home).returncode == 1
    assert files_in(home / "home") == before


def test_a_file_that_codegen_did_not_make_is_kept(home: Path) -> None:
    (home / "home").mkdir()
    (home / "home" / "lamp.py").write_text("print('mine')\n")
    done = codegen("lamp.idl", cwd=home)
    assert done.returncode == 1
    assert "home/lamp.py was not generated by codegen" in done.stderr
    assert files_in(home / "home") == {"lamp.py": "print('mine')\n"}


def test_names_that_two_files_define_are_an_error(home: Path) -> None:
    (home / "other.idl").write_text("module home { struct Light { int a; }; };")
    done = codegen("lamp.idl", "other.idl", cwd=home)
    assert done.returncode == 1
    assert "other.idl:1:22: error[E013]: `Light` is defined in two files" in done.stderr
    assert "lamp.idl:1:22: note: first defined here" in done.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "Missing argument"),
        (["lamp.txt"], "lamp.txt"),
        (["lamp.idl", "-I", "absent"], "absent"),
        (["lamp.idl", "-o", "room.idl"], "room.idl"),
        (["lamp.idl", "--unknown"], "--unknown"),
    ],
)
def test_wrong_usage_exits_with_2(home: Path, arguments: list[str], message: str) -> None:
    done = codegen(*arguments, cwd=home)
    assert done.returncode == 2
    assert message in done.stderr


def test_help_has_examples(home: Path) -> None:
    done = codegen("--help", cwd=home)
    assert done.returncode == 0
    assert "codegen interfaces/*.idl " in done.stdout
    assert "\n    codegen --check interfaces/*.idl " in done.stdout


def test_help_imports_nothing_heavy(home: Path) -> None:
    script = (
        "import sys; import codegen.__main__; import codegen.command; "
        "print([name for name in ('zenoh', 'msgspec', 'msgpack', 'numpy', 'pydantic', 'rich', 'codegen._idl', 'codegen.hfsm') "
        "if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=home,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.stdout == "[]\n", done.stderr


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
        timeout=RUN_LIMIT,
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
        assert watching.wait(END_LIMIT) == 130
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
    assert done.stderr.startswith("::error file=lamp.idl,line=1,col=30,endColumn=34,title=codegen E012::")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_for_a_shell(home: Path, shell: str) -> None:
    script = codegen(cwd=home, environment={"_CODEGEN_COMPLETE": f"source_{shell}"})
    assert "codegen" in script.stdout
    assert f"complete_{shell}" in script.stdout


@pytest.mark.parametrize(
    ("words", "proposals"),
    [
        (["codegen", "--ch"], {"--check"}),
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
