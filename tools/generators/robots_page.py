"""docs/reference/robots.md, generated from running servers by `python -m tools.generators.robots_page`."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, Final, TypeVar

from interfaces import jderobot, nao
from naoserver.bodies import BODY_NAMES, find_body
from naoserver.bodies.nao import H21, H25
from naoserver.fake import FakeRobot
from naoserver.robot import Robot
from tests.support.processes import ComponentProcess, module
from tests.support.robot_server import served_to_client
from zenoh_ice import Communicator, ObjectPrx
from zenoh_ice.data.keys import Target

__all__ = ["PAGE", "robots_page"]

PAGE: Final = Path(__file__).parents[2] / "docs" / "reference/robots.md"

_TITLE: Final = "# What each robot serves"
_BEGINNING: Final = """\
Made by `python -m tools.generators.robots_page` from running servers; a test proves that it is current.
`nao list` shows the servants of any server that runs."""
_ROBOTS: Final = """\
The simulated robot is that of `naoserver-sim`, the real one that of `naoserver-naoqi`, here with a NAOqi of
our own behind libqi; the fake one is for tests. `-` is what a robot does not have: no servant of that
interface is there, and `checkedCast` says so. The interfaces are in `interfaces/*.idl`; what no robot has is
left out. With `--body H21` each lacks the joints {}, the hinges {} and the sensors {}."""
_OTHERS: Final = """## Other bodies

The simulated robot with the other bodies of `naoserver-sim --body`. The fake robot has the same options."""


def robots_page() -> str:
    """Serve each robot, read its abilities, and return the page."""
    from naoserver_sim.robot import SimulatedRobot

    surveys = {
        "simulated": _surveyed(SimulatedRobot()),
        "real": _surveyed_through_naoqi(),
        "fake": _surveyed(FakeRobot()),
    }
    lacking = [name for name in H25.joint_names if name not in H21.joint_names]
    hinges = [name for name in H25.hinges if name not in H21.hinges]
    sensors = [name for name in H25.touch_sensors if name not in H21.touch_sensors]
    lists = [", ".join(names) for names in (lacking, hinges, sensors)]
    text = [fill(each, 120, break_on_hyphens=False) for each in (_BEGINNING, _ROBOTS.format(*lists))]
    others = {
        name: _surveyed(SimulatedRobot(skin=False, body=find_body(name)))
        for name in BODY_NAMES
        if name not in ("H25", "H21")
    }
    return "\n\n".join([_TITLE, *text, _table(surveys).strip(), _OTHERS, _table(others)])


def _surveyed(robot: Robot) -> dict[str, str]:
    with served_to_client(robot) as client:
        return _survey(client.communicator)


def _surveyed_through_naoqi() -> dict[str, str]:
    from plugins.naoqi.tests.support.naoqi import connect_patiently
    from visualhfsm_naoqi.robot._link import RobotAddress
    from visualhfsm_naoqi.robot._robot import NaoqiRobot

    with ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as naoqi:
        address = RobotAddress.parse(naoqi.wait_for(r"^ready: (\S+)")[1], "", "")
        return _surveyed(NaoqiRobot(lambda _: connect_patiently(address)))


P = TypeVar("P", bound=ObjectPrx)

Served = Mapping[str, P]
"""Proxies by identity."""


def _survey(communicator: Communicator) -> dict[str, str]:
    """Return what the servers of a communicator's realm have, by row of the table.

    Raises ZenohIceError when a server does not answer.
    """
    served = {
        identity: communicator.presence.interfaces(Target(communicator.realm, identity))
        for identity in communicator.identities()
    }
    found = {}
    for name, interface, describe in _ROWS:
        proxies = {
            identity: interface.checkedCast(communicator.stringToProxy(identity))
            for identity, interfaces in served.items()
            if interface.ice_interface.type_id in interfaces
        }
        if proxies:
            found[_title(name, interface)] = describe(proxies)
    return found


def _table(surveys: Mapping[str, Mapping[str, str]]) -> str:
    """Return surveys, by the robot's name, as a table in Markdown."""
    lines = [["", *surveys], ["---"] * (1 + len(surveys))]
    for name, interface, _ in _ROWS:
        cells = [found.get(_title(name, interface), "-") for found in surveys.values()]
        if any(cell != "-" for cell in cells):
            lines.append([_title(name, interface), *cells])
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _title(name: str, interface: type[ObjectPrx]) -> str:
    return f"{name} (`{interface.ice_interface.type_id.strip(':')}`)"


