"""Documents with endpoints where the plug-in of their kind is not installed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import parse_document, write_document
from codegen.hfsm.kinds import find_kind
from tests.support.documents import document, problems, state, sub
from tests.support.plugins import without

ENDPOINTS = """<ros>
    <rosinterface kind="publish"><name>drive</name><target>/cmd_vel</target><type>geometry_msgs/msg/Twist</type></rosinterface>
    <rosinterface kind="subscribe"><name>scan</name><target>/scan</target><type>sensor_msgs/msg/LaserScan</type></rosinterface>
  </ros>"""
ONE = sub(1, 0, state(1, "one", "self.drive.publish()", initial=True))


@pytest.fixture(autouse=True)
def not_installed() -> Iterator[None]:
    with without("visualhfsm_ros2", "zenoh_ros2"):
        yield


def test_a_document_with_endpoints_has_one_problem_that_says_what_to_install(tmp_path: Path) -> None:
    (problem,) = problems(tmp_path / "main.xml", document(ONE, head=ENDPOINTS))
    assert "E535: the types of ROS are not installed: `pip install 'visualhfsm[ros2]'`" in problem


def test_other_documents_have_none(tmp_path: Path) -> None:
    assert problems(tmp_path / "main.xml", document(sub(1, 0, state(1, "one", initial=True)))) == []


def test_it_is_read_and_written_as_it_was(tmp_path: Path) -> None:
    read = parse_document(document(ONE, head=ENDPOINTS), tmp_path / "main.xml", Diagnostics())
    assert read is not None
    assert [each.identity for each in read.ros] == ["/cmd_vel", "/scan"]
    assert parse_document(write_document(read), tmp_path / "main.xml", Diagnostics()) == read
    assert not any(map(find_kind().can_generate, read.ros))
