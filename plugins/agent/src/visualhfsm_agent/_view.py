"""The view of the page: the run that an agent asks for, which a person allows or refuses."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypedDict

from visualhfsm import MissingError
from visualhfsm.plugins import TabRequest, ViewedDocument

from ._approval import Approvals
from ._limits import FILE


class AskedAnswer(TypedDict):
    """What an agent asks for: a document by its path, for at most some s, and when, in s since 1970."""

    path: str
    seconds: float
    at: float


class AgentAsked(TabRequest):
    """Ask which run an agent asks for, if any."""

    answer = AskedAnswer | None


class AnswerAgent(TabRequest):
    """Allow or refuse the run that an agent asked for at a time."""

    answer = AskedAnswer | None
    at: float
    allowed: bool


async def _asked(_: AgentAsked, document: ViewedDocument) -> AskedAnswer | None:
    found = await document.in_thread(Approvals(document.root.directory).asked)
    return None if found is None else {"path": found.path, "seconds": found.seconds, "at": found.at}


async def _answer(request: AnswerAgent, document: ViewedDocument) -> None:
    approvals = Approvals(document.root.directory)
    found = await document.in_thread(approvals.asked)
    if found is None or found.at != request.at:
        raise MissingError.because("the agent does not ask for this any more")
    await document.in_thread(lambda: approvals.answer(found, "allowed" if request.allowed else "refused"))


class _View:
    """Implements `View` of `visualhfsm.plugins`."""

    static: Final = Path(__file__).with_name("static")
    requests: Final[Mapping[type[TabRequest], Any]] = MappingProxyType(
        {AgentAsked: _asked, AnswerAgent: _answer}
    )

    def offers(self, path: Path | None) -> bool:
        return path is not None and any((folder / FILE).is_file() for folder in [*path.parents][:8])


view: Final = _View()
