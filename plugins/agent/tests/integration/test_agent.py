"""`visualhfsm agent`, as the official client of the Model Context Protocol knows it."""

from __future__ import annotations

import json
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from anyio.from_thread import start_blocking_portal
from mcp.client.client import Client
from mcp.client.streamable_http import streamable_http_client
from mcp.shared._httpx_utils import create_mcp_http_client

from codegen.diagnostics import Diagnostics
from codegen.hfsm import read_document
from naoserver.fake import FakeRobot
from plugins.agent.tests.support.agent import AgentClient, agent, commands, drawn
from plugins.agent.tests.support.hostile_documents import ORDERS
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess
from tests.support.robot_server import ServedRobot, served
from tests.support.soak import repeated
from visualhfsm import AddEntry, AddState, Place, RenameState, SetComponentText, SetText

_CODE = "self.Head.setPose(0.3, 0.0, 0.5)"


@asynccontextmanager
async def over_http(address: str, headers: dict[str, str]) -> AsyncIterator[Client]:
    """Connect the official client to an address, with headers."""
    async with (
        create_mcp_http_client(headers=headers) as http,
        Client(streamable_http_client(address, http_client=http)) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def robot() -> Iterator[ServedRobot]:
    with served(FakeRobot()) as robot:
        yield robot


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("project")


@pytest.fixture(scope="module")
def call(root: Path, robot: ServedRobot) -> Iterator[AgentClient]:
    """An agent whose processes have started; each test has a document of its own."""
    with agent(root, f"--realm={robot.realm}", f"--connect={robot.endpoint}") as call:
        draw_head(call, "first.xml")
        call("verdict", path="first.xml")
        call("simulate", path="first.xml", seconds=0.1)
        yield call


def draw_head(call: AgentClient, path: str) -> None:
    """Draw a state that turns the head."""
    call(
        "edit",
        path=path,
        commands=commands(
            AddEntry(list="interfaces", fields={"name": "Head", "proxy": "Head", "type": "PoseHead"}),
            AddState(automaton=1, x=100, y=100, name="look"),
            SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=_CODE),
        ),
    )


def wait_for(call: AgentClient, holds: Any) -> dict[str, Any]:
    """Return the first report that meets a condition."""
    for _ in range(int(START_LIMIT)):
        report = call("watch", seconds=1.0)
        if holds(report):
            return report
    raise AssertionError(report)


def test_the_third_experiment_is_drawn_judged_tried_and_run(
    call: AgentClient, root: Path, robot: ServedRobot
) -> None:
    servants = [
        *("Sight", "Head"),
        *(
            f"{side}{part}{end}"
            for side in ("Left", "Right")
            for part in ("Shoulder", "Elbow")
            for end in ("Motors", "Encoders")
        ),
    ]
    (root / "agent.toml").write_text(
        f'realm = "{robot.realm}"\ninterfaces = {json.dumps(servants)}\nask = false\nlongest_run = {START_LIMIT}\n'
    )
    before = call.calls
    for name in ("follow_ball", "dance_and_follow"):
        document = read_document(ROOT / f"behaviors/{name}.xml", Diagnostics())
        assert document is not None
        for step in drawn(document):
            call("edit", path=f"{name}.xml", commands=commands(*step))
    verdict = call("verdict", path="dance_and_follow.xml")
    assert verdict["ready"], verdict
    tried = call("simulate", path="dance_and_follow.xml", seconds=12.0)
    assert not tried["failed"]
    assert any("followBall -> dance" in line for line in tried["data"]["timeline"])
    assert call("run", path="dance_and_follow.xml")["runs"]
    report = wait_for(call, lambda report: report["data"]["states"])
    assert report["data"]["states"][0] == "followBall"
    ended = call("stop")
    assert not ended["runs"]
    assert ended["stopped_by"] == "the agent"
    assert call.calls - before < 60


def test_what_is_offered(call: AgentClient) -> None:
    tools = call.ask("list_tools").tools
    assert len(tools) <= 18
    assert all(tool.description for tool in tools)
    schema = call.ask("read_resource", "visualhfsm://commands").contents[0].text
    assert "AddState" in schema
    assert "automata" in call.ask("read_resource", "visualhfsm://documentation/none").contents[0].text
    assert {each.name for each in call.ask("list_prompts").prompts} == {"behavior", "why"}
    assert "PoseHead" in call("interface")["data"]["interfaces"]
    draw_head(call, "offered.xml")
    assert "<svg" in call("picture", path="offered.xml")["data"]["svg"]
    page = call("document", path="offered.xml")
    assert "setPose" in page["data"]["text"]
    assert call("document", path="offered.xml", since=page["revision"])["unchanged"]
    call("undo", path="offered.xml")
    assert "setPose" not in call("document", path="offered.xml")["data"]["text"]


def test_nothing_runs_without_a_person(call: AgentClient, root: Path) -> None:
    (root / "agent.toml").unlink(missing_ok=True)
    draw_head(call, "alone.xml")
    assert call("verdict", path="alone.xml")["ready"]
    assert (
        call("run", path="alone.xml")["refused"]
        == "no robot may be driven: a person writes realm = ... in {file}"
    )


def test_texts_of_others_are_data(call: AgentClient) -> None:
    at_code = Place(kind="state", automaton=1, id=1, part="code")
    draw_head(call, "data.xml")
    for text in repeated(ORDERS[::4], ORDERS):
        call(
            "edit",
            path="data.xml",
            commands=commands(
                SetText(place=at_code, text=f"raise ValueError({text!r})"),
                RenameState(automaton=1, state=1, name=text),
                SetComponentText(part="description", text=text),
            ),
        )
        answers = [
            call("verdict", path="data.xml", seconds=0.2),
            call("document", path="data.xml"),
            call("run", path=f"{text}.xml"),
            call("edit", path="data.xml", commands=[{"command": text}]),
            call("interface", name=text),
        ]
        for answer in answers:
            assert text not in str({name: value for name, value in answer.items() if name != "data"})
        assert text in str(answers[0]["data"])
    prompt = call.ask("get_prompt", "behavior", {"sentence": ORDERS[0]}).messages[0].content.text
    assert prompt.partition("data: ")[2] == json.dumps({"sentence": ORDERS[0]}, separators=(",", ":"))


def test_over_http_a_token_is_needed(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "visualhfsm", "agent", "--http", f"--root={tmp_path}"]
    with ComponentProcess(command) as process:
        address, token = process.wait_for(r"at (\S+), token: (\S+)").groups()
        assert address.startswith("http://127.0.0.1:")
        for header in ({}, {"Authorization": "Bearer x"}, {"Authorization": token}):
            with pytest.raises(HTTPError, match="401"):
                urlopen(Request(address, b"{}", header), timeout=CALL_LIMIT)
        headers = {"Authorization": f"Bearer {token}"}
        with start_blocking_portal() as portal:
            client = portal.wrap_async_context_manager(over_http(address, headers))
            with client as session:
                found = portal.call(session.call_tool, "project", {})
                assert found.structured_content["data"] == {"documents": []}
