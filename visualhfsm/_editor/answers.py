"""What requests are answered with, as types of JSON: each request of `protocol.py` names its answer.

The types of the page and the tables of docs/reference/protocol.md are made of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NotRequired, TypedDict

from codegen.messages import Message
from visualhfsm._document.diff import Difference
from visualhfsm._document.fixes import Fix
from visualhfsm._document.places import Hit, Place
from visualhfsm._document.views import AutomatonView
from visualhfsm._monitor.followers import Followed, OpenedRecording
from visualhfsm._processes.bodies import KnownBody
from visualhfsm._processes.robots import WorldFacts
from visualhfsm.project._code_help.definition import Definition
from visualhfsm.project._code_help.protocol import Completions, Explanation, Signature
from visualhfsm.project._editing.change import Added

CodeAnswer = Completions | Explanation | Signature | Definition | None
"""What is known of a piece of code: it depends on what is wanted."""


class Template(TypedDict):
    """A document with which one may begin."""

    name: str
    description: str


class Greeting(TypedDict):
    """The state of the editor; `instance` is another one after a restart, `key` lets the page in then."""

    root: str
    templates: list[Template]
    worlds: Sequence[WorldFacts]
    bodies: Sequence[KnownBody]
    demo: bool
    recording: str
    viewer: bool
    instance: str
    key: str


class Done(TypedDict):
    """A step; `conflict` if somebody else had typed over the same words."""

    name: Message
    revision: int
    added: list[Added]
    conflict: NotRequired[bool]


class Undone(Done):
    """A step that was undone or redone, and where.

    It is `others` if another window had made it, and `own` if only what this one had typed changed.
    """

    place: Place | None
    others: bool
    own: bool


class FixedProblem(TypedDict):
    """A problem, by its code and where it is, and the indices of its fixes, the surest first."""

    code: str
    place: Place | None
    line: int
    column: int
    fixes: list[int]


class Fixes(TypedDict):
    """What fixes the problems of a document; several may have the same fix."""

    fixes: list[Fix]
    problems: list[FixedProblem]


class Copied(TypedDict):
    """States as a document, for the clipboard of the system."""

    text: str


class CutOut(Done):
    """The same of states that were cut."""

    text: str


class Opened(TypedDict):
    """A document that is open, with what is missing of a foreign one."""

    tab: int
    remarks: NotRequired[Sequence[Message]]


class Judged(TypedDict):
    """Whether a document is ready, or the first reason why not, who found it, and which `robot` was tried.

    `survived` are the failures that it must survive, and did; `missed` are the states in which the run never
    stayed.
    """

    ready: bool
    found: Literal["", "checks", "model checker", "run", "survives", "tests"]
    message: Message
    place: Place | None
    proved: int
    tests: int
    survived: int
    seconds: float
    missed: list[str]
    robot: Message


class Written(TypedDict):
    """The path of a file that was written."""

    path: str


class SavedAs(Written):
    """The file of a document, and the tab of a copy."""

    tab: NotRequired[int]
    remarks: NotRequired[Sequence[Message]]


class Resolved(TypedDict):
    """What both sides had changed."""

    revision: int
    conflicts: list[str]


class ListedEntry(TypedDict):
    """An entry of a directory, or below it; its size in bytes, when it was changed in s since 1970."""

    name: str
    path: str
    kind: Literal["directory", "document", "recording", "model"]
    size: int
    changedAt: float


class Listing(TypedDict):
    """The content of a directory."""

    directory: str
    parent: str | None
    entries: list[ListedEntry]


class Address(TypedDict):
    """The address for viewers, relative to the page."""

    address: str


class Download(TypedDict):
    """A file to download."""

    name: str
    text: str


class Hits(TypedDict):
    """What was found in a document."""

    tab: int
    hits: list[Hit]


class Comparison(TypedDict):
    """Differences, and the former automata in which they are."""

    differences: list[Difference]
    before: list[AutomatonView]


class Located(TypedDict):
    """A line of a piece of code."""

    place: Place
    line: int


class StartedRun(Followed):
    """The component that was started, and the file in which its run is recorded."""

    component: str
    recording: NotRequired[str]


class ShownRecording(OpenedRecording):
    """A recording, and the tab with its document; 0 without one."""

    tab: int


class Recorded(TypedDict):
    """The file of a recording."""

    recording: str


class SavedRobot(Written):
    """The file of a robot, and all that can be simulated then."""

    bodies: Sequence[KnownBody]


class Numbers(TypedDict):
    """Numbers over time, by their names."""

    times: list[float]
    values: dict[str, list[float | None]]
