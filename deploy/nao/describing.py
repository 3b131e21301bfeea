"""Tell what a servant offers: its operations and the types that they use."""

from __future__ import annotations

import textwrap

from deploy.nao.connection import find_servant, operation_of, operations_of, split
from deploy.nao.definitions import (
    Definitions,
    Dictionary,
    Named,
    OperationSignature,
    Optional,
    Sequence,
    Type,
    unscoped,
)
from deploy.nao.output import for_people, print_json, print_line, width
from deploy.nao.values import Json
from zenoh_ice import initialize
from zenoh_ice.settings import Settings

__all__ = ["describe"]


def describe(settings: Settings, address: str, facet: str, *, as_json: bool) -> None:
    """Print the operations of a servant, or one of them with the types that it uses.

    Raises UsageError for an operation that there is not, and what a call raises.
    """
    with initialize(settings) as communicator:
        identity, name = split(communicator, address, facet)
        proxy = find_servant(communicator, identity, facet)
    definitions = proxy.definitions
    shown = operations_of(proxy)
    if name:
        shown = [operation_of(proxy, identity, name, shown)]
    if as_json:
        print_json(
            {
                "servant": identity,
                "interface": proxy.type_id,
                "fingerprint": proxy.fingerprint,
                "operations": [_operation_as_json(each) for each in shown],
            }
        )
        return
    print_line(f"{identity} is a {proxy.type_id.removeprefix('::')}  (fingerprint {proxy.fingerprint})")
    for signature in shown:
        marks = [word for word, holds in _marks(signature) if holds]
        _print_wrapped(f"{signature}" + (f"  [{', '.join(marks)}]" if marks else ""), "  ")
        if signature.throws:
            _print_wrapped(f"throws {', '.join(map(unscoped, signature.throws))}", "    ")
    _print_types(definitions, shown)


def _marks(signature: OperationSignature) -> tuple[tuple[str, bool], ...]:
    return ("stream", signature.streamed), ("idempotent", signature.idempotent)


def _operation_as_json(signature: OperationSignature) -> Json:
    parameters: list[Json] = [{"name": each.name, "type": str(each.type)} for each in signature.parameters]
    results: list[Json] = [{"name": each.name, "type": str(each.type)} for each in signature.results]
    return {
        "name": signature.name,
        "interface": signature.interface,
        "parameters": parameters,
        "results": results,
        "throws": list(signature.throws),
        "idempotent": signature.idempotent,
        "stream": signature.streamed,
    }


def _print_types(definitions: Definitions, shown: list[OperationSignature]) -> None:
    """Print the members of the structs and the names of the enumerations that operations use."""
    waiting = [each.type for signature in shown for each in (*signature.parameters, *signature.results)]
    seen: set[str] = set()
    while waiting:
        kind = _innermost(waiting.pop(0), waiting)
        if not isinstance(kind, Named) or kind.type_id in seen:
            continue
        seen.add(kind.type_id)
        if (enumeration := definitions.enumerations.get(kind.type_id)) is not None:
            _print_wrapped(f"enum {kind}: {', '.join(enumeration.values)}")
        elif (record := definitions.records.get(kind.type_id)) is not None:
            members = definitions.all_members(kind.type_id)
            _print_wrapped(f"{record.kind} {kind}: {', '.join(map(str, members))}")
            waiting += [member.type for member in members]


def _print_wrapped(text: str, margin: str = "") -> None:
    if not for_people():  # but for a program, such as grep
        print_line(f"{margin}{text}")
        return
    lines = textwrap.wrap(
        text,
        width(),
        initial_indent=margin,
        subsequent_indent=f"{margin}    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    for line in lines:
        print_line(line)


def _innermost(kind: Type, waiting: list[Type]) -> Type:
    match kind:
        case Sequence(element) | Optional(element):
            return _innermost(element, waiting)
        case Dictionary(key, value):
            waiting.append(key)
            return _innermost(value, waiting)
    return kind
