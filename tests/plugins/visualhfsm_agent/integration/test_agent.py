"""`visualhfsm agent`, as the official client of the Model Context Protocol knows it."""

from __future__ import annotations

import json
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
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
from tests.support.agent import AgentClient, agent, commands, drawn
from tests.support.hostile_documents import ORDERS
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess
from tests.support.robot_server import ServedRobot, served
from visualhfsm import AddEntry, AddState, Place, RenameState, SetComponentText, SetText

_HEAD = ("Head",)


@asynccontextmanager
async def over_http(address: str, headers: dict[str, str]) -> AsyncIterator[Client]:
    """Connect the official client to an address, with headers."""
    async with (
        create_mcp_http_client(headers=headers) as http,
        Client(streamable_http_client(address, http_client=http)) as client,
    ):
        yield client


@contextmanager
def agent_and_robot(root: Path, limits: str = "", **toml: Any) -> Iterator[tuple[AgentClient, ServedRobot]]:
    """Serve a fake robot, and an agent that a person lets run what calls some servants."""
    with served(FakeRobot()) as robot:
        given = {
            "realm": robot.realm,
            "interfaces": [*_HEAD],
            "ask": False,
            "longest_run": START_LIMIT,
            **toml,
        }
        text = "".join(f"{key} = {_toml(value)}\n" for key, value in given.items())
        (root / "agent.toml").write_text(text + limits)
        with agent(root, f"--realm={robot.realm}", f"--connect={robot.endpoint}") as call:
            yield call, robot


def _toml(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(value).replace("'", '"')


def draw_head(
    call: AgentClient, code: str = "self.Head.setPose(0.3, 0.0, 0.5)", path: str = "look.xml"
) -> None:
    """Draw a state that turns the head."""
    call(
        "edit",
        path=path,
        commands=commands(
            AddEntry(list="interfaces", fields={"name": "Head", "proxy": "Head", "type": "PoseHead"}),
            AddState(automaton=1, x=100, y=100, name="look"),
            SetText(place=Place(kind="state", automaton=1, id=1, part="code"), text=code),
        ),
    )


def wait_for(call: AgentClient, holds: Any) -> dict[str, Any]:
    """Return the first report that meets a condition."""
    for _ in range(int(START_LIMIT)):
        report = call("watch", seconds=1.0)
        if holds(report):
            return report
    raise AssertionError(report)


def test_the_third_experiment_is_drawn_judged_tried_and_run(tmp_path: Path) -> None:
    servants = (
        *("Camera", "Head"),
        *(
            f"{side}{part}{end}"
            for side in ("Left", "Right")
            for part in ("Shoulder", "Elbow")
            for end in ("Motors", "Encoders")
        ),
    )
    with agent_and_robot(tmp_path, interfaces=[*servants]) as (call, _):
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
        assert call.calls < 60


def test_what_is_offered(tmp_path: Path) -> None:
    with agent(tmp_path) as call:
        tools = call.ask("list_tools").tools
        assert len(tools) <= 18
        assert all(tool.description for tool in tools)
        schema = call.ask("read_resource", "visualhfsm://commands").contents[0].text
        assert "AddState" in schema
        assert "automata" in call.ask("read_resource", "visualhfsm://documentation/none").contents[0].text
        assert {each.name for each in call.ask("list_prompts").prompts} == {"behavior", "why"}
        assert "PoseHead" in call("interface")["data"]["interfaces"]
        draw_head(call)
        assert "<svg" in call("picture", path="look.xml")["data"]["svg"]
        page = call("document", path="look.xml")
        assert "setPose" in page["data"]["text"]
        assert call("document", path="look.xml", since=page["revision"])["unchanged"]
        call("undo", path="look.xml")
        assert "setPose" not in call("document", path="look.xml")["data"]["text"]


def test_nothing_runs_without_a_person(tmp_path: Path) -> None:
    with agent(tmp_path) as call:
        draw_head(call)
        assert call("verdict", path="look.xml")["ready"]
        assert (
            call("run", path="look.xml")["refused"]
            == "no robot may be driven: a person writes realm = ... in {file}"
        )


def test_a_byte_withdraws_a_verdict(tmp_path: Path) -> None:
    with agent_and_robot(tmp_path) as (call, _):
        draw_head(call)
        assert "no verdict" in call("run", path="look.xml")["refused"]
        assert call("verdict", path="look.xml")["ready"]
        with (tmp_path / "look.xml").open("a") as file:
            file.write("\n")
        assert "has changed since" in call("run", path="look.xml")["refused"]
        assert "no verdict" in call("run", path="look.xml")["refused"]


def test_a_run_ends_after_the_time_that_a_person_allows_and_says_so(tmp_path: Path) -> None:
    with agent_and_robot(tmp_path, longest_run=1.0) as (call, _):
        draw_head(call)
        assert call("verdict", path="look.xml")["ready"]
        call("run", path="look.xml")
        report = wait_for(call, lambda report: not report["runs"])
        assert report["exit_code"] == 0
        assert "a behavior runs" not in str(report)


@pytest.mark.parametrize(
    ("limits", "code", "why"),
    [
        ("Head.setPose.fraction", "self.Head.setPose(0.3, 0.0, 0.5)", "allows at most 0.2 for fraction"),
        (
            "Head.setPose.pan",
            "import numpy as np; self.Head.setPose(np.int8(-128), 0.0, 0.1)",
            "allows at most 0.2 for pan",
        ),
        ("Head.setPose.fractoin", "pass", "limits Head.setPose.fractoin, which Head does not have"),
    ],
)
def test_an_argument_beyond_its_limit_is_no_call(tmp_path: Path, limits: str, code: str, why: str) -> None:
    with agent_and_robot(tmp_path, limits=f'[most]\n"{limits}" = 0.2\n') as (call, _):
        draw_head(call, code)
        assert call("verdict", path="look.xml")["ready"]
        call("run", path="look.xml")
        report = wait_for(call, lambda report: not report["runs"])
        assert report["exit_code"] == 1
        assert f"agent.toml {why}" in "\n".join(report["data"]["output"])


def test_texts_of_others_are_data(tmp_path: Path) -> None:
    at_code = Place(kind="state", automaton=1, id=1, part="code")
    with agent(tmp_path) as call:
        draw_head(call)
        for text in ORDERS:
            call(
                "edit",
                path="look.xml",
                commands=commands(
                    SetText(place=at_code, text=f"raise ValueError({text!r})"),
                    RenameState(automaton=1, state=1, name=text),
                    SetComponentText(part="description", text=text),
                ),
            )
            answers = [
                call("verdict", path="look.xml", seconds=0.2),
                call("document", path="look.xml"),
                call("run", path=f"{text}.xml"),
                call("edit", path="look.xml", commands=[{"command": text}]),
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
