"""The table of requests: what handles each of them, and what it waits for."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, TypeVar

from . import documents, edits, questions, steering, trials
from . import protocol as p
from .window import Window
from .workspace import Workspace

R = TypeVar("R", bound=p.Request)

Handle = Callable[[Workspace, Window, R], Awaitable[object]]
"""Executes a request of a window and returns its answer. Raises VisualHfsmError."""


class Lane(Enum):
    """What a request waits for. Each lane of requests that run beside others has its limit."""

    IN_ORDER = "after the earlier requests of its window"
    BESIDE = "beside others, begun in order"
    CODE_HELP = "beside others, and so often that it must not keep out a run"
    STOP_OF_RUN = "beside others, kept out by nothing"
    STOP = "for nothing, not even until earlier requests are begun"
    AT_ONCE = "for nothing, since it takes no time"


@dataclass(frozen=True, slots=True)
class Handler:
    """The handler of a type of requests."""

    handle: Handle[Any]
    lane: Lane
    limit: float | None = None
    """The longest duration in s; None for that of most operations."""


async def _output_shown(_: Workspace, window: Window, _request: p.OutputShown) -> None:
    window.output_shown()


def _row(
    kind: type[R], handle: Handle[R], lane: Lane = Lane.IN_ORDER, limit: float | None = None
) -> tuple[type[p.Request], Handler]:
    return kind, Handler(handle, lane, limit)


HANDLERS: Final[dict[type[p.Request], Handler]] = dict(
    [
        _row(p.AddReady, edits.add_ready),
        _row(p.Attach, steering.attach),
        _row(p.CheckRobot, steering.check_robot, Lane.BESIDE, steering.READING_LIMIT),
        _row(p.Close, documents.close),
        _row(p.CodeHelp, questions.code_help, Lane.CODE_HELP),
        _row(p.ConnectRobot, steering.connect_robot, Lane.BESIDE),
        _row(p.Control, steering.control, Lane.BESIDE),
        _row(p.Copy, edits.copy),
        _row(p.Cut, edits.cut),
        _row(p.Detach, steering.detach),
        _row(p.Diff, questions.diff, Lane.BESIDE),
        _row(p.Discard, documents.discard),
        _row(p.Do, edits.do),
        _row(p.EndRobot, steering.end_robot, Lane.BESIDE),
        _row(p.Export, questions.export, Lane.BESIDE),
        _row(p.ExportRun, steering.export_run, Lane.BESIDE),
        _row(p.Extract, edits.extract),
        _row(p.Generate, steering.generate, Lane.BESIDE),
        _row(p.GoTo, edits.go_to),
        _row(p.GuessRobot, steering.guess_robot, Lane.BESIDE, steering.READING_LIMIT),
        _row(p.Hello, documents.hello),
        _row(p.Imported, questions.imported, Lane.BESIDE),
        _row(p.Inline, edits.inline),
        _row(p.Interfaces, questions.interfaces, Lane.CODE_HELP),
        _row(p.ListFiles, documents.list_files, Lane.BESIDE),
        _row(p.Locate, questions.locate, Lane.BESIDE),
        _row(p.LookAtTests, trials.look_at_tests, Lane.BESIDE),
        _row(p.LookAtTrials, trials.look, Lane.BESIDE),
        _row(p.MoveBalls, steering.move_balls, Lane.BESIDE),
        _row(p.New, documents.new),
        _row(p.Open, documents.open_),
        _row(p.OpenText, documents.open_text),
        _row(p.OutputShown, _output_shown, Lane.AT_ONCE),
        _row(p.Paste, edits.paste),
        _row(p.Duplicate, edits.duplicate),
        _row(p.PutOnShelf, edits.put_on_shelf),
        _row(p.Record, steering.record),
        _row(p.RecordTrial, trials.record, Lane.BESIDE),
        _row(p.Recording, documents.open_recording, Lane.BESIDE),
        _row(p.Recover, documents.recover),
        _row(p.Redo, edits.redo),
        _row(p.Resolve, documents.resolve),
        _row(p.Run, steering.run, Lane.BESIDE),
        _row(p.RunTests, trials.run_tests, Lane.BESIDE),
        _row(p.RunTrials, trials.run, Lane.BESIDE),
        _row(p.Save, documents.save),
        _row(p.SaveAs, documents.save_as),
        _row(p.SaveRobot, steering.save_robot, Lane.BESIDE),
        _row(p.SaveTest, trials.save_test, Lane.BESIDE),
        _row(p.Search, questions.search, Lane.BESIDE),
        _row(p.Share, documents.share),
        _row(p.Simulate, steering.simulate, Lane.BESIDE),
        _row(p.StopRun, steering.stop_run, Lane.STOP_OF_RUN),
        _row(p.StopTests, trials.stop_tests, Lane.STOP_OF_RUN),
        _row(p.StopTrials, trials.stop, Lane.STOP_OF_RUN),
        _row(p.Undo, edits.undo),
    ]
)
"""The handlers of all requests."""


def lane_of(request: p.Request) -> Lane:
    """Return what a request waits for: the operator's stop for nothing."""
    if isinstance(request, p.Control) and request.action == p.EMERGENCY_STOP:
        return Lane.STOP
    return HANDLERS[type(request)].lane
