"""Commands that change the declarations of a component and of its automata."""

from __future__ import annotations

from typing import Any

import pytest

from codegen.hfsm import write_document
from codegen.hfsm.document import Parameter, Text
from codegen.messages import Message
from tests.support.editing import automaton, state, texted, tree
from visualhfsm._base.errors import EditError
from visualhfsm._document.commands import Command
from visualhfsm._document.commands.component import (
    AddEntry,
    ChangeEntry,
    RemoveEntry,
    ReorderEntry,
    SetComponentText,
)
from visualhfsm._document.serialization import parse


def test_a_renamed_input_takes_its_arguments_along() -> None:
    document = AddEntry(
        list="inputs", automaton=2, fields={"name": "times", "type": "int", "default": "1"}
    ).apply(tree())
    for child in (0, 2, 3):
        document = texted(document, "2", kind="state", id=2, part="argument", name="times", child=child)
    document = ChangeEntry(list="inputs", automaton=2, index=0, fields={"name": "rounds"}).apply(document)
    assert automaton(document, 2).inputs == (Parameter(name="rounds", type=Text("int"), default=Text("1")),)
    assert [each.name for each in state(document, 2).arguments] == ["rounds", "rounds", "times"]


def test_a_renamed_output_takes_its_results_along() -> None:
    fields = {"name": "found", "type": "bool", "default": "False"}
    document = AddEntry(list="outputs", automaton=2, fields=fields).apply(tree())
    for child in (0, 2, 3):
        document = texted(document, "x", kind="state", id=2, part="result", name="found", child=child)
    document = ChangeEntry(list="outputs", automaton=2, index=0, fields={"name": "seen"}).apply(document)
    assert [each.name for each in automaton(document, 2).outputs] == ["seen"]
    assert [each.name for each in state(document, 2).results] == ["seen", "seen", "found"]


def test_the_data_of_a_component_is_set() -> None:
    document = tree()
    texts: Any = (
        ("description", "waits"),
        ("onError", "continue"),
        ("onRefused", "error"),
        ("world", "soccer"),
        ("language", "C++"),
    )
    for part, text in texts:
        document = SetComponentText(part=part, text=text).apply(document)
    assert (document.description.text, document.on_error.text) == ("waits", "continue")
    assert (document.world.text, document.language.text) == ("soccer", "C++")


@pytest.mark.parametrize(
    ("add", "change", "list_name"),
    [
        (
            AddEntry(list="parameters"),
            ChangeEntry(list="parameters", index=0, fields={"name": "speed", "default": "1.0"}),
            "parameters",
        ),
        (
            AddEntry(list="events"),
            ChangeEntry(list="events", index=0, fields={"name": "go home", "description": "x"}),
            "events",
        ),
        (
            AddEntry(list="properties"),
            ChangeEntry(
                list="properties", index=0, fields={"kind": "never", "within": "5", "expression": "wait"}
            ),
            "properties",
        ),
        (
            AddEntry(list="survives"),
            ChangeEntry(
                list="survives", index=0, fields={"kind": "late", "amount": "0.5", "must": "succeed"}
            ),
            "survives",
        ),
        (
            AddEntry(list="libraries", fields={"name": "cv2"}),
            ChangeEntry(list="libraries", index=0, fields={"name": "numpy as np"}),
            "libraries",
        ),
        (
            AddEntry(list="interfaces"),
            ChangeEntry(
                list="interfaces", index=0, fields={"name": "head", "proxy": "Head", "type": "PoseHead"}
            ),
            "interfaces",
        ),
        (
            AddEntry(list="ros"),
            ChangeEntry(
                list="ros",
                index=0,
                fields={
                    "name": "scan",
                    "kind": "publish",
                    "target": "/scan",
                    "qos": "latched",
                    "stop": "true",
                },
            ),
            "ros",
        ),
    ],
    ids=["parameter", "event", "property", "failure", "library", "interface", "topic"],
)
def test_entries_are_added_changed_moved_and_removed(add: Command, change: Command, list_name: Any) -> None:
    document = add.apply(add.apply(tree()))
    added = getattr(document, list_name)
    names = {getattr(each, "name", None) for each in added}
    assert len(names) == (1 if list_name in ("libraries", "survives") else 2)
    document = change.apply(document)
    first, second = getattr(document, list_name)
    assert first != added[0]
    assert second == added[1]
    document = ReorderEntry(list=list_name, index=0, to=1).apply(document)
    assert getattr(document, list_name) == (second, first)
    document = RemoveEntry(list=list_name, index=0).apply(document)
    assert getattr(document, list_name) == (first,)
    with pytest.raises(EditError, match="there are 1"):
        RemoveEntry(list=list_name, index=1).apply(document)
    assert parse(write_document(document), Message("Cannot read")) == document


def test_an_entry_has_the_fields_of_its_list_alone() -> None:
    with pytest.raises(EditError, match="it has only name, description"):
        AddEntry(list="events", fields={"type": "int"}).apply(tree())
    document = AddEntry(list="properties", fields={"kind": "never"}).apply(tree())
    with pytest.raises(EditError, match="one of always, eventually, never"):
        ChangeEntry(list="properties", index=0, fields={"kind": "mostly"}).apply(document)
    with pytest.raises(EditError, match="one of publish, subscribe, service, action"):
        AddEntry(list="ros", fields={"kind": "always"}).apply(document)
