"""The view of the page: the task of an exercise beside the drawing, its marks, and handing in."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypedDict

from visualhfsm import MissingError
from visualhfsm.plugins import TabEdit, TabRequest, ViewedDocument
from visualhfsm_classes._task import collected, has_task, read_task


class TaskAnswer(TypedDict):
    """A task, the marks that came back, and since when a teacher can collect what was handed in."""

    text: list[Any]
    marks: list[Any]
    collected: str
    handedIn: float | None


class HandedIn(TypedDict):
    """The file that a teacher collects, if anybody does."""

    path: str
    collected: bool


class Task(TabRequest):
    """Ask for the task of the exercise in whose folder the document lies, and for the marks beside it."""

    answer = TaskAnswer | None


class HandIn(TabEdit):
    """Write a copy of the document to where a teacher collects it, with `overwrite` over an earlier one."""

    answer = HandedIn
    overwrite: bool = False


async def _task(_: Task, document: ViewedDocument) -> TaskAnswer | None:
    if (path := document.path) is None:
        return None
    found: TaskAnswer = await document.in_thread(lambda: read_task(document.root, path, document.language))
    return found


async def _hand_in(request: HandIn, document: ViewedDocument) -> HandedIn:
    root, path = document.root, document.path
    if path is None:
        raise MissingError.because("{title} was never saved", title=document.title)
    if (target := collected(root, path)) is not None:
        await document.save_copy(target, request.overwrite)
    return {"path": root.name(target or path), "collected": target is not None}


class _View:
    """Implements `View` of `visualhfsm.plugins`."""

    static: Final = Path(__file__).with_name("static")
    requests: Final[Mapping[type[TabRequest], Any]] = MappingProxyType({Task: _task, HandIn: _hand_in})

    def offers(self, path: Path | None) -> bool:
        return has_task(path)


view: Final = _View()
