"""Parameters as other nodes read and set them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from plugins.ros2.tests.support.ros_nodes import Inbox, matched, two_nodes
from tests.support.limits import CALL_LIMIT, EVENT_LIMIT
from zenoh_ros2 import MessageError, Node, Parameters

pytestmark = pytest.mark.slow


def refuse_negative(value: float) -> None:
    if value < 0:
        raise ValueError("write a speed of at least 0")


@pytest.fixture
def served() -> Iterator[tuple[Parameters, Node]]:
    with two_nodes() as (robot, tool):
        parameters = Parameters(robot)
        parameters.declare("speed", 0.5, "m/s", on_change=refuse_negative)
        parameters.declare("ball.color", "red")
        parameters.declare("joints", ["HeadYaw", "HeadPitch"])
        parameters.declare("serial", 7, read_only=True)
        yield parameters, tool


def ask(tool: Node, name: str, **request: Any) -> Any:
    snake = "".join(f"_{each.lower()}" if each.isupper() else each for each in name).lstrip("_")
    client = tool.create_client(f"rcl_interfaces/srv/{name}", f"/robot/{snake}")
    client.wait(EVENT_LIMIT)
    try:
        return client.call(timeout=CALL_LIMIT, **request)
    finally:
        client.close()


def setting(name: str, kind: int, **value: object) -> dict[str, object]:
    return {"name": name, "value": {"type": kind, **value}}


def test_values_and_types_are_read(served: tuple[Parameters, Node]) -> None:
    _, tool = served
    speed, joints, none = ask(tool, "GetParameters", names=["speed", "joints", "none"]).values
    assert (speed.type, speed.double_value) == (3, 0.5)
    assert (joints.type, joints.string_array_value) == (9, ["HeadYaw", "HeadPitch"])
    assert none.type == 0
    assert ask(tool, "GetParameterTypes", names=["serial", "none"]).types.tolist() == [2, 0]


def test_values_are_set(served: tuple[Parameters, Node]) -> None:
    parameters, tool = served
    changes = [setting("speed", 3, double_value=0.7), setting("ball.color", 4, string_value="blue")]
    results = ask(tool, "SetParameters", parameters=changes).results
    assert [each.successful for each in results] == [True, True]
    assert (parameters["speed"], parameters["ball.color"]) == (0.7, "blue")


def test_what_does_not_fit_is_refused(served: tuple[Parameters, Node]) -> None:
    parameters, tool = served
    for change, why in (
        (setting("speed", 3, double_value=-1.0), "speed: write a speed of at least 0"),
        (setting("speed", 4, string_value="fast"), "speed: a value like 0.5 is expected, not 'fast'"),
        (setting("speed", 0), "a value like 0.5 is expected"),
        (setting("serial", 2, integer_value=8), "serial is read-only"),
        (setting("none", 1, bool_value=True), "there is no parameter 'none'"),
    ):
        (result,) = ask(tool, "SetParameters", parameters=[change]).results
        assert not result.successful
        assert why in result.reason
        assert (parameters["speed"], parameters["serial"]) == (0.5, 7)


def test_changes_that_belong_together_are_all_made_or_none(served: tuple[Parameters, Node]) -> None:
    parameters, tool = served
    good, bad = setting("ball.color", 4, string_value="blue"), setting("speed", 3, double_value=-1.0)
    result = ask(tool, "SetParametersAtomically", parameters=[good, bad]).result
    assert not result.successful
    assert parameters["ball.color"] == "red"
    assert ask(tool, "SetParametersAtomically", parameters=[good]).result.successful
    assert parameters["ball.color"] == "blue"


def test_parameters_are_listed_and_described(served: tuple[Parameters, Node]) -> None:
    _, tool = served
    listed = ask(tool, "ListParameters").result
    assert listed.names == ["ball.color", "joints", "serial", "speed"]
    assert listed.prefixes == ["ball"]
    assert ask(tool, "ListParameters", prefixes=["ball"]).result.names == ["ball.color"]
    assert ask(tool, "ListParameters", depth=1).result.names == ["joints", "serial", "speed"]
    speed, serial = ask(tool, "DescribeParameters", names=["speed", "serial"]).descriptors
    assert (speed.description, speed.type, serial.read_only) == ("m/s", 3, True)


def test_a_change_is_published() -> None:
    with two_nodes() as (robot, tool):
        parameters = Parameters(robot)
        parameters.declare("speed", 0.5)
        inbox = Inbox()
        tool.create_subscription("rcl_interfaces/msg/ParameterEvent", "/parameter_events", inbox)
        matched(robot, tool, "/parameter_events")
        parameters["speed"] = 0.6
        (event,) = inbox.wait()
        assert (event.node, event.changed_parameters[0].value.double_value) == ("/robot", 0.6)


def test_what_is_no_value_is_refused() -> None:
    with two_nodes() as (robot, _):
        parameters = Parameters(robot)
        for value in ({"a": 1}, [1, "a"], None):
            with pytest.raises(MessageError, match="a parameter is"):
                parameters.declare("bad", value)  # type: ignore[arg-type]
