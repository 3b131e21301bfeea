"""docs/explanation/calls.md: its code runs against a served robot."""

from __future__ import annotations

from typing import Any

from interfaces.nao import HeadLimits, HeadPose, PoseHead
from naoserver.fake import FakeRobot
from tests.support.pages import DOCS, blocks_of
from tests.support.robot_server import served
from zenoh_ice import Current
from zenoh_ice.data import exceptions


class _StillHead(PoseHead):
    """The servant of the page's reader."""

    def setPose(self, pan: float, tilt: float, fraction: float, current: Current) -> HeadPose:
        return self.getPose(current)

    def setSpeed(self, pan: float, tilt: float, current: Current) -> HeadPose:
        return self.getPose(current)

    def stop(self, current: Current) -> None:
        """Do nothing: it never moves."""

    def getPose(self, current: Current) -> HeadPose:
        return HeadPose(0.0, 0.0, 0.0, 0.0, 0.0)

    def getLimits(self, current: Current) -> HeadLimits:
        return HeadLimits(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_the_code_of_the_page_runs() -> None:
    with served(FakeRobot()) as robot, robot.client() as client:
        names: dict[str, Any] = {"__name__": "calls", "communicator": client.communicator}
        adapter = client.communicator.createObjectAdapter("Page")
        adapter.activate()
        names |= {"adapter": adapter, "servant": _StillHead()}
        for block in blocks_of((DOCS / "explanation/calls.md").read_text("utf-8")):
            if block.language == "python":
                exec(compile(block.text, "calls.md", "exec"), names)


def test_every_exception_of_a_call_has_its_row() -> None:
    text = (DOCS / "explanation/calls.md").read_text("utf-8")
    never_of_a_call = {
        "AlreadyRegisteredException",
        "ConfigurationException",
        "EndpointInUseException",
        "ZenohIceError",
    }
    known = [name for name in vars(exceptions) if name.endswith(("Exception", "Error"))]
    assert len(known) > len(never_of_a_call)
    missing = [name for name in known if name not in never_of_a_call and name not in text]
    assert missing == []
