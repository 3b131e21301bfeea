"""Call an operation and print what it returns."""

from __future__ import annotations

from collections.abc import Sequence

from deploy.nao.arguments import read_arguments
from deploy.nao.connection import find_operation
from deploy.nao.output import note, print_json, print_value
from deploy.nao.values import Json, to_json
from zenoh_ice import initialize
from zenoh_ice.settings import Settings

__all__ = ["call", "shown_bytes"]


def call(settings: Settings, address: str, words: Sequence[str], facet: str, *, as_json: bool) -> None:
    """Call the operation that an address names with the arguments of the command line.

    Raises UsageError for arguments that do not fit, and whatever the call raises.
    """
    with initialize(settings) as communicator:
        proxy, name = find_operation(communicator, address, facet)
        arguments, left_out = read_arguments(proxy, name, words)
        if left_out:
            note(f"not given, so zero: {', '.join(left_out)}")
        results = proxy.invoke(name, arguments)
    if as_json:
        print_json(_whole(results))
    elif results:
        print_value(to_json(_result(results), shown_bytes))


def shown_bytes(data: bytes) -> Json:
    """Return what a person is shown of bytes."""
    return f"<{len(data)} bytes>"


def _result(results: dict[str, object]) -> object:
    """Return the one result, or all by name."""
    return next(iter(results.values())) if len(results) == 1 else results


def _whole(results: dict[str, object]) -> Json:
    return to_json(_result(results)) if results else None
