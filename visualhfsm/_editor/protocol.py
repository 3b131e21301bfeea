"""The messages on the websocket, as types: invalid messages are refused before anything is done.

The page sends requests, `{"id": 1, "op": "undo", "tab": 2}`, and gets one answer for each, `{"re": 1, "ok":
3}` or `{"re": 1, "error": "text", "kind": "kind"}`. Changes are sent as pushes, `{"push": "kind"}`; those of
the parts are in `visualhfsm._monitor.messages`. Fields are in camelCase. docs/reference/protocol.md
explains all of them with examples.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Union

import msgspec

from codegen.diagnostics import Severity
from codegen.messages import NO_MESSAGE, Message
from interfaces.hfsm import Breakpoint, Explanation, ReloadReport
from interfaces.nao import Vector3
from visualhfsm._base.errors import ErrorKind
from visualhfsm._base.languages import ENGLISH
from visualhfsm._document.commands import AnyCommand
from visualhfsm._document.commands.transitions import TransitionType
from visualhfsm._document.places import Place
from visualhfsm._document.problems import Problem
from visualhfsm._document.views import AutomatonView, of_page
from visualhfsm._monitor.followers import Followed
from visualhfsm._monitor.messages import PresentComponent, Push
from visualhfsm._monitor.realm.moments import Moment as Snapped
from visualhfsm._monitor.realm.robot import RobotFacts
from visualhfsm._monitor.stopping import StopReport
from visualhfsm.project._code_help.protocol import InterfaceDescription
from visualhfsm.project._editing.shelf import ReadyState
from zenoh_ice.data import typed

from . import answers as a
from .own_robots import Described, OwnRobot
from .views import Request as BaseRequest
from .views import RequestId, TabEdit, TabId, TabRequest, find_views

# ------------------------------------------------------------------------------------------ requests

ElementId = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Position = Annotated[int, msgspec.Meta(ge=0, le=10_000_000)]
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
Revision = Annotated[int, msgspec.Meta(ge=0, le=2**53 - 1)]
Time = Annotated[float, msgspec.Meta(ge=-1e12, le=1e12)]
Name = Annotated[str, msgspec.Meta(max_length=1000)]
Path = Annotated[str, msgspec.Meta(max_length=4096)]
Code = Annotated[str, msgspec.Meta(max_length=1_000_000)]
Ids = Annotated[list[ElementId], msgspec.Meta(max_length=100_000)]


class Hello(BaseRequest):
    """Ask for the whole state, in a language such as `es`; the first request of a window."""

    answer = a.Greeting
    language: Name = ENGLISH


class Open(BaseRequest):
    """Open a document in a tab."""

    answer = a.Opened
    path: Path


class New(BaseRequest):
    """Create a document from a template."""

    answer = a.Opened
    template: Name = "empty"


class OpenText(BaseRequest):
    """Open a document whose text the page has, such as a dropped file; it has no path yet."""

    answer = a.Opened
    name: Name
    text: Annotated[str, msgspec.Meta(max_length=4_000_000)]


class Close(TabRequest):
    """Close a tab; one with unsaved changes only with `discard`."""

    discard: bool = False


class Save(TabRequest):
    """Save to the file that the document came from, with `overwrite` also over an older dialect."""

    answer = a.Written
    overwrite: bool = False


class SaveAs(TabRequest):
    """Save to another file, which is the document's from then on."""

    answer = a.SavedAs
    path: Path
    overwrite: bool = False


class Recover(BaseRequest):
    """Open a document that was still open when its editor ended: one of `recoverable`."""

    answer = a.Opened
    journal: Name


class Discard(BaseRequest):
    """Discard the changes of such a document."""

    journal: Name


class ListFiles(BaseRequest):
    """List a directory, the root for an empty one; with `below` also the files in directories below it."""

    answer = a.Listing
    directory: Path = ""
    below: bool = False


class _ChosenStates(TabEdit):
    automaton: ElementId
    states: Ids
    annotations: Ids = []


class Do(TabEdit):
    """Apply a command of `visualhfsm._document.commands` to the document.

    `base` is the text in which the command's text was typed: changes of others to it are kept.
    """

    command: AnyCommand
    base: Code | None = None


