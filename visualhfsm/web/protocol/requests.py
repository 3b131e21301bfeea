"""What the page asks for."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec

from visualhfsm.editing.places import Place

from .tags import tag

__all__ = [
    "Attach",
    "Close",
    "Complete",
    "Control",
    "Copy",
    "Cut",
    "Detach",
    "Diff",
    "Discard",
    "Do",
    "Explain",
    "Export",
    "Extract",
    "Generate",
    "Hello",
    "Imported",
    "Inline",
    "Interfaces",
    "Lint",
    "ListFiles",
    "New",
    "Open",
    "OpenText",
    "Paste",
    "Recording",
    "Recover",
    "Redo",
    "Request",
    "Resolve",
    "Run",
    "Save",
    "SaveAs",
    "Seal",
    "Search",
    "SendRecording",
    "Signature",
    "StopRun",
    "Undo",
    "decode_request",
    "request_id",
]

RequestId = Annotated[int, msgspec.Meta(ge=0, le=2**53 - 1)]
TabId = Annotated[int, msgspec.Meta(ge=1, le=2**31 - 1)]
ElementId = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]
Position = Annotated[int, msgspec.Meta(ge=0, le=10_000_000)]
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
Name = Annotated[str, msgspec.Meta(max_length=1000)]
Path = Annotated[str, msgspec.Meta(max_length=4096)]
Code = Annotated[str, msgspec.Meta(max_length=1_000_000)]
Ids = Annotated[list[ElementId], msgspec.Meta(max_length=100_000)]


class _Request(
    msgspec.Struct, kw_only=True, rename="camel", forbid_unknown_fields=True, tag_field="op", tag=tag
):
    id: RequestId


class Hello(_Request):
    """Ask for everything; the first request of a window."""


class Open(_Request):
    """Open a document in a tab."""

    path: Path


class New(_Request):
    """Make a document from a template."""

    template: Name = "empty"


class OpenText(_Request):
    """Open a document whose text the page has, such as a dropped file; it has no path yet."""

    name: Name
    text: Annotated[str, msgspec.Meta(max_length=4_000_000)]


class Close(_Request):
    """Close a tab; one with unsaved changes only with `discard`."""

    tab: TabId
    discard: bool = False


class Save(_Request):
    """Save to the file that the document came from, with `overwrite` also over an older dialect."""

    tab: TabId
    overwrite: bool = False


class SaveAs(_Request):
    """Save to another file, which is the document's from then on."""

    tab: TabId
    path: Path
    overwrite: bool = False


class Recover(_Request):
    """Open a document again whose session ended without closing; one of `recoverable`."""

    journal: Name


class Discard(_Request):
    """Give up the changes of such a document."""

    journal: Name


class ListFiles(_Request):
    """List a directory; the root for an empty one."""

    directory: Path = ""


class Do(_Request):
    """Apply a command of `visualhfsm.editing.commands` to the document."""

    tab: TabId
    command: msgspec.Raw


class Undo(_Request):
    """Undo steps."""

    tab: TabId
    steps: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 1


class Redo(_Request):
    """Redo steps."""

    tab: TabId
    steps: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 1


class Copy(_Request):
    """Put states, their sub-trees and the transitions among them into the clipboard."""

    tab: TabId
    automaton: ElementId
    states: Ids


class Cut(_Request):
    """Copy, and delete."""

    tab: TabId
    automaton: ElementId
    states: Ids


class Paste(_Request):
    """Put what is in the clipboard into an automaton, its left upper corner to `x`, `y` if they are given."""

    tab: TabId
    automaton: ElementId
    x: Coordinate | None = None
    y: Coordinate | None = None


class Seal(_Request):
    """Let the next command be a step of its own, such as when a field has lost the focus."""

    tab: TabId


class Search(_Request):
    """Search names and code, in one document or in all open ones."""

    text: Name
    tab: TabId | None = None
    match_case: bool = False
    whole_words: bool = False


