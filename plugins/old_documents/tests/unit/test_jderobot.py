"""Methods of JdeRobot's library for clients, which old documents call."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.loading import check_document
from hfsm_runtime import _jderobot as jderobot
from interfaces.jderobot import CMDVelData, Pose3DData
from tests.support.documents import compile_to, document, state, sub
from visualhfsm.testing import MakeBehavior
from visualhfsm_old_documents._old_names import CLIENT_METHODS


def interface(type: str) -> str:
    """Return the declaration of an interface with the name of its type."""
    return (
        f"<iceinterface><nameinterface>{type}</nameinterface><nameproxy>{type}</nameproxy>"
        f"<interface>{type}</interface></iceinterface>"
    )


def test_the_compiler_knows_all_methods() -> None:
    known = {
        f"jderobot::{name.removesuffix('Prx')}": {
            each for each in vars(getattr(jderobot, name)) if each[0] != "_"
        }
        for name in vars(jderobot)
        if name.endswith("Prx")
    }
    assert known == CLIENT_METHODS


CALLS = {
    "forward": ("Motors", "self.Motors.sendV(0.5)", ("setV", 0.5)),
    "turn": ("Motors", "self.MotorsPrx.sendW(-0.5)", ("setW", -0.5)),
    "sideways": ("Motors", "self.Motors.sendL(0.1)", ("setL", 0.1)),
    "by another name": ("Motors", "motors = self.Motors\nmotors.sendV(0.5)", ("setV", 0.5)),
    "one by one": (
        "CMDVel",
        "cmd = self.CMDVel\ncmd.setVX(1)\ncmd.setVY(2)\ncmd.setVZ(3)\ncmd.setYaw(4)\ncmd.sendVelocities()",
        ("setCMDVelData", CMDVelData(1.0, 2.0, 3.0, 0.0, 0.0, 4.0)),
    ),
    "all at once": (
        "CMDVel",
        "self.CMDVel.sendCMDVel(1, 2, 3, 4, 5, 6)",
        ("setCMDVelData", CMDVelData(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)),
    ),
}


@pytest.mark.parametrize(("type", "code", "expected"), CALLS.values(), ids=CALLS)
def test_code_calls_them(
    tmp_path: Path, behavior: MakeBehavior, type: str, code: str, expected: tuple[str, object]
) -> None:
    calls: list[object] = []
    operation, argument = expected
    compile_to(tmp_path, document(sub(1, 0, state(1, "go", code, initial=True)), config=interface(type)))

    def take(given: object) -> int:
        calls.append(given)
        return 0

    behavior(tmp_path / "behavior.xml", stubs={type: {operation: take}}).advance(0.0)
    assert calls == [argument]


def test_a_pose_is_read_by_its_former_name(tmp_path: Path, behavior: MakeBehavior) -> None:
    code = "self.x = self.Pose3D.getPose3d().x"
    compile_to(tmp_path, document(sub(1, 0, state(1, "go", code, initial=True)), config=interface("Pose3D")))
    run = behavior(tmp_path / "behavior.xml", stubs={"Pose3D": {"getPose3DData": Pose3DData(x=1.5)}})
    run.advance(0.0)
    assert vars(run.component)["x"] == 1.5


def test_they_are_noted_and_other_interfaces_do_not_have_them(tmp_path: Path) -> None:
    path = tmp_path / "behavior.xml"
    code = "self.Motors.sendV(1.0)\nself.Encoders.sendV(1.0)"
    config = interface("Motors") + interface("Encoders")
    path.write_text(document(sub(1, 0, state(1, "go", code, initial=True)), config=config))
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    assert [found.code for found in diagnostics] == ["N504", "W528"]


def test_a_component_without_them_has_the_plain_proxy(tmp_path: Path) -> None:
    text = document(
        sub(1, 0, state(1, "go", "self.Motors.setV(1.0)", initial=True)), config=interface("Motors")
    )
    assert "hfsm_runtime._jderobot" not in compile_to(tmp_path, text).read_text()
