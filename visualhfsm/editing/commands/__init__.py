"""Every change of a document as a value: it comes as JSON, has a name for the undo list, and can be replayed.

`decode_command` makes one of JSON, `encode_command` the other way around.
"""

from __future__ import annotations

from typing import Final, Union

import msgspec

from ..errors import EditError
from .automata import (
    AddAutomaton,
    AddRoot,
    DeleteAutomaton,
    ExtractAutomaton,
    ReorderAutomaton,
    RepairNumbers,
    SetAutomatonCode,
    SetImport,
    SetPeriod,
)
from .base import Command
from .component import (
    AddEvent,
    AddInterface,
    AddLibrary,
    AddParameter,
    AddProperty,
    ChangeEvent,
    ChangeInterface,
    ChangeLibrary,
    ChangeParameter,
    ChangeProperty,
    SetComponentText,
)
from .entries import RemoveEntry, ReorderEntry
from .group import GroupStates
from .items import (
    AlignStates,
    DeleteItems,
    DistributeStates,
    MoveItems,
    PlaceItems,
    Placement,
    ResetHandles,
)
from .paste import FillAutomaton, PasteStates, ReplaceDocument
from .states import (
    AddState,
    MarkFinal,
    MarkInitial,
    RemoveArgument,
    RenameState,
    SetArgument,
    SetHistory,
    SetStateCode,
)
from .transitions import (
    AddTransition,
    RenameTransition,
    ReorderTransition,
    RetargetTransition,
    SetPriority,
    SetTransitionCode,
    SetTransitionType,
)

__all__ = ["COMMANDS", "Command", "Placement", "decode_command", "encode_command"]

COMMANDS: Final[tuple[type[Command], ...]] = (
    AddAutomaton,
    AddEvent,
    AddInterface,
    AddLibrary,
    AddParameter,
    AddProperty,
    AddRoot,
    AddState,
    AddTransition,
    AlignStates,
    ChangeEvent,
    ChangeInterface,
    ChangeLibrary,
    ChangeParameter,
    ChangeProperty,
    DeleteAutomaton,
    DeleteItems,
    DistributeStates,
    ExtractAutomaton,
    FillAutomaton,
    GroupStates,
    MarkFinal,
    MarkInitial,
    MoveItems,
    PasteStates,
    PlaceItems,
    RemoveArgument,
    RemoveEntry,
    RenameState,
    RenameTransition,
    ReorderAutomaton,
    ReorderEntry,
    ReorderTransition,
    RepairNumbers,
    ReplaceDocument,
    ResetHandles,
    RetargetTransition,
    SetArgument,
    SetAutomatonCode,
    SetComponentText,
    SetHistory,
    SetImport,
    SetPeriod,
    SetPriority,
    SetStateCode,
    SetTransitionCode,
    SetTransitionType,
)
"""All commands."""

_DECODER: Final[msgspec.json.Decoder[Command]] = msgspec.json.Decoder(Union[COMMANDS])  # noqa: UP007 - made of a tuple


def decode_command(content: bytes | str | msgspec.Raw) -> Command:
    """Return the command in JSON. Raises EditError when it is none."""
    try:
        return _DECODER.decode(content)
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise EditError("Cannot understand the command", str(error)) from error


def encode_command(command: Command) -> bytes:
    """Return a command as JSON."""
    return msgspec.json.encode(command)