class Resolve(_Request):
    """Say what becomes of a document whose file was changed by another program."""

    tab: TabId
    choice: Literal["mine", "theirs", "merge"]


class Diff(_Request):
    """Compare a document with another version: a file, or `saved`."""

    tab: TabId
    against: Path


class Imported(_Request):
    """Ask for the content of the automata that a document imports from other files."""

    tab: TabId


class Extract(_Request):
    """Move an automaton with all below it to a new file, from which it is imported then."""

    tab: TabId
    automaton: ElementId
    path: Path


class Inline(_Request):
    """Put the content of an imported automaton in its place."""

    tab: TabId
    automaton: ElementId


class Locate(_Request):
    """Ask which line of which piece of code a line of a log, or of an error's report, speaks of.

    A report tells its `automaton` and `state`, too, which tell pieces apart that share a line.
    """

    tab: TabId
    text: Name
    automaton: ElementId = 0
    state: ElementId = 0


class Complete(_Request):
    """Ask for what could follow in a piece of code; `line` from 1, `column` from 0."""

    tab: TabId
    place: Place
    code: Code
    line: Position
    column: Position


class Explain(_Request):
    """Ask what the name at a position stands for."""

    tab: TabId
    place: Place
    code: Code
    line: Position
    column: Position


class Signature(_Request):
    """Ask for the parameters of the call that the cursor stands in."""

    tab: TabId
    place: Place
    code: Code
    line: Position
    column: Position


class Lint(_Request):
    """Check a piece of code as it is being typed."""

    tab: TabId
    place: Place
    code: Code


class Interfaces(_Request):
    """Ask for the interfaces that documents may declare, with their operations."""


class Generate(_Request):
    """Generate the component's Python."""

    tab: TabId


class Run(_Request):
    """Generate and start the component as a process; `arguments` are those of its command line."""

    tab: TabId
    arguments: Annotated[list[Name], msgspec.Meta(max_length=100)] = []


class StopRun(_Request):
    """Stop the process of a component that was started here."""

    tab: TabId


class Attach(_Request):
    """Follow a running component."""

    component: Name


class Detach(_Request):
    """Follow it no longer."""

    component: Name


class Control(_Request):
    """Steer a running component: pause, step, force a transition and the like."""

    component: Name
    action: Name
    arguments: dict[Name, Any] = {}


class Export(_Request):
    """Ask for the document as its file would hold it, to download it."""

    tab: TabId


class Recording(_Request):
    """Open the recording of a run."""

    path: Path


class SendRecording(_Request):
    """Send a recording that the page has, such as a dropped file, in parts; the last one opens it."""

    name: Name
    data: Annotated[bytes, msgspec.Meta(max_length=3_000_000)]
    begins: bool = False
    ends: bool = False


Request = (
    Hello
    | Open
    | New
    | OpenText
    | Close
    | Save
    | SaveAs
    | Recover
    | Discard
    | ListFiles
    | Do
    | Undo
    | Redo
    | Copy
    | Cut
    | Paste
    | Seal
    | Search
    | Resolve
    | Diff
    | Imported
    | Extract
    | Inline
    | Locate
    | Complete
    | Explain
    | Signature
    | Lint
    | Interfaces
    | Generate
    | Run
    | StopRun
    | Attach
    | Detach
    | Control
    | Export
    | Recording
    | SendRecording
)

_requests: msgspec.json.Decoder[Request] = msgspec.json.Decoder(Request)


class _OnlyId(msgspec.Struct):
    id: RequestId


_only_id = msgspec.json.Decoder(_OnlyId)


def decode_request(text: bytes | str) -> Request:
    """Return the request in a message; raises msgspec.DecodeError, and RecursionError if it is too deep."""
    return _requests.decode(text)


def request_id(text: bytes | str) -> int | None:
    """Return the id of a message that may be no request; None without one."""
    try:
        return _only_id.decode(text).id
    except (msgspec.DecodeError, RecursionError, UnicodeError):
        return None
