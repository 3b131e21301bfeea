"""Commands as JSON, and their names."""

from __future__ import annotations

import msgspec
import pytest

from tests.support.editing import tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import COMMANDS, decode_command
from visualhfsm._document.commands.component import AddEntry, RemoveEntry
from visualhfsm._document.commands.items import DeleteItems
from visualhfsm._document.commands.states import AddState, RenameState
from visualhfsm._document.commands.text import SetText
from visualhfsm._document.commands.transitions import AddTransition
from visualhfsm._document.places import Place


def test_commands_come_as_json() -> None:
    command = decode_command('{"command": "addState", "automaton": 1, "x": 10, "y": 20}')
    assert command == AddState(automaton=1, x=10.0, y=20.0)
    assert decode_command(msgspec.json.encode(command)) == command
    assert len({each.__struct_config__.tag for each in COMMANDS}) == len(COMMANDS)


@pytest.mark.parametrize(
    "content",
    [
        "{}",
        "[]",
        "{",
        '{"command": "formatDisk"}',
        '{"command": "addState", "automaton": -1, "x": 0, "y": 0}',
        '{"command": "addState", "automaton": 1, "x": "0", "y": 0}',
        '{"command": "addState", "automaton": 1, "x": 0, "y": 0, "z": 0}',
        '{"command": "addState", "automaton": 1, "x": NaN, "y": 0}',
        '{"command": "setText", "place": {"kind": "world", "part": "code"}, "text": "7"}',
        '{"command": "renameState", "automaton": 1, "state": 1, "name": "\\ud800"}',
        b"\xff",
    ],
)
def test_json_that_is_no_command_is_refused(content: str | bytes) -> None:
    lists = r"its field `command` is one of .*addState|(addState|setText|renameState) has the fields \w+, "
    with pytest.raises(EditError, match=f"Cannot understand the command: .*; ({lists})"):
        decode_command(content)


def test_every_command_is_named_by_what_it_does() -> None:
    document = tree()
    for command, title in (
        (RenameState(automaton=1, state=1, name="x"), "Rename “wait”"),
        (DeleteItems(automaton=1, states=(1, 2), transitions=(1,)), "Delete 2 states and 1 transition"),
        (AddTransition(automaton=1, origin=1, destination=2), "Add a transition from “wait” to “work”"),
        (
            SetText(place=Place(kind="state", automaton=1, id=1, part="entry"), text=""),
            "Edit the entry code of “wait”",
        ),
        (AddEntry(list="interfaces"), "Add an interface"),
        (RemoveEntry(list="properties", index=0), "Remove a property"),
    ):
        assert command.title(document) == title