class Undo(TabEdit):
    """Undo the last step; if it is another window's, what this one has typed at a place."""

    answer = a.Undone
    place: Place | None = None


class Redo(TabEdit):
    """Redo the step that was undone last, perhaps what this window had typed at a place."""

    answer = a.Undone
    place: Place | None = None


class GoTo(TabEdit):
    """Undo or redo up to a step of the document; `revision` is that of the step."""

    answer = a.Undone
    revision: Revision


class Copy(_ChosenStates):
    """Put states, their sub-trees, the transitions among them and annotations into the window's clipboard."""

    answer = a.Copied


class Cut(_ChosenStates):
    """Copy, and delete."""

    answer = a.CutOut


class Paste(TabEdit):
    """Paste into an automaton, with the upper left corner at `x`, `y` if given.

    That is what this window has copied or, as long as it has copied nothing, what any window has copied last.
    """

    automaton: ElementId
    x: Coordinate | None = None
    y: Coordinate | None = None


class Duplicate(_ChosenStates):
    """Copy and paste in one step, beside the clipboard."""


class AddReady(TabEdit):
    """Draw a state of the shelf into an automaton, with a transition to it from `origin` if given.

    It is called `name`, by default as it is on the shelf.
    """

    state: Name
    automaton: ElementId
    x: Coordinate
    y: Coordinate
    origin: ElementId | None = None
    trigger: TransitionType = "condition"
    name: Name = ""


class PutOnShelf(TabEdit):
    """Write states with all below them as a ready state of the project."""

    answer = a.Written
    automaton: ElementId
    states: Ids
    title: Name
    category: Name = ""
    words: Name = ""
    description: Code = ""


class Search(BaseRequest):
    """Search names and code, in one document or in all open ones, for a text or a whole word."""

    answer = list[a.Hits]
    text: Name
    whole: bool = False
    tab: TabId | None = None


class Resolve(TabRequest):
    """Decide about a document whose file another program changed: keep it, read the file, or merge both."""

    answer = a.Resolved
    choice: Literal["mine", "theirs", "merge"]


class Diff(TabRequest):
    """Compare a document with another version: a file, or `saved`."""

    answer = a.Comparison
    against: Path


class Imported(TabRequest):
    """Ask for the content of the automata that a document imports from other files."""

    answer = list[AutomatonView]


class Extract(TabEdit):
    """Move an automaton with all below it to a new file, and import it from there."""

    automaton: ElementId
    path: Path


class Inline(TabEdit):
    """Copy the content of an imported automaton into the document."""

    automaton: ElementId


class Locate(TabRequest):
    """Ask which line of which piece of code a line of a log, or of an error's report, refers to.

    A report also has its `automaton` and `state`, which distinguish pieces that share a line.
    """

    answer = a.Located | None
    text: Name
    automaton: ElementId = 0
    state: ElementId = 0


class CodeHelp(TabRequest):
    """Ask about a piece of code, as it is being typed; `line` counts from 1, `column` from 0.

    `complete`: completions; `define`: where the name at the position is defined; `explain`: what it stands
    for; `signature`: the call around it.
    """

    answer = a.CodeAnswer
    wanted: Literal["complete", "define", "explain", "signature"]
    place: Place
    code: Code
    line: Position = 1
    column: Position = 0


class Interfaces(BaseRequest):
    """Ask for the interfaces that documents may declare, with their operations."""

    answer = list[InterfaceDescription]


class Generate(TabRequest):
    """Generate the component's Python."""

    answer = a.Written


class Start(TabRequest):
    """Generate and start the component as a process; `arguments` are those of its command line.

    With `record`, the run is recorded into a new file below the root, which the answer names. A `dry_run` has
    a fake robot in its own process, whatever robot is there; `body` is the body of that. A document that
    uses a robot runs only `beside` those components of others that the user has accepted, by name.
    """

    answer = a.StartedRun
    arguments: Annotated[list[Name], msgspec.Meta(max_length=100)] = []
    record: bool = False
    dry_run: bool = False
    body: Name = ""
    beside: Annotated[list[Name], msgspec.Meta(max_length=1000)] = []


