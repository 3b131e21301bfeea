"""Call the robot: from programs of one's own, by interfaces of one's own, and automata from plain Python."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.doors.conftest import ServedRobot, printed
from tests.support.codegen_command import codegen, files_in
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from tests.support.screenshots import FOLDER


@pytest.mark.promise("**Call the robot** from your own programs")
def test_the_program_of_the_readme_turns_the_head(simulated: ServedRobot, tmp_path: Path) -> None:
    blocks = blocks_of((ROOT / "README.md").read_text("utf-8"))
    (shown,) = [block.text for block in blocks if block.language == "python" and "PoseHeadPrx" in block.text]
    assert printed("-c", shown, folder=tmp_path, **simulated.environment).startswith("HeadPose(")
    turned = printed(ROOT / "examples/turn_head.py", folder=tmp_path, **simulated.environment).splitlines()
    assert [line.split()[0] for line in turned] == ["at", "at", "at"]
    assert [float(line.split()[1]) for line in turned] == pytest.approx([0.6, -0.6, 0.0], abs=0.03)


@pytest.mark.promise("write interfaces of your own")
def test_a_package_of_interfaces_goes_beside_its_files_and_can_be_imported(tmp_path: Path) -> None:
    (tmp_path / "lamp.idl").write_text(
        "module home { struct Light { float power; }; interface Lamp { Light get(); }; };\n"
    )
    (tmp_path / "room.idl").write_text(
        '#include "lamp.idl"\nmodule home { interface Room { Light lightOf(string lamp); }; };\n'
    )
    done = codegen("lamp.idl", "room.idl", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    files = {"__init__.py", "lamp.py", "room.py", "py.typed", "schema.json"}
    assert set(files_in(tmp_path / "home")) == files
    script = "from home import LampPrx, RoomPrx, Light; print(Light(1.5), RoomPrx.lightOf.__name__)"
    assert printed("-c", script, folder=tmp_path) == "Light(power=1.5) lightOf\n"


@pytest.mark.promise("draw, check, prove and run automata from plain Python")
def test_the_programs_of_plain_python_print_what_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = blocks_of((DOCS / "how-to" / "plain-python.md").read_text("utf-8"))
    programs = [block.text for block in blocks if block.language == "python"]
    outputs = [block.text for block in blocks if block.language == "text"]
    for program, output in zip(programs, outputs, strict=True):
        exec(compile(program, "plain-python.md", "exec"), {})
        assert capsys.readouterr().out == output
    drawn, picture = (tmp_path / "look.svg").read_text("utf-8"), FOLDER / "plain-python" / "look.svg"
    if os.environ.get("SCREENSHOTS"):
        picture.write_text(drawn, "utf-8")
    assert drawn == picture.read_text("utf-8")
