"""The view of the page: the trials of a document, and what they say while they run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Final

import msgspec

from visualhfsm.plugins import TabRequest, TabStop, ViewedDocument, ViewPush, body_option, require_body
from zenoh_ice.data import typed

from ._messages import Choices, ChosenLimit, ChosenRobot, ChosenRuns
from ._service import RunningTrials

Name = Annotated[str, msgspec.Meta(max_length=1000)]
TrialNumber = Annotated[int, msgspec.Meta(ge=1, le=2**31 - 1)]


class LookAtTrials(TabRequest):
    """Ask for the plan of a document's trials, and what those that were run say, which the view pushes.

    The robot has this `body` if the plan names none.
    """

    body: Name = ""


class StartTrials(TabRequest):
    """Run those trials of a document that were not run yet; pushes of the view report what they say.

    Of older outcomes, those of another version of document or plan are replaced only with `again`. `state`,
    `robot` and `limit` take the place of what the plan has; the robot has this `body` if the plan names none.
    """

    runs: ChosenRuns | None = None
    state: Name = ""
    robot: ChosenRobot = ""
    limit: ChosenLimit | None = None
    body: Name = ""
    again: bool = False


class StopTrials(TabStop):
    """Stop the trials of a document; what is done is kept."""


class RecordTrial(TabRequest):
    """Run one of the trials again, and record it; a push says when that is done, and where."""

    number: TrialNumber


async def _look(request: LookAtTrials, document: ViewedDocument) -> None:
    if await _trials(document).read(document.source, await _body(document, request.body)):
        document.dates()


async def _start(request: StartTrials, document: ViewedDocument) -> None:
    choices = typed.convert(request, Choices, from_attributes=True)
    choices = msgspec.structs.replace(choices, body=await _body(document, request.body))
    await _trials(document).run(document.source, choices, again=request.again)
    document.dates()


async def _stop(request: StopTrials, document: ViewedDocument) -> None:
    await _trials(document).stop(request.tab)


async def _record(request: RecordTrial, document: ViewedDocument) -> None:
    folder = await document.recordings()
    await _trials(document).record(request.tab, request.number, folder, document.root.name)


async def _body(document: ViewedDocument, name: str) -> str:
    """Return what a plan calls a body."""
    root = document.root.directory
    return body_option(root, await document.in_thread(lambda: require_body(root, name)))


def _trials(document: ViewedDocument) -> RunningTrials:
    trials: RunningTrials = document.work
    return trials


class _View:
    """Implements `WorkingView` of `visualhfsm.plugins`."""

    static: Final = Path(__file__).with_name("static")
    requests: Final[Mapping[type[TabRequest], Any]] = MappingProxyType(
        {LookAtTrials: _look, StartTrials: _start, StopTrials: _stop, RecordTrial: _record}
    )

    def offers(self, path: Path | None) -> bool:  # noqa: ARG002 - a document that has no file yet, too
        return True

    def begin(self, publish: Callable[[ViewPush], None], include: Sequence[Path]) -> RunningTrials:
        return RunningTrials(publish, include)


view: Final = _View()
