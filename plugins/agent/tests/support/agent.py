"""A client of `visualhfsm agent`, the official one, and a document as the commands that draw it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, cast

import msgspec
from anyio.from_thread import start_blocking_portal
from mcp.client.client import Client
from mcp.client.stdio import StdioServerParameters, stdio_client

from codegen.hfsm.document import Automaton, Document, Text
from visualhfsm import (
    AddAutomaton,
    AddEntry,
    AddState,
    AddTransition,
    Command,
    MarkFinal,
    Place,
    SetImport,
    SetPeriod,
    SetText,
)

__all__ = ["AgentClient", "agent", "commands", "drawn"]

_LISTS: Final = {
    "libraries": ("name",),
    "interfaces": ("name", "proxy", "type"),
    "parameters": ("name", "type", "default"),
    "properties": ("name", "kind", "within", "expression"),
}


class AgentClient:
    """A client, by calls that wait; `calls` counts those of tools."""

    def __init__(self, client: Client, wait: Callable[..., Any]) -> None:
        self.client = client
        self._wait = wait
        self.calls = 0

    def ask(self, method: str, *arguments: Any) -> Any:
        """Call a method of the SDK's client."""
        return self._wait(getattr(self.client, method), *arguments)

    def __call__(self, tool: str, /, **arguments: Any) -> dict[str, Any]:
        """Call a tool; return its answer."""
        self.calls += 1
        result = self.ask("call_tool", tool, arguments)
        answer: dict[str, Any] = result.structured_content
        assert result.is_error == ("refused" in answer and "runs" not in answer), result
        return answer


@contextmanager
def agent(root: Path, *options: str) -> Iterator[AgentClient]:
    """Start the command for a folder, and speak with it over stdin and stdout."""
    command = ["-m", "visualhfsm", "agent", f"--root={root}", *options]
    server = stdio_client(StdioServerParameters(command=sys.executable, args=command))
    with start_blocking_portal() as portal, portal.wrap_async_context_manager(Client(server)) as client:
        yield AgentClient(client, portal.call)


def commands(*several: Command) -> list[dict[str, Any]]:
    """Return commands as JSON has them."""
    return [msgspec.json.decode(msgspec.json.encode(each)) for each in several]


def drawn(document: Document) -> Iterator[list[Command]]:
    """Yield steps that draw a document into an empty one: its lists, then an automaton at a time, from the root."""
    first: list[Command] = []
    for name, fields in _LISTS.items():
        for entry in getattr(document, name):
            values = {field: getattr(entry, field) for field in fields}
            texts = {
                field: value if isinstance(value, str) else value.text
                for field, value in values.items()
                if value
            }
            first.append(msgspec.convert({"command": "addEntry", "list": name, "fields": texts}, AddEntry))
    yield first
    yield from _automaton(document, document.automata[0])
    arguments: list[Command] = []
    for automaton in document.automata:
        for state in automaton.states:
            for each in state.arguments:
                at = {"kind": "state", "automaton": automaton.id, "id": state.id, "part": "argument"}
                place = msgspec.convert({**at, "name": each.name, "child": each.child}, Place)
                arguments.append(SetText(place=place, text=each.value.text))
    if arguments:
        yield arguments


def _automaton(document: Document, automaton: Automaton) -> Iterator[list[Command]]:
    """Yield the steps for an automaton, and for those below it, which get their numbers in this order."""
    number = automaton.id
    if automaton.imported is not None:
        yield [
            SetImport(
                automaton=number, file=automaton.imported.file.text, source=automaton.imported.automaton
            )
        ]
        return
    own: list[Command] = [SetPeriod(automaton=number, period=automaton.iteration_time.text)]

    def texts(kind: Any, id: int, **parts: Text) -> None:
        for part, text in parts.items():
            if text.text:
                own.append(
                    SetText(place=Place(kind=kind, automaton=number, id=id, part=part), text=text.text)
                )

    for state in automaton.states:
        own.append(AddState(automaton=number, x=state.x, y=state.y, name=state.name))
        texts("state", state.id, entry=state.entry, code=state.code, exit=state.exit)
        if state.final:
            own.append(MarkFinal(automaton=number, state=state.id, final=True))
    for each in automaton.transitions:
        kind = cast("Any", each.type)
        origin, destination = each.origin, each.destination
        own.append(
            AddTransition(automaton=number, origin=origin, destination=destination, type=kind, name=each.name)
        )
        texts("transition", each.id, trigger=each.trigger, guard=each.guard, fired=each.code)
    texts("automaton", 0, variables=automaton.variables, functions=automaton.functions)
    for entry in automaton.inputs:
        fields = {"name": entry.name, "type": entry.type.text, "default": entry.default.text}
        own.append(AddEntry(list="inputs", automaton=number, fields=fields))
    yield own
    for state in automaton.states:
        for child in state.children:
            yield [AddAutomaton(automaton=number, state=state.id)]
            below = document.automaton(child)
            assert below is not None
            yield from _automaton(document, below)