def _yes(_: Served[Any]) -> str:
    return "yes"


def _joints(bodies: Served[nao.JointsPrx]) -> str:
    return f"{sum(len(body.getJointNames()) for body in bodies.values())} joints"


def _identities(suffix: str) -> Callable[[Served[Any]], str]:
    """Return a function that names servants by the first part of their identity, and counts hinges."""
    hinges = {f"{name}{suffix}" for body in map(find_body, BODY_NAMES) for name in body.hinges}

    def describe(servants: Served[Any]) -> str:
        others = [identity.removesuffix(suffix) for identity in servants if identity not in hinges]
        count = len(servants.keys() & hinges)
        return _list([f"{count} {'hinge' if count == 1 else 'hinges'}", *others])

    return describe


def _cameras(cameras: Served[jderobot.CameraPrx]) -> str:
    formats = dict.fromkeys(each for camera in cameras.values() for each in camera.getImageFormat())
    return f"{_list(cameras)}, as {_list(formats)}"


def _sonars(sonars: Served[nao.SonarPrx]) -> str:
    limits = next(iter(sonars.values())).getSonarLimits()
    return f"{limits.nearest:g} to {limits.farthest:g} m, cone of {math.degrees(limits.cone):.0f} degrees"


def _names(ask: Callable[[Any], Iterable[str]]) -> Callable[[Served[Any]], str]:
    """Return a function that lists the names that servants answer."""
    return lambda served: _list(name for each in served.values() for name in ask(each))


def _scenes(scenes: Served[nao.ScenePrx]) -> str:
    objects = _names(nao.ScenePrx.getObjects)(scenes)
    return f"can place {objects}" if objects else "yes"


def _clocks(clocks: Served[nao.ClockPrx]) -> str:
    return "simulated time" if any(clock.getTime().simulated for clock in clocks.values()) else "wall time"


def _list(names: Iterable[str]) -> str:
    return ", ".join(names)


_ROWS: Final[Sequence[tuple[str, type[ObjectPrx], Callable[[Served[Any]], str]]]] = (
    ("Whole body", nao.JointsPrx, _joints),
    ("Hinges and mechanisms", jderobot.Pose3DMotorsPrx, _identities("Motors")),
    ("Their encoders", jderobot.Pose3DEncodersPrx, _identities("Encoders")),
    ("Head", nao.PoseHeadPrx, _yes),
    ("Cameras", jderobot.CameraPrx, _cameras),
    ("What it sees", nao.SightPrx, _yes),
    ("Walk", jderobot.MotorsPrx, _yes),
    ("Walk to a place", nao.WalkPrx, _yes),
    ("Odometry", jderobot.EncodersPrx, _yes),
    ("Inertial unit", nao.InertialUnitPrx, _yes),
    ("Foot pressure", nao.FootPressurePrx, _yes),
    ("Sonar", nao.SonarPrx, _sonars),
    ("Touch", nao.TouchPrx, _names(nao.TouchPrx.getTouchNames)),
    ("Battery", nao.BatteryPrx, _yes),
    ("Lights", nao.LedsPrx, _names(nao.LedsPrx.getLedNames)),
    ("Voice", nao.SpeechPrx, _yes),
    ("Sounds", nao.SoundsPrx, _names(lambda of: [sound.name for sound in of.getSounds()])),
    ("Hearing, of what is typed", nao.HearingPrx, _yes),
    ("Motions", nao.MotionsPrx, _names(lambda of: [motion.name for motion in of.getMotions()])),
    ("Postures", nao.PosturesPrx, _names(nao.PosturesPrx.getPostures)),
    ("Team", nao.TeamPrx, _yes),
    ("Emergency stop and lease", nao.SafetyPrx, _yes),
    ("Health", nao.HealthPrx, _yes),
    ("Clock", nao.ClockPrx, _clocks),
    ("Description of its body", nao.DescriptionPrx, _yes),
    ("Ground truth", nao.GroundTruthPrx, _yes),
    ("Scene", nao.ScenePrx, _scenes),
    ("What is made to fail", nao.FaultsPrx, _yes),
)


if __name__ == "__main__":
    PAGE.write_text(robots_page())
