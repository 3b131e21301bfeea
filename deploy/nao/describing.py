"""Describe what a servant offers: its operations and the types that they use."""

from __future__ import annotations

import textwrap

import msgspec

from deploy.nao.connection import find_servant, operation_of, split
from deploy.nao.dynamic import DynamicProxy
from deploy.nao.output import for_people, print_json, print_line, width
from zenoh_ice import initialize
from zenoh_ice.reflection import OperationDescription, unscoped
from zenoh_ice.settings import Settings

__all__ = ["describe"]


def describe(settings: Settings, address: str, *, as_json: bool) -> None:
    """Print the operations of a servant, or one of them, with the types that they use.

    Raises UsageError for an operation that there is not, and what a call raises.
    """
    with initialize(settings) as communicator:
        identity, name = split(communicator, address)
        proxy = find_servant(communicator, identity)
    shown = list(proxy.interface_operations.values())
    if name:
        shown = [operation_of(proxy, identity, name, shown)]
    if as_json:
        print_json(
            {
                "servant": identity,
                "interface": proxy.type_id,
                "fingerprint": proxy.fingerprint,
                "operations": [msgspec.to_builtins(each) for each in shown],
            }
        )
        return
    print_line(f"{identity} is a {proxy.type_id.removeprefix('::')}  (fingerprint {proxy.fingerprint})")
    for operation in shown:
        marks = "stream, " * operation.streamed + "idempotent, " * operation.idempotent
        signature = proxy.signature(operation.name)
        _print_wrapped(f"{signature}  [{marks.removesuffix(', ')}]" if marks else signature, "  ")
        if operation.exceptions:
            _print_wrapped(f"throws {', '.join(sorted(map(unscoped, operation.exceptions)))}", "    ")
    _print_types(proxy, shown)


def _print_types(proxy: DynamicProxy, shown: list[OperationDescription]) -> None:
    """Print the members of the structs and the names of the enumerations that operations use."""
    waiting = [each.type for operation in shown for each in (*operation.parameters, *operation.results)]
    seen: set[str] = set()
    while waiting:
        type_id = waiting.pop(0)
        definition = proxy.schema.definitions.get(type_id)
        if definition is None or type_id in seen:
            continue
        seen.add(type_id)
        match definition.kind:
            case "enumeration":
                names = ", ".join(each.name for each in definition.enumerators)
                _print_wrapped(f"enum {unscoped(type_id)}: {names}")
            case "struct" | "class":
                members = proxy.schema.members(type_id)
                listed = ", ".join(f"{proxy.type_text(each)} {each.name}" for each in members)
                _print_wrapped(f"{definition.kind} {unscoped(type_id)}: {listed}")
                waiting += [member.type for member in members]
            case _:
                waiting[:0] = [definition.element, definition.key, definition.value]


def _print_wrapped(text: str, margin: str = "") -> None:
    if for_people():  # a program, such as grep, has it on one line
        text = textwrap.fill(
            text,
            width(),
            initial_indent=margin,
            subsequent_indent=f"{margin}    ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        margin = ""
    print_line(margin + text)
