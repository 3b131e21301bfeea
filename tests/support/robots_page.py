"""docs/reference/robots.md, generated from running servers by `python -m tests.support.robots_page`."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from naoserver.survey import survey, table
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import served_to_client

__all__ = ["PAGE", "robots_page"]

PAGE: Final = Path(__file__).parents[2] / "docs" / "reference/robots.md"

_TEXT: Final = """# What each robot serves

Made by `python -m tests.support.robots_page` from running servers; a test proves that it is current. `python -m naoserver.survey` prints the same of any server that runs.

The simulated robot is that of `naoserver-sim`, the real one that of `naoserver-naoqi`, here with a NAOqi of our own behind libqi; the fake one is for tests. `-` is what a robot does not have: no servant of that interface is there,
and `checkedCast` says so. The interfaces are in `interfaces/*.idl`; what no robot has is left out.

{table}
"""


def robots_page() -> str:
    """Serve each robot, read its abilities, and return the page."""
    from naoserver_sim.robot import SimulatedRobot

    surveys = {
        "simulated": _surveyed(SimulatedRobot()),
        "real": _surveyed_through_naoqi(),
        "fake": _surveyed(FakeRobot()),
    }
    return _TEXT.format(table=table(surveys).rstrip())


def _surveyed(robot: Robot) -> dict[str, str]:
    with served_to_client(robot) as client:
        return survey(client.communicator)


def _surveyed_through_naoqi() -> dict[str, str]:
    from naoserver_naoqi.link import RobotAddress
    from naoserver_naoqi.robot import NaoqiRobot
    from tests.support.naoqi import connect_patiently

    with ComponentProcess(module("naoserver_qi", "--qi", "tcp://127.0.0.1:0")) as naoqi:
        address = RobotAddress.parse(naoqi.wait_for(r"^ready: (\S+)")[1], "", "")
        return _surveyed(NaoqiRobot(lambda _: connect_patiently(address)))


if __name__ == "__main__":
    PAGE.write_text(robots_page())
