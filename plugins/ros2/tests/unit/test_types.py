"""Interfaces of ROS in documents: their words, their types, reading, writing, merging and generating."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, resolve, write_document
from codegen.hfsm.document import RosInterface, Text
from codegen.hfsm.known_interfaces import find_interfaces
from codegen.hfsm.loading import check_document
from tests.support.documents import compile_to, document, problems, state, sub
from visualhfsm_ros2._types import QosError, RosTypes, is_ros_name, parse_qos, stops

ONE = sub(1, 0, state(1, "one", "self.cmd_vel.publish()\nself.ball.latest()", initial=True))
ROS = """<ros>
    <rosinterface kind="publish">
      <name>cmd_vel</name>
      <target>/cmd_vel</target>
      <type>geometry_msgs/msg/Twist</type>
      <qos>latched depth=3</qos>
      <stop>false</stop>
    </rosinterface>
    <rosinterface kind="subscribe">
      <name>ball</name>
      <target>ball</target>
      <type>my_msgs/msg/Ball</type>
    </rosinterface>
  </ros>"""


@pytest.fixture
def types(tmp_path: Path) -> Path:
    """The project's own types."""
    folder = tmp_path / "interfaces" / "my_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Ball.msg").write_text("geometry_msgs/Point place\nColor color  # Unused is no type\n")
    (folder / "Color.msg").write_text('string name "red"\n')
    (folder / "Unused.msg").write_text("int8 nothing\n")
    (folder / "Broken.msg").write_text("float64[ x\n")
    (folder / "Lost.msg").write_text("Ghost ghost\n")
    return tmp_path


def test_names() -> None:
    assert all(map(is_ros_name, ("/scan", "scan", "~/scan", "/a/b_1/C")))
    assert not any(
        map(is_ros_name, ("", "/", "/a/", "//a", "/a b", "/1a", "~a", "a/~/b", "/a__b", "/" + "a" * 200))
    )


def test_quality_of_service() -> None:
    assert parse_qos("") == {}
    assert parse_qos("sensor_data depth=1") == {"reliability": "best_effort", "depth": 1}
    assert parse_qos(" latched keep_all ") == {"durability": "transient_local", "depth": 1, "keep_all": True}


@pytest.mark.parametrize(
    "text", ["depth=", "depth=10001", "depth=-1", "depth=²", "Reliable", "depth=99999999999"]
)
def test_unknown_quality_is_refused(text: str) -> None:
    with pytest.raises(QosError, match="is none of"):
        parse_qos(text)


def test_velocities_stop_unasked() -> None:
    twist = "geometry_msgs/msg/Twist"
    assert stops("publish", twist, "")
    assert not stops("publish", twist, "false")
    assert not stops("publish", "std_msgs/msg/String", "")
    assert stops("publish", "std_msgs/msg/String", "true")
    assert not stops("subscribe", twist, "")


def test_a_document_is_read_and_written_as_it_was(tmp_path: Path) -> None:
    read = parse_document(document(ONE, head=ROS), tmp_path / "main.xml", Diagnostics())
    assert read is not None
    cmd_vel, ball = read.ros
    assert cmd_vel == RosInterface(
        name="cmd_vel",
        kind="publish",
        target="/cmd_vel",
        type="geometry_msgs/msg/Twist",
        qos=Text("latched depth=3"),
        stop=Text("false"),
    )
    assert (ball.kind, ball.identity, ball.qos) == ("subscribe", "ball", Text())
    written = write_document(read)
    assert f"  {ROS}\n</VisualHFSM>" in written
    assert parse_document(written, tmp_path / "main.xml", Diagnostics()) == read


def test_a_component_declares_them_and_carries_the_projects_own_types(types: Path) -> None:
    (types / "behaviors").mkdir()
    text = compile_to(types / "behaviors", document(ONE, head=ROS)).read_text()
    assert (
        '    cmd_vel = Ros("publish", "/cmd_vel", "geometry_msgs/msg/Twist", durability="transient_local", depth=3)\n'
        '    ball = Ros("subscribe", "ball", "my_msgs/msg/Ball")\n'
    ) in text
    assert text.index('"my_msgs/msg/Color": ') < text.index('"my_msgs/msg/Ball": ')
    assert "my_msgs/msg/Unused" not in text
    assert 'on_error="stop", ros_types=ROS_TYPES):' in text


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Broken", "E535: my_msgs/msg/Broken: "),
        ("Lost", "E535: my_msgs/msg/Lost: it needs my_msgs/msg/Ghost"),
    ],
)
def test_a_type_that_cannot_be_used_says_why(types: Path, name: str, message: str) -> None:
    (problem, *_) = problems(types / "main.xml", document(ONE, head=ROS.replace("Ball", name)))
    assert message in problem


def test_types_are_found_with_their_fields(types: Path) -> None:
    ros = find_interfaces(types / "main.xml").kind
    assert isinstance(ros, RosTypes)
    assert "my_msgs/msg/Ball" in ros.names("publish")
    assert ros.fields("my_msgs/msg/Ball") == {
        "place": "geometry_msgs/msg/Point",
        "color": "my_msgs/msg/Color",
    }
    assert ros.fields("std_srvs/srv/SetBool", "call") == {"data": "bool"}
    assert ros.fields("my_msgs/msg/Ghost") is None


@pytest.mark.parametrize(("target", "codes"), [("/cmd_vel", []), ("/other", ["E553"])])
def test_imported_documents_share_what_they_declare_alike(
    tmp_path: Path, target: str, codes: list[str]
) -> None:
    other = '<ros><rosinterface kind="publish"><name>d</name><target>{}</target><type>std_msgs/msg/Empty</type></rosinterface></ros>'
    part = sub(1, 0, state(1, "part", "self.d.publish()", initial=True))
    (tmp_path / "part.xml").write_text(document(part, head=other.format(target)))
    importing = '<SubAutomata id="2" idFather="1"><import>part.xml</import></SubAutomata>'
    text = document(
        sub(1, 0, state(1, "one", initial=True, child=2)), importing, head=other.format("/cmd_vel")
    )
    path, diagnostics = tmp_path / "main.xml", Diagnostics()
    read = parse_document(text, path, diagnostics)
    assert read is not None
    resolved = resolve(read, path, diagnostics)
    assert [found.code for found in diagnostics] == codes
    assert resolved is None or len(resolved.ros) == 1


@pytest.mark.parametrize(("target", "codes"), [("/cmd_vel", ["W603"]), ("/other", [])])
def test_automata_that_publish_one_topic_side_by_side_conflict(
    tmp_path: Path, target: str, codes: list[str]
) -> None:
    path, diagnostics = tmp_path / "main.xml", Diagnostics()
    owner = (
        '<state initial="true" id="1"><name>both</name><idSubautomataSon>2</idSubautomataSon><child>3</child>'
        "<code></code></state>"
    )
    automata = [sub(2, 1, state(1, "a", "self.one.publish()", initial=True))]
    automata += [sub(3, 1, state(1, "b", "self.other.publish()", initial=True))]
    entry = '<rosinterface kind="publish"><name>{}</name><target>{}</target><type>std_msgs/msg/Empty</type></rosinterface>'
    head = f"<ros>{entry.format('one', '/cmd_vel')}{entry.format('other', target)}</ros>"
    path.write_text(document(sub(1, 0, owner), *automata, head=head))
    check_document(path, diagnostics)
    assert [found.code for found in diagnostics] == codes
