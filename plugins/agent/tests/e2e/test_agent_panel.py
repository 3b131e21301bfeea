"""The run that an agent asks for, which a person allows or refuses in the page."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.support.browser import EditorPage
from tests.support.limits import CALL_LIMIT
from visualhfsm_agent._approval import Approvals
from visualhfsm_agent._desk import Desk
from visualhfsm_agent._limits import AgentError
from zenoh_ice import Settings


@pytest.fixture
def path(path: Path) -> Path:
    (path.parent / "agent.toml").write_text('realm = "nao"\n')
    return path


@pytest.fixture
def asked(shown: EditorPage, path: Path) -> Approvals:
    """A question of an agent in the panel, which opens by itself once."""
    approvals = Approvals(path.parent)
    expect(shown.page.get_by_text("No agent asks for anything.")).to_be_visible()
    with pytest.raises(AgentError, match="a person must allow this run"):
        approvals.require("digest", "look.xml", 30.0)
    words = "An agent asks to run look.xml on the robot, for at most 30 s."
    expect(shown.page.get_by_role("alert")).to_contain_text(words)
    assert shown.violations("hfsm-agent") == []
    return approvals


def test_a_run_is_allowed_once(shown: EditorPage, asked: Approvals) -> None:
    shown.page.get_by_role("button", name="Allow it once").click()
    expect(shown.page.get_by_text("No agent asks for anything.")).to_be_visible()
    assert asked.asked() is None, "it is asked for again, though somebody has answered"
    asked.require("digest", "look.xml", 30.0)
    with pytest.raises(AgentError, match="a person must allow this run"):
        asked.require("digest", "look.xml", 30.0)


def test_a_run_is_refused(shown: EditorPage, asked: Approvals) -> None:
    shown.page.get_by_role("button", name="Refuse").click()
    expect(shown.page.get_by_text("No agent asks for anything.")).to_be_visible()
    with pytest.raises(AgentError, match="a person has refused this run"):
        asked.require("digest", "look.xml", 30.0)


def test_its_step_is_seen_under_its_name_and_undone(shown: EditorPage, path: Path) -> None:
    command = {"command": "addState", "automaton": 1, "x": 200, "y": 300, "name": "ofAgent"}
    with closing(Desk(path.parent, Settings(clock="wall", timeout=CALL_LIMIT))) as desk:
        desk.edit(path.name, [command])
    expect(shown.state("ofAgent")).to_be_visible()
    expect(shown.page.get_by_role("status").filter(has_text="agent: Add a state")).to_be_visible()
    shown.page.locator("hfsm-canvas").focus()
    shown.press("Control+z")
    expect(shown.state("ofAgent")).to_have_count(0)
