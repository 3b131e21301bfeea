"""Completion, parameters and explanations of interfaces of ROS."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document
from codegen.hfsm.known_interfaces import find_interfaces
from tests.support.documents import document, state, sub
from visualhfsm._document.places import Place
from visualhfsm.project._code_help.completion import complete, signature
from visualhfsm.project._code_help.component import TypedComponent, generate_around
from visualhfsm.project._code_help.parsed_files import with_readable_files

TEXT = document(
    sub(1, 0, state(1, "one", "pass", initial=True)),
    head="""<ros>
<rosinterface kind="subscribe"><name>ball</name><target>/ball</target><type>my_msgs/msg/Ball</type>
<qos>no such word</qos></rosinterface>
<rosinterface kind="publish"><name>drive</name><target>/cmd_vel</target><type>geometry_msgs/msg/Twist</type></rosinterface>
<rosinterface kind="service"><name>switch</name><target>/s</target><type>std_srvs/srv/SetBool</type></rosinterface>
<rosinterface kind="action"><name>count</name><target>/c</target>
<type>example_interfaces/action/Fibonacci</type></rosinterface>
<rosinterface kind="publish"><name>wrong</name><target>/w</target><type>no/such/Type</type></rosinterface>
<rosinterface kind="unknown"><name>worse</name><target>/w</target><type>std_msgs/msg/String</type></rosinterface>
</ros>""",
)
PLACE = Place(kind="state", automaton=1, id=1, part="code")


@pytest.fixture(scope="module")
def typed(tmp_path_factory: pytest.TempPathFactory) -> TypedComponent:
    """The component around a piece of code."""
    path = tmp_path_factory.mktemp("project") / "main.xml"
    (path.parent / "my_msgs" / "msg").mkdir(parents=True)
    (path.parent / "my_msgs" / "msg" / "Ball.msg").write_text("geometry_msgs/Point[] places\nstring color\n")
    read = parse_document(TEXT, path, Diagnostics())
    assert read is not None
    return generate_around(read, PLACE, path, find_interfaces(path))


def labels(typed: TypedComponent, code: str) -> list[str]:
    module, line, column = typed.with_code(code), code.count("\n") + 1, len(code.rpartition("\n")[2])
    found = with_readable_files(lambda: complete(module, Path("main.py"), line, column))
    return [each.label for each in found.options if not each.label.startswith("_")]


def test_interfaces_are_offered_without_those_that_cannot_be_used(typed: TypedComponent) -> None:
    found = labels(typed, "self.")
    assert {"ball", "drive", "switch", "count", "ros"} <= set(found)
    assert {"wrong", "worse"}.isdisjoint(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "wanted"),
    [
        ("self.ball.", {"latest", "next", "value"}),
        ("self.ball.latest().", {"value", "age", "sequence"}),
        ("self.ball.latest().value.", {"places", "color"}),
        ("self.ball.value.places[0].", {"x", "y", "z"}),
        ("for place in self.ball.value.places:\n    place.", {"x", "y", "z"}),
        ("self.drive.", {"publish", "subscribers"}),
        ("self.drive.publish(lin", {"linear="}),
        ("self.switch.", {"call", "call_async", "wait"}),
        ("self.switch.call(data=True).", {"success", "message"}),
        ("goal = self.count.send(order=3)\ngoal.", {"status", "feedback", "done", "result", "cancel"}),
        ("goal = self.count.send(order=3)\ngoal.result().", {"sequence"}),
        ("self.ros.", {"make", "fields"}),
    ],
)
def test_operations_and_fields_are_offered(typed: TypedComponent, code: str, wanted: set[str]) -> None:
    assert wanted <= set(labels(typed, code))


def test_parameters_are_the_fields(typed: TypedComponent) -> None:
    code = "self.drive.publish("
    module = typed.with_code(code)
    found = with_readable_files(lambda: signature(module, Path("main.py"), 1, len(code)))
    assert found is not None
    assert [each.partition(":")[0] for each in found.parameters if ":" in each][-2:] == ["linear", "angular"]
    assert "the others are zero" in found.documentation