class Stop(TabRequest):
    """Stop the process of a component that was started here."""


class LookAtTests(TabRequest):
    """Ask for the tests of a document: the push `tests` names them."""


class StartTests(TabRequest):
    """Run the tests of a document as it was saved, or some by name; the push `tests` has the results."""

    names: Annotated[list[Name], msgspec.Meta(max_length=1000)] = []


class Judge(TabRequest):
    """Ask whether a document, as it was saved, is ready to drive a robot, or what to fix first.

    The robot has this `body`.
    """

    body: Name = ""
    answer = a.Judged


class StopTests(TabRequest):
    """Stop the tests of a document."""


class OutputShown(BaseRequest):
    """Say that the last push `output` was shown, so that the next one may come."""


class Simulate(BaseRequest):
    """Start a simulated robot, or start it again with other options; what was started here before is ended.

    The answer comes before the robot is present: the push `robot` reports the progress.
    """

    world: Name = "balls"
    speed: Name = "1"
    balls: bool = False
    body: Name = ""


class GuessRobot(BaseRequest):
    """Take a model of a robot, a URDF, xacro or MJCF below the root, for what it seems to be.

    The answer is an `OwnRobot`, whose text is to be corrected. The path may also be that of a body of the
    project, whose text is answered as it is.
    """

    answer = OwnRobot
    path: Path


class CheckRobot(BaseRequest):
    """Read the text of a robot's file, as that of `name` in the folder `robots`: an `OwnRobot`."""

    answer = OwnRobot
    name: Name
    text: Code


class SaveRobot(BaseRequest):
    """Write the file of a robot in the folder `robots`, with `overwrite` also over another one.

    The answer has its `path`, and all `bodies` that can be simulated then.
    """

    answer = a.SavedRobot
    name: Name
    text: Code
    overwrite: bool = False


class ConnectRobot(BaseRequest):
    """Connect to a real robot at an address such as `nao.local`; `start` is its first action.

    It is refused while components run, because they would drive the robot at once.
    """

    address: Name
    start: Literal["leave", "stiffen", "stand"] = "leave"


class MoveBalls(BaseRequest):
    """Move the balls of the simulation along their routes, or leave them where they are."""

    moving: bool


class EndRobot(BaseRequest):
    """End the simulation, or the connection to the real robot, that was started here."""


class Follow(BaseRequest):
    """Follow a running component."""

    answer = Followed
    component: Name


class Unfollow(BaseRequest):
    """Stop following it; it keeps running."""

    component: Name


class Steering(BaseRequest):
    """An operation of the monitor of a component that is followed, in `interfaces/hfsm.idl`."""

    component: Name


class Pause(Steering):
    """Let running cycles end, and start none."""


class Resume(Steering):
    """Go on after a pause."""


class StepOnce(Steering, tag="step"):
    """Run one cycle of one automaton, or of all with 0, while paused."""

    automaton: ElementId


class SetBreakpoints(Steering):
    """Replace all breakpoints."""

    breakpoints: Annotated[list[Breakpoint], msgspec.Meta(max_length=100_000)]


class ForceTransition(Steering):
    """Fire a transition in the next cycle."""

    automaton: ElementId
    transition: ElementId


class SetVariable(Steering):
    """Set a variable of an automaton, or with 0 a parameter, to a value in JSON."""

    automaton: ElementId
    name: Name
    value: Code


class SendEvent(Steering):
    """Send an event, with data in JSON or blank."""

    name: Name
    data: Code


class SetSpeed(Steering):
    """Let time pass faster or slower in a dry run: seconds in one of wall time."""

    speed: float


class Explain(Steering):
    """Ask why each transition out of the current state has not fired: an `Explanation`."""

    answer = Explanation
    automaton: ElementId


class ExplainMoment(BaseRequest):
    """Ask the same about a component time in s of a component, or a recording; None if it is not known."""

    answer = Explanation | None
    component: Name
    automaton: ElementId
    time: Time


