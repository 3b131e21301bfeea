"""The conversation in docs/reference/protocol.md works as described."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from codegen.messages import Message
from tests.support.editor import DOCUMENT, Window, editor
from tests.support.pages import blocks_of
from visualhfsm._base.errors import ErrorKind
from visualhfsm._editor.handlers import HANDLERS, Lane
from visualhfsm._editor.protocol import REQUESTS, Request
from visualhfsm._monitor.messages import Push
from zenoh_ice.data import typed

PAGE = Path(__file__).parents[2] / "docs" / "reference/protocol.md"


def test_the_conversation_is_held_as_it_is_described(tmp_path: Path) -> None:
    root = tmp_path / "root"
    root.mkdir()
    (root / "robot.xml").write_text(DOCUMENT)
    text = "\n".join(block.text for block in blocks_of(PAGE.read_text("utf-8")))
    shown = re.findall(r"^([→←]) (.*\n(?:  .*\n?)*)", f"{text}\n", re.MULTILINE)
    assert len(shown) > 30
    with editor(root) as running, running.socket() as socket:
        window = Window(socket)
        pushed = 0
        for mark, message in shown:
            expected = json.loads(message)
            if mark == "→":
                socket.send(message)
                pushed = len(window.pushes)
                continue
            # It may have come while something else was waited for.
            seen = [push for push in window.pushes[pushed:] if matches(push, expected)]
            if not seen:
                window.wait_for(partial(matches, expected=expected))
    assert not window.documents
    for request in (json.loads(message) for mark, message in shown if mark == "→"):
        answered = window.answers[request["id"]]
        if "ok" in answered:
            kind = next(each for each in get_args(Request) if each.__struct_config__.tag == request["op"])
            typed.from_json(json.dumps(answered["ok"]), kind.answer, dec_hook=read_message)


def read_message(kind: type, data: object) -> object:
    assert kind is Message
    return Message.verbatim(str(data))


@pytest.mark.parametrize("kind", HANDLERS)
def test_a_handler_returns_what_its_request_is_answered_with(kind: Any) -> None:
    handle = HANDLERS[kind].handle
    returned = get_type_hints(handle, include_extras=True).get("return", object)
    if returned not in (object, Any):  # what is passed on, or a lambda
        assert returned == (kind.answer or type(None))


def matches(message: Any, expected: Any) -> bool:
    """Return whether a message is as expected; `…` matches anything."""
    if expected == "…":
        return True
    if isinstance(expected, dict) and isinstance(message, dict):
        open_ended = "…" in expected
        wanted = {key: value for key, value in expected.items() if key != "…"}
        same_keys = wanted.keys() <= message.keys() if open_ended else wanted.keys() == message.keys()
        return same_keys and all(matches(message[key], value) for key, value in wanted.items())
    if isinstance(expected, list) and isinstance(message, list):
        return len(message) == len(expected) and all(map(matches, message, expected))
    return bool(message == expected)


def test_every_request_push_and_kind_of_error_is_described() -> None:
    page = PAGE.read_text("utf-8")
    used = {field: set(re.findall(rf'"{field}": "(\w+)"', page)) for field in ("op", "push")}
    assert used["op"] - {"dance"} <= tags(Request)
    assert used["push"] <= {each.__struct_config__.tag for each in Push.__subclasses__()}
    # docs/hooks.py lists them all; tests/unit/docs/test_reference.py checks that.
    assert {"requests", "pushes", "edits"} <= set(re.findall(r"<!-- generated: (\w+) -->", page))
    assert re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE) == list(get_args(ErrorKind))
    listed = re.search(r"Those that change no document \((.*?)\)", page, re.DOTALL)
    assert listed
    assert set(re.findall(r"`(\w+)`", listed[1])) == {
        kind.__struct_config__.tag
        for kind, handler in HANDLERS.items()
        if kind in REQUESTS and handler.lane not in {Lane.IN_ORDER, Lane.AT_ONCE}
    }


def tags(union: Any) -> set[str]:
    """Return what the messages of a union are called."""
    return {each.__struct_config__.tag for each in get_args(union)}
