"""Views of plug-ins: what they show of a document beside its drawing, and what the page may ask for that.

A view is an entry point of the seam `visualhfsm.views`, whose name is that of the view. Its module `view.js`
is loaded with the page: `addView` of `shell/panels.js` adds actions, and a panel, whose own module is loaded
when it is shown. Modules of the page have the names `visualhfsm/...` there. What it does for a document may
last: then it says how that goes by pushes.
"""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, Protocol, runtime_checkable

import msgspec

from visualhfsm._monitor.messages import Push, Source, tag
from visualhfsm.project._root import Root
from zenoh_ice import plugins

from . import answers

RequestId = Annotated[int, msgspec.Meta(ge=0, le=2**53 - 1)]
TabId = Annotated[int, msgspec.Meta(ge=1, le=2**31 - 1)]

ENTRY: Final = "view.js"
_SEAM: Final = "visualhfsm.views"

_logger = logging.getLogger(__name__)


class Request(
    msgspec.Struct, kw_only=True, rename="camel", forbid_unknown_fields=True, tag_field="op", tag=tag
):
    """A request of the page, whose `op` is the name of its class."""

    answer: ClassVar[Any] = None
    """The type of what it is answered with."""

    id: RequestId


class TabRequest(Request):
    """A request about the document of a tab; it is executed beside others."""

    tab: TabId


class TabEdit(TabRequest):
    """A change of one document; requests of this kind are executed in order."""

    answer: ClassVar[Any] = answers.Done


class TabStop(TabRequest):
    """A request that stops what was started for a document; no other request keeps it out."""


class ViewPush(Push, kw_only=True, tag="view"):
    """How that goes which a view does for the document of a tab; `name` is that of the view.

    `outdated` says that it is of an older version of the document than is shown.
    """

    name: str
    tab: int
    outdated: bool = False


@dataclass(frozen=True, slots=True)
class ViewedDocument:
    """The document that a request of a view is about."""

    source: Source
    """The document as it is shown, with the number of its tab."""
    language: str
    """The language of the window that asks."""
    root: Root
    """The folder of the project: what pages may reach."""
    in_thread: Callable[[Callable[[], Any]], Awaitable[Any]]
    """The function that returns the result of work that takes some time."""
    save_copy: Callable[[Path, bool], Awaitable[object]]
    """The function that writes the document to a file, perhaps over an earlier one. Raises EditError."""
    recordings: Callable[[], Awaitable[Path]]
    """The function that returns the folder of recordings, which exists then. Raises VisualHfsmError."""
    work: Any
    """What `begin` of the view returned; None without."""
    dates: Callable[[], None]
    """The function that says that pushes of the view are of this version of the document, from now on."""

    @property
    def path(self) -> Path | None:
        """The file of the document, None as long as it was never saved."""
        return self.source.path

    @property
    def title(self) -> str:
        """The name of the document."""
        return self.source.title


class View(Protocol):
    """What a plug-in shows of a document."""

    @property
    def static(self) -> Path:
        """The folder with `view.js` and what it imports, served below `/plugins/NAME/`."""

    @property
    def requests(self) -> Mapping[type[TabRequest], Callable[[Any, ViewedDocument], Awaitable[object]]]:
        """What the page may ask for, and what answers, which raises VisualHfsmError."""

    def offers(self, path: Path | None) -> bool:
        """Whether there is anything to show of a document; this is asked often, such as when it is saved."""


class Work(Protocol):
    """What a view does for documents, in the editor's event loop."""

    async def forget(self, tab: int) -> None:
        """End what it does for a document, which is closed."""

    async def close(self) -> None:
        """End everything."""


@runtime_checkable
class WorkingView(View, Protocol):
    """A view that does something for documents which goes on after its requests are answered."""

    def begin(self, publish: Callable[[ViewPush], None], include: Sequence[Path]) -> Work:
        """Return what does it; `include` are directories with packages of interfaces."""


def find_views(known: Iterable[type[Request]]) -> dict[str, View]:
    """Return the views of plug-ins by name; what is wrong with one that is left out is logged.

    Their requests have other names than those that are `known`.
    """
    names = {kind.__struct_config__.tag for kind in known}
    views: dict[str, View] = {}
    for name in plugins.names(_SEAM):
        try:
            view: View | None = plugins.find(_SEAM, name)
            if view is None:
                continue
            added = {kind.__struct_config__.tag for kind in view.requests}
            if names & added or not name.isidentifier() or not (view.static / ENTRY).is_file():
                raise ValueError("it has a name or requests that there are, or no view.js")
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever the code of others raises
            _logger.warning("the page has no view %s: %s", name, error)
        else:
            names |= added
            views[name] = view
    return views


def begun(
    views: Mapping[str, View], publish: Callable[[ViewPush], None], include: Sequence[Path]
) -> dict[str, Work]:
    """Return what does that which views do for documents, by the names of those that do something."""
    found = {}
    for name, view in views.items():
        try:
            if isinstance(view, WorkingView):
                found[name] = view.begin(publish, include)
        except (Exception, SystemExit):
            _logger.exception("the view %s does nothing for documents", name)
    return found


def offered(views: Mapping[str, View], path: Path | None) -> list[str]:
    """Return the names of the views that have something to show of the document of a file."""
    found = []
    for name, view in views.items():
        try:
            if view.offers(path):
                found.append(name)
        except (Exception, SystemExit):
            _logger.exception("the view %s is not offered", name)
    return found