class Reload(Steering):
    """Load the component's file again, and go on in it: a `ReloadReport`."""

    answer = ReloadReport


class StopPresent(BaseRequest):
    """Stop a component that is followed, also one that was started elsewhere."""

    component: Name


class Moment(BaseRequest):
    """Ask for the snapshot of a component, or a recording, at a component time in s."""

    answer = Snapped | None
    component: Name
    time: Time


class Series(BaseRequest):
    """Ask for numbers over time, by their names: at most `points`, so that no peak is lost."""

    answer = a.Numbers
    component: Name
    names: Annotated[list[Name], msgspec.Meta(max_length=32)]
    start: Time = 0.0
    end: Time = 1e12
    points: Annotated[int, msgspec.Meta(ge=2, le=10_000)] = 1000


class Picture(BaseRequest):
    """Ask for the picture of a camera at a wall time, as JPEG; null if that was not kept."""

    answer = bytes | None
    component: Name
    camera: Name
    at: Time


class EmergencyStop(BaseRequest):
    """Stop the robot and all components of the realm: a `StopReport`."""

    answer = StopReport


class ResetEmergencyStop(BaseRequest):
    """Let the robot accept commands again."""


class StandRobot(BaseRequest):
    """Put a simulated robot on its feet where it is."""


class SceneRequest(BaseRequest):
    """An operation of a simulation's world, in `interfaces/nao.idl`."""


class PlaceObject(SceneRequest):
    """Put something somewhere, at rest."""

    name: Name
    position: Vector3


class PushRobot(SceneRequest):
    """Push the torso with a force in N; refused as a command of the robot is."""

    force: Vector3
    seconds: float


class SayToRobot(SceneRequest):
    """Say something to the robot; the answer is what programs recognized in it."""

    answer = str
    text: Name


class FaultRequest(BaseRequest):
    """An operation of a robot whose parts can be made to fail, in `interfaces/faults.idl`."""


class Inject(FaultRequest):
    """Let a part fail until it is healed, by its usual amount if none is given."""

    part: Name
    kind: Name
    amount: float | None = None


class Heal(FaultRequest):
    """End all failures of a part, and of every part where none is named."""

    part: Name | None = None


class Facts(BaseRequest):
    """Ask for the constants of the robot: `RobotFacts`."""

    answer = RobotFacts


class Body(BaseRequest):
    """Ask for a robot as it is drawn, by the hash of its description; null if it is not known any more."""

    answer = Described | None
    hash: Annotated[str, msgspec.Meta(max_length=64)]


class Fixes(TabRequest):
    """Ask for what fixes the problems of a document."""

    answer = a.Fixes


class Failures(BaseRequest):
    """Ask how each part of a robot with this `body` can fail."""

    body: Name = ""
    answer = dict[str, list[str]]


class Identities(BaseRequest):
    """Ask for the servants of the realm, each with the type ids of its interfaces."""

    answer = dict[str, list[str]]


class RosGraph(BaseRequest):
    """Ask for the graph of ROS, which takes a second."""

    answer = dict[str, Any]


class Share(BaseRequest):
    """Ask for the read-only address of the page, relative to it; or withdraw it, so that all viewers go."""

    answer = a.Address
    shared: bool = True


class Export(TabRequest):
    """Ask for the document as its file would hold it, or as one `page` of HTML, to download it."""

    answer = a.Download
    page: bool = False


class ExportRun(BaseRequest):
    """Ask for the run of a followed component, or of an open recording, as one page of HTML, to download it.

    `tab` is the one that shows its document, 0 without one.
    """

    answer = a.Download
    component: Name
    tab: ElementId = 0


class Record(BaseRequest):
    """Record a followed component into a new file below the root, whose path is the answer; or end that.

    `pictures` is their number per second and camera, None to end. The push `workspace` reports recordings.
    """

    answer = a.Recorded | None
    component: Name
    pictures: Annotated[int, msgspec.Meta(ge=0, le=30)] | None = None


class Recording(BaseRequest):
    """Open the recording of a run."""

    answer = a.ShownRecording
    path: Path


