"""Behaviors of robots as hierarchical state machines: a project of documents, for programs in Python.

`Project` opens documents, which commands such as `AddState` change; docs/how-to/plain-python.md shows it. The
commands `visualhfsm` and `nao`, and the page of the editor, stand in the packages below.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from .code_help.answers import Completion as Completion
    from .code_help.answers import Completions as Completions
    from .code_help.answers import Explanation as Explanation
    from .code_help.answers import Signature as Signature
    from .editing.commands import AnyCommand as AnyCommand
    from .editing.commands import decode_command as decode_command
    from .editing.commands.automata import AddAutomaton as AddAutomaton
    from .editing.commands.automata import AddRoot as AddRoot
    from .editing.commands.automata import ExtractAutomaton as ExtractAutomaton
    from .editing.commands.automata import RepairNumbers as RepairNumbers
    from .editing.commands.automata import SetAutomatonCode as SetAutomatonCode
    from .editing.commands.automata import SetImport as SetImport
    from .editing.commands.automata import SetPeriod as SetPeriod
    from .editing.commands.base import Command as Command
    from .editing.commands.component import AddEntry as AddEntry
    from .editing.commands.component import ChangeEntry as ChangeEntry
    from .editing.commands.component import RemoveEntry as RemoveEntry
    from .editing.commands.component import ReorderEntry as ReorderEntry
    from .editing.commands.component import SetComponentText as SetComponentText
    from .editing.commands.group import GroupStates as GroupStates
    from .editing.commands.items import AlignStates as AlignStates
    from .editing.commands.items import DeleteItems as DeleteItems
    from .editing.commands.items import DistributeStates as DistributeStates
    from .editing.commands.items import MoveItems as MoveItems
    from .editing.commands.items import PlaceItems as PlaceItems
    from .editing.commands.items import ResetHandles as ResetHandles
    from .editing.commands.paste import FillAutomaton as FillAutomaton
    from .editing.commands.paste import PasteStates as PasteStates
    from .editing.commands.paste import ReplaceDocument as ReplaceDocument
    from .editing.commands.states import AddState as AddState
    from .editing.commands.states import MarkFinal as MarkFinal
    from .editing.commands.states import MarkInitial as MarkInitial
    from .editing.commands.states import RemoveArgument as RemoveArgument
    from .editing.commands.states import RenameState as RenameState
    from .editing.commands.states import SetArgument as SetArgument
    from .editing.commands.states import SetHistory as SetHistory
    from .editing.commands.states import SetStateCode as SetStateCode
    from .editing.commands.text import ReplaceText as ReplaceText
    from .editing.commands.transitions import AddTransition as AddTransition
    from .editing.commands.transitions import RenameTransition as RenameTransition
    from .editing.commands.transitions import ReorderTransition as ReorderTransition
    from .editing.commands.transitions import RetargetTransition as RetargetTransition
    from .editing.commands.transitions import SetPriority as SetPriority
    from .editing.commands.transitions import SetTransitionCode as SetTransitionCode
    from .editing.commands.transitions import SetTransitionType as SetTransitionType
    from .editing.places import Place as Place
    from .editing.problems import Findings as Findings
    from .editing.problems import Problem as Problem
    from .editing.problems import Proof as Proof
    from .errors import ChangedOutsideError as ChangedOutsideError
    from .errors import EditError as EditError
    from .errors import ForbiddenPathError as ForbiddenPathError
    from .errors import MissingError as MissingError
    from .errors import OldFormatError as OldFormatError
    from .errors import TooManyError as TooManyError
    from .errors import UnsavedError as UnsavedError
    from .errors import VisualHfsmError as VisualHfsmError
    from .errors import WouldOverwriteError as WouldOverwriteError
    from .project.document import OpenDocument as OpenDocument
    from .project.events import Changed as Changed
    from .project.events import Checked as Checked
    from .project.events import Closed as Closed
    from .project.events import Event as Event
    from .project.events import FileChanged as FileChanged
    from .project.events import Opened as Opened
    from .project.project import Entry as Entry
    from .project.project import Project as Project
    from .project.version import Version as Version
    from .sessions.session import Change as Change
    from .sessions.session import Choice as Choice
    from .sessions.session import Resolution as Resolution

_MODULES: Final = {
    "AddAutomaton": "editing.commands.automata",
    "AddEntry": "editing.commands.component",
    "AddRoot": "editing.commands.automata",
    "AddState": "editing.commands.states",
    "AddTransition": "editing.commands.transitions",
    "AlignStates": "editing.commands.items",
    "AnyCommand": "editing.commands",
    "Change": "sessions.session",
    "ChangeEntry": "editing.commands.component",
    "Changed": "project.events",
    "ChangedOutsideError": "errors",
    "Checked": "project.events",
    "Choice": "sessions.session",
    "Closed": "project.events",
    "Command": "editing.commands.base",
    "Completion": "code_help.answers",
    "Completions": "code_help.answers",
    "DeleteItems": "editing.commands.items",
    "DistributeStates": "editing.commands.items",
    "EditError": "errors",
    "Entry": "project.project",
    "Event": "project.events",
    "Explanation": "code_help.answers",
    "ExtractAutomaton": "editing.commands.automata",
    "FileChanged": "project.events",
    "FillAutomaton": "editing.commands.paste",
    "Findings": "editing.problems",
    "ForbiddenPathError": "errors",
    "GroupStates": "editing.commands.group",
    "MarkFinal": "editing.commands.states",
    "MarkInitial": "editing.commands.states",
    "MissingError": "errors",
    "MoveItems": "editing.commands.items",
    "OldFormatError": "errors",
    "OpenDocument": "project.document",
    "Opened": "project.events",
    "PasteStates": "editing.commands.paste",
    "Place": "editing.places",
    "PlaceItems": "editing.commands.items",
    "Problem": "editing.problems",
    "Project": "project.project",
    "Proof": "editing.problems",
    "RemoveArgument": "editing.commands.states",
    "RemoveEntry": "editing.commands.component",
    "RenameState": "editing.commands.states",
    "RenameTransition": "editing.commands.transitions",
    "ReorderEntry": "editing.commands.component",
    "ReorderTransition": "editing.commands.transitions",
    "RepairNumbers": "editing.commands.automata",
    "ReplaceDocument": "editing.commands.paste",
    "ReplaceText": "editing.commands.text",
    "ResetHandles": "editing.commands.items",
    "Resolution": "sessions.session",
    "RetargetTransition": "editing.commands.transitions",
    "SetArgument": "editing.commands.states",
    "SetAutomatonCode": "editing.commands.automata",
    "SetComponentText": "editing.commands.component",
    "SetHistory": "editing.commands.states",
    "SetImport": "editing.commands.automata",
    "SetPeriod": "editing.commands.automata",
    "SetPriority": "editing.commands.transitions",
    "SetStateCode": "editing.commands.states",
    "SetTransitionCode": "editing.commands.transitions",
    "SetTransitionType": "editing.commands.transitions",
    "Signature": "code_help.answers",
    "TooManyError": "errors",
    "UnsavedError": "errors",
    "Version": "project.version",
    "VisualHfsmError": "errors",
    "WouldOverwriteError": "errors",
    "decode_command": "editing.commands",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    # Every command begins with this package: it loads nothing that is not used.
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    """Return the names that completion in a shell or a notebook offers."""
    return sorted({*globals(), *_MODULES})
