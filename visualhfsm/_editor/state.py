"""The state of the workspace as all windows get it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from visualhfsm._monitor.messages import Present
from visualhfsm.project._root import Root
from visualhfsm.project._session.journal import Abandoned

from .protocol import Recoverable, TabState, Workspace
from .tab import Tab


def workspace_state(
    tabs: Iterable[Tab], recoverable: Iterable[Abandoned], present: Present, root: Root
) -> Workspace:
    """Return the open documents, those that can be recovered, and the components of the realm."""
    return Workspace(
        tabs=[_tab_state(tab, root) for tab in tabs],
        recoverable=[
            Recoverable(
                journal=each.file.name,
                name=each.name,
                path=_name(each.path, root),
                changed_at=each.changed_at,
            )
            for each in recoverable
        ],
        present=[dict(each) for each in present.components],
    )


def _tab_state(tab: Tab, root: Root) -> TabState:
    shown = tab.shown
    return TabState(
        tab=tab.id,
        title=shown.title,
        path=_name(shown.path, root),
        component=tab.component,
        dirty=shown.dirty,
        recording=_name(tab.recording, root),
        outside="" if tab.outside is None else tab.outside.state,
        changed=tab.differs_from_loaded,
    )


def _name(path: Path | None, root: Root) -> str:
    return "" if path is None else root.name(path)