REQUESTS: Final = [
    found
    for found in [*globals().values()]
    if isinstance(found, type) and issubclass(found, BaseRequest) and not found.__name__.startswith("_")
    if found not in (BaseRequest, FaultRequest, SceneRequest, Steering, TabEdit, TabRequest)
]
"""The requests of the page itself."""
VIEWS: Final = find_views(REQUESTS)
"""The views of plug-ins, by name."""

if TYPE_CHECKING:
    Request = BaseRequest
else:
    Request = Union[(*REQUESTS, *(kind for view in VIEWS.values() for kind in view.requests))]
    """Any request."""

decode_request: Final[Callable[[bytes | str], Request]] = typed.json_decoder(Request)
"""Return the request in a message; raises msgspec.DecodeError, and RecursionError if it is too deep."""


class _OnlyId(msgspec.Struct):
    id: RequestId


_decode_only_id: Final = typed.json_decoder(_OnlyId)


def request_id(text: bytes | str) -> int | None:
    """Return the id of a message that may be invalid; None without one."""
    try:
        return _decode_only_id(text).id
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return None


# ------------------------------------------------------------------------------------------ answers


class Answer(msgspec.Struct, kw_only=True):
    """The result of an operation."""

    re: int
    ok: object = None


class ErrorAnswer(msgspec.Struct, kw_only=True):
    """Why an operation was not done; `re` is missing when the request's own id could not be read."""

    re: int | None
    error: Message
    kind: ErrorKind


# ------------------------------------------------------------------------------------------ pushes


class TabState(msgspec.Struct, kw_only=True, rename="camel"):
    """An open document.

    `path` is relative to the root where it can be, and empty as long as there is no file. `component` is the
    name of its running component, or of the one that it would become. `outside` says what another
    program did to the file: nothing, `changed` or `deleted`. `changed` says that the document differs from
    that of the running component. `recording` is the file that contains the document, which is read-only.
    `views` are the plug-ins' that have something to show of it.
    """

    tab: int
    title: str
    path: str
    component: str
    dirty: bool
    outside: str
    changed: bool = False
    recording: str = ""
    views: list[str] = []


class Recoverable(msgspec.Struct, kw_only=True, rename="camel"):
    """A document with unsaved changes that was open when its editor ended; `changed_at` in s since 1970."""

    journal: str
    name: str
    path: str
    changed_at: float


class WorkspacePush(Push, tag="workspace"):
    """The open documents, those that can be recovered, and the components of the realm."""

    tabs: list[TabState]
    recoverable: list[Recoverable]
    present: list[PresentComponent]


class Shelf(Push):
    """What can be drawn as ready states: ours, then those of the project."""

    states: list[ReadyState]


class Closed(Push):
    """A tab is closed."""

    tab: int


class UndoStep(msgspec.Struct, frozen=True):
    """A step that can be undone or redone, and the revision of the document to which that leads."""

    name: str
    revision: int


class DocumentPush(Push, tag="document"):
    """A document, whole in `full` each time that it changes; the steps come latest first."""

    tab: int
    revision: int
    undo: tuple[UndoStep, ...]
    redo: tuple[UndoStep, ...]
    dirty: bool
    full: Annotated[Mapping[str, Any], of_page("Fields & {automata: Automaton[]}")]


class Problems(Push):
    """The problems of a revision of a document; of very many not all `items`, but the `counts` of all.

    `imports` counts the changes of imported files. Until they are `complete`, the verdicts of the model
    checker, and what is said of events, are those of an earlier revision.
    """

    tab: int
    revision: int
    items: Sequence[Problem]
    counts: Mapping[Severity, int] = {}
    imports: int = 0
    complete: bool = True


class Outside(Push):
    """The change of the file of a document by another program.

    `reloaded`: the document had no unsaved changes, and is now as the file, which can be undone. `changed`
    and `deleted`: the user has to choose. `same`: the file is as it was. `message`: why it cannot be read, or
    who has changed what, if that program has a name.
    """

    tab: int
    state: Literal["reloaded", "changed", "deleted", "same"]
    message: Message = NO_MESSAGE
