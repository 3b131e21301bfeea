"""Behaviors of robots as hierarchical state machines: a project of documents, for programs in Python.

`Project` opens documents, which commands such as `AddState` change; docs/how-to/plain-python.md shows it. It
owns the documents of a folder: files, versions, undo, recovery, checks by version, completion, generation,
proofs and simulation, without web and without asyncio. The page, the command `visualhfsm` and other programs
are its faces. The rooms, from above:

- `_commands/`: the command `visualhfsm`, and the projects that `new` makes;
- `testing/`: the plugin for pytest: behaviors in tests, coverage of states and lines, random stimuli;
- `_editor/`: the server of the page, and the page;
- `project/`: one object for all faces, with what is open (`_editing/`) and help with code (`_code_help/`);
- `plugins/`: what plug-ins use of the other rooms;
- `_processes/`: components, robots and the tests of documents as child processes;
- `trials/`: a trial of a behavior in virtual time, judged at its end (decision 36);
- `_monitor/`: running components of the realm: follow, steer, stop, record, replay, and a run as one HTML
  file;
- `_drawing/`: an automaton as a picture, and as a page that stands alone;
- `simulation/`: a document, its component and a robot in virtual time; *Try it*;
- `_document/`: documents as values: commands, each of which makes a new document from an old one;
- `_base/`: errors, languages, child processes, HTML files that stand alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._base.errors import ChangedOutsideError as ChangedOutsideError
    from ._base.errors import EditError as EditError
    from ._base.errors import ForbiddenPathError as ForbiddenPathError
    from ._base.errors import MissingError as MissingError
    from ._base.errors import OldFormatError as OldFormatError
    from ._base.errors import TooManyError as TooManyError
    from ._base.errors import UnsavedError as UnsavedError
    from ._base.errors import VisualHfsmError as VisualHfsmError
    from ._base.errors import WouldOverwriteError as WouldOverwriteError
    from ._document.commands import AnyCommand as AnyCommand
    from ._document.commands import decode_command as decode_command
    from ._document.commands.automata import AddAutomaton as AddAutomaton
    from ._document.commands.automata import AddRoot as AddRoot
    from ._document.commands.automata import ExtractAutomaton as ExtractAutomaton
    from ._document.commands.automata import RepairNumbers as RepairNumbers
    from ._document.commands.automata import SetImport as SetImport
    from ._document.commands.automata import SetPeriod as SetPeriod
    from ._document.commands.base import Command as Command
    from ._document.commands.component import AddEntry as AddEntry
    from ._document.commands.component import ChangeEntry as ChangeEntry
    from ._document.commands.component import RemoveEntry as RemoveEntry
    from ._document.commands.component import ReorderEntry as ReorderEntry
    from ._document.commands.component import SetComponentText as SetComponentText
    from ._document.commands.group import GroupStates as GroupStates
    from ._document.commands.items import AlignStates as AlignStates
    from ._document.commands.items import DeleteItems as DeleteItems
    from ._document.commands.items import DistributeStates as DistributeStates
    from ._document.commands.items import MoveItems as MoveItems
    from ._document.commands.items import PlaceItems as PlaceItems
    from ._document.commands.items import ResetHandles as ResetHandles
    from ._document.commands.notes import AddAnnotation as AddAnnotation
    from ._document.commands.notes import ResizeAnnotation as ResizeAnnotation
    from ._document.commands.notes import SetAnnotationColor as SetAnnotationColor
    from ._document.commands.notes import SetAnnotationText as SetAnnotationText
    from ._document.commands.paste import AddReadyState as AddReadyState
    from ._document.commands.paste import FillAutomaton as FillAutomaton
    from ._document.commands.paste import PasteStates as PasteStates
    from ._document.commands.paste import ReplaceDocument as ReplaceDocument
    from ._document.commands.states import AddState as AddState
    from ._document.commands.states import MarkFinal as MarkFinal
    from ._document.commands.states import MarkInitial as MarkInitial
    from ._document.commands.states import RemoveArgument as RemoveArgument
    from ._document.commands.states import RemoveResult as RemoveResult
    from ._document.commands.states import RenameState as RenameState
    from ._document.commands.states import SetHistory as SetHistory
    from ._document.commands.text import Correction as Correction
    from ._document.commands.text import CorrectName as CorrectName
    from ._document.commands.text import ReplaceText as ReplaceText
    from ._document.commands.text import SetArguments as SetArguments
    from ._document.commands.text import SetText as SetText
    from ._document.commands.text import StraightenText as StraightenText
    from ._document.commands.transitions import AddTransition as AddTransition
    from ._document.commands.transitions import RenameTransition as RenameTransition
    from ._document.commands.transitions import ReorderTransition as ReorderTransition
    from ._document.commands.transitions import RetargetTransition as RetargetTransition
    from ._document.commands.transitions import SetPriority as SetPriority
    from ._document.commands.transitions import SetTransitionType as SetTransitionType
    from ._document.commands.variables import ShareVariable as ShareVariable
    from ._document.commands.variables import TakeOutput as TakeOutput
    from ._document.places import Place as Place
    from ._document.problems import CounterexampleView as CounterexampleView
    from ._document.problems import Findings as Findings
    from ._document.problems import Problem as Problem
    from ._document.problems import Proof as Proof
    from ._document.problems import StepView as StepView
    from ._document.reasons import Reason as Reason
    from .project._code_help.protocol import Completion as Completion
    from .project._code_help.protocol import Completions as Completions
    from .project._code_help.protocol import Explanation as Explanation
    from .project._code_help.protocol import Signature as Signature
    from .project._document import Changed as Changed
    from .project._document import Checked as Checked
    from .project._document import Closed as Closed
    from .project._document import Event as Event
    from .project._document import FileChanged as FileChanged
    from .project._document import OpenDocument as OpenDocument
    from .project._document import Opened as Opened
    from .project._editing.change import Added as Added
    from .project._editing.change import Change as Change
    from .project._editing.change import Choice as Choice
    from .project._editing.change import Resolution as Resolution
    from .project._editing.journal import Abandoned as Abandoned
    from .project._editing.shelf import ReadyState as ReadyState
    from .project._editing.undo_stack import Step as Step
    from .project._folder import Entry as Entry
    from .project._project import Project as Project
    from .project._verdict import Verdict as Verdict
    from .project._version import Version as Version

# Every command begins with this package: it loads nothing that is not used.
__getattr__, __dir__ = import_on_use(__name__)
