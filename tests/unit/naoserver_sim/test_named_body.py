"""The body of a name: a known one, a file of facts, or what a plug-in makes of a model."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from naoserver.body import write_body
from naoserver.errors import RobotError
from naoserver_sim._command import app
from naoserver_sim.named_body import named_body
from tests.support.bodies import ARM
from tests.support.commands import run_here
from tests.support.places import ROOT
from tests.support.plugins import without

BUST = ROOT / "visualhfsm/_commands/template_hardware/bust.toml"
INSTALL = "visualhfsm_own_robots is not installed; type: pip install 'visualhfsm[models]'"


def test_files_of_facts_need_no_plug_in(tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(write_body(ARM), "utf-8")
    with without("visualhfsm_own_robots"):
        assert named_body(BUST).joint_names[:2] == ("pan", "tilt")
        assert write_body(named_body(str(path))) == write_body(ARM)
        assert named_body("H25").name == "H25"


def test_a_text_stands_for_that_of_its_file(tmp_path: Path) -> None:
    text = BUST.read_text("utf-8")
    assert named_body(tmp_path / "mine.toml", text=text).joint_names == named_body(BUST).joint_names
    with pytest.raises(RobotError, match=r"mine\.toml: not TOML"):
        named_body(tmp_path / "mine.toml", text="name =")


@pytest.mark.parametrize("name", ["H25", BUST])
def test_arguments_of_what_has_no_model_are_refused(name: str | Path) -> None:
    with pytest.raises(RobotError, match="it has no xacro, so that it takes no arguments"):
        named_body(name, arguments={"dof": "7"})


@pytest.mark.parametrize(
    ("file", "text"),
    [("arm.urdf", "<robot/>"), ("arm.xacro", ""), ("arm.MJCF", ""), ("arm.toml", 'model = "arm.urdf"')],
)
def test_without_the_plug_in_a_model_is_named_with_what_to_install(
    tmp_path: Path, file: str, text: str
) -> None:
    (tmp_path / file).write_text(text)
    with (
        without("visualhfsm_own_robots"),
        pytest.raises(RobotError, match=re.escape(f"{tmp_path / file}: ") + ".*" + re.escape(INSTALL)),
    ):
        named_body(tmp_path / file)


def test_without_the_plug_in_no_body_is_written(tmp_path: Path) -> None:
    words = ("--body", "arm.urdf", "--write-body", "arm.toml")
    with without("visualhfsm_own_robots"):
        done = run_here(app, "naoserver-sim", *words, cwd=tmp_path, expected=(RobotError,), columns=200)
    assert done.returncode == 1
    assert INSTALL in done.stderr
    assert not (tmp_path / "arm.toml").exists()
