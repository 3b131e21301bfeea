"""docs/how-to/nao.md: what it says of the status, its stack file and its commands; test_docs_commands runs these."""

from __future__ import annotations

import json
import re
from pathlib import Path

from nao_tools._command import app
from nao_tools._deployment.stack import load_stack
from naoserver.fake import FakeRobot
from tests.support.nao_command import at, nao
from tests.support.pages import DOCS, blocks_of
from tests.support.robot_server import served

PAGE = (DOCS / "how-to/nao.md").read_text("utf-8")


JSON_TYPES = {str: "text", int: "integer", float: "number", bool: "boolean", list: "list", dict: "object"}


def test_the_form_of_the_status_is_that_of_the_page() -> None:
    rows = re.findall(r"^\| `([\w.\[\]*]+)` \| ([\w ]+) \| (.*) \|$", PAGE, re.M)
    with served(FakeRobot()) as robot, at(robot.endpoint, robot.realm):
        status = json.loads(nao("status", "--json").out)
    (process,) = status["processes"]
    servant = process["servants"][f"Head@{status['realm']}"]
    found = {
        prefix + key: JSON_TYPES[type(value)]
        for prefix, part in {
            "": status,
            "robot.": status["robot"],
            "processes[].": process,
            "processes[].servants.*.": servant,
        }.items()
        for key, value in part.items()
    }
    assert {key: kind.removesuffix(" of text") for key, kind, _ in rows} == found
    for key, _, meaning in rows:
        if (name := key.removeprefix("robot.")) in status["robot"]:
            written = set(re.findall(r"`(\w+)`", meaning.partition(": ")[2]))
            assert written == set(status["robot"][name]), name


def test_the_stack_file_is_one(tmp_path: Path) -> None:
    (stack,) = (block.text for block in blocks_of(PAGE) if block.language == "toml")
    (tmp_path / "my.toml").write_text(stack, "utf-8")
    assert [each.name for each in load_stack(tmp_path / "my.toml").processes] == [
        "naoserver",
        "ball",
        "behavior",
    ]


def test_every_command_is_explained() -> None:
    names = [
        command.name or (command.callback and command.callback.__name__)
        for command in app.registered_commands
    ]
    assert [name for name in names if name and f"nao {name.replace('_', '-')}" not in PAGE] == []
