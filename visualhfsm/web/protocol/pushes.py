"""What the page is told by itself."""

from __future__ import annotations

from typing import Any, Literal

import msgspec

from visualhfsm.editing.places import Place

from .tags import tag

__all__ = [
    "Closed",
    "DocumentPush",
    "Output",
    "OutputLine",
    "Outside",
    "Problems",
    "Push",
    "Recoverable",
    "RunPush",
    "Snapshot",
    "Stale",
    "Structure",
    "TabState",
    "Workspace",
]


class _Push(msgspec.Struct, kw_only=True, rename="camel", tag_field="push", tag=tag):
    pass


class TabState(msgspec.Struct, kw_only=True, rename="camel"):
    """An open document.

    `path` is relative to the root where it can be, and empty as long as there is no file. `outside` says what
    another program did to the file: nothing, `changed` or `deleted`. A `dialect` other than `native` is
    replaced when the document is saved.
    """

    tab: int
    title: str
    path: str
    dirty: bool
    dialect: str
    recovered: bool
    outside: str


class Recoverable(msgspec.Struct, kw_only=True, rename="camel"):
    """A document with unsaved changes whose session ended without closing; `changed_at` in s since 1970."""

    journal: str
    name: str
    path: str
    changed_at: float


class Workspace(_Push, omit_defaults=True):
    """The open documents, those that can be recovered, and the components and the robot of the realm."""

    tabs: list[TabState]
    recoverable: list[Recoverable]
    running: list[dict[str, Any]]
    clipboard: int
    """States in the clipboard."""
    robot_stopped: str = ""
    """Why the robot's emergency stop is latched; left out while it is not."""


class Closed(_Push):
    """A tab is closed."""

    tab: int


class DocumentPush(_Push, tag="document"):
    """A document, whole in `full` or what of it changed in `patch`; the names of steps come latest first.

    What is in them stands in `visualhfsm.web.rendering` and `visualhfsm.editing.views`.
    """

    tab: int
    revision: int
    undo: tuple[str, ...]
    redo: tuple[str, ...]
    dirty: bool
    full: msgspec.Raw | msgspec.UnsetType = msgspec.UNSET
    patch: msgspec.Raw | msgspec.UnsetType = msgspec.UNSET


class Problems(_Push):
    """What the checks say of a revision of a document."""

    tab: int
    revision: int
    items: Any


class Outside(_Push):
    """What another program did to the file of a document.

    `reloaded`: the document had no changes of its own, and is now as the file, which can be undone. `changed`
    and `deleted`: the person is to say what shall be. `same`: it is over.
    """

    tab: int
    state: Literal["reloaded", "changed", "deleted", "same"]
    message: str = ""


class OutputLine(msgspec.Struct, kw_only=True, rename="camel"):
    """A line that a component wrote, and the piece of code that it speaks of, if any."""

    text: str
    stream: Literal["out", "err"] = "out"
    place: Place | None = None
    line: int = 0


class Output(_Push):
    """Lines that a component wrote; `dropped` older ones were too many for this window.

    `whole` says that these are all that are kept, in the place of those that the window has.
    """

    tab: int
    lines: list[OutputLine]
    dropped: int = 0
    whole: bool = False


class RunPush(_Push, tag="run"):
    """What became of a component that was started here."""

    tab: int
    status: Literal["generating", "starting", "running", "stopping", "ended"]
    exit_code: int | None = None
    message: str = ""


class Snapshot(_Push):
    """What a running component does at this moment."""

    component: str
    value: Any


class Structure(_Push):
    """What automata a running component has."""

    component: str
    value: Any


class Stale(_Push):
    """A component is silent since a moment (s of wall time); `since` 0 says that it speaks again."""

    component: str
    since: float


Push = (
    Workspace | Closed | DocumentPush | Problems | Outside | Output | RunPush | Snapshot | Structure | Stale
)
