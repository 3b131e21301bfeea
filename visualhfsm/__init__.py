"""Behaviors of robots as hierarchical state machines: a project of documents, for programs in Python.

`Project` opens documents, which commands such as `AddState` change; docs/how-to/plain-python.md shows it. The
commands `visualhfsm` and `nao`, and the page of the editor, stand in the packages below.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._code_help.answers import Completion as Completion
    from ._code_help.answers import Completions as Completions
    from ._code_help.answers import Explanation as Explanation
    from ._code_help.answers import Signature as Signature
    from ._editing.commands import AnyCommand as AnyCommand
    from ._editing.commands import decode_command as decode_command
    from ._editing.commands.automata import AddAutomaton as AddAutomaton
    from ._editing.commands.automata import AddRoot as AddRoot
    from ._editing.commands.automata import ExtractAutomaton as ExtractAutomaton
    from ._editing.commands.automata import RepairNumbers as RepairNumbers
    from ._editing.commands.automata import SetAutomatonCode as SetAutomatonCode
    from ._editing.commands.automata import SetImport as SetImport
    from ._editing.commands.automata import SetPeriod as SetPeriod
    from ._editing.commands.base import Command as Command
    from ._editing.commands.component import AddEntry as AddEntry
    from ._editing.commands.component import ChangeEntry as ChangeEntry
    from ._editing.commands.component import RemoveEntry as RemoveEntry
    from ._editing.commands.component import ReorderEntry as ReorderEntry
    from ._editing.commands.component import SetComponentText as SetComponentText
    from ._editing.commands.corrections import Correction as Correction
    from ._editing.commands.corrections import CorrectName as CorrectName
    from ._editing.commands.group import GroupStates as GroupStates
    from ._editing.commands.items import AlignStates as AlignStates
    from ._editing.commands.items import DeleteItems as DeleteItems
    from ._editing.commands.items import DistributeStates as DistributeStates
    from ._editing.commands.items import MoveItems as MoveItems
    from ._editing.commands.items import PlaceItems as PlaceItems
    from ._editing.commands.items import ResetHandles as ResetHandles
    from ._editing.commands.notes import AddAnnotation as AddAnnotation
    from ._editing.commands.notes import ResizeAnnotation as ResizeAnnotation
    from ._editing.commands.notes import SetAnnotationColor as SetAnnotationColor
    from ._editing.commands.notes import SetAnnotationText as SetAnnotationText
    from ._editing.commands.paste import AddReadyState as AddReadyState
    from ._editing.commands.paste import FillAutomaton as FillAutomaton
    from ._editing.commands.paste import PasteStates as PasteStates
    from ._editing.commands.paste import ReplaceDocument as ReplaceDocument
    from ._editing.commands.states import AddState as AddState
    from ._editing.commands.states import MarkFinal as MarkFinal
    from ._editing.commands.states import MarkInitial as MarkInitial
    from ._editing.commands.states import RemoveArgument as RemoveArgument
    from ._editing.commands.states import RemoveResult as RemoveResult
    from ._editing.commands.states import RenameState as RenameState
    from ._editing.commands.states import SetArgument as SetArgument
    from ._editing.commands.states import SetHistory as SetHistory
    from ._editing.commands.states import SetResult as SetResult
    from ._editing.commands.states import SetStateCode as SetStateCode
    from ._editing.commands.text import ReplaceText as ReplaceText
    from ._editing.commands.transitions import AddTransition as AddTransition
    from ._editing.commands.transitions import RenameTransition as RenameTransition
    from ._editing.commands.transitions import ReorderTransition as ReorderTransition
    from ._editing.commands.transitions import RetargetTransition as RetargetTransition
    from ._editing.commands.transitions import SetPriority as SetPriority
    from ._editing.commands.transitions import SetTransitionCode as SetTransitionCode
    from ._editing.commands.transitions import SetTransitionType as SetTransitionType
    from ._editing.commands.variables import HandUpVariable as HandUpVariable
    from ._editing.commands.variables import PassVariable as PassVariable
    from ._editing.commands.variables import ShareVariable as ShareVariable
    from ._editing.commands.variables import TakeOutput as TakeOutput
    from ._editing.places import Place as Place
    from ._editing.problems import CounterexampleView as CounterexampleView
    from ._editing.problems import Findings as Findings
    from ._editing.problems import Problem as Problem
    from ._editing.problems import Proof as Proof
    from ._editing.problems import StepView as StepView
    from ._errors import ChangedOutsideError as ChangedOutsideError
    from ._errors import EditError as EditError
    from ._errors import ForbiddenPathError as ForbiddenPathError
    from ._errors import MissingError as MissingError
    from ._errors import OldFormatError as OldFormatError
    from ._errors import TooManyError as TooManyError
    from ._errors import UnsavedError as UnsavedError
    from ._errors import VisualHfsmError as VisualHfsmError
    from ._errors import WouldOverwriteError as WouldOverwriteError
    from ._sessions.journal import Abandoned as Abandoned
    from ._sessions.session import Added as Added
    from ._sessions.session import Change as Change
    from ._sessions.session import Choice as Choice
    from ._sessions.session import Resolution as Resolution
    from ._sessions.session import Step as Step
    from ._sessions.shelf import ReadyState as ReadyState
    from .project._document import OpenDocument as OpenDocument
    from .project._events import Changed as Changed
    from .project._events import Checked as Checked
    from .project._events import Closed as Closed
    from .project._events import Event as Event
    from .project._events import FileChanged as FileChanged
    from .project._events import Opened as Opened
    from .project._project import Entry as Entry
    from .project._project import Project as Project
    from .project._version import Version as Version

_MODULES: Final = {
    "Abandoned": "._sessions.journal",
    "AddAnnotation": "._editing.commands.notes",
    "AddAutomaton": "._editing.commands.automata",
    "AddEntry": "._editing.commands.component",
    "AddReadyState": "._editing.commands.paste",
    "AddRoot": "._editing.commands.automata",
    "AddState": "._editing.commands.states",
    "AddTransition": "._editing.commands.transitions",
    "Added": "._sessions.session",
    "AlignStates": "._editing.commands.items",
    "AnyCommand": "._editing.commands",
    "Change": "._sessions.session",
    "ChangeEntry": "._editing.commands.component",
    "Changed": ".project._events",
    "ChangedOutsideError": "._errors",
    "Checked": ".project._events",
    "Choice": "._sessions.session",
    "Closed": ".project._events",
    "Command": "._editing.commands.base",
    "Completion": "._code_help.answers",
    "Completions": "._code_help.answers",
    "CorrectName": "._editing.commands.corrections",
    "Correction": "._editing.commands.corrections",
    "CounterexampleView": "._editing.problems",
    "DeleteItems": "._editing.commands.items",
    "DistributeStates": "._editing.commands.items",
    "EditError": "._errors",
    "Entry": ".project._project",
    "Event": ".project._events",
    "Explanation": "._code_help.answers",
    "ExtractAutomaton": "._editing.commands.automata",
    "FileChanged": ".project._events",
    "FillAutomaton": "._editing.commands.paste",
    "Findings": "._editing.problems",
    "ForbiddenPathError": "._errors",
    "GroupStates": "._editing.commands.group",
    "HandUpVariable": "._editing.commands.variables",
    "MarkFinal": "._editing.commands.states",
    "MarkInitial": "._editing.commands.states",
    "MissingError": "._errors",
    "MoveItems": "._editing.commands.items",
    "OldFormatError": "._errors",
    "OpenDocument": ".project._document",
    "Opened": ".project._events",
    "PassVariable": "._editing.commands.variables",
    "PasteStates": "._editing.commands.paste",
    "Place": "._editing.places",
    "PlaceItems": "._editing.commands.items",
    "Problem": "._editing.problems",
    "Project": ".project._project",
    "Proof": "._editing.problems",
    "ReadyState": "._sessions.shelf",
    "RemoveArgument": "._editing.commands.states",
    "RemoveEntry": "._editing.commands.component",
    "RemoveResult": "._editing.commands.states",
    "RenameState": "._editing.commands.states",
    "RenameTransition": "._editing.commands.transitions",
    "ReorderEntry": "._editing.commands.component",
    "ReorderTransition": "._editing.commands.transitions",
    "RepairNumbers": "._editing.commands.automata",
    "ReplaceDocument": "._editing.commands.paste",
    "ReplaceText": "._editing.commands.text",
    "ResetHandles": "._editing.commands.items",
    "ResizeAnnotation": "._editing.commands.notes",
    "Resolution": "._sessions.session",
    "RetargetTransition": "._editing.commands.transitions",
    "SetAnnotationColor": "._editing.commands.notes",
    "SetAnnotationText": "._editing.commands.notes",
    "SetArgument": "._editing.commands.states",
    "SetAutomatonCode": "._editing.commands.automata",
    "SetComponentText": "._editing.commands.component",
    "SetHistory": "._editing.commands.states",
    "SetImport": "._editing.commands.automata",
    "SetPeriod": "._editing.commands.automata",
    "SetPriority": "._editing.commands.transitions",
    "SetResult": "._editing.commands.states",
    "SetStateCode": "._editing.commands.states",
    "SetTransitionCode": "._editing.commands.transitions",
    "SetTransitionType": "._editing.commands.transitions",
    "ShareVariable": "._editing.commands.variables",
    "Signature": "._code_help.answers",
    "Step": "._sessions.session",
    "StepView": "._editing.problems",
    "TakeOutput": "._editing.commands.variables",
    "TooManyError": "._errors",
    "UnsavedError": "._errors",
    "Version": ".project._version",
    "VisualHfsmError": "._errors",
    "WouldOverwriteError": "._errors",
    "decode_command": "._editing.commands",
}


# Every command begins with this package: it loads nothing that is not used.
__getattr__ = import_on_use(__name__, _MODULES)


def __dir__() -> list[str]:
    """Return the names that completion in a shell or a notebook offers."""
    return sorted({*globals(), *_MODULES})
