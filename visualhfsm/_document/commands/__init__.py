"""Every change of a document as a value: it arrives as JSON, has a name for undo, and can be replayed.

`decode_command` reads one from JSON, `msgspec.json.encode` writes it; `AnyCommand` is their type.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Final, Union

import msgspec

from codegen.messages import Message
from codegen.reasons import reason
from visualhfsm._base.errors import EditError
from zenoh_ice.data import typed

from . import automata, component, group, items, notes, paste, states, text, transitions, variables
from .base import Command

__all__ = ["COMMANDS", "AnyCommand", "Command", "decode_command", "in_language"]

_MODULES: Final = (automata, component, group, items, notes, paste, states, text, transitions, variables)
COMMANDS: Final[tuple[type[Command], ...]] = tuple(
    found
    for module in _MODULES
    for found in vars(module).values()
    if isinstance(found, type) and issubclass(found, Command) and not found.__name__.startswith("_")
    if found.__module__ == module.__name__
)
"""All commands."""

if TYPE_CHECKING:
    AnyCommand = Command
else:
    AnyCommand = Union[COMMANDS]  # noqa: UP007 - made of a tuple
    """The type of any command in JSON."""


class _Named(msgspec.Struct):
    command: str


_decode: Final[Callable[[bytes | str | msgspec.Raw], Command]] = typed.json_decoder(AnyCommand)


def in_language(command: Command, language: str) -> Command:
    """Return a command with the language of the names that it makes up, if it has none yet."""
    is_open = getattr(command, "language", None) == ""
    return msgspec.structs.replace(command, language=language) if is_open else command


def decode_command(content: bytes | str | msgspec.Raw) -> Command:
    """Return the command in JSON. Raises EditError when it is not a command."""
    try:
        return _decode(content)
    except (msgspec.MsgspecError, UnicodeError) as error:
        raise EditError("Cannot understand the command", reason(error), _expected(content)) from error


def _expected(content: bytes | str | msgspec.Raw) -> Message:
    """Return what a command that is none could be: the names of all, or the fields of the one it names."""
    name = ""
    with suppress(msgspec.MsgspecError, UnicodeError):
        name = typed.from_json(content, _Named).command
    for each in COMMANDS:
        if name == each.__struct_config__.tag:
            return Message(
                "{name} has the fields {fields}", name=name, fields=", ".join(each.__struct_encode_fields__)
            )
    names = ", ".join(str(each.__struct_config__.tag) for each in COMMANDS)
    return Message("its field `command` is one of {names}", names=names)
