"""What the checks say of interfaces of ROS and of their uses in code."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm.loading import check_document
from tests.support.documents import document, problems, state, sub
from visualhfsm_ros2 import _ends as ros
from visualhfsm_ros2.documents import ROS_OPERATIONS

FAULTY = sorted((Path(__file__).parents[1] / "data" / "faulty").glob("*.xml"))
SCAN = ("subscribe", "scan", "/scan", "sensor_msgs/msg/LaserScan")
DRIVE = ("publish", "drive", "/cmd_vel", "geometry_msgs/msg/Twist")
RESET = ("service", "reset", "/reset", "std_srvs/srv/SetBool")
POINT = ("action", "point", "/point", "example_interfaces/action/Fibonacci")
USES = "self.scan.latest()\nself.drive.publish()\nself.reset.call()\nself.point.send()\n"


def found(directory: Path, *interfaces: tuple[str, ...], code: str = "") -> list[str]:
    written = "".join(
        f'<rosinterface kind="{kind}"><name>{name}</name><target>{target}</target><type>{kind_of_type}</type>'
        f"{''.join(more)}</rosinterface>"
        for kind, name, target, kind_of_type, *more in interfaces
    )
    text = document(sub(1, 0, state(1, "one", code, initial=True)), head=f"<ros>{written}</ros>")
    return [each.split(": ", 1)[1] for each in problems(directory / "main.xml", text)]


@pytest.mark.parametrize(
    ("kind", "offered"),
    [
        ("publish", ros.Publisher),
        ("subscribe", ros.Subscription),
        ("service", ros.Service),
        ("action", ros.Action),
    ],
)
def test_operations_are_known_as_they_are(kind: str, offered: type) -> None:
    public = {name: value for name, value in vars(offered).items() if not name.startswith("_")}
    known = ROS_OPERATIONS[kind]
    assert set(known) == set(public)
    for name, method in public.items():
        if inspect.isfunction(method):
            parameters = list(inspect.signature(method).parameters.values())[1:]
            plain = [each for each in parameters if each.kind is not each.VAR_KEYWORD]
            by_name = {each.name for each in plain if each.kind is each.KEYWORD_ONLY}
            assert known[name].by_name == by_name
            assert known[name].parameters == tuple(each.name for each in plain if each.name not in by_name)


def test_uses_that_fit_are_not_reported(tmp_path: Path) -> None:
    code = (
        "self.drive.publish(linear={'x': 0.2, 'y': 0.0})\nself.drive.publish(self.scan.value)\n"
        "self.drive.publish(**{})\nself.reset.call(data=True, timeout=1.0)\nself.scan.next(timeout=1.0)\n"
        "goal = self.point.send(order=1, timeout=1.0)\ngoal.cancel()\nself.ros['std_msgs/msg/String']"
    )
    assert found(tmp_path, SCAN, DRIVE, RESET, POINT, code=code) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "warning"),
    [
        (
            "self.scan.publish()",
            "W528: `scan` is subscribed and has no `publish`: it has latest, next, value",
        ),
        (
            "self.drive.latest()",
            "W528: `drive` is published and has no `latest`: it has publish, subscribers",
        ),
        ("self.reset.send()", "W528: `reset` is a service and has no `send`: it has call, call_async, wait"),
        ("self.point.call()", "W528: `point` is an action and has no `call`: it has send"),
        ("self.drive.publish(liner={'x': 1})", "W529: `publish` has no parameter `liner`"),
        ("self.drive.publish(linear={'w': 1})", "W529: `geometry_msgs/msg/Vector3` has no field `w`"),
        ("self.reset.call(date=True)", "W529: `call` has no parameter `date`"),
        ("self.point.send(1, 2)", "W529: `send` takes 1 argument, but gets 2"),
        (
            "self.scna.latest()",
            "W524: `self.scna` is not an interface, function or parameter, and is never assigned",
        ),
    ],
)
def test_a_wrong_use_is_reported(tmp_path: Path, code: str, warning: str) -> None:
    assert found(tmp_path, SCAN, DRIVE, RESET, POINT, code=USES + code) == [warning]


@pytest.mark.parametrize(
    ("interface", "error"),
    [
        (("broadcast", "x", "/x", "std_msgs/msg/String"), ("E536: the kind of `x` must be one of publish, subscribe, "
         "service, action, not `broadcast`")),
        (("publish", "x", "/1st", "std_msgs/msg/String"), "E534: `/1st` is not a name that ROS accepts"),
        (("publish", "x", "", "std_msgs/msg/String"), "E534: `` is not a name that ROS accepts"),
        (("publish", "x", "/a__b", "std_msgs/msg/String"), "E534: `/a__b` is not a name that ROS accepts"),
        (("publish", "x", "/x", "std_msgs/msg/Strng"), "E535: there is no type `std_msgs/msg/Strng`"),
        (("publish", "x", "/x", "std_msgs/String"), ("E535: `std_msgs/String` is not the type of a topic, such as "
         "geometry_msgs/msg/Twist")),
        (("service", "x", "/x", "std_msgs/msg/String"), ("E535: `std_msgs/msg/String` is not the type of a service, "
         "such as std_srvs/srv/Trigger")),
        ((*SCAN[:1], "x", *SCAN[2:], "<qos>depth=0</qos>"), ("E536: the QoS of `x`: `depth=0` is none of sensor_data, "
         "latched, reliable, best_effort, volatile, transient_local, keep_all and depth=1 to depth=10000")),
        ((*DRIVE[:1], "x", *DRIVE[2:], "<stop>yes</stop>"), "E536: `stop` of `x` must be `true` or `false`, not `yes`"),
        ((*SCAN[:1], "x", *SCAN[2:], "<stop>true</stop>"), ("E536: only what is published has a message at the stop: "
         "`x` is subscribed")),
        (("publish", "log", "/x", "std_msgs/msg/String"), "E530: `self.log` belongs to every component: choose another"),
        ((*DRIVE[:1], "drive", *DRIVE[2:]), "E530: a second interface has the name `drive`"),
    ],
)  # fmt: skip
def test_a_wrong_declaration_is_an_error(tmp_path: Path, interface: tuple[str, ...], error: str) -> None:
    assert [
        each for each in found(tmp_path, DRIVE, interface, code="self.drive.publish()") if each[0] == "E"
    ] == [error]


def test_what_nothing_uses_is_reported(tmp_path: Path) -> None:
    assert found(tmp_path, SCAN) == ["W533: `self.scan` is never used"]


@pytest.mark.parametrize("name", ["remap", "ros", "ros_domain"])
def test_parameters_keep_clear_of_the_options_of_ros(tmp_path: Path, name: str) -> None:
    parameter = f"<parameters><parameter><name>{name}</name><type>int</type><default>1</default></parameter></parameters>"
    plain = sub(1, 0, state(1, "one", initial=True))
    (problem,) = problems(tmp_path / "plain.xml", document(plain, head=parameter))
    option = f"--{name.replace('_', '-')}"
    assert f"E526: `{option}` is an option of every component: choose another name" in problem


@pytest.mark.parametrize("path", FAULTY, ids=lambda path: path.stem)
def test_a_planted_fault_is_found_at_its_line_and_nothing_else(path: Path) -> None:
    expected = re.search(r"Brings ([EW]\d{3}) in line (\d+)\.", path.read_text("utf-8"))
    assert expected is not None
    diagnostics = Diagnostics()
    check_document(path, diagnostics)
    assert [(each.code, str(each.location.line)) for each in diagnostics] == [expected.groups()]
